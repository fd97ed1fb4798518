"""Stability of the toe of a block that rotates about it (Gibson's dissertation, 4.3.1).

At the start of the rotation the toe bears R/m = r3 θ'' t - g G, with θ'' = p² q/F_s, so that, with
q = F_s (k cos θc - sin θc + m0), θc = α3 - β and friction alone,

    tan φ = (sin β + k cos β + e_x - q cos α3)/(cos β - k sin β - e_y + q sin α3),

where e is the push of water over the weight, down the base and off it, and m0 its forward moment
about the toe over m g r3. Blocks are single ones, or arrays with pushes and angles of their shape.
"""

from __future__ import annotations

import math
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.formulas import SCALAR, array_elementwise
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import DRY, Push

if TYPE_CHECKING:
    from rbfrag.solver.block.arrays import BlockArray
    from rbfrag.solver.results import ResponseHistory

# of 2,652 random blocks 16 % slip at the toe below their critical amplitude, ln of which then
# differs by 0.036 +- 0.10 from that of pure toppling
TOE_SLIPS = Diagnostic(
    "the toe slips above {threshold:.2f} g: P(toppling) changes little (critical amplitude ±10 %), "
    "but the toe may move by centimetres",
    "toe_slips",
)
# followed blocks of a rock mass over Newmark's: 10, 90 % and geometric mean
HEEL_TIPS = Diagnostic(
    "pulses into the slope above {threshold:.2f} g tip the block: it slides 1.4 times as far on "
    "average (1.0–2.7), so P is too low; rbfrag respond follows it",
    "heel_tips",
)
TOE_FOLLOWED = "the toe gives way: its slip is followed step by step"
NEEDS = "rotation without slip needs {need:.1f} deg at the toe at {where}"


def _trigonometry(block: Block | BlockArray) -> ModuleType:
    """Return the module of functions for a single block, or for arrays."""
    if isinstance(block, Block):
        return math
    import numpy as np

    return np


def moment_about_toe(block: Block | BlockArray, push: Push | None) -> Any:
    """Return the forward moment of water about the toe over m g r3, m0."""
    if push is None:
        return 0.0
    along, off, moment_m = push
    return (block.toe[0] * off - block.toe[1] * along - moment_m) / block.r3_m


def _balance(block: Block | BlockArray, beta_deg: Any, push: Push | None) -> tuple[Any, ...]:
    """Return thrust and pressure at the toe over the weight, each a constant and per k."""
    m = _trigonometry(block)
    beta, alpha3 = m.radians(beta_deg), m.radians(block.alpha3_deg)
    turns, factor = alpha3 - beta, block.shape_factor
    along, off, _ = push or DRY
    up = factor * m.cos(turns)
    down = factor * (moment_about_toe(block, push) - m.sin(turns))
    return (
        m.sin(beta) + along - down * m.cos(alpha3), m.cos(beta) - up * m.cos(alpha3),
        m.cos(beta) - off + down * m.sin(alpha3), -m.sin(beta) + up * m.sin(alpha3),
    )  # fmt: skip


def toe_needs_deg(block: Block, beta_deg: float, k: float, push: Push | None = None) -> float:
    """Return the friction angle required at the toe at the start of a rotation [deg].

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        k: greatest acceleration out of the slope, above k_r [g].
        push: of water, as :class:`rbfrag.solver.stability.single.Stability` has it.
    """
    thrust, per_k, pressure, pressed_per_k = _balance(block, beta_deg, push)
    return math.degrees(math.atan2(abs(thrust + per_k * k), pressure + pressed_per_k * k))


def toe_slips_g(
    block: Block | BlockArray, beta_deg: Any, phi_deg: Any, push: Push | None = None
) -> Any:
    """Return the acceleration at which the toe slips at the start of a rotation [g].

    +inf where it holds at any.

    Args:
        block: a block that topples, or several.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        push: of water.
    """
    m = _trigonometry(block)
    thrust, per_k, pressure, pressed_per_k = _balance(block, beta_deg, push)
    friction = m.tan(m.radians(phi_deg))
    rises = per_k - friction * pressed_per_k
    where = SCALAR.where if m is math else array_elementwise().where
    return where(
        rises > 0.0, (friction * pressure - thrust) / where(rises > 0.0, rises, 1.0), math.inf
    )


def heel_tips_g(
    block: Block | BlockArray, beta_deg: Any, phi_deg: Any, push: Push | None = None
) -> Any:
    """Return the acceleration into the slope above which a block that has slid tips back [g].

    tan(β - α1) less the backward moment of water; 0 for a block that leans at rest, and +inf for
    one that slides up its base first, α1 <= -φ.

    Args:
        block: a block that slides, or several.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        push: of water.
    """
    m = _trigonometry(block)
    where = SCALAR.where if m is math else array_elementwise().where
    tips = (block.alpha1_deg > -phi_deg) & (beta_deg - block.alpha1_deg < 90.0)
    past_heel = m.radians(where(tips, beta_deg - block.alpha1_deg, 0.0))
    along, off, about_centroid = push or DRY
    moment_m: Any = about_centroid + block.heel[1] * along - block.heel[0] * off
    threshold = m.tan(past_heel) - moment_m / (block.r1_m * m.cos(past_heel))
    return where(tips, where(threshold > 0.0, threshold, 0.0), math.inf)


def slides_at_toe(need_deg: float, where: str, phi_deg: float, slips_g: float) -> Diagnostic:
    """Return the sentence on a slipping toe: the friction required, and from what time on."""
    at = "" if slips_g == math.inf else f" at {slips_g:.2f} g"
    consequence = f"phi = {phi_deg:g} gives way{at}: the slip of the toe is followed step by step"
    text = f"{NEEDS.format(need=need_deg, where=where)}; {consequence}"
    return Diagnostic(text, "toe_followed")


def toe_needs_in_time(
    block: Block, beta_deg: float, history: ResponseHistory, push: Push | None = None
) -> tuple[float, float] | None:
    """Return the maximum friction angle required at the toe during a rotation [deg], and its time
    [s].

    max atan(|Rx|/Ry) of R/m = r3 (θ'' t - θ'² e) - g G, e from the toe to the centroid, t along its
    path, θ'' of eq. (4.13). None for a block that does not turn.

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        history: its motion in time.
        push: of water, which turns with the block.
    """
    import numpy as np

    turns = history.theta_rad > 0.0
    if not turns.any():
        return None
    beta, alpha3 = math.radians(beta_deg), math.radians(block.alpha3_deg)
    at = alpha3 - history.theta_rad[turns]
    k, w = history.k_h[turns], 1.0 + history.k_v[turns]
    along, off, _ = push or DRY
    theta, m0 = history.theta_rad[turns], moment_about_toe(block, push)
    turning = block.r3_m * block.p2 * (k * np.cos(at - beta) - w * (np.sin(at - beta) - m0))
    inward = block.r3_m * history.theta_dot_rad_s[turns] ** 2
    thrust = turning * np.cos(at) + inward * np.sin(at)
    thrust -= STANDARD_GRAVITY_M_S2 * (w * math.sin(beta) + k * math.cos(beta))
    thrust -= STANDARD_GRAVITY_M_S2 * w * (along * np.cos(theta) + off * np.sin(theta))
    pressure = turning * np.sin(at) - inward * np.cos(at)
    pressure += STANDARD_GRAVITY_M_S2 * (w * math.cos(beta) - k * math.sin(beta))
    pressure -= STANDARD_GRAVITY_M_S2 * w * (off * np.cos(theta) - along * np.sin(theta))
    needs = np.degrees(np.arctan2(np.abs(thrust), pressure))
    worst = int(np.argmax(needs))
    return float(needs[worst]), float(history.time_s[turns][worst])
