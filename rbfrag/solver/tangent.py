"""Tangent and cotangent of angles in degrees, the same bits for numbers and arrays.

The libraries' tangents differ in the last bit between processors, and between a number and
an array. A block on a boundary between two modes must not change mode for that, so the
tangent is made here of operations that round correctly.
"""

from __future__ import annotations

import math

from rbfrag.solver.elementwise import Elementwise, N

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
    size = abs(angle_deg)
    steep = size > 45.0
    # 90 - size is exact for these angles
    small = _tan_to_45(where(steep, 90.0 - size, size))
    tangent = where(steep, 1.0 / where(steep, small, 1.0), small)
    result: N = where(angle_deg < 0.0, -tangent, tangent)
    return result


def cot_deg(angle_deg: N, functions: Elementwise[N]) -> N:
    """Return the cotangent of an angle between 0 and 180 degrees, both excluded.

    Args:
        angle_deg: angle [deg], scalar or array; NaN gives NaN.
        functions: the functions for this kind of number.
    """
    where = functions.where
    obtuse = angle_deg > 90.0
    acute = where(obtuse, 180.0 - angle_deg, angle_deg)
    flat = acute < 45.0
    small = _tan_to_45(where(flat, acute, 90.0 - acute))
    cotangent = where(flat, 1.0 / where(flat, small, 1.0), small)
    result: N = where(obtuse, -cotangent, cotangent)
    return result


def _tan_to_45(angle_deg: N) -> N:
    y = angle_deg * _RADIAN
    z = y * y
    return y * _polynomial(_NUMERATOR, z) / _polynomial(_DENOMINATOR, z)


def _polynomial(coefficients: tuple[float, ...], z: N) -> N:
    total = z * coefficients[0] + coefficients[1]
    for coefficient in coefficients[2:]:
        total = total * z + coefficient
    return total
