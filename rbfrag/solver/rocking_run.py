"""One free-standing block under one excitation: the public form of the rocking kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.free_rocking import TOPPLED
from rbfrag.solver.integrator.rocking_kernel import IMPACT, RockingRules, RockingRun, run_rocking
from rbfrag.solver.integrator.state import Corner
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.node_history import node_history, with_free_motion
from rbfrag.solver.results import FloatArray, ResponseHistory

REST_SPEED = 1e-6
"""Speed after an impact at which the block rests, over the least p times the least critical angle.

1e-3 gives the same statistics of outcomes."""

MOST_IMPACTS = 100_000
"""Impacts beyond which nothing is said about the outcome."""

_NO_ROWS = np.empty((4, 0))


@dataclass(frozen=True)
class FreeBlock:
    """A free-standing block on two corners.

    Args:
        toe: the corner of forward rotation, down the base.
        heel: that of backward rotation.
        toe_m: from the heel to the toe, along the base [m].
        centroid_m: centroid in the base frame with the heel as origin [m].
        beta_rad: dip of the base, forward positive [rad].
    """

    toe: Corner
    heel: Corner
    toe_m: float
    centroid_m: tuple[float, float]
    beta_rad: float

    @property
    def slowest_p(self) -> float:
        """The smaller of both frequency parameters p [1/s]."""
        return min(self.toe.p, self.heel.p)

    @property
    def rest_speed(self) -> float:
        """Speed after an impact below which the block rests [rad/s]."""
        return REST_SPEED * self.slowest_p * min(self.toe.theta_c, self.heel.theta_c)


def simulate(
    excited: Excitation,
    block: FreeBlock,
    *,
    rows: FloatArray = _NO_ROWS,
    order: int = ORDER,
    ph_max: float = PH_MAX,
) -> RockingRun:
    """Run the kernel once.

    Args:
        excited: the excitation.
        rows: history to be filled, shape (4, n).
        order: order of the step; for convergence studies.
        ph_max: greatest p·h of a step; for convergence studies.
    """
    rules = RockingRules(order, ph_max, block.rest_speed, MOST_IMPACTS)
    return run_rocking(
        excited.nodes, excited.tail_max_q, block.toe, block.heel, rules, rows, np.empty(9)
    )


@dataclass(frozen=True, eq=False)
class RockingHistory:
    """Time history of the motion, and its impacts.

    Args:
        motion: rotation (forward positive) and its rate at nodes and events.
        impact_s: times of the impacts [s], shape (n,), those of the free motion that is shown
            after the record included.
    """

    motion: ResponseHistory
    impact_s: FloatArray


def rocking_history(excited: Excitation, block: FreeBlock, impacts: int) -> RockingHistory:
    """Run over the record and a stretch of rest after it, keeping every node and event.

    Args:
        impacts: number of impacts within the record, which decides the size of the arrays.
    """
    longer = with_free_motion(excited, block.slowest_p)
    # a node and a turn in each interval, four events an impact; the free motion has far fewer than
    # the array that is left for it, and what does not fit is not drawn
    rows = np.empty((4, 3 * longer.time_s.size + 5 * impacts + 50_000))
    run = simulate(longer, block, rows=rows)
    columns = rows[:, : run.history_length]
    motion = node_history(excited, longer, columns, toppled=run.outcome == TOPPLED)
    return RockingHistory(motion, columns[0, columns[3] == IMPACT])


@dataclass(frozen=True)
class CornerForce:
    """Force on the rotating corner, and the instants at which it violates the model.

    Args:
        lifts_s: when the normal force first vanishes [s]; None if it never does.
        friction: greatest friction over normal force while it presses.
        slips_s: when it first exceeds the friction of the base [s]; None if it never does.
    """

    lifts_s: float | None
    friction: float
    slips_s: float | None


def corner_force(
    block: FreeBlock, history: ResponseHistory, tan_phi: float, until_s: float
) -> CornerForce:
    """Return the force at the corner that exceeds pressure and friction.

    R/m = r (θ'' t - θ'² e) - g G in the base frame, with e from the corner to the centroid and t
    across it (physics of toppling, section 5); backward rotation is the mirror image.

    Args:
        history: its motion.
        tan_phi: coefficient of friction of the base; infinite where it does not slip.
        until_s: time up to which it is of interest [s].
    """
    theta = history.theta_rad
    # of the two entries of an impact, the first has the speed about the corner that it ends
    ends = np.append((np.diff(history.time_s) == 0.0) & (theta[:-1] == 0.0), False)
    moves = (history.theta_dot_rad_s != 0.0) & (history.time_s <= until_s) & ~ends
    side = np.where(theta != 0.0, np.sign(theta), np.sign(history.theta_dot_rad_s))
    along = np.zeros_like(theta)
    across = np.ones_like(theta)
    for sign, at in ((1.0, block.toe), (-1.0, block.heel)):
        rows = (side == sign) & moves
        turned, rate = np.abs(theta[rows]), history.theta_dot_rad_s[rows]
        k_h, w = sign * history.k_h[rows], 1.0 + history.k_v[rows]
        to_balance = at.theta_c - turned
        # α - θ of the corner: the dip is a slope down for the one and up for the other
        lean = to_balance + sign * block.beta_rad
        arm = block.centroid_m[0] - (block.toe_m if sign > 0.0 else 0.0)
        factor = at.p * at.p * math.hypot(arm, block.centroid_m[1]) / STANDARD_GRAVITY_M_S2
        speeds_up = factor * (k_h * np.cos(to_balance) - w * np.sin(to_balance))
        inward = factor * (rate / at.p) ** 2
        tilt = sign * block.beta_rad
        along[rows] = (
            speeds_up * np.cos(lean) + inward * np.sin(lean)
            - (w * math.sin(tilt) + k_h * math.cos(tilt))
        )  # fmt: skip
        across[rows] = (
            speeds_up * np.sin(lean) - inward * np.cos(lean)
            + (w * math.cos(tilt) - k_h * math.sin(tilt))
        )  # fmt: skip
    lifted = moves & (across <= 0.0)
    pressed = moves & (across > 0.0)
    need = np.zeros_like(theta)
    need[pressed] = np.abs(along[pressed]) / across[pressed]
    return CornerForce(
        lifts_s=_first(history.time_s, lifted),
        friction=float(need.max(initial=0.0)),
        slips_s=_first(history.time_s, need > tan_phi),
    )


def _first(time_s: FloatArray, where: np.ndarray) -> float | None:
    return float(time_s[np.argmax(where)]) if where.any() else None
