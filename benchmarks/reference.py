"""Reference peak rotations for all methods, in extended precision.

A Taylor step of degree 16 in numpy's longdouble (64 bits of mantissa on x86), p·h <= 0.25,
sines and cosines called at every step, roots isolated by bounds of the polynomial on each
half of the step. It shares no code with rbfrag.solver, only the arrays of the excitation and the
speed at which a free-standing block comes to rest.
The truncation of a step is below (p h)^17/17!, some 1e-25; the rounding of longdouble remains.
Where longdouble is no longer than a double (some platforms) some 1e-13 remains.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rbfrag.bench.peers import STABLE, TOPPLED, BenchCase, PeerAnswer, free_motion
from rbfrag.solver.rocking_run import REST_SPEED

Real = np.longdouble
ORDER = 16
PH_MAX = 0.25

EVEN = 1e-15
"""Part of an interval that is no step of its own: its end is reached but for rounding."""


def reference(
    case: BenchCase,
    *,
    sides: tuple[int, ...] = (1,),
    restitution: float = 0.0,
    after_record: Callable[[Real, Real, Real, Real, Real], PeerAnswer] = free_motion,
) -> PeerAnswer:
    """Return outcome and peak rotation [rad] of one case.

    Args:
        case: size, strength and excitation.
        sides: senses of rotation; (1, -1) for a free-standing rectangle on level ground.
        restitution: ratio of the speeds after and before an impact.
        after_record: outcome of a block in motion at the end of the record.
    """
    excited = case.excitation
    k = [Real(x) for x in excited.k_h]
    w = [Real(x) for x in excited.w]
    kr, p = Real(case.kr), np.sqrt(Real(case.p2))
    theta_c, e = np.arctan(kr), Real(restitution)
    slowest = Real(REST_SPEED) * p * theta_c
    rest = Real(0)
    # tan falls short past 90 degrees: the block is followed by its angle, never by tan
    border = {
        side: [np.arctan(min(Real(q), rest)) for q in np.minimum.accumulate(side * excited.q[::-1])]
        for side in sides
    }
    side, theta, rate, peak = 0, rest, rest, rest
    for i in range(len(k) - 1):
        h = Real(excited.interval_s[i])
        da, dw = k[i + 1] - k[i], w[i + 1] - w[i]
        at, from_rest = rest, False
        while at < 1 and h > 0:
            if side == 0:
                at, side, from_rest = _departure(sides, k[i], da, w[i] * kr, dw * kr, at)
                if side == 0:
                    break
            part = (1 - at) / max(1, math.ceil(float(p * h * (1 - at)) / PH_MAX))
            u = _coefficients(
                theta_c - theta, rate * h * part, (p * h * part) ** 2,
                side * (k[i] + da * at), side * da * part, w[i] + dw * at, dw * part, from_rest,
            )  # fmt: skip
            from_rest = False
            path, landing, peak = _followed(theta, u, peak)
            if landing is None:
                theta, rate = _value(path, Real(1)), _value(u, Real(1)) / (h * part)
                at = at + part if at + part < 1 - EVEN else Real(1)
                continue
            speed = -e * _value(u, landing) / (h * part)
            at += part * landing
            theta = rest
            side, rate = (-side, speed) if speed >= slowest else (0, rest)
        if side and rate > 0 and theta_c - theta < border[side][len(k) - 2 - i]:
            return PeerAnswer(TOPPLED, math.nan)
    if side == 0:
        return PeerAnswer(STABLE, float(peak))
    return after_record(theta, rate, p, theta_c, peak)


def _departure(
    sides: tuple[int, ...], a: Real, da: Real, g: Real, dg: Real, at: Real
) -> tuple[Real, int, bool]:
    """Return where a block at rest lifts off, its sense, and whether k_h just reaches k_r."""
    first = (Real(1), 0, False)
    for side in sides:
        above, slope = side * a - g, side * da - dg
        if above + slope * at > 0:
            return at, side, False
        if above + slope > 0 and -above / slope < first[0]:
            first = (max(at, -above / slope), side, True)
    return first


def _coefficients(
    phi: Real, u0: Real, big_p: Real, a: Real, da: Real, w: Real, dw: Real, from_rest: bool
) -> list[Real]:
    """Taylor coefficients of h theta' over one step."""
    u, s, c = [u0], [np.sin(phi)], [np.cos(phi)]
    for n in range(ORDER):
        moment = a * c[n] - w * s[n]
        if n:
            moment += da * c[n - 1] - dw * s[n - 1]
        elif from_rest:
            moment = Real(0)  # a = w k_r is where the motion starts
        u.append(big_p * moment / (n + 1))
        s.append(-sum((u[j] * c[n - j] for j in range(n + 1)), Real(0)) / (n + 1))
        c.append(sum((u[j] * s[n - j] for j in range(n + 1)), Real(0)) / (n + 1))
    return u


def _value(x: list[Real], t: Real) -> Real:
    total = Real(0)
    for coefficient in reversed(x):
        total = total * t + coefficient
    return total


def _followed(theta: Real, u: list[Real], peak: Real) -> tuple[list[Real], Real | None, Real]:
    """Return the rotation over a step, its first return to zero, and the maximum so far."""
    path = [theta, *(u[j] / (j + 1) for j in range(len(u)))]
    landing = next(iter(_roots(path)), None)
    turns = (turn for turn in _roots(u) if landing is None or turn < landing)
    return path, landing, max([peak, *(_value(path, turn) for turn in turns)])


def _roots(x: list[Real]) -> list[Real]:
    """Sign changes of a polynomial in (0, 1], in order; a root at 0 itself is divided out."""
    while x and x[0] == 0:
        x = x[1:]
    roots: list[Real] = []
    if x:
        _isolate(x, Real(0), Real(1), roots)
    return roots


def _isolate(x: list[Real], low: Real, high: Real, roots: list[Real]) -> None:
    middle, half = (low + high) / 2, (high - low) / 2
    about = x if low == 0 and high == 1 else _shifted(x, middle, half)
    if about is x:  # expanded at 0: bounds hold on [0, 1]
        if abs(x[0]) > sum((abs(v) for v in x[1:]), Real(0)):
            return
        about = _shifted(x, middle, half)
    tail = [abs(v) for v in about[1:]]
    if abs(about[0]) > sum(tail, Real(0)):
        return
    slope = sum((n * v for n, v in enumerate(tail[1:], 2)), Real(0))
    if (tail and tail[0] > slope) or high - low < 1e-9:
        at_low, at_high = _value(x, low), _value(x, high)
        if at_low != 0 and (at_high == 0 or (at_low > 0) != (at_high > 0)):
            roots.append(_bisected(x, low, high, at_low))
        return
    _isolate(x, low, middle, roots)
    _isolate(x, middle, high, roots)


def _bisected(x: list[Real], low: Real, high: Real, at_low: Real) -> Real:
    for _ in range(200):
        middle = (low + high) / 2
        f = _value(x, middle)
        if middle in (low, high) or f == 0:
            return middle
        if (f > 0) == (at_low > 0):
            low = middle
        else:
            high = middle
    return high


def _shifted(x: list[Real], centre: Real, scale: Real) -> list[Real]:
    """Coefficients of x(centre + scale t) in t."""
    y = list(x)
    for i in range(len(y) - 1):
        for j in range(len(y) - 2, i - 1, -1):
            y[j] += centre * y[j + 1]
    power = Real(1)
    for i in range(len(y)):
        y[i] *= power
        power *= scale
    return y
