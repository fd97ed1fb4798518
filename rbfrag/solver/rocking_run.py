"""Free-standing blocks under one excitation, one or many: the public form of the rocking kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import Excitation, Nodes
from rbfrag.solver.history import node_history, with_free_motion
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.rocking_kernel import (
    IMPACT,
    STABLE,
    TOPPLED,
    RockingRules,
    RockingRun,
    run_rocking,
)
from rbfrag.solver.integrator.state import Corner
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.results import FloatArray, IntArray, ResponseHistory

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


def rocking_history(excited: Excitation, block: FreeBlock, impacts: int) -> ResponseHistory:
    """Run over the record and a stretch of rest after it, keeping every node, event and impact.

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
    return replace(motion, impact_s=columns[0, columns[3] == IMPACT])


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


@kernel
def run_free_blocks(
    excitations: tuple[Nodes, Nodes, Nodes],
    tails: tuple[FloatArray, FloatArray, FloatArray],
    corners: FloatArray,
    slowest: FloatArray,
    most_impacts: int,
    outcome: IntArray,
    theta_n: FloatArray,
    sensitive: IntArray,
) -> None:
    """Run one block after another, each under the motion and under two almost identical ones.

    Args:
        excitations: the motion, and the same times a little more and a little less.
        tails: greatest k_h/(1 + k_v) from each node on, of each.
        corners: numbers of both corners of each block, toe before heel, shape (n, 2, 6).
        slowest: speed after an impact below which each block rests [rad/s], shape (n,).
        most_impacts: impacts beyond which a run is given up.
        outcome: filled with the codes, shape (n,).
        theta_n: filled with the peaks over their critical angles, shape (n,).
        sensitive: filled with 1 where the outcomes differ, shape (n,).
    """
    # made once for all blocks: the coefficients of a step, and no history
    u = np.empty(9)
    no_rows = np.empty((4, 0))
    for j in range(outcome.size):
        c = corners[j]
        toe = Corner(c[0, 0], c[0, 1], c[0, 2], c[0, 3], c[0, 4], c[0, 5])
        heel = Corner(c[1, 0], c[1, 1], c[1, 2], c[1, 3], c[1, 4], c[1, 5])
        rules = RockingRules(ORDER, PH_MAX, slowest[j], most_impacts)
        run = run_rocking(excitations[0], tails[0], toe, heel, rules, no_rows, u)
        outcome[j] = run.outcome
        theta_n[j] = np.nan
        if run.outcome == STABLE:
            theta_n[j] = max(run.forward.x / toe.theta_c, run.backward.x / heel.theta_c)
        sensitive[j] = 0
        # one other outcome is enough: most sensitive blocks cost two runs, not three
        for i in (1, 2):
            if sensitive[j] == 0:
                other = run_rocking(excitations[i], tails[i], toe, heel, rules, no_rows, u)
                sensitive[j] = 1 if other.outcome != run.outcome else 0


def simulate_free(
    excited: Excitation,
    corners: FloatArray,
    slowest: FloatArray,
    *,
    most_impacts: int,
    change: float,
) -> tuple[IntArray, FloatArray, IntArray]:
    """Run many free-standing blocks under one excitation.

    Args:
        corners: numbers of both corners of each block, toe before heel, shape (n, 2, 6).
        slowest: speed after an impact below which each block rests [rad/s], shape (n,).
        most_impacts: impacts beyond which a run is given up.
        change: relative change of the motion that sensitive outcomes are told by.

    Returns:
        Codes of the outcomes (`rbfrag.solver.integrator.rocking_kernel`); the larger ratio of a
        peak rotation to its critical angle, NaN unless the block stays; 1 where the outcome changes
        with the motion; each of shape (n,).
    """
    # Rocking about two corners is chaotic for slender blocks (docs/theory/rocking.md): an outcome
    # that changes under a motion scaled by 1 + change or 1 - change is reported as sensitive
    more, less = excited.scaled(1.0 + change), excited.scaled(1.0 - change)
    excitations = (excited.nodes, more.nodes, less.nodes)
    tails = (excited.tail_max_q, more.tail_max_q, less.tail_max_q)
    n = slowest.size
    outcome, theta_n, sensitive = np.empty(n, np.int64), np.empty(n), np.empty(n, np.int64)
    run_free_blocks(excitations, tails, corners, slowest, most_impacts, outcome, theta_n, sensitive)
    return outcome, theta_n, sensitive
