"""Numbers of 106 bits as unevaluated sums of two doubles, compiled: some 32 digits.

Dekker (1971), Knuth (TAOCP 2, 4.2.2), Hida, Li & Bailey (2001). A number is a pair
(high, low) with |low| at most half a unit in the last place of high. The compiler is not
allowed to reorder or fuse, on which all of this rests. Each operation errs by a few 1e-32
relative; the tests prove it against exact fractions.
"""

from __future__ import annotations

import math

from numba import njit

from rbfrag.solver.integrator.compiled import kernel

Pair = tuple[float, float]

SPLITTER = 134217729.0
"""2^27 + 1: cuts a double into two halves whose products are exact."""


@njit(inline="always")
def _quick_two_sum(high: float, low: float) -> Pair:
    s = high + low
    return s, low - (s - high)


@kernel
def add(a: Pair, b: Pair) -> Pair:
    """a + b, without loss where they cancel."""
    s = a[0] + b[0]
    v = s - a[0]
    e = (a[0] - (s - v)) + (b[0] - v)
    t = a[1] + b[1]
    v = t - a[1]
    f = (a[1] - (t - v)) + (b[1] - v)
    s, e = _quick_two_sum(s, e + t)
    return _quick_two_sum(s, e + f)


@kernel
def minus(a: Pair) -> Pair:
    """-a."""
    return -a[0], -a[1]


@kernel
def sub(a: Pair, b: Pair) -> Pair:
    """a - b."""
    return add(a, (-b[0], -b[1]))


@kernel
def mul(a: Pair, b: Pair) -> Pair:
    """a b."""
    x = a[0]
    y = b[0]
    p = x * y
    t = SPLITTER * x
    xh = t - (t - x)
    xl = x - xh
    t = SPLITTER * y
    yh = t - (t - y)
    yl = y - yh
    e = ((xh * yh - p) + xh * yl + xl * yh) + xl * yl
    return _quick_two_sum(p, e + (x * a_low(b) + a_low(a) * y))


@njit(inline="always")
def a_low(a: Pair) -> float:
    """Lower half."""
    return a[1]


@kernel
def scaled(a: Pair, factor: float) -> Pair:
    """a times a double."""
    return mul(a, (factor, 0.0))


@kernel
def div(a: Pair, b: Pair) -> Pair:
    """a/b."""
    q1 = a[0] / b[0]
    r = sub(a, mul(b, (q1, 0.0)))
    q2 = r[0] / b[0]
    r = sub(r, mul(b, (q2, 0.0)))
    return add(_quick_two_sum(q1, q2), (r[0] / b[0], 0.0))


@kernel
def root(a: Pair) -> Pair:
    """Square root of a >= 0."""
    if a[0] <= 0.0:
        return 0.0, 0.0
    x = (math.sqrt(a[0]), 0.0)
    for _ in range(2):
        x = add(x, scaled(div(sub(a, mul(x, x)), x), 0.5))
    return x


@kernel
def sine_versine(a: Pair) -> tuple[Pair, Pair]:
    """sin a and 1 - cos a, |a| < 8: series of a/64, doubled six times."""
    x = scaled(a, 1.0 / 64.0)
    square = mul(x, x)
    sine = (0.0, 0.0)
    versine = (0.0, 0.0)
    for n in range(10, 0, -1):
        # Horner forms of sin x = x (1 - x²/6 (1 - ...)) and 1 - cos x = x²/2 (1 - x²/12 (...))
        sine = sub((1.0, 0.0), div(mul(square, sine), (2.0 * n * (2.0 * n + 1.0), 0.0)))
        versine = sub(
            (1.0, 0.0), div(mul(square, versine), ((2.0 * n + 1.0) * (2.0 * n + 2.0), 0.0))
        )
    sine = mul(x, sine)
    versine = scaled(mul(square, versine), 0.5)
    for _ in range(6):
        cosine = sub((1.0, 0.0), versine)
        versine = scaled(mul(sine, sine), 2.0)
        sine = scaled(mul(sine, cosine), 2.0)
    return sine, versine


@kernel
def arctangent(a: Pair) -> Pair:
    """atan a, from that of the double and what is left."""
    first = (math.atan(a[0]), 0.0)
    sine, versine = sine_versine(first)
    cosine = sub((1.0, 0.0), versine)
    # tan(x - first) = (a cos - sin)/(cos + a sin): a few 1e-17, its own angle
    correction = div(sub(mul(a, cosine), sine), add(cosine, mul(a, sine)))
    return add(first, correction)


@kernel
def arcsine(a: Pair) -> Pair:
    """asin a for |a| < 1."""
    return arctangent(div(a, root(mul(sub((1.0, 0.0), a), add((1.0, 0.0), a)))))
