"""Failure modes, yield accelerations and parameters at rest, for single numbers and arrays.

At the yield of a mechanism friction is mobilised at both of its contacts. Their reactions then
have directions u_a and u_b, and because they hold the block in moment equilibrium their ratio
follows from their moments about the centroid, R_a : R_b = M_b : -M_a. The resultant of weight
and inertia must oppose F = R_a u_a + R_b u_b, which makes the angle δ* with the normal of
the base, tan δ* = -F_x/F_y, so that (eqs. 3.16-3.29)

    k = (1 + k_v) tan(δ* - β).

The yields here use (-F_x, F_y), the sine and cosine of δ* up to a positive factor, and do
without any angle: u_a and u_b are scaled by 1/cos φ1 and 1/(sin γ cos φ2), so that tangents and
cot γ are enough.

At rest predictions use p_s² of blocks on two sliding contacts, and p², k_r and restitution of
free-standing ones. No numpy is loaded for a single number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, Literal

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.formulas import Elementwise, N, corner_distance, moments_about_corners

ModeName = Literal["slide", "topple", "slump", "confined_topple"]
StateName = Literal["stable", "unstable", "locked"]

MODES: tuple[ModeName, ...] = ("slide", "topple", "slump", "confined_topple")
"""Names of the mode codes 0 to 3."""

STATES: tuple[StateName, ...] = ("stable", "unstable", "locked")
"""Names of the state codes 0 to 2."""

SLIDE, TOPPLE, SLUMP, CONFINED_TOPPLE = range(4)
STABLE, UNSTABLE, LOCKED = range(3)

AT_LIMIT = 1e-12
"""A yield acceleration coefficient nearer to zero than this is zero: stable, at its limit."""

_SQUARE = 1e-12
"""Cosine of δ* - β below which the reaction is assumed to be level, and k to be infinite."""


def yield_coefficient(
    sine: N,
    cosine: N | float,
    tan_beta: N,
    weight: N | float,
    functions: Elementwise[N],
    bond: N | float = 0.0,
) -> N:
    """Return k = (1 + k_v) tan(δ* - β), with the contribution of a cohesive bond if there is one.

    Args:
        sine: sin δ* up to a positive factor.
        cosine: cos δ* up to the same factor.
        tan_beta: tangent of the dip of the base.
        functions: the functions for this kind of number.
        bond: what the bond adds to the numerator, in the same scale.

    Returns:
        The yield acceleration coefficient; +inf where δ* - β >= 90° (locked) and -inf
        where δ* - β <= -90° (unstable without any finite k).
    """
    where = functions.where
    # sine and cosine of δ* - β, over cos β
    numerator = (sine - cosine * tan_beta) * weight + bond
    denominator = cosine + sine * tan_beta
    # beyond a level reaction no k balances it: bigger ones only press harder, or nothing holds
    level = denominator <= _SQUARE * abs(numerator)
    k = numerator / where(level, 1.0, denominator)
    result: N = where(level, where(numerator > 0.0, math.inf, -math.inf), k)
    return result


def on_its_branch(k: N, ky: N, rises: object, functions: Elementwise[N]) -> N:
    """Return k with the sign of infinity that continuity gives it.

    As the back plane takes load, δ* leaves φ1 in one sense and turns by less than 180°. A δ*
    that rises can lock the block but not free it, and one that falls the reverse, although
    beyond ±180° sine and cosine say otherwise.

    Args:
        k: yield acceleration coefficient of a mechanism with two contacts.
        ky: that of sliding, at which δ* = φ1.
        rises: whether δ* rises from φ1.
        functions: the functions for this kind of number.
    """
    where = functions.where
    risen = where((k == -math.inf) | (ky == math.inf), math.inf, k)
    fallen = where((k == math.inf) & (ky < math.inf), -math.inf, k)
    result: N = where(rises, risen, fallen)
    return result


def mode_code(
    tan_alpha1: N, tan_alpha3: N, limit: N, confined: object, functions: Elementwise[N]
) -> N:
    """Return the code of the mode of a block with a back plane.

    Boundaries belong to sliding; a back plane normal to the base does not confine.

    Args:
        tan_alpha1: tan α1.
        limit: tan φ of the base, or with a cohesive bond the tangent of the angle of the
            resultant at which the base slides.
        confined: whether the back plane hinders a rotation about the toe (γ > 90°).
        functions: the functions for this kind of number.
    """
    where = functions.where
    rotates = where(confined, CONFINED_TOPPLE, TOPPLE)
    # the resultant at which the base slides passes the toe inside: it slides before it rotates
    forward = where(tan_alpha3 >= limit, SLIDE, rotates)
    # or behind the heel: the base alone holds no such resultant, and the back plane takes a part
    result: N = where(tan_alpha1 > limit, SLUMP, forward)
    return result


def mode_code_without_back(
    tan_alpha1: N, tan_alpha3: N, limit: N, tan_beta: N, functions: Elementwise[N]
) -> N:
    """Return the code of the mode of a block without a back plane.

    Beyond the friction angle (α1 > φ1) such a block does not stand: it turns back about its
    heel (coded as a slump) if β < α1, and slides otherwise.

    Args:
        limit: as in :func:`mode_code`.
        tan_beta: tangent of the dip of the base.
        functions: the functions for this kind of number.
    """
    where = functions.where
    backward = where(tan_beta < tan_alpha1, SLUMP, SLIDE)
    forward = where(tan_alpha3 >= limit, SLIDE, TOPPLE)
    result: N = where(tan_alpha1 > limit, backward, forward)
    return result


def state_code(k: N, functions: Elementwise[N]) -> N:
    """Return the code of the state that a yield acceleration coefficient means."""
    where = functions.where
    result: N = where(k < -AT_LIMIT, UNSTABLE, where(k == math.inf, LOCKED, STABLE))
    return result


@dataclass(frozen=True)
class Water(Generic[N]):
    """The push of water on a block, over its weight.

    Args:
        along: down the base.
        normal: off the base.
        moment: about the centroid, counter-clockwise with x down the base, in the unit of the arms.
    """

    along: N
    normal: N
    moment: N


@dataclass(frozen=True)
class DrainedYield:
    """The drained bound of a yield.

    Args:
        yield_acceleration: of the governing mode of the drained block [g].
    """

    yield_acceleration: float


Push = tuple[float, float, float]
"""Push of water over the weight: down the base, off it, and the moment about the centroid,
counter-clockwise [m]."""

DRY: Push = (0.0, 0.0, 0.0)

Arms = tuple[tuple[N, Any], tuple[N, Any], tuple[N, Any], tuple[N, Any]]
"""Contacts from the centroid, along the base and normal to it."""


@dataclass(frozen=True)
class Planes(Generic[N]):
    """Plane and load parameters of a mechanism's yield, apart from its contacts.

    Args:
        tan_beta: tangent of the dip of the base.
        mu1: tangent of the friction angle of the base.
        mu2: tangent of the friction angle of the back plane.
        weight: 1 + k_v.
        functions: the functions for this kind of number.
        bond: strength of the base's bond over the weight, c L/(ρ g A); None without cohesion.
        water: the push of water in the back fracture; None for a dry one.
    """

    tan_beta: N
    mu1: N
    mu2: N
    weight: N | float
    functions: Elementwise[N]
    bond: N | None = None
    water: Water[N] | None = None

    @cached_property
    def _slope(self) -> N:
        """1/cos β."""
        return self.functions.sqrt(1.0 + self.tan_beta * self.tan_beta)

    def coefficient(
        self, sine: N, cosine: N | float, turn: N | float = 0.0, bond_y: N | float | None = None
    ) -> N:
        """Return :func:`yield_coefficient` on these planes.

        Of a mechanism whose reactions have no power, a force e on the block with the moment m
        about the centroid adds -(cosine e_x + sine e_y + turn m) to the numerator: its power as
        the mechanism moves.

        Args:
            sine: as there.
            cosine: as there.
            turn: rotation rate of the mechanism in this scale.
            bond_y: height of the base over the centroid, where its bond resists; None where the
                mechanism does not slide on it.
        """
        adds: N | float = 0.0
        # over cos β, as the numerator is
        if self.bond is not None and bond_y is not None:
            adds = self.bond * self._slope * (cosine - turn * bond_y)
        if self.water is not None:
            push = self.water
            power = cosine * push.along + sine * push.normal + turn * push.moment
            adds = adds - self._slope * power
        return yield_coefficient(sine, cosine, self.tan_beta, self.weight, self.functions, adds)

    @cached_property
    def ky(self) -> N:
        """Yield acceleration coefficient of sliding (eq. 3.17): δ* = φ1."""
        return self.coefficient(self.mu1, 1.0, bond_y=0.0)

    def pressed_by(self, k: N) -> N:
        """Return the normal force on the base at k, over the weight."""
        normal = (self.weight - k * self.tan_beta) / self._slope
        return normal if self.water is None else normal - self.water.normal

    @property
    def limit(self) -> N:
        """Tangent at which the base's reaction stands as it slides; see :func:`mode_code`.

        Dry and without a bond that of φ1: otherwise what its place over half the thickness is.
        """
        if self.bond is None and self.water is None:
            return self.mu1
        where = self.functions.where
        ky, differs = self.ky, abs(self.mu1) < 0.0
        along = (self.weight * self.tan_beta + ky) / self._slope
        normal = self.pressed_by(ky)
        if self.bond is not None:
            differs = differs | (self.bond != 0.0)
        if self.water is not None:
            along = along + self.water.along - self.water.moment
            differs = differs | (self.water.along != 0.0)
        # a bond may hold until the inertial force lifts the block off its base
        pressed = normal > 0.0
        limit = where(pressed, along / where(pressed, normal, 1.0), math.inf)
        result: N = where(differs & (abs(ky) < math.inf), limit, self.mu1)
        return result

    def floats(self, k: N, code: int, cot: N) -> Any:
        """Return whether water relieves the base of all load at the yield of a mode.

        Args:
            k: the yield; infinite ones do not float.
            code: the mode.
            cot: cot γ.
        """
        if self.water is None:
            return False
        carried = self.pressed_by(k)
        if code in (SLUMP, CONFINED_TOPPLE):  # a part of it rests on the back plane
            mu2 = self.mu2 if code == SLUMP else -self.mu2
            u_x, u_y = 1.0 - cot * mu2, cot + mu2
            along = (self.weight * self.tan_beta + k) / self._slope + self.water.along
            along = along if self.bond is None else along - self.bond
            across = u_x + self.mu1 * u_y
            there = abs(across) > _SQUARE
            base = (along * u_y + carried * u_x) / self.functions.where(there, across, 1.0)
            carried = self.functions.where(there, base, carried)
        # a dry block among wet ones does not float, even if its bond lets the base lift first
        return (carried <= 0.0) & (abs(k) < math.inf) & (self.water.along != 0.0)

    def slump(self, heel_x: N, heel_y: N, back_x: N, back_y: N, cot: N) -> tuple[N, Any]:
        """Return k_s (eqs. 3.24, 3.25), and whether the back contact cannot hold the block.

        Args:
            heel_x: from the centroid to the heel, along the base.
            heel_y: the same, normal to the base.
            back_x: from the centroid to the back contact, along the base.
            back_y: the same, normal to the base.
            cot: cot γ.
        """
        mu1, mu2, where = self.mu1, self.mu2, self.functions.where
        u_x, u_y = 1.0 - cot * mu2, cot + mu2
        r_base = back_y * u_x - back_x * u_y
        r_back = heel_x + heel_y * mu1
        sine, cosine = r_base * mu1 - r_back * u_x, r_base + r_back * u_y
        k = self.coefficient(sine, cosine, u_x + mu1 * u_y, heel_y)
        # sin(γ + φ1 - φ2) over sin γ cos φ1 cos φ2: is the back plane stronger, φ2 > φ1 + γ?
        back_is_rougher = u_y * mu1 - cot * mu2 + 1.0 < 0.0
        k = on_its_branch(k, self.ky, back_is_rougher, self.functions)
        # moments balance only if the base pulls: nothing holds the block, which is unstable
        untenable = r_base <= 0.0
        return where(untenable, -math.inf, k), untenable

    def confined_topple(self, toe_x: N, toe_y: N, low_x: N, low_y: N, cot: N) -> tuple[N, Any]:
        """Return k_ct (eqs. 3.28, 3.29), and whether the toe lifts off a bond before it slides.

        The moments are paired as equilibrium demands; the printed equations pair them the other way
        round. The toe lifts where the bond would have to bear tension at the yield.

        Args:
            toe_x: from the centroid to the toe, along the base.
            toe_y: the same, normal to the base.
            low_x: from the centroid to the lowest point on the back plane, along the base.
            low_y: the same, normal to the base.
            cot: cot γ.
        """
        mu1, mu2, where = self.mu1, self.mu2, self.functions.where
        u_x, u_y = 1.0 + cot * mu2, cot - mu2
        r_base = low_x * u_y - low_y * u_x
        r_back = -(toe_x + toe_y * mu1)
        sine, cosine = r_base * mu1 - r_back * u_x, r_base + r_back * u_y
        k = self.coefficient(sine, cosine, -(u_x + mu1 * u_y), toe_y)
        # sin(γ + φ1 + φ2), likewise: do both planes hold the block between them, beyond 180°?
        wedges = u_y * mu1 + cot * mu2 + 1.0 < 0.0
        k = on_its_branch(k, self.ky, wedges, self.functions)
        # α1 + γ + φ2 >= 180°: the heel jams, whatever pushes it
        k = where(r_base <= 0.0, math.inf, k)
        if self.bond is None:
            return k, False
        normal = (self.weight - k * self.tan_beta) / self._slope
        # over the factor of sine and cosine; a bond of 1 m g takes toe_y (cot γ - μ2) from it
        pressed = normal * r_base + self.bond * (toe_y * u_y)
        lifts = ((pressed <= 0.0) & (cosine > 0.0)) | ((pressed >= 0.0) & (cosine < 0.0))
        return k, lifts & (self.bond > 0.0) & (abs(k) < math.inf)

    def mode(self, tan_alpha1: N, tan_alpha3: N, confined: object, *, back_fracture: bool) -> N:
        """Return the code of the mode of a block; arguments as for :func:`mode_code`."""
        if back_fracture:
            return mode_code(tan_alpha1, tan_alpha3, self.limit, confined, self.functions)
        return mode_code_without_back(
            tan_alpha1, tan_alpha3, self.limit, self.tan_beta, self.functions
        )

    def yield_of(self, code: int, arms: Arms[N], cot: N) -> tuple[N, Any, Any]:
        """Return the yield in a mode, where its back contact cannot hold, and where its toe lifts.

        Args:
            code: the mode.
            arms: contacts from the centroid: heel, back, toe and the lowest point on the back
                plane, in any unit.
            cot: cot γ.
        """
        heel, back, (toe_x, toe_y), lowest = arms
        if code == SLUMP:
            k, untenable = self.slump(*heel, *back, cot)
            return k, untenable, False
        if code == CONFINED_TOPPLE:
            k, lifts = self.confined_topple(toe_x, toe_y, *lowest, cot)
            return k, False, lifts
        if code == TOPPLE:  # (3.16): δ* = α3
            return self.coefficient(toe_x / -toe_y, 1.0, 1.0 / toe_y), False, False
        return self.ky, False, False


def words_of_mode(mode: str) -> str:
    """Return the name of a mode for use in a sentence."""
    return mode.replace("_", " ")


def two_contacts_at_rest(
    block: Any,
    *,
    confined: bool,
    beta_deg: Any,
    phis_deg: tuple[Any, Any],
    functions: Elementwise[Any],
    trigonometry: Any,
) -> Any:
    """Return p_s² of parallelograms at rest [1/s²].

    p_s² = g (F_y cos β - F_x sin β)/D with the contact forces of a slump, or a confined topple,
    that starts; NaN where there is none.

    Args:
        block: a `Block`, or several as a `BlockArray`.
        confined: whether they topple confined, instead of slumping.
        beta_deg: dip of the base [deg].
        phis_deg: friction angles of the base and of the back plane [deg].
        functions: the functions for this kind of number.
        trigonometry: what has its ``sin``, ``cos`` and ``radians``: math, or numpy.
    """
    where, sin, cos = functions.where, trigonometry.sin, trigonometry.cos
    angles = (block.alpha1_deg, block.alpha3_deg, block.gamma_deg, beta_deg, *phis_deg)
    a1, a3, gamma, beta, phi1, phi2 = (trigonometry.radians(angle) for angle in angles)
    r1_m, r3_m = block.r1_m, block.r3_m
    if confined:  # A, B and C' of docs/theory/confined-toppling.md
        pulls = gamma + phi2
        base_edge = r3_m * sin(a3) - r1_m * sin(a1)
        on_base, on_back = r1_m * sin(a1 + pulls), r3_m * sin(phi1 - a3)
        path_x = r3_m * cos(a3) - base_edge * cos(gamma) / sin(gamma)
        path_y = r3_m * sin(a3)
    else:  # of docs/theory/slumping.md
        pulls = gamma - phi2
        back_edge = 2.0 * r1_m * cos(a1) / sin(gamma)
        on_base, on_back = r3_m * sin(a3 + pulls), r1_m * sin(a1 - phi1)
        path_x, path_y = back_edge / sin(gamma) - r1_m * cos(a1), -r1_m * sin(a1)
    force_x = -on_base * sin(phi1) + on_back * sin(pulls)
    force_y = on_base * cos(phi1) + on_back * cos(pulls)
    inertia_m2 = (r1_m * r1_m + r3_m * r3_m) / 6.0
    inertia = force_y * path_x - force_x * path_y + inertia_m2 * sin(pulls + phi1)
    pull = STANDARD_GRAVITY_M_S2 * (force_y * cos(beta) - force_x * sin(beta))
    turns = (inertia > 0.0) & (pull > 0.0)
    return where(turns, pull / where(turns, inertia, 1.0), math.nan)


def rocking_at_rest(
    block: Any, tan_beta: Any, functions: Elementwise[Any]
) -> tuple[Any, Any, Any, Any, Any]:
    """Return k_r of both senses, forward and backward, p², restitution, and 90° less the balance
    angles.

    Predictions are about symmetric blocks on level ground: of another block, about the one that is
    as weak as its weaker sense, whose p² [1/s²] is returned, and loses as much speed in two
    impacts, √(e31 e13) (Housner 1963).

    Args:
        block: a `Block`, or several as a `BlockArray`.
        tan_beta: tangent of the dip of the base.
        functions: the functions for this kind of number.

    Returns:
        k_r about the toe and about the heel, at most 0 for a block that falls over it; p² of the
        weaker of the two; the restitution; and the least cosine of both critical angles up to a
        positive factor, at most 0 where one is 90° or more.
    """
    t1, t3, half_s1_m = block.tan_alpha1, block.tan_alpha3, block.half_s1_m
    where, sqrt = functions.where, functions.sqrt
    steep = 1.0 + t3 * tan_beta, 1.0 + t1 * tan_beta
    least = where(steep[0] < steep[1], steep[0], steep[1])
    forward = (t3 - tan_beta) / where(steep[0] > 0.0, steep[0], 1.0)
    backward = (tan_beta - t1) / where(steep[1] > 0.0, steep[1], 1.0)
    heel, toe = ((half_s1_m * t, -half_s1_m) for t in (t1, t3))
    about_toe, about_heel, momentum = moments_about_corners(block.inertia_m2, heel, toe)
    per_moment = where(
        forward <= backward,
        corner_distance(half_s1_m, t3, functions) / about_toe,
        corner_distance(half_s1_m, t1, functions) / about_heel,
    )
    restitution = where(momentum > 0.0, momentum, 0.0) / sqrt(about_toe * about_heel)
    return forward, backward, STANDARD_GRAVITY_M_S2 * per_moment, restitution, least
