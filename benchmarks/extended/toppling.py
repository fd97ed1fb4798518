"""The toppling block in numbers of 32 digits, to judge the solver's outcomes and peaks by.

It shares nothing with rbfrag.solver but the arrays of the excitation, which both take as
exact. Every step computes sine and cosine of the angle anew; the Taylor series goes on until
its terms are below 1e-34; roots are isolated by bounds of the polynomial on each part of a
step, so that no touch and no peak is stepped over; the start of motion, the impact and the
state after the record are closed-form or bisected to the last digit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.extended.double_double import (
    Pair,
    add,
    arcsine,
    arctangent,
    div,
    mul,
    root,
    scaled,
    sine_versine,
    sub,
)
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.compiled import kernel

FloatArray = NDArray[np.float64]

STABLE, TOPPLED, JUMP = 0, 1, 2
OUTCOMES = ("stable", "toppled", "jump")

HIGHEST = 30
"""Greatest degree of the rotation rate in one step."""

PH_MAX = 0.25
"""Greatest p·h of one step."""

SMALLEST = 1e-34
"""Terms below this part of a step are left out."""

CLEAR = 1e-9
"""Angle [rad] by which a block must be past recovery before that is said."""


class Truth(NamedTuple):
    """How a run ended.

    Args:
        outcome: ``stable``, ``toppled`` or ``jump``.
        peak_rad: peak rotation, NaN unless stable; the double nearest to it.
        peak_low_rad: what is left of the peak beyond that double.
        intervals_moved: record intervals in which the block moved until the verdict.
        steps: steps taken.
    """

    outcome: str
    peak_rad: float
    peak_low_rad: float
    intervals_moved: int
    steps: int


def truth(
    excited: Excitation,
    *,
    p2: float,
    kr: float | Pair,
    ph_max: float = PH_MAX,
    smallest: float = SMALLEST,
) -> Truth:
    """Run one block over one excitation.

    Args:
        excited: the excitation.
        p2: frequency parameter p² [1/s²], taken as exact.
        kr: rocking acceleration coefficient; a pair for one between doubles.
        ph_max: greatest p·h of one step; with `smallest`, for tests of the reference itself.
        smallest: part of a step below which terms are left out.
    """
    strength = kr if isinstance(kr, tuple) else (float(kr), 0.0)
    code, high, low, moved, steps = _run(
        excited.interval_s, excited.k_h, excited.w, p2, strength[0], strength[1], ph_max, smallest
    )
    return Truth(OUTCOMES[code], high, low, moved, steps)


@kernel
def _run(
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    p2: float,
    kr_high: float,
    kr_low: float,
    ph_max: float,
    smallest: float,
) -> tuple[int, float, float, int, int]:
    n = k_h.size
    zero = (0.0, 0.0)
    unity = (1.0, 0.0)
    kr = (kr_high, kr_low)
    p = root((p2, 0.0))
    theta_c = arctangent(kr)
    c_rest = div(unity, root(add(unity, mul(kr, kr))))
    s_rest = mul(kr, c_rest)
    # angle of which all later excitation exceeds the tangent: beyond it nothing brings a block back
    border = np.zeros(n)
    least = 0.0
    for i in range(n - 1, -1, -1):
        if w[i] <= 0.0:
            return JUMP, math.nan, 0.0, 0, 0
        least = min(least, k_h[i] / w[i])
        border[i] = math.atan(least)

    u = np.zeros((HIGHEST + 1, 2))
    s = np.zeros((HIGHEST + 1, 2))
    c = np.zeros((HIGHEST + 1, 2))
    path = np.zeros((HIGHEST + 2, 2))
    roots = np.zeros((HIGHEST + 2, 2))
    peak = zero
    theta = zero
    rate = zero  # theta'/p
    moving = False
    steps = 0
    moved = 0

    for i in range(n - 1):
        if interval_s[i] == 0.0:
            continue
        span = mul(p, (interval_s[i], 0.0))
        a_start = (k_h[i], 0.0)
        w_start = (w[i], 0.0)
        a_slope = sub((k_h[i + 1], 0.0), a_start)
        w_slope = sub((w[i + 1], 0.0), w_start)
        g_start = sub(a_start, mul(w_start, kr))
        g_slope = sub(a_slope, mul(w_slope, kr))
        g_end = add(g_start, g_slope)
        at = zero
        counted = False
        while True:
            fresh = False
            if not moving:
                if not (at[0] < 1.0):
                    break
                g = add(g_start, mul(g_slope, at))
                if not (g[0] > 0.0):
                    if not (g_end[0] > 0.0):
                        break
                    crossing = div((-g_start[0], -g_start[1]), g_slope)
                    if crossing[0] > at[0]:
                        at = crossing
                    if not (at[0] < 1.0):
                        break
                    fresh = True
                moving = True
                theta = zero
                rate = zero
            if not counted:
                counted = True
                moved += 1
            rest = sub(unity, at)
            part = rest
            pieces = math.ceil(span[0] * rest[0] / ph_max)
            if pieces > 1:
                part = div(rest, (float(pieces), 0.0))
            ph = mul(span, part)
            steps += 1
            sine, versine = sine_versine(theta)
            cosine = sub(unity, versine)
            degree = _series(
                u, s, c,
                sub(mul(s_rest, cosine), mul(c_rest, sine)),
                add(mul(c_rest, cosine), mul(s_rest, sine)),
                mul(rate, ph), mul(ph, ph),
                add(a_start, mul(a_slope, at)), mul(a_slope, part),
                add(w_start, mul(w_slope, at)), mul(w_slope, part), fresh, smallest,
            )  # fmt: skip
            path[0, 0] = theta[0]
            path[0, 1] = theta[1]
            for j in range(degree + 1):
                term = div((u[j, 0], u[j, 1]), (j + 1.0, 0.0))
                path[j + 1, 0] = term[0]
                path[j + 1, 1] = term[1]
            landing = (2.0, 0.0)
            if _roots(path, degree + 2, roots, 1) > 0:
                landing = (roots[0, 0], roots[0, 1])
            for m in range(_roots(u, degree + 1, roots, HIGHEST + 2)):
                turn = (roots[m, 0], roots[m, 1])
                if sub(turn, landing)[0] < 0.0:
                    there = _value(path, degree + 2, turn)
                    if sub(there, peak)[0] > 0.0:
                        peak = there
            if landing[0] <= 1.0:
                at = add(at, mul(part, landing))
                moving = False
                theta = zero
                rate = zero
                continue
            theta = _value(path, degree + 2, unity)
            rate = div(_value(u, degree + 1, unity), ph)
            at = add(at, part) if pieces > 1 else unity
            if rate[0] > 0.0 and sub(theta_c, theta)[0] < border[i] - CLEAR:
                return TOPPLED, math.nan, 0.0, moved, steps
            if not (at[0] < 1.0):
                break
        if moving and rate[0] > 0.0 and sub(theta_c, theta)[0] < border[i + 1] - CLEAR:
            return TOPPLED, math.nan, 0.0, moved, steps
    if moving:
        # (theta'/p)²/2 + cos(phi) is kept; upright it is 1
        sine, versine = sine_versine(sub(theta_c, theta))
        half = root(scaled(versine, 2.0))
        distance = sub(rate, half) if sine[0] > 0.0 else add(rate, half)
        if distance[0] > 0.0:
            return TOPPLED, math.nan, 0.0, moved, steps
        if rate[0] > 0.0:
            chord = root(mul(sub(half, rate), add(half, rate)))
            top = sub(theta_c, scaled(arcsine(scaled(chord, 0.5)), 2.0))
            if sub(top, peak)[0] > 0.0:
                peak = top
    return STABLE, peak[0], peak[1], moved, steps


@kernel
def _series(
    u: FloatArray,
    s: FloatArray,
    c: FloatArray,
    s0: Pair,
    c0: Pair,
    u0: Pair,
    big_p: Pair,
    a: Pair,
    a_slope: Pair,
    w: Pair,
    w_slope: Pair,
    fresh: bool,
    smallest: float,
) -> int:
    """Fill the Taylor coefficients of h theta', sin(phi), cos(phi); return the degree reached."""
    u[0, 0], u[0, 1] = u0
    s[0, 0], s[0, 1] = s0
    c[0, 0], c[0, 1] = c0
    size = abs(u0[0])
    for k in range(HIGHEST):
        moment = (0.0, 0.0)
        if k > 0 or not fresh:  # at a crossing it vanishes by definition
            moment = sub(mul(a, (c[k, 0], c[k, 1])), mul(w, (s[k, 0], s[k, 1])))
        if k > 0:
            moment = add(moment, mul(a_slope, (c[k - 1, 0], c[k - 1, 1])))
            moment = sub(moment, mul(w_slope, (s[k - 1, 0], s[k - 1, 1])))
        over = (k + 1.0, 0.0)
        term = div(mul(big_p, moment), over)
        u[k + 1, 0], u[k + 1, 1] = term
        size = max(size, abs(term[0]))
        if k > 4:
            # three in a row, since every other one, or two of three, may vanish
            last = max(abs(term[0]), max(abs(u[k, 0]), abs(u[k - 1, 0])))
            if last <= smallest * size:
                return k + 1
        sum_s = (0.0, 0.0)
        sum_c = (0.0, 0.0)
        for j in range(k + 1):
            factor = (u[j, 0], u[j, 1])
            sum_s = sub(sum_s, mul(factor, (c[k - j, 0], c[k - j, 1])))
            sum_c = add(sum_c, mul(factor, (s[k - j, 0], s[k - j, 1])))
        term = div(sum_s, over)
        s[k + 1, 0], s[k + 1, 1] = term
        term = div(sum_c, over)
        c[k + 1, 0], c[k + 1, 1] = term
    return HIGHEST


@kernel
def _value(x: FloatArray, count: int, t: Pair) -> Pair:
    """Polynomial of `count` coefficients at t."""
    total = (0.0, 0.0)
    for j in range(count - 1, -1, -1):
        total = add(mul(total, t), (x[j, 0], x[j, 1]))
    return total


@kernel
def _roots(x: FloatArray, count: int, roots: FloatArray, most: int) -> int:
    """Find where a polynomial changes sign in (0, 1], in order; return how many, up to `most`.

    Roots at 0 itself are divided out.
    """
    first = 0
    while first < count and x[first, 0] == 0.0:
        first += 1
    if first >= count - 1:
        return 0
    rest = 0.0
    for j in range(first + 1, count):
        rest += abs(x[j, 0])
    if abs(x[first, 0]) > rest * 1.0000001:
        return 0
    size = count - first
    about = np.empty((size, 2))
    lows = np.empty(200)
    highs = np.empty(200)
    lows[0] = 0.0
    highs[0] = 1.0
    depth = 1
    number = 0
    while depth > 0 and number < most:
        depth -= 1
        low = lows[depth]
        high = highs[depth]
        middle = 0.5 * (low + high)
        half = 0.5 * (high - low)
        for j in range(size):
            about[j, 0] = x[first + j, 0]
            about[j, 1] = x[first + j, 1]
        for j in range(size - 1):
            for m in range(size - 2, j - 1, -1):
                term = add(
                    (about[m, 0], about[m, 1]),
                    mul((middle, 0.0), (about[m + 1, 0], about[m + 1, 1])),
                )
                about[m, 0], about[m, 1] = term
        power = 1.0
        tail = 0.0
        bend = 0.0
        for j in range(1, size):
            power *= half
            now = abs(about[j, 0]) * power
            tail += now
            if j > 1:
                bend += j * now
        if abs(about[0, 0]) > tail * 1.0000001:
            continue
        lone = size > 1 and abs(about[1, 0]) * half > bend * 1.0000001
        if lone or half < 1e-25 or depth > 190:
            at_low = _part(x, first, count, (low, 0.0))
            at_high = _part(x, first, count, (high, 0.0))
            if at_low[0] != 0.0 and (at_high[0] == 0.0 or (at_low[0] > 0.0) != (at_high[0] > 0.0)):
                t = _closed_in(x, first, count, low, high, at_low[0] > 0.0)
                roots[number, 0], roots[number, 1] = t
                number += 1
            continue
        lows[depth] = middle
        highs[depth] = high
        lows[depth + 1] = low
        highs[depth + 1] = middle
        depth += 2
    return number


@kernel
def _part(x: FloatArray, first: int, count: int, t: Pair) -> Pair:
    total = (0.0, 0.0)
    for j in range(count - 1, first - 1, -1):
        total = add(mul(total, t), (x[j, 0], x[j, 1]))
    return total


@kernel
def _closed_in(
    x: FloatArray, first: int, count: int, low: float, high: float, low_positive: bool
) -> Pair:
    """The sign change between two doubles: bisection to the double, then one secant beyond."""
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        f = _part(x, first, count, (middle, 0.0))
        if f[0] == 0.0:
            return middle, 0.0
        if (f[0] > 0.0) == low_positive:
            low = middle
        else:
            high = middle
    at_low = _part(x, first, count, (low, 0.0))
    at_high = _part(x, first, count, (high, 0.0))
    share = div(at_low, sub(at_low, at_high))
    return add((low, 0.0), mul(share, sub((high, 0.0), (low, 0.0))))
