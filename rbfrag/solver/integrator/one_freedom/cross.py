"""One interval of motion: steps of equal length, up to the first event."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.one_freedom.events import (
    AT_HIGHEST,
    AT_LOWEST,
    BROKEN,
    IMPACT,
    PASSED,
    STANDSTILL,
    find_event,
    first_violation,
    least_condition,
)
from rbfrag.solver.integrator.one_freedom.state import (
    COMES_TO_REST,
    PhaseRules,
    PhaseState,
    resting,
)
from rbfrag.solver.integrator.one_freedom.step import (
    Step,
    converges_slowly,
    error_growth,
    fill_step,
)
from rbfrag.solver.integrator.state import EVENT, Line, Peak, append_history, higher
from rbfrag.solver.integrator.taylor import rotation, value
from rbfrag.solver.results import FloatArray

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
        # conditions are looked at where a step ends: steps are short beside the block's own time
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
