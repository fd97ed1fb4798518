"""Water in the back fracture, roughness of the base, and what the first slip leaves of a joint.

Formulas for single numbers and for arrays; no numpy is loaded for a single number. Water presses
on the wetted part of the back plane, V = γw z l/2 at l/3 from the heel with l = z/sin(β + γ), and
lifts the base, U = γw z L/2 at L/3 from the heel: hydrostatic at the heel and drained at the toe.
Undrained, which is assumed unless the contrary is given, both keep acting while the block moves:
they turn with it and scale with 1 + k_v. Drained they vanish as it starts to move, so that the
block is a dry one: the other bound. Hydrodynamic pressure is neglected. Roughness ends with the
first slip, which shears it off.

References:
    Barton and Bandis (1982), 23rd US Symposium on Rock Mechanics, 739-760.
    Barton and Choubey (1977), Rock Mechanics 10, 1-54.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, TypedDict, TypeVar

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.formulas import Elementwise, N, tan_deg
from rbfrag.solver.kinds import KindSpec
from rbfrag.solver.stability.modes import Planes, Water

V = TypeVar("V")


class OnJoint(TypedDict, Generic[V], total=False):
    """Water and roughness; numbers, or arrays with one element per block.

    Args:
        water_m: height of the water in the back fracture above the heel [m].
        drainage: `UNDRAINED` (None means that) or `DRAINED`.
        jrc: joint roughness coefficient of the base, of samples of 10 cm; 0 or None: smooth.
        jcs_mpa: compressive strength of its walls, of such samples, needed with `jrc` [MPa].
        joint_length_m: length of the joint that shears as one [m]; None, or in arrays 0, for that
            of the base.
    """

    water_m: V
    drainage: str | None
    jrc: V | None
    jcs_mpa: V | None
    joint_length_m: V | None


UNDRAINED, DRAINED = DRAINAGES = ("undrained", "drained")
"""What the water does while the block moves: its pressure keeps acting, or vanishes."""

ROCK_KG_M3 = 2650.0
"""Density of the rock where none is given [kg/m³]."""

ASSUMED_DENSITY = Diagnostic(
    f"the density is not given: {ROCK_KG_M3:,.0f} kg/m³ is assumed", "density_assumed"
)

NO_DRAINAGE = "drainage = {!r}: it must be undrained or drained"

STAYS_UNDRAINED = Diagnostic(
    "water pressure keeps acting while the block moves (conservative); a joint under 1 mm without "
    "inflow behaves almost as drained; hydrodynamic pressure is neglected",
    "undrained",
)
IS_DRAINED = Diagnostic(
    "drained: the water pressure is assumed to vanish as the block starts to move (unconservative)",
    "drained",
)

NO_EFFECT_OF_COHESION = Diagnostic(
    "cohesion has no effect on k_r: the base opens in tension; the tensile strength of rock "
    "bridges is neglected (conservative)",
    "cohesion_without_effect",
)

WATER_N_M3 = 9810.0
"""Unit weight of water, γw [N/m³]."""

SPILLS = 1.0001
"""Level over the top of the back fracture, beyond rounding, at which it would spill over."""

LAB_M = 0.1
"""Length of the samples on which JRC and JCS are measured [m]."""

STEEPEST_DEG = 70.0
"""Greatest secant friction angle that roughness gives (Barton and Choubey 1977) [deg]."""

_ROUNDS = 60

MEGA = 1e6


def water_at(
    *,
    water_m: N,
    density_kg_m3: N,
    half_s1_m: N,
    tan_alpha1: N,
    tan_alpha3: N,
    cot: N,
    tan_beta: N,
    functions: Elementwise[N],
) -> tuple[Water[N], Any]:
    """Return the push of the water on a parallelogram, and whether its fracture can hold it.

    Args:
        water_m: height of the water above the heel [m].
        density_kg_m3: density of the rock [kg/m³].
        half_s1_m: half of the thickness normal to the base [m].
        tan_alpha1: tan α1.
        tan_alpha3: tan α3.
        cot: cot γ.
        tan_beta: tangent of the dip of the base.
        functions: the functions for this kind of number.

    Returns:
        The push, and whether the back plane rises from the heel and the water is not above its top.
    """
    where = functions.where
    sine = 1.0 / functions.sqrt(1.0 + cot * cot)
    cosine = cot * sine
    # sin(β + γ) over sin γ
    steep = (1.0 + cot * tan_beta) / functions.sqrt(1.0 + tan_beta * tan_beta)
    holds = (steep > 0.0) & (water_m <= SPILLS * 2.0 * half_s1_m * steep)
    wetted = water_m / (where(holds, steep, 1.0) * sine) / half_s1_m
    base = tan_alpha3 - tan_alpha1
    # over the weight, of which half_s1_m² 2 base is the area
    weight = density_kg_m3 * STANDARD_GRAVITY_M_S2 * 2.0 * base * half_s1_m
    v = 0.5 * WATER_N_M3 * water_m * wetted / weight
    u = 0.5 * WATER_N_M3 * water_m * base / weight
    along, normal = v * sine, v * cosine
    at_x, at_y = tan_alpha1 - wetted * cosine / 3.0, -1.0 + wetted * sine / 3.0
    moment = at_x * normal - at_y * along + (tan_alpha1 + base / 3.0) * u
    return Water(along, normal + u, moment), holds


def is_drained(drainage: object) -> bool:
    """Return whether the water drains as the block starts to move.

    Raises:
        InputError: neither of `DRAINAGES`.
    """
    if drainage is not None and drainage not in DRAINAGES:
        raise InputError(NO_DRAINAGE.format(f"{drainage}"[:40]), fields=("drainage",))
    return drainage == DRAINED


def roughened(
    planes: Planes[N],
    phi_deg: N,
    *,
    jrc: N,
    jcs_mpa: N,
    length_m: N,
    weight_pa: N,
    power: Callable[[Any, Any], Any] = pow,
) -> tuple[Planes[N], tuple[N, N, N, N]]:
    """Return planes whose base has the secant friction angle at the normal stress of its yield.

    φ = φr + JRCn log10(JCSn/σ) with JRCn = JRC (L/L0)^(-0.02 JRC) and JCSn = JCS (L/L0)^(-0.03
    JRC), L0 = 0.1 m, and σ at the yield of sliding, which φ decides: repeated halfway to the
    answer, which converges for all dips because φ is at most :data:`STEEPEST_DEG`.

    Args:
        planes: the planes, with water if there is any.
        phi_deg: residual friction angle of the base φr [deg].
        jrc: joint roughness coefficient of samples of 10 cm.
        jcs_mpa: compressive strength of their walls [MPa].
        length_m: length of the joint that shears as one, from 0.1 m [m].
        weight_pa: weight of the block over its base [Pa].
        power: the power function.

    Returns:
        The planes, and JRCn, JCSn [Pa], the normal stress [Pa] and the secant angle [deg].
    """
    where, log10 = planes.functions.where, planes.functions.log10
    longer = length_m / LAB_M
    jrc_n = jrc * power(longer, -0.02 * jrc)
    jcs_pa = MEGA * jcs_mpa * power(longer, -0.03 * jrc)
    secant, stress = phi_deg, weight_pa
    for _ in range(_ROUNDS):
        planes = replace(planes, mu1=tan_deg(secant, planes.functions))
        stress = weight_pa * planes.pressed_by(planes.ky)
        weaker = (stress > 0.0) & (stress < jcs_pa)
        over = log10(jcs_pa / where(weaker, stress, jcs_pa))
        steep = phi_deg + jrc_n * over
        steep = where(steep > STEEPEST_DEG, where(phi_deg > STEEPEST_DEG, phi_deg, STEEPEST_DEG),
                      steep)  # fmt: skip
        secant = 0.5 * (secant + steep)
    return planes, (jrc_n, jcs_pa, stress, secant)


@dataclass(frozen=True)
class JointStrength:
    """Friction of a rough base at the normal stress of its yield (Barton and Bandis).

    Args:
        jrc: joint roughness coefficient at the length of the joint.
        jcs_mpa: compressive strength of its walls at that length [MPa].
        normal_stress_pa: normal stress at the yield of sliding [Pa].
        secant_deg: φ = φr + JRC log10(JCS/σ) [deg].
        tangent_deg: slope of the envelope there [deg].
        intercept_pa: the tangent's instantaneous cohesion [Pa].
    """

    jrc: float
    jcs_mpa: float
    normal_stress_pa: float
    secant_deg: float
    tangent_deg: float
    intercept_pa: float

    @classmethod
    def of(cls, jrc: float, jcs_pa: float, stress_pa: float, secant_deg: float) -> JointStrength:
        """Return the strength at a normal stress [Pa] and its secant angle [deg]."""
        secant = math.tan(math.radians(secant_deg))
        falls = 0.0
        if 0.0 < stress_pa < jcs_pa and secant_deg < STEEPEST_DEG:
            falls = math.radians(jrc) / math.log(10.0) * (secant * secant + 1.0)
        tangent_deg = math.degrees(math.atan(secant - falls))
        return cls(jrc, jcs_pa / MEGA, stress_pa, secant_deg, tangent_deg, stress_pa * falls)


NO_FRACTURE = (
    "water_m cannot be combined with a block without a back fracture: that is where the water "
    "stands"
)

JOINT = ("water_m", "drainage", "jrc", "jcs_mpa", "joint_length_m", "phi_residual_deg")
"""Inputs of a joint besides bond and friction: those of `OnJoint` and the residual friction."""

ENDED = frozenset(
    {"jrc", "jcs_mpa", "joint_length_m", "phi_residual_deg", "cohesion_pa", "phi_back_deg"}
)
"""Keywords of planes that the first slip ends, or that the residual friction takes the place of."""

STATE_RESIDUAL = "give phi_residual_deg, the friction angle that is left, for the answer after it"

_ENDS = (
    " ends with the first slip (yield {k:.4g} g, {mode}), and no displacement or probability "
    f"follows from it: {STATE_RESIDUAL}"
)
ROUGH = f"jrc cannot be combined with a probability or a time history of {{kind}}: roughness{_ENDS}"

SLIPS_ON = (
    "after its first slip (yield {k:.4g} g, {mode}) the block does not stand on phi_residual_deg: "
    "it fails where the motion exceeds that yield, and no model is needed"
)

AFTER_SLIP = Diagnostic(
    "the answer is that of the block after its first slip, without bond or roughness, on "
    "phi_residual_deg; before it the yield of the block is another one (rbfrag block prints it), "
    "and a motion below that does nothing",
    "after_first_slip",
    fields=("phi_residual_deg",),
)


def slips_on_base(facts: KindSpec) -> bool:
    """Return whether blocks of a kind slip on their base; a topple turns about its toe."""
    return facts.free_standing or "p2" not in facts.parameters


def reject_half(jrc: object, jcs_mpa: object, joint_length_m: object) -> None:
    """Reject an incomplete roughness.

    Raises:
        InputError: JRC without JCS, JCS without JRC, or a length without both.
    """
    inputs = {"jrc": jrc, "jcs_mpa": jcs_mpa, "joint_length_m": joint_length_m}
    present = [name for name, value in inputs.items() if value is not None]
    for name in ("jrc", "jcs_mpa"):
        if present and inputs[name] is None:
            raise InputError(
                f"{name} is missing: the roughness of a joint is jrc with jcs_mpa, and phi_deg is "
                "then its residual friction angle",
                fields=(name, *present),
            )
