"""Formulas of block shape, written once for single numbers and for arrays (eqs. 3.1-3.15).

Only the functions of :class:`Elementwise`, the four operations and comparisons are used, and all of
them but the logarithm round correctly, so that single numbers and arrays give the same bits. No
numpy is loaded until
an array is asked for. The libraries' tangents differ in the last bit between processors; a block on
a boundary between two modes must not change mode for that, so the tangent is made here. All of a
parallelogram follows from the tangents of its angles, t1 = tan α1 and t3 = tan α3, and from half
its thickness, h = S1/2 = r1 cos α1 = r3 cos α3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

N = TypeVar("N", float, "NDArray[np.float64]")
"""A number or an array of numbers."""


@dataclass(frozen=True)
class Elementwise(Generic[N]):
    """The functions that the formulas need, for one kind of number.

    Args:
        where: ``where(condition, a, b)`` is a where the condition holds, else b.
        log10: the logarithm, which alone may differ in the last bit between numbers and arrays.
    """

    sqrt: Callable[[N], N]
    where: Callable[[Any, Any, Any], Any]
    log10: Callable[[N], N]


SCALAR: Elementwise[float] = Elementwise(
    sqrt=math.sqrt,
    where=lambda condition, yes, no: yes if condition else no,
    log10=math.log10,
)
"""The functions for single numbers."""


@cache
def array_elementwise() -> Elementwise[Any]:
    """Return the functions for numpy arrays."""
    import numpy as np

    return Elementwise(sqrt=np.sqrt, where=np.where, log10=np.log10)


_RADIAN = math.pi / 180.0

# Ninth convergent of Lambert's continued fraction, tan y = y/(1 - y²/(3 - y²/(5 - ...))), as
# polynomials in y²; at 45° it is 9e-19 off.
_NUMERATOR = (1.0, -990.0, 135135.0, -4729725.0, 34459425.0)
_DENOMINATOR = (45.0, -13860.0, 945945.0, -16216200.0, 34459425.0)


def tan_deg(angle_deg: N, functions: Elementwise[N]) -> N:
    """Return the tangent of an angle between -90 and 90 degrees, both excluded.

    Args:
        angle_deg: angle [deg], scalar or array; NaN gives NaN.
        functions: the functions for this kind of number.
    """
    where = functions.where
    steep = abs(angle_deg) > 45.0
    # the complement is exact for these angles
    rest = where(steep, where(angle_deg < 0.0, -90.0, 90.0) - angle_deg, angle_deg)
    above, below = _tangent_parts(rest)
    result: N = where(steep, below, above) / where(steep, above, below)
    return result


def cot_deg(angle_deg: N, functions: Elementwise[N]) -> N:
    """Return the cotangent of an angle between 0 and 180 degrees, both excluded.

    Args:
        angle_deg: angle [deg], scalar or array; NaN gives NaN.
        functions: the functions for this kind of number.
    """
    where = functions.where
    steep = abs(angle_deg - 90.0) <= 45.0
    # complement and supplement are exact for these angles
    flat = where(angle_deg > 90.0, angle_deg - 180.0, angle_deg)
    above, below = _tangent_parts(where(steep, 90.0 - angle_deg, flat))
    result: N = where(steep, above, below) / where(steep, below, above)
    return result


def _tangent_parts(angle_deg: N) -> tuple[N, N]:
    """Return two numbers whose quotient is the tangent of an angle up to 45 degrees."""
    y = angle_deg * _RADIAN
    z = y * y
    return y * _polynomial(_NUMERATOR, z), _polynomial(_DENOMINATOR, z)


def _polynomial(coefficients: tuple[float, ...], z: N) -> N:
    total = z * coefficients[0] + coefficients[1]
    for coefficient in coefficients[2:]:
        total = total * z + coefficient
    return total


def cot_gamma(tan_alpha1: N, tan_alpha3: N) -> N:
    """Return cot γ = (t1 + t3)/2 (eq. 3.12)."""
    return (tan_alpha1 + tan_alpha3) * 0.5


def tangents_from_spacings(
    s1_m: N, s2_m: N, gamma_deg: N, functions: Elementwise[N]
) -> tuple[N, N]:
    """Return (t1, t3) of the block that two fracture sets cut out (eq. 3.15).

    tan α = cot γ ∓ (S2/S1)/sin γ, with 1/sin γ = √(1 + cot² γ).

    Args:
        s1_m: spacing of the base fractures [m].
        s2_m: spacing of the back fractures [m].
        gamma_deg: dip of the back less dip of the base [deg].
        functions: the functions for this kind of number.
    """
    cot = cot_deg(gamma_deg, functions)
    half_base = s2_m / s1_m * functions.sqrt(cot * cot + 1.0)
    return cot - half_base, cot + half_base


def corner_distance(half_s1_m: N, tangent: N, functions: Elementwise[N]) -> N:
    """Return r = (S1/2)/cos α, from the centroid to the corner whose angle has this tangent [m]."""
    return half_s1_m * functions.sqrt(tangent * tangent + 1.0)


def parallelogram_inertia(tan_alpha1: N, tan_alpha3: N, half_s1_m: N) -> N:
    """Return (r1² + r3²)/6, the moment of inertia about the centroid per mass [m²]."""
    heel_x, toe_x = half_s1_m * tan_alpha1, half_s1_m * tan_alpha3
    return (heel_x * heel_x + toe_x * toe_x + 2.0 * half_s1_m * half_s1_m) / 6.0


def moments_about_corners(inertia_m2: N, heel: tuple[N, N], toe: tuple[N, N]) -> tuple[N, N, N]:
    """Return the moments of inertia about toe and heel, and the angular momentum factor of an
    impact, per mass [m²].

    The last is I_C + r1·r3, the angular momentum about the corner that takes over, over the speed
    before: it is the same after the impact, whose force passes through that corner (Housner 1963).

    Args:
        inertia_m2: moment of inertia about the centroid per mass [m²].
        heel: from the centroid to the heel [m].
        toe: from the centroid to the toe [m].
    """
    about_toe = inertia_m2 + (toe[0] * toe[0] + toe[1] * toe[1])
    about_heel = inertia_m2 + (heel[0] * heel[0] + heel[1] * heel[1])
    return about_toe, about_heel, inertia_m2 + (heel[0] * toe[0] + heel[1] * toe[1])


def bond_over_weight(cohesion_pa: N, density_kg_m3: N, base_m: N, area_m2: N) -> N:
    """Return the strength of the bond of a base over the weight of its block, c L/(ρ g A)."""
    return cohesion_pa * base_m / (density_kg_m3 * STANDARD_GRAVITY_M_S2 * area_m2)


def shape_factor(tan_alpha1: N, tan_alpha3: N) -> N:
    """Return F_s = m r3²/I_toe = 1/(7/6 + (cos α3/cos α1)²/6)."""
    ratio = (tan_alpha1 * tan_alpha1 + 1.0) / (tan_alpha3 * tan_alpha3 + 1.0)
    return 6.0 / (ratio + 7.0)


def frequency_parameter(factor: N, r3_m: N) -> N:
    """Return p² = F_s g/r3 [1/s²] (eq. 4.27) for a distance toe-centroid r3 [m]."""
    return factor * STANDARD_GRAVITY_M_S2 / r3_m
