"""Kernel of a motion with one degree of freedom: one phase over one record.

The block rests, moves forward (x grows) or moves in reverse. Rest ends where the acceleration
that one of the two equations gives at rest has the sense of that equation; the crossing is located
inside the sample interval. Motion ends at a standstill (friction) or at a limit of x. Every event
is located to rounding on the polynomial of the step.

Where the equation does not depend on position, the acceleration is a straight line between samples,
the rate a parabola and x a cubic: :func:`coast` takes whole intervals in a few operations, up to
one that may hold an event.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.excitation import Nodes
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.events import Thresholds, depart
from rbfrag.solver.integrator.one_freedom.interval import (
    AT_HIGHEST,
    AT_LOWEST,
    BROKEN,
    IMPACT,
    PASSED,
    broken_condition,
    cross_interval,
)
from rbfrag.solver.integrator.one_freedom.step import (
    AT_REST,
    CONDITIONS,
    DRIVING,
    ENDLESS,
    EPSILON,
    INERTIA,
    JUMPED,
    LOWER,
    NO_REVERSE,
    RESISTANCE,
    REVERSE,
    REVERSE_LEAVES,
    UPPER,
    VIOLATED,
    Entry,
    PhaseRules,
    PhaseRun,
    PhaseState,
    PhaseWork,
    certain_since,
    harmonic_sum,
    local_frequency,
    resting,
    uniform_terms,
)
from rbfrag.solver.integrator.state import (
    EVENT,
    Line,
    Peak,
    Place,
    append_history,
    higher,
    line_at,
    time_of_jump,
)
from rbfrag.solver.results import FloatArray

NEAR_STANDSTILL = 1e-9
"""Least rate within an interval, over that at its start, that is told from a standstill here."""


@within
def fill_uniform_conditions(rules: PhaseRules, work: PhaseWork) -> None:
    """Fill the factors of k_h, 1 + k_v and x'^2 in each condition of equations without x."""
    fill_conditions(rules.forward, work.conditions_forward)
    fill_conditions(rules.reverse, work.conditions_reverse)


@inner_kernel
def fill_conditions(table: FloatArray, conditions: FloatArray) -> None:
    """Fill these factors for one equation, shape (conditions, 3)."""
    for n in range(conditions.shape[0]):
        for part in range(3):
            row = CONDITIONS + 3 * n + part
            conditions[n, part] = harmonic_sum(table, row, 1.0, 0.0)
        # the third harmonic of the factor of x'^2, at x = 0
        conditions[n, 2] += table[CONDITIONS + 3 * n + 2, 5]


class Coast(NamedTuple):
    """State of the block after whole intervals of motion; see :func:`coast`."""

    node: int
    state: PhaseState
    peak: Peak
    certain_s: float
    filled: int


@inner_kernel
def coast(
    record: Nodes,
    rules: PhaseRules,
    table: FloatArray,
    conditions: FloatArray,
    node: int,
    state: PhaseState,
    peak: Peak,
    certain_s: float,
    history: FloatArray,
    filled: int,
) -> Coast:
    """Follow a moving block over whole intervals, up to one in which an event is possible.

    Args:
        record: the excitation.
        rules: those of the phase, whose equations are the same everywhere.
        table: coefficients of the equation of the present sense.
        conditions: :func:`fill_conditions` of that table.
        node: interval to start with, from its beginning.
        state: state of the block there, its rate not zero.
        peak: greatest x so far.
        certain_s: time from which nothing turns the motion back; NaN while it may be.
        history: as for the phase.
        filled: columns of it that are filled.
    """
    # D x'' = N k_h - M (1 + k_v) with constant D, N, M and k_h, k_v linear in time: over an
    # interval U = h x' = u0 + u1 tau + u2 tau² and x = x0 + u0 tau + u1 tau²/2 + u2 tau³/3, exactly
    time_s, interval_s, k_h, w = record.time_s, record.interval_s, record.k_h, record.w
    tail_min_q, last = record.tail_min_q, record.last
    lowest, highest = rules.lowest, rules.highest
    inertia, driving, resistance = table[INERTIA, 0], table[DRIVING, 0], table[RESISTANCE, 0]
    forward_driving, forward_resistance = rules.forward[DRIVING, 0], rules.forward[RESISTANCE, 0]
    # plain numbers in the loop: one interval costs a few operations, a tuple would cost as many
    x, rate, error_x, error_rate = state.x, state.rate, state.error_x, state.error_rate
    while node < last:
        h = interval_s[node]
        if h <= 0.0:  # a jump of the record: the kernel of the phase looks at the conditions
            break
        a0, a1, w0, w1 = k_h[node], k_h[node + 1], w[node], w[node + 1]
        u0 = h * rate
        u1, u2 = uniform_terms(inertia, driving, resistance, h, a0, a1 - a0, w0, w1 - w0)
        # a standstill at the end, or between two ends of one sign: the vertex of the parabola
        u_end = u2 + u1 + u0
        if not u_end * u0 > 0.0:  # NaN too
            break
        if u1 * u0 < 0.0 and (u1 + 2.0 * u2) * u0 > 0.0:
            least = u0 - 0.25 * u1 * u1 / u2
            if not least * u0 > NEAR_STANDSTILL * u0 * u0:
                break
        reached = x + (u2 / 3.0 + u1 / 2.0 + u0)
        # x is monotone while the rate keeps its sign: its end tells whether a limit is met
        if reached > highest or reached < lowest:
            break
        rate_end = u_end / h
        # a margin is linear in both accelerations; what changes its sign inside is seen at the end
        holds = True
        for n in range(conditions.shape[0]):
            margin = conditions[n, 0] * a1 + conditions[n, 1] * w1
            if margin + conditions[n, 2] * rate_end * rate_end <= 0.0:
                holds = False
        if not holds:
            break
        # x'' does not depend on x or x': errors add up, and rounding adds to them
        error_x += h * error_rate
        error_x += EPSILON * (2.0 * abs(reached) + abs(u0))
        error_rate += EPSILON * (2.0 * abs(rate))
        error_rate += 4.0 * EPSILON * (abs(u1) + abs(u2)) / h
        x = reached
        rate = rate_end
        peak = higher(peak, x, error_x)
        node += 1
        now_s = time_s[node]
        filled = append_history(history, filled, now_s, x, rate, node)
        least_q = tail_min_q[node]
        certain_s = certain_since(
            certain_s, now_s, rate, forward_driving, forward_resistance, least_q
        )
    end = PhaseState(x, rate, 1.0, 0.0, error_x, error_rate, state.sense, False)
    return Coast(node, end, peak, certain_s, filled)


GOES_ON = -1
"""A phase that has not ended."""

FREE_STEPS_MAX = 100_000
PASSES_PER_NODE = 100
"""Passes of the loop of a phase before it is given up: for motion after the record that does not
end, and per node of it: accelerations next to the smallest numbers start and stop a block at one
place without end."""

FREE_STEP_S = 0.1
"""Length of a step after the record where the equation is the same everywhere [s]."""


@bare_kernel
def run_phase(
    record: Nodes, rules: PhaseRules, entry: Entry, work: PhaseWork, history: FloatArray
) -> PhaseRun:
    """Run one phase from its entry to its end.

    Args:
        record: the excitation.
        rules: what governs the motion.
        work: work arrays of the kernels.
        history: shape (4, m), for time, x, x' and node (-1 between nodes); (4, 0) for none.
    """
    # Invariant of the loop: `state` holds at the fraction tau of interval `node`, or free_s seconds
    # after the record. A block at rest departs where the acceleration of one of the two equations
    # has that equation's sense; friction opposes the motion, so that each sense has its own
    # coefficients D, N, M and Q
    fill_uniform_conditions(rules, work)
    node, tau, free_s = entry.place.interval, entry.place.fraction, entry.free_s
    state = state_on_entry(rules, entry)
    peak = Peak(entry.x, entry.error_x)
    started_s = stopped_s = certain_s = math.nan
    steps = moved = impacts = filled = passes = 0
    passes_max = FREE_STEPS_MAX + PASSES_PER_NODE * record.k_h.size
    counted = -1  # the interval that was last counted as moved in
    stop, condition = GOES_ON, 0
    # without friction nothing holds the block, even where its rate is zero
    moving = entry.rate != 0.0 or not rules.sticks
    barred = 0  # sense in which the block has just come to a standstill
    jumped = False  # the accelerations have: conditions must be checked again
    line = line_at(record, node, free_s, 1.0)

    while stop == GOES_ON:
        passes += 1
        if passes > passes_max:
            stop = ENDLESS
            break
        if not moving:
            # a block at rest does not change its thresholds: once is enough
            rest = depart(record, thresholds(rules, state), Place(node, tau), barred)
            node, tau = rest.place
            state = resting(state, state.error_x, rest.sense, rest.smooth)
            line = line_at(record, node, free_s, 1.0)
            stop, condition = stop_at_rest(record, rules, state, line, rest.place)
            now_s = line.start_s + tau * line.h
            # a start that a contact does not survive, or into another phase, is one too
            if math.isnan(started_s) and stop in (GOES_ON, VIOLATED, REVERSE):
                started_s = now_s
            if stop != GOES_ON:
                break
            moving, barred = True, 0
            filled = append_history(history, filled, now_s, state.x, 0.0, EVENT)
        elif jumps_after(record, node):
            stop = JUMPED
            break
        past_record = node >= record.last
        forward = state.sense > 0 or not rules.sticks
        table = rules.forward if forward else rules.reverse

        # whole intervals in which nothing happens, where an interval is one exact step
        if (
            rules.uniform
            and not (past_record or jumped)
            and tau == 0.0
            and state.rate * state.sense > 0.0
        ):
            conditions = work.conditions_forward if forward else work.conditions_reverse
            far = coast(
                record, rules, table, conditions, node, state, peak, certain_s, history, filled
            )
            if far.node > node:
                # the first of them may have been counted already, by an event in it
                steps += far.node - node
                moved += far.node - node - (1 if counted == node else 0)
                node, counted = far.node, far.node - 1
                state, peak, certain_s, filled = far.state, far.peak, far.certain_s, far.filled
                continue
        frequency = 0.0 if rules.uniform else local_frequency(table, state.cos, state.sin)
        # after the record any length of step will do: nothing drives the block any more
        line = line_at(
            record, node, free_s, FREE_STEP_S if rules.uniform else rules.turn_max / frequency
        )
        if line.h * (1.0 - tau) <= 0.0:  # a jump of the record, or a start at an interval's end
            moving = not rules.sticks or state.rate != 0.0
            if moving:
                filled = append_history(history, filled, line.start_s, state.x, state.rate, node)
            node, tau, jumped = node + 1, 0.0, True
            continue
        if not past_record and node != counted:
            moved, counted = moved + 1, node
        if jumped:
            jumped = False
            broken, condition = broken_condition(table, state, line.a0, line.w0)
            if broken:
                stop = VIOLATED
                break
        crossing = cross_interval(
            rules, table, work.series, line, tau, frequency, state, peak, history, filled
        )
        state, peak, filled = crossing.state, crossing.peak, crossing.filled
        steps += crossing.steps
        tau, condition = crossing.tau, crossing.condition
        stop = stop_of(crossing.kind)
        if stop != GOES_ON:
            break
        if crossing.kind != PASSED:  # a standstill, or an impact that stops the block
            impacts += 1 if crossing.kind == IMPACT else 0
            moving, barred = not rules.sticks, state.sense
            stopped_s, certain_s = line.start_s + tau * line.h, math.nan
            filled = append_history(history, filled, stopped_s, state.x, 0.0, EVENT)
            # what is left of an interval of the record goes on from the same place
            if past_record:
                free_s, tau = free_s + tau * line.h, 0.0
            elif tau >= 1.0:
                node, tau = node + 1, 0.0
            continue
        tau = 0.0
        if past_record:
            free_s += line.h
        else:
            node += 1
        now_s = record.time_s[node] + free_s
        filled = append_history(
            history, filled, now_s, state.x, state.rate, EVENT if past_record else node
        )
        certain_s = certain_at(record, rules, state, node, past_record, now_s, certain_s)

    stop_s, end = ended(record, stop, line, Place(node, tau), free_s, state)
    return PhaseRun(
        stop, condition, stop_s, end, peak, started_s, stopped_s, certain_s, steps, moved, impacts,
        filled,
    )  # fmt: skip


@within
def ended(
    record: Nodes, stop: int, line: Line, place: Place, free_s: float, state: PhaseState
) -> tuple[float, Entry]:
    """Return the end of a phase, in the form in which another one is entered."""
    stop_s = line.start_s + place.fraction * line.h
    if stop == JUMPED:
        stop_s = time_of_jump(record.time_s, record.interval_s, record.w, record.last)
    elif place.interval >= record.last:
        # an interval of rest has no length of its own that another phase could go on in
        free_s += place.fraction * line.h
        place = Place(place.interval, 0.0)
    return stop_s, Entry(place, free_s, state.x, state.rate, state.error_x, state.error_rate)


@within
def certain_at(
    record: Nodes,
    rules: PhaseRules,
    state: PhaseState,
    node: int,
    past_record: bool,
    now_s: float,
    since_s: float,
) -> float:
    """Return :func:`certain_since` at a node, or after the record."""
    driving = harmonic_sum(rules.forward, DRIVING, state.cos, state.sin)
    resistance = harmonic_sum(rules.forward, RESISTANCE, state.cos, state.sin)
    # after the record k_h is zero for ever: the block goes on only if it has no strength left
    least_q = 0.0 if past_record else record.tail_min_q[node]
    return certain_since(since_s, now_s, state.rate, driving, resistance, least_q)


@within
def state_on_entry(rules: PhaseRules, entry: Entry) -> PhaseState:
    """Return the state in which a phase is entered."""
    cos, sin = 1.0, 0.0  # the harmonics of a constant: no cosine is taken that nothing depends on
    if not rules.uniform:
        cos, sin = math.cos(entry.x), math.sin(entry.x)
    sense = -1 if entry.rate < 0.0 else 1
    return PhaseState(entry.x, entry.rate, cos, sin, entry.error_x, entry.error_rate, sense, False)


@within
def jumps_after(record: Nodes, node: int) -> bool:
    """Return whether 1 + k_v falls to zero or below before the next node."""
    return node >= record.last and record.last < record.k_h.size - 1


@within
def thresholds(rules: PhaseRules, state: PhaseState) -> Thresholds:
    """Return the factors of both equations for a block at rest."""
    c, s = state.cos, state.sin
    # factors of zero: the acceleration in reverse is then zero, which starts nothing
    reverse_driving = 0.0
    reverse_resistance = 0.0
    if rules.in_reverse != NO_REVERSE:
        reverse_driving = harmonic_sum(rules.reverse, DRIVING, c, s)
        reverse_resistance = harmonic_sum(rules.reverse, RESISTANCE, c, s)
    return Thresholds(
        harmonic_sum(rules.forward, DRIVING, c, s),
        harmonic_sum(rules.forward, RESISTANCE, c, s),
        reverse_driving,
        reverse_resistance,
        rules.in_reverse != NO_REVERSE and state.x > rules.lowest,
    )


@within
def stop_at_rest(
    record: Nodes, rules: PhaseRules, state: PhaseState, line: Line, place: Place
) -> tuple[int, int]:
    """Return the reason why a phase ends at the end of a rest, or that it goes on, and the failed
    condition.
    """
    if state.sense == 0:
        return (JUMPED if jumps_after(record, place.interval) else AT_REST), 0
    # confined toppling: the heel leaves its plane, and another phase begins
    # (docs/theory/confined-toppling.md)
    if state.sense < 0 and rules.in_reverse == REVERSE_LEAVES:
        return REVERSE, 0
    table = rules.forward if state.sense > 0 else rules.reverse
    a = line.a0 + (line.a1 - line.a0) * place.fraction
    w = line.w0 + (line.w1 - line.w0) * place.fraction
    broken, condition = broken_condition(table, state, a, w)
    return (VIOLATED if broken else GOES_ON), condition


@within
def stop_of(kind: int) -> int:
    """Return the reason why a phase ends with an event, or that it goes on."""
    if kind == BROKEN:
        return VIOLATED
    if kind == AT_HIGHEST:
        return UPPER
    return LOWER if kind == AT_LOWEST else GOES_ON
