"""Failure mode and yield acceleration of a block: `stability`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Unpack

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import rounded
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.block.formulas import SCALAR, bond_over_weight, tan_deg
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kinds import facts_of, kind_of_mode
from rbfrag.solver.quantity import (
    angle,
    friction_angle,
    json_value,
    not_negative,
    positive,
    vertical_g,
)
from rbfrag.solver.stability import joint as joints
from rbfrag.solver.stability.modes import (
    MODES,
    STATES,
    DrainedYield,
    ModeName,
    Planes,
    Push,
    StateName,
    Water,
    state_code,
    words_of_mode,
    yield_coefficient,
)
from rbfrag.solver.stability.validity import (
    Margin,
    MarginFacts,
    margins,
    toe_slips_g,
    warnings_about,
)

YIELDS = {
    "slide": "Yield acceleration of sliding {} g",
    "topple": "Uplift acceleration {} g (toppling): above it the block lifts off its base, and it "
    "topples only if the pulse lasts long enough",
    "slump": "Yield acceleration of slumping {} g",
    "confined_topple": "Yield acceleration of confined toppling {} g",
}
"""Headline of a block that stands, by its failure mode."""

KEYS = (
    "mode", "state", "p2", "kr", "ky", "ks", "kct", "yield_acceleration", "alpha1_deg",
    "alpha3_deg", "gamma_deg", "r1_m", "r2_m", "r3_m", "s1_m", "s2_m", "area_m2", "shape_factor",
    "delta_deg", "margins", "cohesion", "joint", "water_m", "drained", "toe_slips_g",
    "warnings",
)  # fmt: skip
"""What the JSON contract has of a stability and of its block."""


@dataclass(frozen=True)
class Cohesion:
    """Contribution of a cohesive base to the sliding yield, exact and by an equivalent friction.

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
class Stability(Result):
    """Failure mode of a block and its horizontal yield acceleration.

    Yield acceleration coefficients are in g. The yield of the governing mode and that of sliding
    are given; the others are None.

    Args:
        block: the block.
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
        phi_deg: friction angle of the base [deg], of a rough one the secant angle at its yield.
        phi_back_deg: friction angle of the back plane [deg].
        kv: vertical acceleration of the ground, up positive [g].
        back_fracture: whether there is a back plane.
        margins: nearest boundaries to other modes.
        cohesion: the effect of cohesion, or None if there is none.
        joint: the effect of roughness, or None if there is none.
        water_m: height of the water above the heel [m].
        toe_slips_g: of a topple, the acceleration at which its toe gives way as it starts to
            turn [g]; None where it holds at any, and for other modes.
        push: what water that keeps acting does to the block: forces down the base and off it over
            the weight, and the moment about the centroid, counter-clockwise, over the weight [m];
            None for a dry or drained block.
        drained: yield acceleration of the drained block, the bound next to that of the undrained
            one; None without water.
        warnings: sentences on what the answer takes for granted.
    """

    block: Block = field(compare=False)
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
    joint: joints.JointStrength | None = None
    water_m: float = 0.0
    toe_slips_g: float | None = None
    push: Push | None = None
    drained: DrainedYield | None = None

    def sentences(self) -> Iterator[str]:
        """Yield the yield acceleration of the governing mode."""
        mode = words_of_mode(self.mode)
        if self.state == "locked":
            yield f"The block is locked ({mode}): no horizontal acceleration moves it"
        elif self.state == "unstable":
            yield f"The block is unstable at rest ({mode}): it fails without an earthquake"
        else:
            yield YIELDS[self.mode].format(rounded(self.yield_acceleration))

    def lines(self) -> Iterator[TextLine]:
        """Yield the size and strength of the block, its angles and the drained yield."""
        block = self.block
        strengths = {"k_r": self.kr, "k_y": self.ky, "k_s": self.ks, "k_ct": self.kct}
        numbers = (
            f"{symbol} = {rounded(k)}"
            for symbol, k in strengths.items()
            if k is not None and math.isfinite(k)
        )
        yield TextLine("Block", ", ".join((f"p² = {rounded(block.p2)} s⁻²", *numbers)))
        angles = {"α₁": block.alpha1_deg, "α₃": block.alpha3_deg, "γ": block.gamma_deg}
        yield TextLine(
            "Shape", ", ".join(f"{symbol} = {rounded(value)}°" for symbol, value in angles.items())
        )
        if self.drained is not None and math.isfinite(self.drained.yield_acceleration):
            bound = rounded(self.drained.yield_acceleration)
            yield TextLine("Drained", f"yield acceleration {bound} g")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value and the nearest boundaries to other modes, if verbose."""
        if not verbose:
            return
        values = self.as_dict()
        margins = values.pop("margins")
        for name in ("cohesion", "joint"):
            effect = values.pop(name) or {}
            values |= {f"{name}_{key}": value for key, value in effect.items()}
        del values["warnings"], values["drained"]
        yield TextTable((), [*values.items()])
        if margins:
            yield TextTable(tuple(margins[0]), [tuple(margin.values()) for margin in margins])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract.

        A yield acceleration that no number expresses is None; the state says why.
        """
        fields = Stability.__annotations__
        return {
            name: json_value(getattr(self if name in fields else self.block, name)) for name in KEYS
        }


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
    **joint: Unpack[joints.OnJoint[float]],
) -> Stability:
    """Return the failure mode of a block, its state and its yield acceleration.

    Gibson's dissertation, eqs. 3.16-3.34, with (3.28) and (3.29) corrected and the vertical
    acceleration included; with water and roughness as `rbfrag.solver.stability.joint` has them.

    Args:
        block: the block.
        beta_deg: dip of the base plane, out of the slope positive, between -90 and 90 [deg].
        phi_deg: friction angle of the base, from 0 and below 90, of a rough one the residual [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kv: vertical acceleration of the ground, up positive, above -1 [g].
        back_fracture: False for a block that no plane supports or hinders from behind.
        cohesion_pa: cohesion of the base [Pa]; the back plane has none.
        density_kg_m3: density of the rock [kg/m³]; None for 2,650 where cohesion, water or
            roughness need it.
        joint: water and roughness, as :class:`rbfrag.solver.stability.joint.OnJoint` has them.

    Raises:
        InputError: a value outside its range; the message names the range; or water that lifts
            the block off its base.
    """
    question: dict[str, Any] = {
        "beta_deg": beta_deg, "phi_deg": phi_deg, "phi_back_deg": phi_back_deg, "kv": kv,
        "back_fracture": back_fracture, "cohesion_pa": cohesion_pa, "density_kg_m3": density_kg_m3,
    }  # fmt: skip
    finding, planes, strength = assess_stability(block, **question, **joint)
    water_m = float(joint.get("water_m") or 0.0)
    drained = None
    if water_m > 0.0:
        dry: dict[str, Any] = {**joint, "drainage": joints.DRAINED}
        drained = DrainedYield(assess_stability(block, **question, **dry)[0].k)
    push = push_of(block, planes)
    assumed: tuple[str, ...] = ()
    if density_kg_m3 is None and (cohesion_pa or water_m or strength):
        assumed = (joints.ASSUMED_DENSITY,)
    if planes.bond and finding.mode == "topple":
        assumed = (*assumed, joints.NO_EFFECT_OF_COHESION)
    beta_deg, bond, k = finding.beta_deg, planes.bond or 0.0, finding.k
    slips_g = math.inf
    if finding.mode == "topple":
        slips_g = toe_slips_g(block, beta_deg, finding.phi_deg, push)
    cohesion = None
    if bond:
        equivalent = planes.mu1 + bond
        cohesion = Cohesion(
            ratio=bond,
            ky=planes.ky,
            phi_equivalent_deg=math.degrees(math.atan(equivalent)),
            ky_equivalent=yield_coefficient(
                equivalent, 1.0, planes.tan_beta, planes.weight, SCALAR
            ),
        )
    yields = {mode: k if mode == finding.mode else None for mode in MODES}
    return Stability(
        block=block,
        mode=finding.mode,
        state=finding.state,
        yield_acceleration=k,
        ky=planes.ky,
        kr=yields["topple"],
        ks=yields["slump"],
        kct=yields["confined_topple"],
        delta_deg=beta_deg + math.degrees(math.atan(k / planes.weight))
        if math.isfinite(k)
        else None,
        beta_deg=beta_deg,
        phi_deg=finding.phi_deg,
        phi_back_deg=finding.phi_back_deg,
        kv=vertical_g(kv),
        back_fracture=back_fracture,
        margins=margins(
            block,
            finding,
            math.degrees(math.atan(planes.limit)) if bond or planes.water else finding.phi_deg,
            partial(_friction_that_slides_at, beta_deg=beta_deg, planes=planes),
        ),
        cohesion=cohesion,
        warnings=(*warnings_about(block, finding), *assumed),
        joint=strength,
        water_m=water_m,
        toe_slips_g=slips_g if slips_g < math.inf else None,
        push=push,
        drained=drained,
    )


def assess_stability(
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
    back_fracture: bool = True,
    cohesion_pa: float = 0.0,
    density_kg_m3: float | None = None,
    **joint: Unpack[joints.OnJoint[float]],
) -> tuple[MarginFacts, Planes[float], joints.JointStrength | None]:
    """Return the mode and yield of a block, its planes and the effect of roughness on its friction.

    Arguments as for :func:`stability`.
    """
    if not isinstance(block, Block):
        raise InputError(
            f"block = {block!r}: use Block.rectangle, .from_angles, .from_fractures or "
            ".from_polygon"
        )
    beta_deg = angle(beta_deg, "beta_deg", -90.0, 90.0)
    phi_deg = friction_angle(phi_deg, "phi_deg")
    phi_back_deg = phi_deg if phi_back_deg is None else friction_angle(phi_back_deg, "phi_back_deg")
    cohesion = not_negative(cohesion_pa, "cohesion_pa", "Pa")
    density = joints.ROCK_KG_M3
    if density_kg_m3 is not None:
        density = positive(density_kg_m3, "density_kg_m3", "kg/m³")
    bond = bond_over_weight(cohesion, density, block.base_m, block.area_m2)
    tb, mu1, mu2 = (tan_deg(value, SCALAR) for value in (beta_deg, phi_deg, phi_back_deg))
    planes = Planes(tb, mu1, mu2, 1.0 + vertical_g(kv), SCALAR, bond or None)
    t1, t3 = block.tan_alpha1, block.tan_alpha3
    water_m = not_negative(joint.get("water_m") or 0.0, "water_m", "m")
    # the drained block is a dry one
    if not joints.is_drained(joint.get("drainage")) and water_m > 0.0:
        if not back_fracture:
            raise InputError(joints.NO_FRACTURE, fields=("water_m", "back_fracture"))
        planes = replace(planes, water=_water_on(block, tb, water_m, density))
    strength = None
    jrc, jcs_mpa, length_m = (joint.get(name) for name in ("jrc", "jcs_mpa", "joint_length_m"))
    joints.reject_half(jrc, jcs_mpa, length_m)
    if jrc is not None:
        coefficient = not_negative(jrc, "jrc", "")
        length_m = positive(block.base_m if length_m is None else length_m, "joint_length_m", "m")
        planes, rough = joints.roughened(
            planes, phi_deg, jrc=coefficient, jcs_mpa=positive(jcs_mpa, "jcs_mpa", "MPa"),
            length_m=max(length_m, joints.LAB_M),
            weight_pa=density * STANDARD_GRAVITY_M_S2 * block.area_m2 / block.base_m,
        )  # fmt: skip
        strength = joints.JointStrength.of(*rough)
        phi_deg = strength.secant_deg
    code = int(planes.mode(t1, t3, block.confines, back_fracture=back_fracture))
    # the weight passes upslope of the heel, and nothing stands there to lean on
    backward = not back_fracture and tb < t1
    k, untenable, lifts = planes.yield_of(code, block.arms, block.cot_gamma)
    k = -math.inf if backward else k
    if planes.floats(k, code, block.cot_gamma):
        raise InputError(
            "the water lifts the block off its base (the reaction of the base at the yield is "
            "below zero): it floats, and no yield acceleration describes it; lower water_m",
            fields=("water_m",),
        )
    finding = MarginFacts(
        MODES[code], STATES[int(state_code(k, SCALAR))], k, beta_deg, phi_deg, phi_back_deg,
        back_fracture, backward, untenable and back_fracture, lifts,
    )  # fmt: skip
    return finding, planes, strength


def push_of(block: Block, planes: Planes[float]) -> Push | None:
    """Return the push of water on a block as :class:`Stability` has it; None for none."""
    water = planes.water
    if water is None:
        return None
    return water.along, water.normal, water.moment * block.half_s1_m


def _water_on(block: Block, tan_beta: float, water_m: float, density: float) -> Water[float]:
    """Return the push of water on a block, or reject it with the reason."""
    if not block.is_parallelogram:
        raise InputError(
            "water_m is known of blocks between two pairs of fractures (rectangles, angles, "
            "spacings), not of outlines",
            fields=("water_m",),
        )
    water, holds = joints.water_at(
        water_m=water_m, density_kg_m3=density, half_s1_m=block.half_s1_m,
        tan_alpha1=block.tan_alpha1, tan_alpha3=block.tan_alpha3, cot=block.cot_gamma,
        tan_beta=tan_beta, functions=SCALAR,
    )  # fmt: skip
    if not holds:
        beta = math.atan(tan_beta)
        top_m = block.s1_m * (math.cos(beta) + block.cot_gamma * math.sin(beta))
        raise InputError(
            f"water_m = {water_m:g} stands above the top of the back fracture, "
            f"{max(top_m, 0.0):.4g} m above the heel, or the fracture does not rise from the heel: "
            "give the height that it holds",
            fields=("water_m",),
        )
    return water


def _friction_that_slides_at(alpha_deg: float, beta_deg: float, planes: Planes[float]) -> float:
    """Return the friction angle with which the base slides when its reaction is at alpha_deg.

    The reaction stands there at the k that balances what acts on the block about that point of the
    base; the friction is what the bond leaves of the thrust along it.
    """
    bond, water = planes.bond or 0.0, planes.water
    if bond == 0.0 and water is None:
        return alpha_deg
    along, off, moment = (water.along, water.normal, water.moment) if water else (0.0, 0.0, 0.0)
    alpha, beta = math.radians(alpha_deg), math.radians(beta_deg)
    tilt = alpha - beta
    if math.cos(tilt) <= 0.0:
        return math.copysign(90.0, tilt)
    # over cos α: (1 + k_v) sin(α - β) less the power of the water, and k cos(α - β)
    pushed = (along - moment) * math.cos(alpha) + off * math.sin(alpha)
    k = (planes.weight * math.sin(tilt) - pushed) / math.cos(tilt)
    normal = planes.pressed_by(k)
    thrust = planes.weight * math.sin(beta) + k * math.cos(beta) + along - bond
    return math.degrees(math.atan2(thrust, normal))


def rectangle_r3_m(p2: float) -> float:
    """Return the distance from centroid to toe of a rectangle, r3 = 3g/(4p²) [m].

    Args:
        p2: frequency parameter p² [1/s²], above 0.
    """
    return 0.75 * STANDARD_GRAVITY_M_S2 / positive(p2, "p2", "1/s²")


def level_rectangle(p2: float, kr: float) -> tuple[Block, Stability]:
    """Return a free-standing rectangle on level ground, rough enough to topple.

    Args:
        p2: its frequency parameter p² [1/s²], above 0.
        kr: its yield acceleration coefficient k_r = tan(critical angle), above 0.
    """
    slender_deg = math.degrees(math.atan(positive(kr, "kr", "")))
    block = Block.from_angles(-slender_deg, slender_deg, rectangle_r3_m(p2))
    rough = rough_deg(block)
    return block, stability(block, beta_deg=0.0, phi_deg=rough, back_fracture=False)


def require_stable(at_rest: Stability) -> None:
    """Reject a block that fails or is locked at rest, whatever the ground motion.

    Raises:
        InputError: it fails at rest, or it does not move under any horizontal acceleration.
    """
    k = at_rest.yield_acceleration
    if at_rest.state == "locked":
        raise InputError(
            f"the block is locked in its mode, {words_of_mode(at_rest.mode)}: it does not move "
            "under any horizontal acceleration"
        )
    if at_rest.state == "unstable" or k <= 0.0:
        name = {"topple": "k_r", "slide": "k_y", "slump": "k_s"}.get(at_rest.mode, "k_ct")
        raise InputError(
            f"the block is {at_rest.state} at rest (mode {words_of_mode(at_rest.mode)}, {name} = "
            f"{k:.4g} g)"
        )


def rough_deg(block: Block) -> float:
    """Return a friction angle [deg] at which a block topples rather than slides."""
    return 0.5 * (block.alpha3_deg + 90.0)


def after_first_slip(
    block: Block, planes: Mapping[str, Any]
) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return the planes after the first slip, and the warnings about them.

    Args:
        planes: keywords of `stability`, and perhaps ``phi_residual_deg``, else left as they are.

    Raises:
        InputError: no earthquake decides about the block, or it does not stand on what is left.
    """
    keywords = dict(planes)
    residual_deg = keywords.pop("phi_residual_deg", None)
    if residual_deg is None:
        return keywords, ()
    first = stability(block, **keywords)
    require_stable(first)
    remaining = {name: value for name, value in keywords.items() if name not in joints.ENDED}
    remaining["phi_deg"] = residual_deg
    if stability(block, **remaining).yield_acceleration <= 0.0:
        finding = {"k": first.yield_acceleration, "mode": words_of_mode(first.mode)}
        raise InputError(joints.SLIPS_ON.format(**finding), fields=("phi_residual_deg",))
    return remaining, (joints.AFTER_SLIP,)


def reject_before_slip(block: Block, planes: Mapping[str, Any], kind: str | None) -> None:
    """Reject a simulation in time with contributions that end at the first slip.

    Args:
        planes: keywords of `stability`.
        kind: kind of the block; None for that of its mode.

    Raises:
        InputError: a base that it slips on is rough.
    """
    if not planes.get("jrc"):
        return
    at_rest = stability(block, **planes)
    backed = planes.get("back_fracture", True)
    facts = facts_of(kind) if kind else kind_of_mode(at_rest.mode, back_fracture=backed)
    if joints.slips_on_base(facts):
        finding = {
            "k": at_rest.yield_acceleration,
            "mode": words_of_mode(at_rest.mode),
        }
        text = joints.ROUGH.format(kind=facts.kind, **finding)
        raise InputError(text, fields=("jrc", "phi_residual_deg"))
