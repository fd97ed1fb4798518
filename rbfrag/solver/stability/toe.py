"""Whether the toe of a block that turns about it holds (Gibson's dissertation, 4.3.1).

At the start of the rotation the toe bears R/m = r3 θ'' t - g G, with θ'' = p² q/F_s, so that, with
q = F_s (k cos θc - sin θc), θc = α3 - β and friction alone,

    tan φ = (sin β + k cos β - q cos α3)/(cos β - k sin β + q sin α3).
"""

from __future__ import annotations

import math

from rbfrag.solver.block.geometry import Block

SLIDE_ROCK = (
    "rotation without slip needs {need:.1f} deg at the toe at {pga:.3g} g; phi = {phi:g} gives way "
    "at {slips:.2f} g: slide-rock, outside the model"
)

HOLDS = "rotation without slip needs {need:.1f} deg at the toe at {pga:.3g} g, and phi is {phi:g}"


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
        return HOLDS.format(need=need, pga=pga_g, phi=phi_deg)
    return SLIDE_ROCK.format(need=need, pga=pga_g, phi=phi_deg, slips=slips)
