"""Taylor step of the rocking block, and the polynomials that it leaves for locating events;
the effect of a step on the error of the motion.

On tau in [0, 1] with h the interval, P = p²h², U = h theta', psi = theta_c - theta,
s = sin(psi), c = cos(psi), a(tau) = a0 + da tau the driving
acceleration and w(tau) = w0 + dw tau the effective gravity, both in g::

    U[k+1] = P/(k+1) (a0 c[k] + da c[k-1] - w0 s[k] - dw s[k-1])
    s[k+1] = -sum_j U[j] c[k-j]/(k+1),    c[k+1] = sum_j U[j] s[k-j]/(k+1)
    theta(tau) = theta + sum_k U[k] tau^(k+1)/(k+1)

The step takes the same series in the angle delta turned since the start, whose sine and cosine
begin with 0 and 1: with A = a c - w s and D = a s + w c, linear in tau like a and w, theta''/p² is
A cos(delta) + D sin(delta).

The record is linear between samples, so no step crosses a kink. s and c are carried from
step to step by turning through the small increment of theta: the loop calls no sine or
cosine, and s² + c² stays 1. (Summing the truncated series of s and c instead loses all
terms in theta³ beyond the order, which is the greatest error where theta grows from rest.)
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import fused_kernel, inner_kernel, within
from rbfrag.solver.integrator.state import State, StepExcitation
from rbfrag.solver.results import FloatArray

ORDER = 8
"""Degree of the rotation-rate polynomial; the method's order of convergence."""

PH_MAX = 0.03
"""Greatest p·h of one step; longer intervals are split evenly. At order 8 the truncation
of a step, and what is estimated for it, is then near the rounding of its result."""

MACHINE_EPSILON = 2.220446049250313e-16


@within
def even_parts(ph: float, fraction: float, ph_max: float) -> tuple[int, float, float]:
    """Split a stretch of an interval into steps that are short enough.

    Args:
        ph: p times its length.
        ph_max: greatest p·h of one step.

    Returns:
        Number of steps; fraction of the interval and p·h of each.
    """
    if ph <= ph_max:  # a division takes as long as a tenth of a step
        return 1, fraction, ph
    parts = math.ceil(ph / ph_max)
    return parts, fraction / parts, ph / parts


@within
def series(
    order: int, u0: float, ph: float, s0: float, c0: float, shaking: StepExcitation
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:
    """Fill the series of a step; arguments as of :func:`taylor_step`.

    With v_k = k U[k], s_k and c_k the coefficients of the sine and cosine of the angle turned::

        v[k+1] = A c[k] + A' c[k-1] + D s[k] + D' s[k-1]
        s[k+1] = sum_j U[j] c[k-j]/(k+1),    c[k+1] = -sum_j U[j] s[k-j]/(k+1)

    A lower order is the same series, ended early. Sums begin with the terms that are known first:
    the time of a step is that of its longest chain of dependent operations.

    Returns:
        theta(1) - theta(0), U(1), U'(1), and the coefficients of U from the first to the eighth.
    """
    a0, da, w0, dw = shaking
    big_p = ph * ph
    # in delta the start is always 0: no value of psi enters the recurrence but here.
    # A and D, P in them, and their changes over the step; U[1] is A itself
    pa, pa1 = big_p * (a0 * c0 - w0 * s0), big_p * (da * c0 - dw * s0)
    pd, pd1 = big_p * (a0 * s0 + w0 * c0), big_p * (da * s0 + dw * c0)
    s2 = 0.5 * pa
    c2 = -0.5 * (u0 * u0)
    v2 = pa1 + pd * u0
    s3 = (1.0 / 3.0) * (u0 * c2) + (1.0 / 6.0) * v2
    u2 = 0.5 * v2
    c3 = -(1.0 / 3.0) * (u0 * s2 + pa * u0)
    v3 = pd1 * u0 + pa * c2 + pd * s2
    s4 = 0.25 * (pa * c2 + u0 * c3) + (1.0 / 12.0) * v3
    u3 = (1.0 / 3.0) * v3
    c4 = -0.25 * (u0 * s3 + pa * s2 + u2 * u0)
    v4 = pa1 * c2 + pd1 * s2 + pa * c3 + pd * s3
    u4 = 0.25 * v4
    # each sum of theta, U and U' begins with its three greatest terms, which are ready first
    turned = u0 + (0.5 * pa + (1.0 / 6.0) * v2)
    u_end = u0 + (pa + 0.5 * v2)
    if order == 4:
        turned += (1.0 / 12.0) * v3 + 0.05 * v4
        u_end += (1.0 / 3.0) * v3 + 0.25 * v4
        return turned, u_end, pa + v2 + v3 + v4, pa, u2, u3, u4, 0.0, 0.0, 0.0, 0.0
    # below 0.004 p·h the fifth order is exact to 1e-12 of A (`lean_step`)
    v5 = pa1 * c3 + pd1 * s3 + pa * c4 + pd * s4
    u5 = 0.2 * v5
    if order == 5:
        turned += (1.0 / 12.0) * v3 + 0.05 * v4 + (1.0 / 30.0) * v5
        u_end += (1.0 / 3.0) * v3 + 0.25 * v4 + 0.2 * v5
        return turned, u_end, pa + v2 + v3 + v4 + v5, pa, u2, u3, u4, u5, 0.0, 0.0, 0.0
    # s[k] and c[k] are only made as far as a higher order needs them
    s5 = 0.2 * (u2 * c2 + pa * c3 + u0 * c4) + 0.05 * v4
    c5 = -0.2 * (u0 * s4 + pa * s3 + u2 * s2 + u3 * u0)
    v6 = pa1 * c4 + pd1 * s4 + pa * c5 + pd * s5
    u6 = (1.0 / 6.0) * v6
    if order == 6:
        turned += (1.0 / 12.0) * v3 + 0.05 * v4 + (1.0 / 30.0) * v5 + (1.0 / 42.0) * v6
        u_end += (1.0 / 3.0) * v3 + 0.25 * v4 + 0.2 * v5 + (1.0 / 6.0) * v6
        return turned, u_end, pa + v2 + v3 + v4 + v5 + v6, pa, u2, u3, u4, u5, u6, 0.0, 0.0
    s6 = (1.0 / 6.0) * (u2 * c3 + u3 * c2 + pa * c4 + u0 * c5) + (1.0 / 30.0) * v5
    c6 = -(1.0 / 6.0) * (u0 * s5 + pa * s4 + u2 * s3 + u3 * s2 + u4 * u0)
    s7 = (1.0 / 7.0) * (u3 * c3 + u2 * c4 + u4 * c2 + pa * c5 + u0 * c6) + (1.0 / 42.0) * v6
    c7 = -(1.0 / 7.0) * (u0 * s6 + pa * s5 + u2 * s4 + u3 * s3 + u4 * s2 + u5 * u0)
    v7 = pa1 * c5 + pd1 * s5 + pa * c6 + pd * s6
    u7 = (1.0 / 7.0) * v7
    v8 = pa1 * c6 + pd1 * s6 + pa * c7 + pd * s7
    u8 = 0.125 * v8
    turned += (
        (1.0 / 12.0) * v3
        + 0.05 * v4
        + (1.0 / 30.0) * v5
        + (1.0 / 42.0) * v6
        + (1.0 / 56.0) * v7
        + (1.0 / 72.0) * v8
    )
    u_end += (
        (1.0 / 3.0) * v3 + 0.25 * v4 + 0.2 * v5 + (1.0 / 6.0) * v6 + (1.0 / 7.0) * v7 + 0.125 * v8
    )
    v_end = pa + v2 + v3 + v4 + v5 + v6 + v7 + v8
    return turned, u_end, v_end, pa, u2, u3, u4, u5, u6, u7, u8


@fused_kernel
def taylor_step(
    order: int, u: FloatArray, u0: float, ph: float, s0: float, c0: float, shaking: StepExcitation
) -> tuple[float, float, float]:
    """Take one step of order 4, 5, 6 or 8.

    Args:
        order: degree of U.
        u: filled with the coefficients of U, zero beyond the order, for whoever has to look
            inside the step, shape (9,).
        u0: U at the start, p times the step length times theta'/p.
        ph: p times the step length.
        s0: sin(psi) at the start.
        c0: cos(psi) at the start.
        shaking: the excitation over the step.

    Returns:
        theta(1) - theta(0), U(1), U'(1).
    """
    turned, u_end, v_end, u1, u2, u3, u4, u5, u6, u7, u8 = series(order, u0, ph, s0, c0, shaking)
    u[0] = u0
    u[1] = u1
    u[2] = u2
    u[3] = u3
    u[4] = u4
    u[5] = u5
    u[6] = u6
    u[7] = u7
    u[8] = u8
    return turned, u_end, v_end


@inner_kernel
def lean_step(
    u: FloatArray, u0: float, ph: float, s0: float, c0: float, shaking: StepExcitation
) -> tuple[float, float, float]:
    """Take one step of the lowest order whose omitted terms are below 6e-14 of theta'/p.

    With d = |dk_h| + |dw|, what the excitation changes by in the step, the fifth order leaves out
    up to (p·h)^4 d²/72 + (p·h)^5/240 and the sixth up to 0.015 (p·h)^5 d² + 2 (p·h)^8: squares of
    d come before high powers of p·h, so that the length of a step alone does not tell.
    """
    # the margins of the search are parts of k_r, a step errs by angles: 1e-12 where k_r is 0.01
    rough = ph * ph * (abs(shaking.dk_h) + abs(shaking.dw))
    order = ORDER
    if ph <= 0.004 and rough <= 8e-7:
        order = 5
    elif ph <= 0.02 and rough <= 5e-6:
        order = 6
    return taylor_step(order, u, u0, ph, s0, c0, shaking)


SMALL_TURN = 0.125
"""Greatest angle [rad] for which the series of :func:`small_turn` is exact to rounding."""


@within
def small_turn(s: float, c: float, angle: float) -> tuple[float, float]:
    """Return the result of :func:`turn` for angles up to SMALL_TURN."""
    # 1 - cos instead of cos: near the start of a rotation nothing is lost in the difference
    x = angle * angle
    sine = angle + (angle * x) * (
        (x * (1.0 / 120.0) - 1.0 / 6.0) + (x * x) * (x * (1.0 / 362880.0) - 1.0 / 5040.0)
    )
    versine = x * ((0.5 - x * (1.0 / 24.0)) + (x * x) * (1.0 / 720.0 - x * (1.0 / 40320.0)))
    return (s - s * versine) - c * sine, (c - c * versine) + s * sine


@fused_kernel
def turn(s: float, c: float, angle: float) -> tuple[float, float]:
    """Return s = sin(psi) and c = cos(psi) after psi has fallen by `angle`."""
    if abs(angle) <= SMALL_TURN:
        return small_turn(s, c, angle)
    # 1 - cos as 2 sin²(half) keeps its digits where the angle is small
    sine = math.sin(angle)
    half = math.sin(0.5 * angle)
    versine = 2.0 * half * half
    return (s - s * versine) - c * sine, (c - c * versine) + s * sine


@inner_kernel
def value(x: FloatArray, order: int, tau: float) -> float:
    """Return the polynomial sum_k x[k] tau^k, k = 0..order."""
    total: float = x[order]
    for k in range(order - 1, -1, -1):
        total = total * tau + x[k]
    return total


@inner_kernel
def slope(x: FloatArray, order: int, tau: float) -> float:
    """Return the derivative of :func:`value` with respect to tau."""
    total: float = order * x[order]
    for k in range(order - 1, 0, -1):
        total = total * tau + k * x[k]
    return total


@inner_kernel
def curvature(x: FloatArray, order: int, tau: float) -> float:
    """Return the second derivative of :func:`value` with respect to tau."""
    total: float = order * (order - 1) * x[order]
    for k in range(order - 1, 1, -1):
        total = total * tau + k * (k - 1) * x[k]
    return total


@inner_kernel
def rotation(theta: float, u: FloatArray, order: int, tau: float) -> float:
    """Return the rotation theta(tau) on the step that starts at `theta`."""
    total: float = u[order] / (order + 1)
    for k in range(order - 1, -1, -1):
        total = total * tau + u[k] / (k + 1)
    return theta + tau * total


OF_ROTATION, OF_RATE, OF_ACCELERATION = 0, 1, 2
"""Whose root is asked for: theta(tau), U(tau) or U'(tau)."""


@inner_kernel
def bracketed_root(
    kind: int, theta: float, u: FloatArray, order: int, low: float, high: float
) -> float:
    """Return the root in [low, high] by Newton's method kept inside the bracket.

    Args:
        kind: OF_ROTATION, OF_RATE or OF_ACCELERATION.
        theta: rotation at the start of the step.
        u: coefficients of U.
        order: their degree.
        low: end of the bracket where the function has one sign.
        high: end where it has the other (or is zero).

    Newton starts where the chord crosses zero. Bisection takes over whenever it leaves the
    bracket or gains too little, so the bracket always shrinks to rounding and no iterate is ever
    mistaken for a root. Convergence being quadratic, three steps in a row tell the next one, and
    the search ends when that is below rounding.
    """
    # invariant: the function has the sign of `at_low` at `low` and not at `high`
    at_low = _at(kind, theta, u, order, low)
    at_high = _at(kind, theta, u, order, high)
    tau = 0.5 * (low + high)
    if (at_low > 0.0) != (at_high > 0.0):
        # most functions here are nearly straight in a step
        chord = low + (high - low) * (at_low / (at_low - at_high))
        if low < chord < high:
            tau = chord
    before = 0.0  # size of the last step of Newton
    for _ in range(200):
        f = _at(kind, theta, u, order, tau)
        # the bracket shrinks first: whatever the next iterate is, it stays inside
        if f == 0.0:
            return tau
        if (f > 0.0) == (at_low > 0.0):
            low = tau
        else:
            high = tau
        if kind == OF_ROTATION:
            d = value(u, order, tau)
        elif kind == OF_RATE:
            d = slope(u, order, tau)
        else:
            d = curvature(u, order, tau)
        following = tau - f / d if d != 0.0 else low - 1.0
        newton = low < following < high
        if not newton:  # a flat or curved stretch: halving always gains
            following = 0.5 * (low + high)
        step = abs(following - tau)
        if step <= MACHINE_EPSILON * tau or high - low <= MACHINE_EPSILON * high:
            return following
        if newton and step < 0.01 * before and step**3 <= 0.01 * MACHINE_EPSILON * tau * before**2:
            return following
        before = step if newton else 0.0
        tau = following
    return 0.5 * (low + high)


@inner_kernel
def _at(kind: int, theta: float, u: FloatArray, order: int, tau: float) -> float:
    if kind == OF_ROTATION:
        return rotation(theta, u, order, tau)
    if kind == OF_RATE:
        return value(u, order, tau)
    return slope(u, order, tau)


@within
def exponential_bound(x: float) -> float:
    """Upper bound of exp(x) for 0 <= x <= 1, close for the small x of one step."""
    return 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * 0.06)))


@within
def step_errors(
    order: int,
    ph: float,
    state: State,
    shaking: StepExcitation,
    turned: float,
    highest: tuple[float, float, float, float],
) -> tuple[float, float, float]:
    """Return the growth of the initial error over one step, and the error that the step adds.

    At order 8 truncation and rounding together were no less than what the step adds to
    |error of theta| + |error of theta'/p| in all of a million drawn steps; this is measured, not
    proven. A series of lower order may end before the first terms in theta³: there it is a guess.

    Args:
        order: degree N of U.
        ph: p times the step length.
        shaking: over the step.
        turned: theta(1) - theta(0).
        highest: U[N - 3], U[N - 2], U[N - 1] and U[N].

    Returns:
        Exponent by which an error grows at most; truncation; rounding.
    """
    a_size = abs(shaking.k_h) + abs(shaking.dk_h)
    w_size = abs(shaking.w) + abs(shaking.dw)
    # the linearised equation: d(theta'/p)/dt = p D d(theta), d(theta)/dt = p d(theta'/p)
    stiffness = w_size * abs(state.cos)
    stiffness += a_size * abs(state.sin)
    growth = ph * max(1.0, stiffness)
    # What is omitted begins with U[N + 1]. The linear equation gives it P D U[N - 1]/(N (N + 1))
    # and P D' U[N - 2]/(N (N + 1)), ...
    linear = 8.0 * ph * (a_size + w_size) / (order * order)
    truncation = linear * (abs(highest[2]) + abs(highest[1]))
    # ... and products of angles give it what a linear one has not. From rest under a rising k_h
    # they come three places apart and last for three, so that they show in U[N]; under a constant
    # one four places, and only U[N - 3] theta² tells their size. The factors are those that hold
    # in some million drawn steps
    size = ph * (abs(state.rate) + ph * (a_size * abs(state.cos) + w_size * abs(state.sin)))
    truncation += (0.0625 * abs(highest[3]) + 0.25 * abs(highest[0]) * (size * size)) / ph
    # theta, theta'/p and the sine are rounded where they are stored, theta'' where k_h drives it;
    # what gravity takes back, w sin(psi), is less than the rounding of the sine itself
    rounding = MACHINE_EPSILON * (
        2.0 * (abs(state.theta + turned) + abs(state.rate) + abs(state.sin))
        + 4.0 * ph * a_size * abs(state.cos)
    )
    return growth, truncation, rounding


@within
def drift_of_step(ph: float, error: float, theta_end: float) -> float:
    """Return the error of theta that a step adds: theta' errs by `error`, theta by rounding."""
    return ph * error + 2.0 * MACHINE_EPSILON * abs(theta_end)


class StepRules(NamedTuple):
    """Subdivision of an interval into steps.

    Args:
        order: degree of the Taylor step: 4, 5, 6 or 8.
        ph_max: greatest p·h of one step.
    """

    order: int
    ph_max: float


class StepResult(NamedTuple):
    """Result of a step; U = h theta', with the length of the step as unit of time.

    Args:
        theta: rotation at its end [rad].
        turned: what it has grown by.
        u_start: U at its start.
        v_start: the derivative of U there.
        u_end: U at its end.
        v_end: the derivative of U there.
        growth, truncation, rounding: see :func:`step_errors`.
    """

    theta: float
    turned: float
    u_start: float
    v_start: float
    u_end: float
    v_end: float
    growth: float
    truncation: float
    rounding: float


@within
def take_step(
    order: int, u: FloatArray, ph: float, state: State, shaking: StepExcitation
) -> StepResult:
    """Take one step and estimate its errors; `u` is filled as by `taylor_step`."""
    u_start = ph * state.rate
    # exact up to its truncation where k_h and k_v are straight lines: it ends at a kink
    turned, u_end, v_end = taylor_step(order, u, u_start, ph, state.sin, state.cos, shaking)
    highest = (u[order - 3], u[order - 2], u[order - 1], u[order])
    growth, truncation, rounding = step_errors(order, ph, state, shaking, turned, highest)
    return StepResult(
        state.theta + turned, turned, u_start, u[1], u_end, v_end, growth, truncation, rounding
    )


@within
def state_after(state: State, step: StepResult, ph: float) -> State:
    """Return the state of the block at the end of a step."""
    s, c = turn(state.sin, state.cos, step.turned)
    return State(step.theta, step.u_end / ph, s, c)
