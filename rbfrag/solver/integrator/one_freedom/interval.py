"""One interval of motion: steps of equal length, up to the first event.

Events are a standstill, a limit of x, and a contact that fails.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.one_freedom.step import (
    COMES_TO_REST,
    CONDITIONS,
    INERTIA,
    PhaseRules,
    PhaseState,
    Step,
    converges_slowly,
    error_growth,
    fill_step,
    resting,
    with_double,
)
from rbfrag.solver.integrator.state import EVENT, Line, Peak, append_history, higher
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


TURN_OF_ORDER_5, TURN_OF_ORDER_6 = 0.012, 0.03
"""Steps, in units of the block's own time, whose truncation at these orders is below rounding."""

SPLITS_MAX = 40
"""Halvings of a step whose series does not converge."""


class Crossing(NamedTuple):
    """The end of an interval, or of the part of it up to its first event.

    Args:
        kind: `PASSED`, or the event.
        condition: which condition failed, if it is `BROKEN`.
        state: state of the block.
        peak: greatest x so far.
        filled: columns of the history that are filled.
        steps: integration steps.
    """

    kind: int
    condition: int
    tau: float
    state: PhaseState
    peak: Peak
    filled: int
    steps: int


class Arrival(NamedTuple):
    """The end of a step.

    Args:
        kind: `PASSED`, or the event that cuts it short.
        condition: which condition failed, if it is `BROKEN`.
        tau: fraction of the step.
        state: state of the block.
        turn_tau: where a block that nothing holds turns round on the way; -1 if it does not.
        turn_x: position there.
    """

    kind: int
    condition: int
    tau: float
    state: PhaseState
    turn_tau: float
    turn_x: float


@inner_kernel
def cross_interval(
    rules: PhaseRules,
    table: FloatArray,
    series: FloatArray,
    line: Line,
    tau: float,
    frequency: float,
    state: PhaseState,
    peak: Peak,
    history: FloatArray,
    filled: int,
) -> Crossing:
    """Integrate to the end of an interval or to the first event in it.

    Args:
        table: coefficients of the equation of the present sense.
        series: work array for the series of a step.
        tau: where in it the motion is.
        frequency: rate of the block's own time [1/s]; 0 where the equation is the same everywhere.
        state: state of the block.
        peak: greatest x so far.
        history: as for the phase.
        filled: columns of it that are filled.
    """
    # The Taylor series converges as fast as for a linear system of the local frequency parameter
    # sqrt((N + M)/D): steps are even, and p·h with that p is at most `rules.turn_max`

    # an equation that is the same everywhere is solved exactly by one step, whatever its length
    order, parts = rules.order, 1
    if not rules.uniform:
        # the second harmonics change by 2 x': a fast block shortens its own time by moving
        turn = max(frequency, 2.0 * abs(state.rate)) * (line.h * (1.0 - tau))
        parts = max(1, math.ceil(turn / rules.turn_max))
        # short steps need no high order: the terms beyond are below rounding
        if turn < TURN_OF_ORDER_5:
            order = min(order, 5)
        elif turn < TURN_OF_ORDER_6:
            order = min(order, 6)
    first, size = tau, (1.0 - tau) / parts
    finished = steps = splits = 0
    while finished < parts:
        at = first + finished * size
        step = Step(
            size * line.h,
            line.a0 + (line.a1 - line.a0) * at,
            (line.a1 - line.a0) * size,
            line.w0 + (line.w1 - line.w0) * at,
            (line.w1 - line.w0) * size,
        )
        fill_step(table, series, order, state, step)
        steps += 1
        if not rules.uniform and splits < SPLITS_MAX and converges_slowly(series[0], order):
            # the state changes faster than its own time says, near D = 0: halve what is left
            splits += 1
            order, first = rules.order, at
            parts = 2 * (parts - finished)
            size, finished = (1.0 - first) / parts, 0
            continue
        arrival = arrive(rules, table, series[0], order, frequency, state, step)
        # a turn inside the step is a peak of its own, though the step goes on
        if arrival.turn_tau >= 0.0:
            peak = higher(peak, arrival.turn_x, state.error_x)
            turned_s = line.start_s + (at + size * arrival.turn_tau) * line.h
            filled = append_history(history, filled, turned_s, arrival.turn_x, 0.0, EVENT)
        state = arrival.state
        peak = higher(peak, state.x, state.error_x)
        tau = at + size * arrival.tau
        if arrival.kind != PASSED:
            return Crossing(arrival.kind, arrival.condition, tau, state, peak, filled, steps)
        finished += 1
    return Crossing(PASSED, 0, tau, state, peak, filled, steps)


@within
def arrive(
    rules: PhaseRules,
    table: FloatArray,
    u: FloatArray,
    order: int,
    frequency: float,
    state: PhaseState,
    step: Step,
) -> Arrival:
    """Return the end of a step whose series is filled: its first event, or its full length.

    Args:
        table: coefficients of the equation of the present sense.
        u: Taylor coefficients of U.
        order: degree of U.
        frequency: rate of the block's own time [1/s].
        state: state at the start.
        step: length and accelerations.
    """
    x_end = rotation(state.x, u, order, 1.0)
    leading = 0  # of the coefficients are zero
    if state.rate == 0.0:
        leading = 1
        if state.smooth:  # where k_h crosses the threshold x'' is zero too, but for rounding
            u[1] = 0.0
            leading = 2
    event = find_event(u, order, leading, rules, state, x_end)
    kind, tau = event.kind, event.tau
    growth = error_growth(rules, table, u, order, frequency, state, step, tau, event.x)
    x, rate, cos, sin = state.x, state.rate, state.cos, state.sin
    if tau > 0.0:
        x = event.x if kind < AT_HIGHEST else rotation(state.x, u, order, tau)
        # U = h x' is carried by the series, so that the rate is one division away
        rate = 0.0 if kind == STANDSTILL else value(u, order, tau) / step.h
        if not rules.uniform:
            cos, sin = math.cos(x), math.sin(x)
        # conditions are checked where a step ends: steps are short compared with the block's time
        a, w = step.a0 + step.da * tau, step.w0 + step.dw * tau
        least, condition = least_condition(table, cos, sin, rate, a, w)
        if least <= 0.0:
            # a contact that would have to pull opens, and the model ends (docs/theory/slumping.md)
            tau, condition = first_violation(table, u, order, state.x, step, tau)
            x, rate = rotation(state.x, u, order, tau), value(u, order, tau) / step.h
            end = PhaseState(x, rate, cos, sin, growth.x, growth.rate, state.sense, False)
            return Arrival(BROKEN, condition, tau, end, event.turn_tau, event.turn_x)
        # at a limit x is the limit itself, not the last iterate of a root finder
        if kind == AT_HIGHEST:
            x = rules.highest
        elif kind == AT_LOWEST:
            x = rules.lowest
    end = PhaseState(x, rate, cos, sin, growth.x, growth.rate, state.sense, False)
    # friction holds what has come to a standstill: no rate is left, and no error of one
    if kind == STANDSTILL:
        end = resting(end, growth.x, state.sense, False)
    elif kind == AT_LOWEST and rules.impact == COMES_TO_REST:
        # the impact takes all speed (an assumption: docs/theory/slumping.md) and every error of x
        kind, end = IMPACT, resting(end, 0.0, -1, False)
    return Arrival(kind, 0, tau, end, event.turn_tau, event.turn_x)
