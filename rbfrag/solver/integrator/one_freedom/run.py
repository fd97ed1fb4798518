"""Kernel of a motion with one degree of freedom: one phase over one record.

The block rests, moves forward (x grows) or moves in reverse. Rest ends where the acceleration
that one of the two equations gives at rest has the sense of that equation; the crossing is located
inside the sample interval. Motion ends at a standstill (friction) or at a limit of x. Every event
is located to rounding on the polynomial of the step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rbfrag.solver.excitation import BLOCK
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.one_freedom.coast import EPSILON, coast, fill_uniform_conditions
from rbfrag.solver.integrator.one_freedom.step import (
    BRAKING,
    CONDITIONS,
    DRIVE,
    INERTIA,
    RESISTANCE,
    UNIFORM_ORDER,
    fill_step,
    first_standstill,
    first_violation,
    harmonic_slope,
    harmonic_sum,
    least_condition,
    rate_at,
    root_between,
    travel_at,
)
from rbfrag.solver.results import FloatArray

AT_REST, UPPER, LOWER, REVERSE, VIOLATED, JUMPED, ENDLESS = range(7)
"""Why the kernel stopped."""

NO_REVERSE, REVERSE_MOVES, REVERSE_LEAVES = range(3)
"""What the onset of motion in reverse means."""

CALM = 1e-12
"""Margin of a threshold by which a whole block of nodes must fall short of it to be passed over."""

FREE_STEPS_MAX = 100_000
"""Steps after the record before a motion that does not end is given up."""

TURN_OF_ORDER_5, TURN_OF_ORDER_6 = 0.012, 0.03
"""Steps, in units of the block's own time, whose truncation at these orders is below rounding."""

SLOW = 1e-4
"""Size of the last two terms of a series, over its first three, at which a step is halved."""

SPLITS_MAX = 40
"""Halvings of a step whose series does not converge."""


class PhaseRun(NamedTuple):
    """What the kernel returns; times are NaN where nothing happened."""

    code: int
    condition: int
    node: int
    tau: float
    free_s: float
    time_s: float
    x: float
    rate: float
    peak: float
    started_s: float
    stopped_s: float
    certain_s: float
    error_x: float
    error_rate: float
    peak_error: float
    steps: int
    samples_moved: int
    seatings: int
    history_length: int


@kernel
def calm_between(
    f_drive: float, f_resist: float, r_drive: float, r_resist: float, may_reverse: bool
) -> tuple[float, float]:
    """Return bounds of k_h/(1 + k_v) between which a block certainly stays at rest."""
    above = -math.inf
    below = -math.inf
    if f_drive > 0.0 and f_resist > 0.0:
        above = f_resist / f_drive * (1.0 - CALM)
    if may_reverse:
        below = math.inf
        if r_drive > 0.0 and r_resist < 0.0:
            below = r_resist / r_drive * (1.0 - CALM)
    return above, below


@kernel
def run_phase(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    block_min_q: FloatArray,
    jump_node: int,
    forward: FloatArray,
    reverse: FloatArray,
    sticks: bool,
    in_reverse: int,
    lowest: float,
    highest: float,
    seats: bool,
    node: int,
    tau: float,
    free_s: float,
    x: float,
    rate: float,
    error_x: float,
    error_rate: float,
    highest_order: int,
    turn_max: float,
    history: FloatArray,
) -> tuple[
    int, int, int, float, float, float, float, float, float, float, float, float, float, float,
    float, int, int, int, int,
]:  # fmt: skip
    """Run one phase; the fields of :class:`PhaseRun` in order.

    Args:
        time_s: node times [s], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g].
        w: 1 + k_v at the nodes.
        tail_min_q: least k_h/(1 + k_v) from each node on, rest after the record included.
        block_max_q: greatest k_h/(1 + k_v) of each block of `BLOCK` nodes.
        block_min_q: least of it.
        jump_node: first node with 1 + k_v <= 0, or n.
        forward: table of the equation of forward motion, or of all motion if not `sticks`.
        reverse: table of the equation of motion in reverse.
        sticks: whether friction holds the block at a standstill.
        in_reverse: `NO_REVERSE`, `REVERSE_MOVES` or `REVERSE_LEAVES`.
        lowest: least x.
        highest: greatest x.
        seats: whether the block comes to rest at `lowest` instead of leaving the phase.
        node: interval that the phase is entered in.
        tau: position inside that interval, 0 to 1.
        free_s: time after the record at the entry [s].
        x: position at the entry.
        rate: rate at the entry [1/s].
        error_x: error of the position at the entry.
        error_rate: error of the rate at the entry.
        highest_order: degree of a step; `UNIFORM_ORDER` where the equation is the same everywhere.
            Short steps, that need no more, take a lower one.
        turn_max: greatest step in units of the block's own time.
        history: shape (4, m) to be filled with time, x, x' and node (-1 for an event between
            nodes); (4, 0) for none.
    """
    n = k_h.size
    last = min(n, jump_node) - 1
    room = history.shape[1]
    filled = 0
    u = np.empty(highest_order + 1)
    work = np.empty((7, highest_order + 1))
    uniform = highest_order == UNIFORM_ORDER
    order = highest_order
    conditions = np.empty(((forward.shape[0] - CONDITIONS) // 3 if uniform else 0, 3))
    conditions_of = 0

    peak = x
    peak_error = error_x
    started_s = math.nan
    stopped_s = math.nan
    certain_s = math.nan
    steps = 0
    moved = 0
    seatings = 0
    counted = -1
    free_steps = 0
    code = -1
    condition = 0

    moving = rate != 0.0 or not sticks
    sense = -1 if rate < 0.0 else 1
    just_lifted = False  # started where the acceleration is zero
    barred = 0  # sense in which the block has just come to a standstill: not resumed at once
    inspect = False  # accelerations have jumped: conditions must be looked at anew
    f_drive = f_resist = r_drive = r_resist = 0.0
    c = 1.0
    s = 0.0
    if not uniform:
        c = math.cos(x)
        s = math.sin(x)
    settled = False  # thresholds at the present position are known
    base_s = time_s[0]
    h = 0.0

    while code < 0:
        free = node >= last
        if free and last < n - 1:
            code = JUMPED
            break
        if free:
            a0, a1, w0, w1 = 0.0, 0.0, 1.0, 1.0
            h = 1.0
            base_s = time_s[n - 1] + free_s
        else:
            base_s = time_s[node]
            a0, a1, w0, w1 = k_h[node], k_h[node + 1], w[node], w[node + 1]
            h = interval_s[node]

        if not moving:
            if not settled:
                settled = True
                f_drive = harmonic_sum(forward, DRIVE, c, s)
                f_resist = harmonic_sum(forward, RESISTANCE, c, s)
                if in_reverse != NO_REVERSE:
                    r_drive = harmonic_sum(reverse, DRIVE, c, s)
                    r_resist = harmonic_sum(reverse, RESISTANCE, c, s)
            may_reverse = in_reverse != NO_REVERSE and x > lowest
            f0 = f_drive * a0 - f_resist * w0
            f1 = f_drive * a1 - f_resist * w1
            r0 = r_drive * a0 - r_resist * w0
            r1 = r_drive * a1 - r_resist * w1
            if tau > 0.0:
                f0 += (f1 - f0) * tau
                r0 += (r1 - r0) * tau
            if h == 0.0:  # nothing starts in no time
                node += 1
                tau = 0.0
                barred = 0
                continue
            start = 2.0
            just_lifted = False
            if f0 > 0.0 and barred != 1:
                start = tau
                sense = 1
            elif may_reverse and r0 < 0.0 and barred != -1:
                start = tau
                sense = -1
            else:
                if f1 > 0.0 and f1 > f0:
                    start = tau + (1.0 - tau) * max(-f0, 0.0) / (f1 - f0)
                    sense = 1
                    just_lifted = True
                if may_reverse and r1 < 0.0 and r1 < r0:
                    other = tau + (1.0 - tau) * max(r0, 0.0) / (r0 - r1)
                    if other < start:
                        start = other
                        sense = -1
                        just_lifted = True
            barred = 0
            if start > 1.0:
                if free:
                    code = AT_REST
                    break
                node += 1
                tau = 0.0
                # rest costs one comparison a sample, or one a block of samples
                above, below = calm_between(f_drive, f_resist, r_drive, r_resist, may_reverse)
                while node < last:
                    if (node + 1) % BLOCK == 0 and node + BLOCK <= last:
                        block = (node + 1) // BLOCK
                        if block_max_q[block] < above and block_min_q[block] > below:
                            node += BLOCK
                            continue
                    if f_drive * k_h[node + 1] > f_resist * w[node + 1]:
                        break
                    if may_reverse and r_drive * k_h[node + 1] < r_resist * w[node + 1]:
                        break
                    node += 1
                continue
            tau = min(start, 1.0)
            table = forward if sense > 0 else reverse
            moment_s = base_s + tau * h
            if sense < 0 and in_reverse == REVERSE_LEAVES:
                code = REVERSE
                break
            least, condition = least_condition(
                table, c, s, 0.0, a0 + (a1 - a0) * tau, w0 + (w1 - w0) * tau
            )
            if least <= 0.0:
                code = VIOLATED
                if math.isnan(started_s):
                    started_s = moment_s
                break
            moving = True
            rate = 0.0
            error_rate = 0.0
            if math.isnan(started_s):
                started_s = moment_s
            if filled < room:
                history[0, filled] = moment_s
                history[1, filled] = x
                history[2, filled] = 0.0
                history[3, filled] = -1.0
                filled += 1

        table = forward if sense > 0 or not sticks else reverse
        if uniform and not free and tau == 0.0 and not inspect and rate * sense > 0.0:
            if conditions_of != sense:
                conditions_of = sense
                fill_uniform_conditions(table, conditions)
            before = node
            node, x, rate, error_x, error_rate, peak, peak_error, certain_s, filled = coast(
                time_s, interval_s, k_h, w, tail_min_q, table, conditions,
                forward[DRIVE, 0], forward[RESISTANCE, 0], lowest, highest, node, last,
                x, rate, error_x, error_rate, peak, peak_error, certain_s, history, filled,
            )  # fmt: skip
            if node > before:
                steps += node - before
                moved += node - before - (1 if counted == before else 0)
                counted = node - 1
                continue
        inertia = table[INERTIA, 0]
        own = 0.0
        if not uniform:
            inertia = harmonic_sum(table, INERTIA, c, s)
            pull = abs(harmonic_sum(table, DRIVE, c, s))
            hold = abs(harmonic_sum(table, RESISTANCE, c, s))
            own = math.sqrt((pull + hold) / max(abs(inertia), 1e-300))
        if free:
            # any length will do: nothing drives the block any more
            h = turn_max / own if not uniform else 0.1
            free_steps += 1
            if free_steps > FREE_STEPS_MAX:
                code = ENDLESS
                break
        left = h * (1.0 - tau)
        if left <= 0.0:
            if sticks and rate == 0.0:
                moving = False
            elif filled < room:
                history[0, filled] = base_s
                history[1, filled] = x
                history[2, filled] = rate
                history[3, filled] = node
                filled += 1
            node += 1
            tau = 0.0
            inspect = True
            continue
        if not free and node != counted:
            counted = node
            moved += 1
        if inspect:
            inspect = False
            least, condition = least_condition(table, c, s, rate, a0, w0)
            if least <= 0.0:
                code = VIOLATED
                break

        pieces = 1
        if not uniform:
            turn = max(own, 2.0 * abs(rate)) * left
            pieces = max(1, math.ceil(turn / turn_max))
            order = highest_order
            if turn < TURN_OF_ORDER_5:
                order = min(order, 5)
            elif turn < TURN_OF_ORDER_6:
                order = min(order, 6)
        start_tau = tau
        part = (1.0 - tau) / pieces
        piece = 0
        splits = 0
        standing = False
        while piece < pieces:
            at = start_tau + piece * part
            step_s = part * h
            ab = a0 + (a1 - a0) * at
            wb = w0 + (w1 - w0) * at
            da = (a1 - a0) * part
            dw = (w1 - w0) * part
            u[0] = step_s * rate
            fill_step(table, u, work, order, c, s, step_s, ab, da, wb, dw)
            steps += 1
            travel = travel_at(u, order, 1.0)
            truncation = 0.0
            if not uniform:
                last_terms = abs(u[order]) + abs(u[order - 1])
                if last_terms > SLOW * (abs(u[0]) + abs(u[1]) + abs(u[2])) and splits < SPLITS_MAX:
                    # the state changes faster than its own time says, near inertia = 0
                    splits += 1
                    start_tau = at
                    order = highest_order
                    pieces = 2 * (pieces - piece)
                    piece = 0
                    part = (1.0 - start_tau) / pieces
                    continue
                # the first two terms left out follow from these two as those did from earlier ones
                ratio = 64.0 * (own * own + 4.0 * rate * rate) * step_s * step_s
                truncation = min(1.0, ratio / (order * (order + 1))) * last_terms / order

            # leading zeros: the block starts from rest, or where the acceleration is zero too
            first = 0
            if rate == 0.0:
                first = 1
                if just_lifted:
                    u[1] = 0.0
                    first = 2
                just_lifted = False
            # a start that rounding turns into the other sense is none
            standstill = 0.0
            if u[first] * sense > 0.0 or not sticks:
                standstill = first_standstill(u, first, order)
            end = min(standstill, 1.0)
            reached = x + travel_at(u, order, end) if end < 1.0 else x + travel
            event = 0
            if standstill <= 1.0:
                event = 1
            if not sticks and event == 1 and lowest <= reached <= highest:
                # without friction the block turns and goes on
                if reached > peak:
                    peak = reached
                    peak_error = error_x
                if filled < room:
                    history[0, filled] = base_s + (at + part * end) * h
                    history[1, filled] = reached
                    history[2, filled] = 0.0
                    history[3, filled] = -1.0
                    filled += 1
                event = 0
                turned_at = end
                end = 1.0
                reached = x + travel
                if reached > highest:
                    end = root_between(u, 0, order, 0, highest - x, turned_at, 1.0)
                    event = 2
                elif reached < lowest:
                    end = root_between(u, 0, order, 0, lowest - x, turned_at, 1.0)
                    event = 3
            if event < 2 and reached > highest:
                end = root_between(u, 0, order, 0, highest - x, 0.0, end)
                event = 2
            elif event < 2 and reached < lowest:
                end = root_between(u, 0, order, 0, lowest - x, 0.0, end)
                event = 3

            # errors: those of the start carried on by the linearised equation, and the new ones
            slope = 0.0
            drag = 0.0
            if not uniform:
                inertia = harmonic_sum(table, INERTIA, c, s)
                acceleration = u[1] / (step_s * step_s)
                slope = abs(
                    harmonic_slope(table, DRIVE, c, s) * ab
                    - harmonic_slope(table, RESISTANCE, c, s) * wb
                    - harmonic_slope(table, BRAKING, c, s) * rate * rate
                    - harmonic_slope(table, INERTIA, c, s) * acceleration
                ) / abs(inertia)
                drag = abs(2.0 * harmonic_sum(table, BRAKING, c, s) * rate / inertia)
            span = end * step_s
            pull = slope * error_x + drag * error_rate
            error_x += span * (error_rate + 0.5 * span * pull)
            error_rate += span * (pull + 0.5 * span * (slope * error_rate + drag * pull))
            error_x += truncation + EPSILON * (2.0 * abs(reached) + abs(u[0]))
            if step_s > 0.0:
                error_rate += order * truncation / step_s
                error_rate += EPSILON * (2.0 * abs(rate) + 4.0 * own * own * span)
                if uniform:
                    error_rate += 4.0 * EPSILON * (abs(u[1]) + abs(u[2])) / step_s

            # conditions at the end of the stretch
            if end > 0.0:
                rate_end = rate_at(u, 0, order, end) / step_s
                if event == 1:
                    rate_end = 0.0
                c_end = c
                s_end = s
                if not uniform:
                    c_end = math.cos(reached if event < 2 else x + travel_at(u, order, end))
                    s_end = math.sin(reached if event < 2 else x + travel_at(u, order, end))
                least, condition = least_condition(
                    table, c_end, s_end, rate_end, ab + da * end, wb + dw * end
                )
                if least <= 0.0:
                    end, condition = first_violation(
                        table, u, order, x, step_s, ab, da, wb, dw, end
                    )
                    code = VIOLATED
                    tau = at + part * end
                    rate = rate_at(u, 0, order, end) / step_s
                    x += travel_at(u, order, end)
                    if x > peak:
                        peak = x
                        peak_error = error_x
                    break
                c = c_end
                s = s_end
                if event == 2:
                    x = highest
                elif event == 3:
                    x = lowest
                else:
                    x = reached
                rate = rate_end
            tau = at + part * end
            if x > peak:
                peak = x
                peak_error = error_x
            if event == 2:
                code = UPPER
                break
            if event == 3:
                if not seats:
                    code = LOWER
                    break
                rate = 0.0
                error_x = 0.0
                standing = True
                seatings += 1
                barred = -1
                break
            if event == 1:
                rate = 0.0
                standing = True
                barred = sense
                break
            piece += 1

        if code >= 0:
            break
        if standing:
            stopped_s = base_s + tau * h
            settled = False
            moving = not sticks
            error_rate = 0.0
            certain_s = math.nan
            if filled < room:
                history[0, filled] = stopped_s
                history[1, filled] = x
                history[2, filled] = 0.0
                history[3, filled] = -1.0
                filled += 1
            if free:
                free_s += tau * h
                tau = 0.0
            elif tau >= 1.0:
                node += 1
                tau = 0.0
            continue
        tau = 0.0
        if free:
            free_s += h
            base_s = time_s[n - 1] + free_s
        else:
            node += 1
            base_s = time_s[node]
        if filled < room:
            history[0, filled] = base_s
            history[1, filled] = x
            history[2, filled] = rate
            history[3, filled] = -1.0 if free else node
            filled += 1
        least_q = 0.0 if free else tail_min_q[node]
        pull = harmonic_sum(forward, DRIVE, c, s)
        if rate > 0.0 and pull > 0.0 and pull * least_q > harmonic_sum(forward, RESISTANCE, c, s):
            if math.isnan(certain_s):
                certain_s = base_s
        else:
            certain_s = math.nan

    moment_s = base_s + tau * h
    if node >= last and code != JUMPED:
        # a free interval has no length of its own that another phase could go on in
        free_s += tau * h
        tau = 0.0
    if code == JUMPED:
        moment_s = time_s[0]
        if last >= 0:
            moment_s = time_s[last] + interval_s[last] * w[last] / (w[last] - w[last + 1])
    return (
        code, condition, node, tau, free_s, moment_s, x, rate, peak, started_s, stopped_s,
        certain_s, error_x, error_rate, peak_error, steps, moved, seatings, filled,
    )  # fmt: skip
