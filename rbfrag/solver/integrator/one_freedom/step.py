"""One Taylor step of a motion with one degree of freedom.

On tau in [0, 1] with h the interval, U = h x', a(tau) = a0 + da tau the driving acceleration and
w(tau) = w0 + dw tau the effective gravity, both in g, the equation of motion reads

    D(x) U' = h² [N(x) a - M(x) w] - Q(x) U²

with D, N, M and Q sums of harmonics of x. The Taylor coefficients of U follow one from another:
those of cos x, sin x, cos 2x and sin 2x from U, those of D, N, M, Q from these, and the next one
of U from a division of series. The record is linear between samples, so no step crosses a kink.
"""

from __future__ import annotations

import math

from rbfrag.solver.integrator.compiled import fused_kernel, kernel
from rbfrag.solver.results import FloatArray

ORDER = 8
"""Degree of the polynomial of U where the equation depends on x."""

UNIFORM_ORDER = 2
"""The same where it does not: then the step is exact."""

TURN_MAX = 0.12
"""Greatest step, in units of the block's own time; longer intervals are split evenly."""

INERTIA, DRIVE, RESISTANCE, BRAKING, CONDITIONS = 0, 1, 2, 3, 4
"""Rows of a table of coefficients."""


@kernel
def harmonic_sum(table: FloatArray, row: int, c: float, s: float) -> float:
    """Value of one row of coefficients (up to the second harmonic) where cos x = c, sin x = s."""
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    value: float = table[row, 0] + table[row, 1] * c + table[row, 2] * s
    value += table[row, 3] * c2 + table[row, 4] * s2
    return value


@kernel
def harmonic_slope(table: FloatArray, row: int, c: float, s: float) -> float:
    """Derivative of one row of coefficients (up to the second harmonic)."""
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    slope: float = table[row, 2] * c - table[row, 1] * s
    slope += 2.0 * (table[row, 4] * c2 - table[row, 3] * s2)
    return slope


@fused_kernel
def uniform_terms(
    inertia: float,
    drive: float,
    resistance: float,
    h: float,
    a0: float,
    da: float,
    w0: float,
    dw: float,
) -> tuple[float, float]:
    """First and second Taylor coefficient of U where the equation is the same everywhere."""
    scale = h * h / inertia
    first = scale * (drive * a0 - resistance * w0)
    return first, 0.5 * scale * (drive * da - resistance * dw)


@fused_kernel
def fill_step(
    table: FloatArray,
    u: FloatArray,
    work: FloatArray,
    order: int,
    c: float,
    s: float,
    h: float,
    a0: float,
    da: float,
    w0: float,
    dw: float,
) -> None:
    """Fill u[1..order] from u[0].

    Args:
        table: coefficients of an equation.
        u: Taylor coefficients of U; u[0] = h x' on entry.
        work: room for series, shape (7, order + 1).
        order: degree of U.
        c: cosine of x at the start.
        s: its sine.
        h: length of the step [s].
        a0: driving acceleration at the start [g].
        da: its change over the step.
        w0: effective gravity at the start.
        dw: its change over the step.
    """
    if order == UNIFORM_ORDER:
        u[1], u[2] = uniform_terms(
            table[INERTIA, 0], table[DRIVE, 0], table[RESISTANCE, 0], h, a0, da, w0, dw
        )
        return
    hh = h * h
    c1, s1, c2, s2 = work[0], work[1], work[2], work[3]
    d, q, squared = work[4], work[5], work[6]
    c1[0], s1[0], c2[0], s2[0] = c, s, c * c - s * s, 2.0 * c * s
    n_before = 0.0
    m_before = 0.0
    inverse = 0.0
    for k in range(order):
        ck, sk, c2k, s2k = c1[k], s1[k], c2[k], s2[k]
        dk = table[0, 1] * ck + table[0, 2] * sk + table[0, 3] * c2k + table[0, 4] * s2k
        n = table[1, 1] * ck + table[1, 2] * sk + table[1, 3] * c2k + table[1, 4] * s2k
        m = table[2, 1] * ck + table[2, 2] * sk + table[2, 3] * c2k + table[2, 4] * s2k
        qk = table[3, 1] * ck + table[3, 2] * sk + table[3, 3] * c2k + table[3, 4] * s2k
        if k == 0:
            dk += table[0, 0]
            n += table[1, 0]
            m += table[2, 0]
            qk += table[3, 0]
            inverse = 1.0 / dk
        d[k] = dk
        q[k] = qk
        square = 0.0
        turn_c = 0.0
        turn_s = 0.0
        turn_c2 = 0.0
        turn_s2 = 0.0
        for j in range(k + 1):
            uj = u[j]
            square += uj * u[k - j]
            turn_c += uj * s1[k - j]
            turn_s += uj * c1[k - j]
            turn_c2 += uj * s2[k - j]
            turn_s2 += uj * c2[k - j]
        squared[k] = square
        known = hh * (a0 * n + da * n_before - w0 * m - dw * m_before)
        n_before = n
        m_before = m
        for j in range(k + 1):
            known -= q[j] * squared[k - j]
        for j in range(1, k + 1):
            known -= d[j] * (k - j + 1) * u[k - j + 1]
        part = 1.0 / (k + 1)
        u[k + 1] = known * inverse * part
        c1[k + 1] = -turn_c * part
        s1[k + 1] = turn_s * part
        c2[k + 1] = -2.0 * turn_c2 * part
        s2[k + 1] = 2.0 * turn_s2 * part


@kernel
def rate_at(u: FloatArray, first: int, order: int, tau: float) -> float:
    """Value of U/tau^first at tau, where the coefficients before `first` are zero."""
    value = 0.0
    for k in range(order, first - 1, -1):
        value = value * tau + u[k]
    return value


@kernel
def acceleration_at(u: FloatArray, first: int, order: int, tau: float) -> float:
    """Derivative of U/tau^first at tau."""
    value = 0.0
    for k in range(order, first, -1):
        value = value * tau + (k - first) * u[k]
    return value


@kernel
def travel_at(u: FloatArray, order: int, tau: float) -> float:
    """Change of x from the start of the step to tau."""
    value = 0.0
    for k in range(order, -1, -1):
        value = value * tau + u[k] / (k + 1)
    return value * tau


@kernel
def root_between(
    u: FloatArray, first: int, order: int, what: int, target: float, low: float, high: float
) -> float:
    """Root in [low, high], to rounding, by Newton's method kept inside a bracket.

    Args:
        u: Taylor coefficients of U.
        first: number of leading coefficients that are zero.
        order: degree of U.
        what: 0 for the travel less `target`, 1 for U/tau^first, 2 for its derivative.
        target: travel to reach.
        low: end where the sign is that of the function just after the start.
        high: end where the sign is the other, or the value zero.
    """
    sign_low = 1.0
    at_high = _value(u, first, order, what, target, high)
    if at_high == 0.0:
        return high
    if at_high > 0.0:
        sign_low = -1.0
    tau = 0.5 * (low + high)
    for _ in range(100):
        value = _value(u, first, order, what, target, tau)
        if value == 0.0:
            return tau
        if value * sign_low > 0.0:
            low = tau
        else:
            high = tau
        slope = 0.0
        if what == 0:
            slope = rate_at(u, 0, order, tau)
        elif what == 1:
            slope = acceleration_at(u, first, order, tau)
        following = tau - value / slope if slope != 0.0 else low - 1.0
        if not low < following < high:
            following = 0.5 * (low + high)
        if following == tau or high - low <= 1e-16 * max(abs(high), abs(low)):
            return high
        tau = following
    return high


@kernel
def _value(u: FloatArray, first: int, order: int, what: int, target: float, tau: float) -> float:
    if what == 0:
        return travel_at(u, order, tau) - target
    if what == 1:
        return rate_at(u, first, order, tau)
    return acceleration_at(u, first, order, tau)


@kernel
def first_standstill(u: FloatArray, first: int, order: int) -> float:
    """First tau in (0, 1] at which the rate vanishes, or 2.

    A rate that dips below zero between two ends of one sign is seen where its derivative
    changes sign once, which short steps ensure.
    """
    start = u[first]
    if start == 0.0:
        return 2.0
    end = rate_at(u, first, order, 1.0)
    if start * end <= 0.0:
        return root_between(u, first, order, 1, 0.0, 0.0, 1.0)
    slope_start = acceleration_at(u, first, order, 0.0)
    slope_end = acceleration_at(u, first, order, 1.0)
    if slope_start * start < 0.0 and slope_end * start > 0.0:
        least = root_between(u, first, order, 2, 0.0, 0.0, 1.0)
        if rate_at(u, first, order, least) * start <= 0.0:
            return root_between(u, first, order, 1, 0.0, 0.0, least)
    return 2.0


@kernel
def _with_double(table: FloatArray, row: int, c: float, s: float, c2: float, s2: float) -> float:
    """Value of one row that has no third harmonic."""
    value: float = table[row, 0] + table[row, 1] * c + table[row, 2] * s
    value += table[row, 3] * c2 + table[row, 4] * s2
    return value


@kernel
def least_condition(
    table: FloatArray, c: float, s: float, rate: float, a: float, w: float
) -> tuple[float, int]:
    """Least of the inertia and the conditions at a state, and which it is (0: the inertia)."""
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    c3 = c * c2 - s * s2
    s3 = s * c2 + c * s2
    least = _with_double(table, INERTIA, c, s, c2, s2)
    which = 0
    if least <= 0.0:
        return least, which  # the conditions are those of forces times the inertia
    for n in range((table.shape[0] - CONDITIONS) // 3):
        row = CONDITIONS + 3 * n
        value = _with_double(table, row, c, s, c2, s2) * a
        value += _with_double(table, row + 1, c, s, c2, s2) * w
        third = _with_double(table, row + 2, c, s, c2, s2)
        third += table[row + 2, 5] * c3 + table[row + 2, 6] * s3
        value += third * rate * rate
        if value < least:
            least = value
            which = n + 1
    return least, which


@kernel
def first_violation(
    table: FloatArray,
    u: FloatArray,
    order: int,
    x: float,
    h: float,
    a0: float,
    da: float,
    w0: float,
    dw: float,
    end: float,
) -> tuple[float, int]:
    """First tau in (0, end] of a step at which a condition fails at its end, and which."""
    low = 0.0
    high = end
    which = 0
    for _ in range(60):
        tau = 0.5 * (low + high)
        here = x + travel_at(u, order, tau)
        rate = rate_at(u, 0, order, tau) / h
        least, number = least_condition(
            table, math.cos(here), math.sin(here), rate, a0 + da * tau, w0 + dw * tau
        )
        if least > 0.0:
            low = tau
        else:
            high = tau
            which = number
    return high, which
