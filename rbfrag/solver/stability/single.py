"""The failure mode and yield acceleration of a block: `stability`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

from rbfrag.errors import InputError
from rbfrag.frames import Tabular
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.formulas import SCALAR, bond_over_weight, tan_deg
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.quantity import (
    angle,
    friction_angle,
    json_value,
    not_negative,
    positive,
    vertical_g,
)
from rbfrag.solver.stability.margins import (
    Margin,
    MarginFacts,
    degrees_of,
    margins,
    warnings_about,
)
from rbfrag.solver.stability.modes import (
    MODES,
    STATES,
    ModeName,
    Planes,
    StateName,
    state_code,
    words_of_mode,
    yield_coefficient,
)


@dataclass(frozen=True)
class Cohesion:
    """What a cohesive base adds to the sliding yield, exactly and by an equivalent friction.

    Args:
        ratio: strength of the bond over the weight, c/(ρ g S1).
        ky: k_y = (1 + k_v) tan(φ - β) + c/(ρ g S1) cos φ/cos(φ - β), exact.
        phi_equivalent_deg: the dissertation's atan(tan φ + c/(ρ g S1)), which takes the whole
            weight as normal force (eqs. 3.30-3.34) [deg].
        ky_equivalent: (1 + k_v) tan(phi_equivalent - β).
    """

    ratio: float
    ky: float
    phi_equivalent_deg: float
    ky_equivalent: float


@dataclass(frozen=True, repr=False)
class Stability(Tabular):
    """How a block fails and at which horizontal acceleration.

    Yield acceleration coefficients are in g. The yield of the governing mode and that of sliding
    are given; the others are None.

    Args:
        mode: ``slide``, ``topple``, ``slump`` or ``confined_topple``.
        state: ``stable``, ``unstable`` (fails at rest) or ``locked`` (no horizontal
            acceleration moves it in this mode).
        yield_acceleration: of the governing mode; +inf if locked, -inf if nothing holds it.
        ky: of sliding on the base.
        kr: of toppling about the toe.
        ks: of slumping.
        kct: of confined toppling.
        delta_deg: angle of the resultant at yield, from the inward normal of the base,
            positive downslope [deg]; None where no finite k is the yield.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
        kv: vertical acceleration of the ground, up positive [g].
        back_fracture: whether there is a back plane.
        margins: nearest boundaries to other modes.
        cohesion: the effect of cohesion, or None if there is none.
        warnings: sentences on what the answer takes for granted.
    """

    mode: ModeName
    state: StateName
    yield_acceleration: float
    ky: float
    kr: float | None
    ks: float | None
    kct: float | None
    delta_deg: float | None
    beta_deg: float
    phi_deg: float
    phi_back_deg: float
    kv: float
    back_fracture: bool
    margins: tuple[Margin, ...]
    cohesion: Cohesion | None
    warnings: tuple[str, ...]


def stability(
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
    back_fracture: bool = True,
    cohesion_pa: float = 0.0,
    density_kg_m3: float | None = None,
) -> Stability:
    """Return the failure mode of a block, its state and its yield acceleration.

    Gibson's dissertation, eqs. 3.16-3.34, with (3.28) and (3.29) corrected and the vertical
    acceleration included.

    Args:
        block: the block.
        beta_deg: dip of the base plane, out of the slope positive, between -90 and 90 [deg].
        phi_deg: friction angle of the base, from 0 and below 90 [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kv: vertical acceleration of the ground, up positive, above -1 [g].
        back_fracture: False for a block that no plane supports or hinders from behind.
        cohesion_pa: cohesion of the base [Pa]; the back plane has none.
        density_kg_m3: density of the rock [kg/m³], needed with a cohesion.

    Raises:
        InputError: a value outside its range; the message names the range.
    """
    finding, planes = judged(
        block, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg, kv=kv,
        back_fracture=back_fracture, cohesion_pa=cohesion_pa, density_kg_m3=density_kg_m3,
    )  # fmt: skip
    beta_deg, bond, k = finding.beta_deg, planes.bond or 0.0, finding.k
    own = {mode: k if mode == finding.mode else None for mode in MODES}
    return Stability(
        mode=finding.mode,
        state=finding.state,
        yield_acceleration=k,
        ky=planes.ky,
        kr=own["topple"],
        ks=own["slump"],
        kct=own["confined_topple"],
        delta_deg=beta_deg + degrees_of(k / planes.weight) if math.isfinite(k) else None,
        beta_deg=beta_deg,
        phi_deg=finding.phi_deg,
        phi_back_deg=finding.phi_back_deg,
        kv=vertical_g(kv),
        back_fracture=back_fracture,
        margins=margins(
            block,
            finding,
            degrees_of(planes.limit) if bond else finding.phi_deg,
            partial(_friction_that_slides_at, beta_deg=beta_deg, weight=planes.weight, bond=bond),
        ),
        cohesion=_cohesion(planes, bond) if bond else None,
        warnings=warnings_about(block, finding),
    )


def judged(
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
    back_fracture: bool = True,
    cohesion_pa: float = 0.0,
    density_kg_m3: float | None = None,
) -> tuple[MarginFacts, Planes[float]]:
    """Return the mode and yield of a block and its planes; arguments as for :func:`stability`."""
    if not isinstance(block, Block):
        raise InputError(f"block = {block!r}: make one with Block.from_angles or its siblings")
    beta_deg = angle(beta_deg, "beta_deg", -90.0, 90.0)
    phi_deg = friction_angle(phi_deg, "phi_deg")
    phi_back_deg = phi_deg if phi_back_deg is None else friction_angle(phi_back_deg, "phi_back_deg")
    bond = _bond(block, cohesion_pa, density_kg_m3)
    tb, mu1, mu2 = (tan_deg(value, SCALAR) for value in (beta_deg, phi_deg, phi_back_deg))
    planes = Planes(tb, mu1, mu2, 1.0 + vertical_g(kv), SCALAR, bond or None)
    t1, t3 = block.tan_alpha1, block.tan_alpha3
    code = int(planes.mode(t1, t3, block.confines, back_fracture=back_fracture))
    # the weight passes upslope of the heel, and nothing stands there to lean on
    backward = not back_fracture and tb < t1
    k, untenable, lifts = planes.yield_of(code, block.arms, block.cot_gamma)
    k = -math.inf if backward else k
    finding = MarginFacts(
        MODES[code], STATES[int(state_code(k, SCALAR))], k, beta_deg, phi_deg, phi_back_deg,
        back_fracture, backward, untenable and back_fracture, lifts,
    )  # fmt: skip
    return finding, planes


def _bond(block: Block, cohesion_pa: object, density_kg_m3: object) -> float:
    """Return the strength of the base's bond over the weight, c L/(ρ g A)."""
    cohesion = not_negative(cohesion_pa, "cohesion_pa", "Pa")
    if density_kg_m3 is None:
        if cohesion > 0.0:
            raise InputError(
                f"cohesion_pa = {cohesion:g} needs density_kg_m3, the density of the rock "
                "(about 2700 kg/m³): its effect is that of a stress over the weight"
            )
        return 0.0
    density = positive(density_kg_m3, "density_kg_m3", "kg/m³")
    return bond_over_weight(cohesion, density, block.base_m, block.area_m2)


def _friction_that_slides_at(
    alpha_deg: float, beta_deg: float, weight: float, bond: float
) -> float:
    """Return the friction angle with which the base slides when the resultant is at alpha_deg."""
    if bond == 0.0:
        return alpha_deg
    tilt = math.radians(alpha_deg - beta_deg)
    if math.cos(tilt) <= 0.0:
        return math.copysign(90.0, tilt)
    # of (1 + k_v) (T cos β - sin β) + C = k (cos β + T sin β) with k = (1 + k_v) tan(α - β)
    alpha = math.radians(alpha_deg)
    return degrees_of(math.tan(alpha) - bond * math.cos(tilt) / (weight * math.cos(alpha)))


def _cohesion(planes: Planes[float], bond: float) -> Cohesion:
    equivalent = planes.mu1 + bond
    return Cohesion(
        ratio=bond,
        ky=planes.ky,
        phi_equivalent_deg=degrees_of(equivalent),
        ky_equivalent=yield_coefficient(equivalent, 1.0, planes.tan_beta, planes.weight, SCALAR),
    )


def rectangle_r3_m(p2: float) -> float:
    """Return the distance from centroid to toe of a rectangle, r3 = 3g/(4p²) [m].

    Args:
        p2: frequency parameter p² [1/s²], above 0.
    """
    return 0.75 * STANDARD_GRAVITY_M_S2 / positive(p2, "p2", "1/s²")


def level_rectangle(p2: float, kr: float) -> tuple[Block, Stability]:
    """Return a rectangle that stands free on level ground, rough enough to topple.

    Args:
        p2: its frequency parameter p² [1/s²], above 0.
        kr: its yield acceleration coefficient k_r = tan(critical angle), above 0.
    """
    slender_deg = math.degrees(math.atan(positive(kr, "kr", "")))
    block = Block.from_angles(-slender_deg, slender_deg, rectangle_r3_m(p2))
    rough = rough_deg(block)
    return block, stability(block, beta_deg=0.0, phi_deg=rough, back_fracture=False)


def refuse_undecided(judged: Stability) -> None:
    """Refuse a block whose fate at rest leaves nothing to a ground motion.

    Raises:
        InputError: it fails at rest, or no horizontal acceleration moves it.
    """
    k = judged.yield_acceleration
    if judged.state == "locked":
        raise InputError(
            f"the block is locked in its mode, {words_of_mode(judged.mode)}: no horizontal "
            "acceleration moves it"
        )
    if judged.state == "unstable" or k <= 0.0:
        name = {"topple": "k_r", "slide": "k_y", "slump": "k_s"}.get(judged.mode, "k_ct")
        raise InputError(
            f"the block is {judged.state} at rest (mode {words_of_mode(judged.mode)}, "
            f"{name} = {k:.4g} g): no earthquake decides about it"
        )


def rough_deg(block: Block) -> float:
    """Return a friction angle [deg] at which a block topples rather than slides."""
    return 0.5 * (block.alpha3_deg + 90.0)


KEYS = (
    "mode", "state", "p2", "kr", "ky", "ks", "kct", "yield_acceleration", "alpha1_deg",
    "alpha3_deg", "gamma_deg", "r1_m", "r2_m", "r3_m", "s1_m", "s2_m", "area_m2", "shape_factor",
    "delta_deg", "margins", "cohesion", "warnings",
)  # fmt: skip
"""What the JSON contract has of a stability and of its block."""


def stability_as_dict(block: Block, stability: Stability) -> dict[str, Any]:
    """Return the answer with the keys of the JSON contract.

    A yield acceleration that no number expresses is None; the state says why.
    """
    own = Stability.__annotations__
    return {name: json_value(getattr(stability if name in own else block, name)) for name in KEYS}
