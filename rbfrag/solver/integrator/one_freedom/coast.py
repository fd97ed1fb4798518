"""Whole sample intervals of a motion whose equation is the same everywhere.

The acceleration is then a straight line between samples, the rate a parabola and x a cubic: an
interval takes a few operations. What may stop the block, bring it to a limit or break a contact
is left to the kernel of the phase, which looks into the interval.
"""

from __future__ import annotations

import math

from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.one_freedom.step import (
    CONDITIONS,
    DRIVE,
    INERTIA,
    RESISTANCE,
    harmonic_sum,
    uniform_terms,
)
from rbfrag.solver.results import FloatArray

EPSILON = 2.220446049250313e-16

NEAR_STANDSTILL = 1e-9
"""Least rate within an interval, over that at its start, that is told from a standstill here."""


@kernel
def fill_uniform_conditions(table: FloatArray, conditions: FloatArray) -> None:
    """Fill the factors of k_h, 1 + k_v and x'^2 in each condition, shape (conditions, 3)."""
    for n in range(conditions.shape[0]):
        for part in range(3):
            row = CONDITIONS + 3 * n + part
            conditions[n, part] = harmonic_sum(table, row, 1.0, 0.0)
        conditions[n, 2] += table[CONDITIONS + 3 * n + 2, 5]


@kernel
def coast(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    tail_min_q: FloatArray,
    table: FloatArray,
    conditions: FloatArray,
    pull: float,
    hold: float,
    lowest: float,
    highest: float,
    node: int,
    last: int,
    x: float,
    rate: float,
    error_x: float,
    error_rate: float,
    peak: float,
    peak_error: float,
    certain_s: float,
    history: FloatArray,
    filled: int,
) -> tuple[int, float, float, float, float, float, float, float, int]:
    """Follow a moving block over whole intervals, up to one in which something may happen.

    Args:
        time_s: node times [s].
        interval_s: interval lengths [s].
        k_h: driving acceleration at the nodes [g].
        w: 1 + k_v at the nodes.
        tail_min_q: least k_h/(1 + k_v) from each node on.
        table: coefficients of the equation of the present sense.
        conditions: as :func:`fill_uniform_conditions` makes them of `table`.
        pull: factor of k_h in the equation of forward motion.
        hold: factor of 1 + k_v in it.
        lowest: least x.
        highest: greatest x.
        node: interval to start with, from its beginning.
        last: last node.
        x: position.
        rate: its rate, not zero.
        error_x: error of the position.
        error_rate: error of the rate.
        peak: greatest x so far.
        peak_error: its error.
        certain_s: time from which nothing turns the motion back; NaN while it may be.
        history: as for the kernel of the phase.
        filled: columns of it that are filled.

    Returns:
        node, x, rate, error_x, error_rate, peak, peak_error, certain_s and filled.
    """
    room = history.shape[1]
    inertia = table[INERTIA, 0]
    drive = table[DRIVE, 0]
    resistance = table[RESISTANCE, 0]
    while node < last:
        h = interval_s[node]
        if h <= 0.0:
            break
        a0, a1, w0, w1 = k_h[node], k_h[node + 1], w[node], w[node + 1]
        u0 = h * rate
        u1, u2 = uniform_terms(inertia, drive, resistance, h, a0, a1 - a0, w0, w1 - w0)
        u_end = u2 + u1 + u0
        if not u_end * u0 > 0.0:
            break
        if u1 * u0 < 0.0 and (u1 + 2.0 * u2) * u0 > 0.0:
            least = u0 - 0.25 * u1 * u1 / u2
            if not least * u0 > NEAR_STANDSTILL * u0 * u0:
                break
        reached = x + (u2 / 3.0 + u1 / 2.0 + u0)
        if reached > highest or reached < lowest:
            break
        rate_end = u_end / h
        holds = True
        for n in range(conditions.shape[0]):
            margin = conditions[n, 0] * a1 + conditions[n, 1] * w1
            if margin + conditions[n, 2] * rate_end * rate_end <= 0.0:
                holds = False
        if not holds:
            break
        error_x += h * error_rate
        error_x += EPSILON * (2.0 * abs(reached) + abs(u0))
        error_rate += EPSILON * (2.0 * abs(rate))
        error_rate += 4.0 * EPSILON * (abs(u1) + abs(u2)) / h
        x = reached
        rate = rate_end
        if x > peak:
            peak = x
            peak_error = error_x
        node += 1
        if filled < room:
            history[0, filled] = time_s[node]
            history[1, filled] = x
            history[2, filled] = rate
            history[3, filled] = node
            filled += 1
        if rate > 0.0 and pull > 0.0 and pull * tail_min_q[node] > hold:
            if math.isnan(certain_s):
                certain_s = time_s[node]
        else:
            certain_s = math.nan
    return node, x, rate, error_x, error_rate, peak, peak_error, certain_s, filled
