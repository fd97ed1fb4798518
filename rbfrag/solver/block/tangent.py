"""Tangent and cotangent of angles in degrees, the same bits for numbers and arrays.

The libraries' tangents differ in the last bit between processors, and between a number and
an array. A block on a boundary between two modes must not change mode for that, so the
tangent is made here of operations that round correctly.
"""

from __future__ import annotations

import math

from rbfrag.solver.block.elementwise import Elementwise, N

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
