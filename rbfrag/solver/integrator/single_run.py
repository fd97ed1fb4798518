"""Kernel of the toppling block: one run over one record.

    moving: theta'' = p² [k_h cos(theta_c - theta) - (1 + k_v) sin(theta_c - theta)]   (4.2, 4.13)
    rest:   theta = theta' = 0 while k_h <= (1 + k_v) k_r

theta is the forward rotation about the toe; theta_c = atan(k_r). Events: lift-off (an upward
crossing of the threshold), impact (theta back to 0, without rebound; motion restarts at once if
the threshold is exceeded), and the verdict "irrecoverable". After the last sample the ground is
at rest and the verdict is closed-form, by energy.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from rbfrag.solver.excitation import BLOCK, Nodes
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.events import (
    examine_step,
    irrecoverable,
    keeps_direction,
    simple_turn,
    upright_rate,
)
from rbfrag.solver.integrator.one_freedom.state import noted
from rbfrag.solver.integrator.state import (
    State,
    at_rest,
    excitation_over,
    time_of_jump,
)
from rbfrag.solver.integrator.step import drift_of_step, exponential_bound, step_errors
from rbfrag.solver.integrator.taylor import even_parts, taylor_step, turn, value
from rbfrag.solver.results import FloatArray

STABLE, TOPPLED, UNDETERMINED, JUMP = 0, 1, 2, 3

PENDING = 4
"""Outcome of a run that is handed over before its end: its state is to be carried on."""

HANDED = np.dtype(
    [
        ("interval", "i8"), ("theta", "f8"), ("rate", "f8"), ("sin", "f8"), ("cos", "f8"),
        ("error", "f8"), ("drift", "f8"), ("peak", "f8"), ("peak_error", "f8"),
        ("started_s", "f8"), ("lost", "i8"), ("steps", "i8"), ("samples", "i8"),
        ("to_the_end", "i8"),
    ]
)  # fmt: skip
"""A run that moves at a node, as it is handed over. An interval below 0 means the beginning;
`to_the_end` above 0 that the run is not handed over again."""


class Run(NamedTuple):
    """What the kernel returns.

    `peak_rad` is NaN unless the block stays; times are NaN where nothing happened.
    """

    outcome: int
    peak_rad: float
    started_s: float
    verdict_s: float
    error_rad: float
    steps: int
    samples_moved: int
    history_length: int


class Block(NamedTuple):
    """A block, and how it is integrated.

    Args:
        kr: rocking acceleration coefficient k_r.
        theta_c: critical angle [rad].
        cos_rest: cosine of it.
        p: frequency parameter [1/s].
        order: degree of the Taylor step.
        ph_max: greatest p·h of one step.
    """

    kr: float
    theta_c: float
    cos_rest: float
    p: float
    order: int
    ph_max: float


class Known(NamedTuple):
    """What is known of a trajectory up to a place.

    Args:
        error: bound on |error of theta| + |error of theta'/p|.
        drift: closer bound on the error of theta alone, which times an impact.
        peak: greatest rotation so far [rad].
        peak_error: bound of its error [rad].
    """

    error: float
    drift: float
    peak: float
    peak_error: float


@inner_kernel
def next_lifting_node(
    q: FloatArray, block_max_q: FloatArray, start: int, stop: int, kr: float
) -> int:
    """First node in [start, stop) with q > kr, or `stop`; skips rest by block maxima."""
    i = start
    while i < stop:
        # a record is at rest most of the time: most of it is passed sixteen nodes at a time
        if i % BLOCK == 0 and block_max_q[i // BLOCK] <= kr:
            i += BLOCK
        elif q[i] > kr:
            return i
        else:
            i += 1
    return stop


@inner_kernel
def lift_off(nodes: Nodes, kr: float, i: int, tau: float, last: int) -> tuple[int, float, bool]:
    """Find where a block at rest at (i, tau) begins to move: k_h > (1 + k_v) k_r.

    Returns:
        Interval (`last` or beyond for never) and fraction; whether the threshold is crossed there
        from below, so that no impact is possible in the first step.
    """
    interval_s, k_h, w = nodes.interval_s, nodes.k_h, nodes.w
    while i < last:
        g0 = k_h[i] - w[i] * kr
        g1 = k_h[i + 1] - w[i + 1] * kr
        if interval_s[i] == 0.0 or (tau > 0.0 and g1 <= 0.0):
            # nothing lifts in no time, nor where k_h is falling back
            i += 1
            tau = 0.0
        elif tau > 0.0:  # at rest inside the interval, after an impact
            return i, min(max(tau, -g0 / (g1 - g0)), 1.0), True
        elif g0 > 0.0:
            return i, 0.0, False
        elif g1 > 0.0:
            return i, -g0 / (g1 - g0), True
        else:
            i = next_lifting_node(nodes.q, nodes.block_max_q, i + 2, last + 1, kr) - 1
    return i, 0.0, False


class Crossing(NamedTuple):
    """What the rest of an interval brought.

    Args:
        state: of the block at its end.
        known: of the trajectory.
        impact_at: fraction of the interval at which the block closes its contact, or -1; `state`
            then holds the rate of the impact.
        verdict_at: fraction at the end of the first step past which it has toppled, or -1.
        verdict_error: `known.error` there.
        steps: integration steps taken.
        filled: rows of the history that are filled.
    """

    state: State
    known: Known
    impact_at: float
    verdict_at: float
    verdict_error: float
    steps: int
    filled: int


@within
def cross_interval(
    nodes: Nodes,
    block: Block,
    i: int,
    tau: float,
    state: State,
    known: Known,
    lifting: bool,
    rows: FloatArray,
    filled: int,
    u: FloatArray,
) -> Crossing:
    """Integrate from (i, tau) to the end of the interval, or to an impact before it.

    Args:
        nodes: the excitation.
        tau: fraction of it to begin at.
        state: state of the block there.
        known: what is known of the trajectory.
        lifting: the threshold is being crossed from below: the first step holds no impact.
        rows: history to be filled with peaks; with one, the run goes on after the verdict.
        filled: how many rows are.
        u: work, shape (9,).
    """
    theta, rate, s, c = state
    error, drift, peak, peak_error = known
    order = block.order
    keeps = rows.shape[1] > 0
    impact_at = -1.0
    verdict_at = -1.0
    verdict_error = 0.0
    steps = 0
    # a step holds the truncation at rounding only up to ph_max (see `taylor.PH_MAX`)
    whole = block.p * (nodes.interval_s[i] * (1.0 - tau))
    parts, part, ph = even_parts(whole, 1.0 - tau, block.ph_max)
    for number in range(parts):
        at = tau + number * part
        shaking = excitation_over(nodes.k_h, nodes.w, i, at, part)
        steps += 1
        u_start = ph * rate
        # exact up to its truncation where k_h and k_v are straight lines: it ends at a kink
        turned, u_end, v_end = taylor_step(order, u, u_start, ph, s, c, shaking)
        theta_end = theta + turned

        highest = (u[order - 2], u[order - 1], u[order])
        growth, truncation, rounding = step_errors(
            order, ph, State(theta, rate, s, c), shaking, turned, highest
        )
        grown = math.exp(growth) if growth > 1.0 else exponential_bound(growth)
        # Gronwall: what was wrong at the start grows at most so, what the step adds is added
        error = error * grown + truncation + rounding
        drift += drift_of_step(ph, error, truncation, theta_end)

        if lifting:
            # a threshold exceeded by less than rounding may seem to pull the block back
            lifting = False
            if theta_end <= 0.0 or u_end <= 0.0:
                impact_at = at + part
        elif theta_end <= 0.0 or (
            not keeps_direction(u_start, u[1], u_end, v_end)
            and (
                keeps  # a history has all peaks
                or not simple_turn(theta, theta_end, u_start, u[1], u_end, v_end, peak, drift)
            )
        ):
            x, top, top_at, lowest = examine_step(theta, u, order, theta_end, u_end, v_end)
            if top > peak:
                peak = top
                peak_error = error
            if keeps and top > 0.0:
                top_s = nodes.time_s[i] + (at + part * top_at) * nodes.interval_s[i]
                filled = noted(rows, filled, top_s, top, 0.0, -1)
            # no rebound: theta' of the impact is lost, and matters for the error estimate only
            if x >= 0.0:
                impact_at = at + part * x
                rate = value(u, order, x) / ph
            elif lowest <= drift:
                # it may have touched after all, and lost the speed of the touch
                g0 = nodes.k_h[i] - nodes.w[i] * block.kr
                g1 = nodes.k_h[i + 1] - nodes.w[i + 1] * block.kr
                error += math.sqrt(2.0 * max(g0, g1, 0.0) * block.cos_rest * drift)
        if impact_at >= 0.0:
            break  # the rest of the interval begins anew, from rest
        theta = theta_end
        rate = u_end / ph
        s, c = turn(s, c, turned)
        # in a long interval the block could swing right round before its end
        between_nodes = number < parts - 1 and verdict_at < 0.0
        if between_nodes and s < 0.0 and irrecoverable(rate, s, c, nodes.tail_min_q[i], error):
            verdict_at = at + part
            verdict_error = error
            if not keeps:
                break
    return Crossing(
        State(theta, rate, s, c), Known(error, drift, peak, peak_error),
        impact_at, verdict_at, verdict_error, steps, filled,
    )  # fmt: skip


class Closed(NamedTuple):
    """What follows an impact, which closes the contact of the block.

    Args:
        known: of the trajectory.
        hidden: whether the error hides what comes then.
        moving: whether motion restarts at once.
    """

    known: Known
    hidden: bool
    moving: bool


@inner_kernel
def after_impact(
    nodes: Nodes, block: Block, i: int, tau: float, stuck: bool, known: Known, rate: float
) -> Closed:
    """Return what follows an impact at (i, tau).

    Args:
        nodes: the excitation.
        i: the interval.
        tau: fraction of it.
        stuck: whether the block has not moved since it was there last.
        known: what is known of the trajectory before it.
        rate: theta'/p of the impact.
    """
    # k_h - (1 + k_v) k_r, a straight line: at both ends of the interval, and here
    start = nodes.k_h[i] - nodes.w[i] * block.kr
    end = nodes.k_h[i + 1] - nodes.w[i + 1] * block.kr
    threshold = start + (end - start) * tau
    known, hidden = errors_after_impact(known, rate, threshold, block)
    # Stuck, the threshold is exceeded by less than rounding. A falling excitation leaves the block
    # at rest; a rising one starts it as an upward crossing does
    return Closed(known, hidden, end > start if stuck else threshold > 0.0 and tau < 1.0)


@within
def errors_after_impact(
    known: Known, rate: float, threshold: float, block: Block
) -> tuple[Known, bool]:
    """Carry the errors through an impact, which takes away theta' and with it its error.

    Args:
        known: what is known of the trajectory before it.
        rate: theta'/p of the impact.
        threshold: k_h - (1 + k_v) k_r there.

    Returns:
        What is known after it, and whether the error hides what comes then.
    """
    error, drift, peak, peak_error = known
    impact = abs(rate)
    push = max(threshold * block.cos_rest, 0.0)  # theta''/p² at theta = 0
    if impact <= 2.0 * error or impact * impact <= 4.0 * push * drift:
        # a graze: whether it touches at all is below the error, and if it does not it
        # keeps its speed
        error += impact + math.sqrt(2.0 * push * drift)
        return Known(error, drift, peak, peak_error), error > 0.25 * block.theta_c
    if threshold > 0.0:
        # motion restarts at once; only the error of its starting time is left
        late = 2.0 * drift / impact
        error = push * late
        return Known(error, error * late, peak, peak_error), False
    return Known(0.0, 0.0, peak, peak_error), False


@inner_kernel
def after_record(state: State, known: Known, theta_c: float) -> tuple[int, float, float]:
    """Return outcome, peak rotation and its error of free motion after the record, by energy."""
    error, _, peak, peak_error = known
    border = upright_rate(state.sin, state.cos)
    margin = state.rate - border
    # nearer to the border than the error: neither outcome is known
    if abs(margin) <= error:
        return UNDETERMINED, math.nan, error
    if margin > 0.0:
        return TOPPLED, math.nan, error
    if state.rate > 0.0:
        # 1 - cos is conserved up to the kinetic energy: sin²(x_top/2) = sin²(x/2) - rate²/4
        rest = math.sqrt((border - state.rate) * (border + state.rate))
        x_top = 2.0 * math.asin(0.5 * rest)
        if theta_c - x_top > peak:
            x = math.atan2(state.sin, state.cos)
            peak = theta_c - x_top
            peak_error = error * ((abs(math.sin(x)) + state.rate) / math.sin(x_top))
    return STABLE, peak, peak_error


@inner_kernel
def verdict(
    nodes: Nodes, last: int, lost: bool, moving: bool, state: State, known: Known, theta_c: float
) -> tuple[int, float, float, float]:
    """Return outcome, peak, time of the verdict and error of a run that reached node `last`."""
    n = nodes.k_h.size
    if last < n - 1:
        jump_s = time_of_jump(nodes.time_s, nodes.interval_s, nodes.w, last)
        return JUMP, math.nan, jump_s, known.error
    if lost:  # the block may be another one since an impact that the error hid
        return UNDETERMINED, math.nan, math.nan, known.error
    if not moving:
        return STABLE, known.peak, math.nan, known.peak_error
    outcome, peak, error = after_record(state, known, theta_c)
    return outcome, peak, math.nan if outcome == STABLE else nodes.time_s[n - 1], error


@within
def hand_over(
    run: Any,
    i: int,
    state: State,
    known: Known,
    started_s: float,
    lost: bool,
    steps: int,
    samples: int,
) -> None:
    """Put down a run that moves at node i; arguments as in `run_toppling`."""
    run.interval = i
    run.theta, run.rate, run.sin, run.cos = state
    run.error, run.drift, run.peak, run.peak_error = known
    run.started_s, run.lost, run.steps, run.samples = started_s, lost, steps, samples


@bare_kernel
def run_toppling(
    nodes: Nodes,
    kr: float,
    p: float,
    order: int,
    ph_max: float,
    rows: FloatArray,
    handed: np.ndarray,
    u: FloatArray,
) -> tuple[int, float, float, float, float, int, int, int]:
    """Run one block over one record; the fields of :class:`Run` in order.

    Args:
        nodes: the excitation.
        kr: rocking acceleration coefficient k_r.
        p: frequency parameter [1/s].
        order: degree of the Taylor step: 4, 5, 6 or 8.
        ph_max: greatest p·h of one step.
        rows: history to be filled with time, theta, theta' and node (-1 for an event between
            nodes), shape (4, m); (4, 0) for none. With one, the run goes on after the verdict until
            the block lies beyond 90 degrees.
        handed: of type HANDED, shape (1,) to go on from there and to hand over with PENDING as
            soon as the block moves at a node beyond; (0,) to run to the end.
        u: work, shape (9,).
    """
    time_s, interval_s = nodes.time_s, nodes.interval_s
    # nothing is integrated through a jump: the model ends at the last node in contact
    last = min(nodes.k_h.size, nodes.jump_node) - 1
    rest = at_rest(kr)
    block = Block(kr, math.atan(kr), rest.cos, p, order, ph_max)
    keeps = rows.shape[1] > 0
    filled = steps = samples = 0
    counted = entered = -1  # interval counted last; the one at which a run was taken over
    started_s, decided_s, decided_error = math.nan, math.nan, 0.0
    i, tau = 0, 0.0  # interval, and position inside it
    moving = False
    lifting = False  # starting at an upward crossing: no impact is possible in the first step
    lost = False  # whether an impact may as well have been a fall: the error hid the difference
    state, known = rest, Known(0.0, 0.0, 0.0, 0.0)
    hands_over = handed.size > 0 and handed[0].to_the_end == 0
    if handed.size > 0 and handed[0].interval >= 0:
        run = handed[0]
        i = entered = run.interval
        moving = True
        state = State(run.theta, run.rate, run.sin, run.cos)
        known = Known(run.error, run.drift, run.peak, run.peak_error)
        started_s, lost, steps, samples = run.started_s, run.lost > 0, run.steps, run.samples

    # only a history goes on after the verdict
    while i < last and (keeps or math.isnan(decided_s)):
        # only at a node and in motion: the batch knows plain steps of whole intervals alone
        if hands_over and moving and tau == 0.0 and not lifting and i > entered:
            hand_over(handed[0], i, state, known, started_s, lost, steps, samples)
            return PENDING, math.nan, started_s, math.nan, known.error, steps, samples, 0
        if not moving:
            i, tau, lifting = lift_off(nodes, kr, i, tau, last)
            if i >= last:
                break
            moving = True
            state = rest
            lifted_s = time_s[i] + tau * interval_s[i]
            if math.isnan(started_s):
                started_s = lifted_s
            filled = noted(rows, filled, lifted_s, 0.0, 0.0, -1)
        if interval_s[i] * (1.0 - tau) <= 0.0:
            # a jump, or a start at the very end of the interval: what follows decides
            moving = state.theta != 0.0 or state.rate != 0.0
            lifting = False
        else:
            # an impact and a new start in one interval count it once
            if i != counted:
                counted = i
                samples += 1
            state, known, impact_at, verdict_at, verdict_error, taken, filled = cross_interval(
                nodes, block, i, tau, state, known, lifting, rows, filled, u
            )
            steps += taken
            lifting = False
            if verdict_at >= 0.0 and math.isnan(decided_s):
                decided_s = time_s[i] + verdict_at * interval_s[i]
                decided_error = verdict_error
            if impact_at >= 0.0:
                stuck = impact_at <= tau
                tau = min(impact_at, 1.0)
                known, hidden, moving = after_impact(nodes, block, i, tau, stuck, known, state.rate)
                lost = lost or hidden
                filled = noted(rows, filled, time_s[i] + tau * interval_s[i], 0.0, 0.0, -1)
                state = rest
                lifting = stuck and moving
                if not moving and (stuck or tau >= 1.0):
                    i, tau = i + 1, 0.0
                continue
        i, tau = i + 1, 0.0
        theta, rate, s, c = state
        filled = noted(rows, filled, time_s[i], theta, rate * p, i)
        # a history shows the fall as far as the block lies on its face
        if not math.isnan(decided_s):
            if theta > block.theta_c + 0.5 * math.pi:
                break
        elif s < 0.0 and irrecoverable(rate, s, c, nodes.tail_min_q[i], known.error):
            decided_s = time_s[i]
            decided_error = known.error

    if not math.isnan(decided_s):
        return TOPPLED, math.nan, started_s, decided_s, decided_error, steps, samples, filled
    outcome, peak, verdict_s, error = verdict(
        nodes, last, lost, moving, state, known, block.theta_c
    )
    return outcome, peak, started_s, verdict_s, error, steps, samples, filled
