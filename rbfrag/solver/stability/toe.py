"""Whether the toe of a block that turns about it holds (Gibson's dissertation, 4.3.1).

At the start of the rotation the toe bears R/m = r3 θ'' t - g G, with θ'' = p² q/F_s, so that, with
q = F_s (k cos θc - sin θc), θc = α3 - β and friction alone,

    tan φ = (sin β + k cos β - q cos α3)/(cos β - k sin β + q sin α3).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block

if TYPE_CHECKING:
    from rbfrag.solver.results import ResponseHistory

# of 2,652 random blocks 16 % slip at the toe below their critical amplitude, ln of which then
# differs by 0.036 +- 0.10 from that of pure toppling
TOE_SLIPS = (
    "the toe slips above {slips:.2f} g: P(toppling) changes little (critical amplitude ±10 %), but "
    "the toe may move by centimetres"
)
NEEDS = "rotation without slip needs {need:.1f} deg at the toe at {where}"


def _balance(block: Block, beta_deg: float) -> tuple[float, float, float, float]:
    """Return thrust and pressure at the toe over the weight, each a constant and per k."""
    beta, alpha3 = math.radians(beta_deg), math.radians(block.alpha3_deg)
    turns, factor = alpha3 - beta, block.shape_factor
    up, down = factor * math.cos(turns), -factor * math.sin(turns)
    return (
        math.sin(beta) - down * math.cos(alpha3), math.cos(beta) - up * math.cos(alpha3),
        math.cos(beta) + down * math.sin(alpha3), -math.sin(beta) + up * math.sin(alpha3),
    )  # fmt: skip


def toe_needs_deg(block: Block, beta_deg: float, k: float) -> float:
    """Return the friction angle that the start of a rotation needs at the toe [deg].

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        k: greatest acceleration out of the slope, above k_r [g].
    """
    thrust, per_k, pressure, pressed_per_k = _balance(block, beta_deg)
    return math.degrees(math.atan2(abs(thrust + per_k * k), pressure + pressed_per_k * k))


def toe_slips_g(block: Block, beta_deg: float, phi_deg: float) -> float | None:
    """Return the acceleration at which the toe gives way as a rotation starts [g].

    None where it holds at any.

    Args:
        block: a block that topples.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
    """
    thrust, per_k, pressure, pressed_per_k = _balance(block, beta_deg)
    friction = math.tan(math.radians(phi_deg))
    rises = per_k - friction * pressed_per_k
    return (friction * pressure - thrust) / rises if rises > 0.0 else None


def about_toe(block: Block, beta_deg: float, phi_deg: float, pga_g: float) -> str:
    """Return whether the toe of a block that topples holds at a PGA [g], as a sentence."""
    need, slips = toe_needs_deg(block, beta_deg, pga_g), toe_slips_g(block, beta_deg, phi_deg)
    if slips is None or pga_g <= slips:
        return f"{NEEDS.format(need=need, where=f'{pga_g:.3g} g')}, and phi is {phi_deg:g}"
    return TOE_SLIPS.format(slips=slips)


def slides_at_toe(need_deg: float, where: str, phi_deg: float, slips_g: float | None) -> str:
    """Return that a toe gives way, as a sentence: what it needs and where, and from when on."""
    at = "" if slips_g is None else f" at {slips_g:.2f} g"
    consequence = f"phi = {phi_deg:g} gives way{at}: the slip of the toe is followed step by step"
    return f"{NEEDS.format(need=need_deg, where=where)}; {consequence}"


def toe_needs_in_time(
    block: Block, beta_deg: float, history: ResponseHistory
) -> tuple[float, float] | None:
    """Return the greatest friction angle that a rotation needs at the toe [deg], and when [s].

    max atan(|Rx|/Ry) of R/m = r3 (θ'' t - θ'² e) - g G, e from the toe to the centroid, t along its
    path, θ'' of eq. (4.13). None for a block that does not turn.

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        history: its motion in time.
    """
    import numpy as np

    turns = history.theta_rad > 0.0
    if not turns.any():
        return None
    beta, alpha3 = math.radians(beta_deg), math.radians(block.alpha3_deg)
    at = alpha3 - history.theta_rad[turns]
    k, w = history.k_h[turns], 1.0 + history.k_v[turns]
    turning = block.r3_m * block.p2 * (k * np.cos(at - beta) - w * np.sin(at - beta))
    inward = block.r3_m * history.theta_dot_rad_s[turns] ** 2
    thrust = turning * np.cos(at) + inward * np.sin(at)
    thrust -= STANDARD_GRAVITY_M_S2 * (w * math.sin(beta) + k * math.cos(beta))
    pressure = turning * np.sin(at) - inward * np.cos(at)
    pressure += STANDARD_GRAVITY_M_S2 * (w * math.cos(beta) - k * math.sin(beta))
    needs = np.degrees(np.arctan2(np.abs(thrust), pressure))
    worst = int(np.argmax(needs))
    return float(needs[worst]), float(history.time_s[turns][worst])
