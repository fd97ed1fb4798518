"""Events within a step: a standstill, a limit of x, a contact that fails."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.one_freedom.state import PhaseRules, PhaseState
from rbfrag.solver.integrator.one_freedom.step import CONDITIONS, INERTIA, Step, with_double
from rbfrag.solver.integrator.taylor import rotation, slope, value
from rbfrag.solver.results import FloatArray

PASSED, STANDSTILL, AT_HIGHEST, AT_LOWEST, IMPACT, BROKEN = range(6)
"""What ends a step: nothing; a standstill; a limit of x; an impact at the lower one, which stops
the block; a condition that fails."""

TRAVEL, RATE, ACCELERATION = range(3)
"""Functions of tau that a root is looked for of: the travel less its target, U, U'."""


class Event(NamedTuple):
    """The first event of a step.

    Args:
        kind: `PASSED`, `STANDSTILL`, `AT_HIGHEST` or `AT_LOWEST`.
        tau: where; 1 if nothing happens.
        x: position at the end of the step, or at the standstill in it.
        turn_tau: where a block that nothing holds turns round before it; -1 if it does not.
        turn_x: position there.
    """

    kind: int
    tau: float
    x: float
    turn_tau: float
    turn_x: float


@within
def find_event(
    u: FloatArray, order: int, leading: int, rules: PhaseRules, state: PhaseState, x_end: float
) -> Event:
    """Return the first event of a step.

    Args:
        u: Taylor coefficients of U.
        order: degree of U.
        leading: how many of the first of them are zero.
        state: state at the start.
        x_end: position at the end of the whole step.
    """
    # up to the first standstill x is monotone, so that x at its end shows whether a limit is met:
    # the first event is that limit, if there is one, or else the standstill
    standstill = 0.0
    # a start that rounding turns into the other sense is none
    if u[leading] * state.sense > 0.0 or not rules.sticks:
        standstill = first_standstill(u[leading:], order - leading)
    end = min(standstill, 1.0)
    kind = STANDSTILL if standstill <= 1.0 else PASSED
    reached = rotation(state.x, u, order, end) if end < 1.0 else x_end
    turn_tau, turn_x = -1.0, 0.0
    low = 0.0
    if kind == STANDSTILL and not rules.sticks and rules.lowest <= reached <= rules.highest:
        # without friction the block turns and goes on: only a limit beyond the turn ends the step
        turn_tau, turn_x = end, reached
        kind, low, end, reached = PASSED, end, 1.0, x_end
    # x is monotone from `low` to `end`, so that a limit beyond its end is met once on the way
    if reached > rules.highest:
        end = root_between(u, order, TRAVEL, rules.highest - state.x, low, end)
        kind = AT_HIGHEST
    elif reached < rules.lowest:
        end = root_between(u, order, TRAVEL, rules.lowest - state.x, low, end)
        kind = AT_LOWEST
    return Event(kind, end, reached, turn_tau, turn_x)


@inner_kernel
def first_standstill(series: FloatArray, degree: int) -> float:
    """Return the first tau in (0, 1] at which the rate vanishes, or 2.

    A rate that dips below zero between two ends of one sign is seen where its derivative
    changes sign once, which short steps ensure.

    Args:
        series: coefficients of U, less the leading ones that are zero.
    """
    # divided by tau to the number of leading zeros: the start itself is not a standstill
    start = series[0]
    if start == 0.0:
        return 2.0
    end = value(series, degree, 1.0)
    # the ends differ in sign: one standstill, or an odd number that short steps do not have
    if start * end <= 0.0:
        return root_between(series, degree, RATE, 0.0, 0.0, 1.0)
    slope_start = slope(series, degree, 0.0)
    slope_end = slope(series, degree, 1.0)
    # the rate falls at first and rises at last: it may touch zero where its derivative vanishes
    if slope_start * start < 0.0 and slope_end * start > 0.0:
        least = root_between(series, degree, ACCELERATION, 0.0, 0.0, 1.0)
        if value(series, degree, least) * start <= 0.0:
            return root_between(series, degree, RATE, 0.0, 0.0, least)
    return 2.0


@inner_kernel
def root_between(
    u: FloatArray, order: int, quantity: int, target: float, low: float, high: float
) -> float:
    """Return the root in [low, high], to rounding, by Newton's method kept inside a bracket.

    It differs from `rbfrag.solver.integrator.taylor.bracketed_root` in its target, in taking an
    end at which the function vanishes by construction (a limit that the step begins at) for the
    low one, and in returning the far side of the bracket: an event is never reported before it.

    Args:
        u: Taylor coefficients.
        order: their degree.
        quantity: `TRAVEL`, `RATE` or `ACCELERATION`.
        target: travel to reach.
        low: end where the sign is that of the function just after the start.
        high: end where the sign is the other, or the value zero.
    """
    # invariant: the function has the sign `sign_low` just above `low`, and not at `high`

    # the sign at the low end is taken from the high one: at the low end the function may vanish
    sign_low = 1.0
    at_high = value_of(u, order, quantity, target, high)
    if at_high == 0.0:
        return high
    if at_high > 0.0:
        sign_low = -1.0
    tau = 0.5 * (low + high)
    for _ in range(100):
        current = value_of(u, order, quantity, target, tau)
        if current == 0.0:
            return tau
        if current * sign_low > 0.0:
            low = tau
        else:
            high = tau
        derivative = 0.0  # of U' it is not worth its work: bisection
        if quantity == TRAVEL:
            derivative = value(u, order, tau)
        elif quantity == RATE:
            derivative = slope(u, order, tau)
        following = tau - current / derivative if derivative != 0.0 else low - 1.0
        # outside the bracket Newton has lost the root: halve
        if not low < following < high:
            following = 0.5 * (low + high)
        if following == tau or high - low <= 1e-16 * max(abs(high), abs(low)):
            return high
        tau = following
    return high


@within
def value_of(u: FloatArray, order: int, quantity: int, target: float, tau: float) -> float:
    """Return the function whose root is sought."""
    if quantity == TRAVEL:
        return rotation(0.0, u, order, tau) - target
    if quantity == RATE:
        return value(u, order, tau)
    return slope(u, order, tau)


@inner_kernel
def least_condition(
    table: FloatArray, c: float, s: float, rate: float, a: float, w: float
) -> tuple[float, int]:
    """Return the minimum of the inertia and the conditions at a state, and its index (0: the
    inertia).
    """
    # double and triple angles without a further cosine
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    c3 = c * c2 - s * s2
    s3 = s * c2 + c * s2
    least = with_double(table, INERTIA, c, s, c2, s2)
    which = 0
    if least <= 0.0:
        return least, which  # the conditions are those of forces times the inertia
    for n in range((table.shape[0] - CONDITIONS) // 3):
        row = CONDITIONS + 3 * n
        force = with_double(table, row, c, s, c2, s2) * a
        # third harmonics: a lever times the push of water, or times C'' (two_contacts)
        per_w = with_double(table, row + 1, c, s, c2, s2)
        per_w += table[row + 1, 5] * c3 + table[row + 1, 6] * s3
        force += per_w * w
        third = with_double(table, row + 2, c, s, c2, s2)
        third += table[row + 2, 5] * c3 + table[row + 2, 6] * s3
        force += third * rate * rate
        if force < least:
            least = force
            which = n + 1
    return least, which


@within
def broken_condition(table: FloatArray, state: PhaseState, a: float, w: float) -> tuple[bool, int]:
    """Return whether a condition fails at a state under two accelerations, and its index."""
    least, condition = least_condition(table, state.cos, state.sin, state.rate, a, w)
    return least <= 0.0, condition


@inner_kernel
def first_violation(
    table: FloatArray, u: FloatArray, order: int, start: float, step: Step, end: float
) -> tuple[float, int]:
    """Return the first tau in (0, end] of a step from `start` whose end breaks a condition, and its
    index.
    """
    # bisection: the least of several conditions has no derivative where they change places
    low = 0.0
    high = end
    which = 0
    for _ in range(60):
        tau = 0.5 * (low + high)
        x = rotation(start, u, order, tau)
        rate = value(u, order, tau) / step.h
        least, number = least_condition(
            table, math.cos(x), math.sin(x), rate, step.a0 + step.da * tau, step.w0 + step.dw * tau
        )
        if least > 0.0:
            low = tau
        else:
            high = tau
            which = number
    return high, which
