"""Whole sample intervals of a motion whose equation does not depend on position.

The acceleration is then a straight line between samples, the rate a parabola and x a cubic: an
interval takes a few operations. What may stop the block, bring it to a limit or break a contact
is left to the kernel of the phase, which looks into the interval.
"""

from __future__ import annotations

from typing import NamedTuple

from rbfrag.solver.excitation import Nodes
from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.one_freedom.state import (
    PhaseRules,
    PhaseState,
    PhaseWork,
    certain_since,
)
from rbfrag.solver.integrator.one_freedom.step import (
    CONDITIONS,
    DRIVING,
    EPSILON,
    INERTIA,
    RESISTANCE,
    harmonic_sum,
    uniform_terms,
)
from rbfrag.solver.integrator.state import Peak, append_history, higher
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
