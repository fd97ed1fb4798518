"""Logarithm and exponential in plain arithmetic, so that one number and many get the same bits.

A library's logarithm rounds its last bit in its own way, and differently for one number than for
a vector of them; a model multiplies that bit until the probability differs by dozens. These two
are sums and products in a fixed order: called as they stand for one number, compiled for many,
where the compiler takes several rows at a time. Both are within one unit of the last place; their
polynomials are those of fdlibm (Sun Microsystems 1993, e_log.c and e_exp.c).
"""

from __future__ import annotations

import math
from collections.abc import Callable

ROOT_HALF = math.sqrt(0.5)
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
"""ln 2 in two parts; a whole number below 2^20 times the first is exact."""

_L1, _L2, _L3, _L4, _L5, _L6, _L7 = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01,
    1.531383769920937332e-01,
    1.479819860510658591e-01,
)
_E1, _E2, _E3, _E4, _E5 = (
    1.66666666666666019037e-01,
    -2.77777777770155933842e-03,
    6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)
_ONE_OVER_LN2 = 1.44269504088896338700
_ROUNDER = 1.5 * 2.0**52  # added and taken off again it leaves a whole number

MOST = 700.0
"""Beyond ±700 the exponential is taken for that of ±700: 1e304 and 1e-304."""


split: Callable[[float], tuple[float, float]] = math.frexp
"""``split(x)`` is m in [0.5, 1) and the whole number k with x = m 2^k; x > 0."""


def scaled(m: float, k: float) -> float:
    """Return m 2^k for a whole number k."""
    return math.ldexp(m, int(k))


def ln(x: float) -> float:
    """Return the natural logarithm of x > 0."""
    m, k = split(x)
    small = m < ROOT_HALF
    m = 2.0 * m if small else m
    k = k - 1.0 if small else k
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    half = 0.5 * f * f
    rest = z * (_L1 + w * (_L3 + w * (_L5 + w * _L7))) + w * (_L2 + w * (_L4 + w * _L6))
    high = k * LN2_HIGH
    total = high + f
    lost = (high - total) + f  # what the sum rounded off
    return total + (lost - (half - (s * (half + rest) + k * LN2_LOW)))


def exponential(x: float) -> float:
    """Return e^x, x taken for no less than -700 and no more than 700."""
    x = -MOST if x < -MOST else x
    x = MOST if x > MOST else x
    k = (x * _ONE_OVER_LN2 + _ROUNDER) - _ROUNDER
    high, low = x - k * LN2_HIGH, k * LN2_LOW
    r = high - low
    t = r * r
    c = r - t * (_E1 + t * (_E2 + t * (_E3 + t * (_E4 + t * _E5))))
    return scaled(1.0 - ((low - (r * c) / (2.0 - c)) - high), k)
