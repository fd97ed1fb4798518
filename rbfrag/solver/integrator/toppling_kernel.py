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
from typing import NamedTuple

from rbfrag.solver.excitation import BLOCK, Nodes
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.events import (
    Thresholds,
    depart,
    eventful,
    examine_step,
    irrecoverable,
    left_at_turn,
    upright_rate,
)
from rbfrag.solver.integrator.state import (
    EVENT,
    Corner,
    Peak,
    Place,
    State,
    append_history,
    excitation_over,
    higher,
    kernel_corner,
    time_of_jump,
)
from rbfrag.solver.integrator.taylor import (
    StepRules,
    drift_of_step,
    even_parts,
    exponential_bound,
    state_after,
    take_step,
    value,
)
from rbfrag.solver.results import FloatArray

STABLE, TOPPLED, UNDETERMINED, JUMP = 0, 1, 2, 3


class Run(NamedTuple):
    """Result of a run.

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


class TrajectoryBounds(NamedTuple):
    """Error bounds and peak of a trajectory up to its present position.

    Args:
        error: bound on |error of theta| + |error of theta'/p|.
        drift: closer bound on the error of theta alone, which times an impact.
        peak: greatest rotation so far [rad], and the bound of its error.
    """

    error: float
    drift: float
    peak: Peak


class Progress(NamedTuple):
    """Progress of a run: at a node, where it may be interrupted and resumed, or at its end.

    Args:
        node: the node; the last one of the record, or that of the verdict, at the end.
        moving: whether the block is off its base.
        state: of the block.
        bounds: of the trajectory so far.
        started_s: first motion [s], NaN for none.
        is_hidden: True after an impact within the error bound: what follows it is unknown.
        steps: integration steps so far.
        samples: sample intervals in which the block moved.
        decided_s: when toppling was certain [s], NaN as long as it is not.
        decided_error: `bounds.error` at that time.
        filled: columns of the history that are filled.
    """

    node: int
    moving: bool
    state: State
    bounds: TrajectoryBounds
    started_s: float
    is_hidden: bool
    steps: int
    samples: int
    decided_s: float
    decided_error: float
    filled: int


@within
def state_at_rest(corner: Corner) -> State:
    """Return the state of rest, where psi is the critical angle."""
    return State(0.0, 0.0, corner.sin, corner.cos)


@within
def beginning(corner: Corner) -> Progress:
    """Return the progress of a run at the beginning of its record."""
    bounds = TrajectoryBounds(0.0, 0.0, Peak(0.0, 0.0))
    return Progress(
        0, False, state_at_rest(corner), bounds, math.nan, False, 0, 0, math.nan, 0.0, 0
    )


@inner_kernel
def next_lifting_node(
    q: FloatArray, block_max_q: FloatArray, start: int, stop: int, kr: float
) -> int:
    """Return the first node in [start, stop) with q > kr, or `stop`; rest is skipped by block
    maxima.
    """
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


class ArcEnd(NamedTuple):
    """Result of the remainder of an interval.

    Args:
        state: of the block at its end.
        bounds: of the trajectory.
        impact_at: fraction of the interval at which the block closes its contact, or -1; `state`
            then holds the rate of the impact.
        verdict_at: fraction at the end of the first step past which it has toppled, or -1.
        verdict_error: `bounds.error` at that time.
        steps: integration steps taken.
        filled: columns of the history that are filled.
    """

    state: State
    bounds: TrajectoryBounds
    impact_at: float
    verdict_at: float
    verdict_error: float
    steps: int
    filled: int


@within
def cross_interval(
    nodes: Nodes,
    corner: Corner,
    rules: StepRules,
    place: Place,
    state: State,
    bounds: TrajectoryBounds,
    lifting: bool,
    rows: FloatArray,
    filled: int,
    u: FloatArray,
) -> ArcEnd:
    """Integrate from a place to the end of its interval, or to an impact before it.

    Args:
        nodes: the excitation.
        place: where to begin.
        state: state of the block there.
        bounds: what is known of the trajectory.
        lifting: the threshold is being crossed from below: the first step holds no impact.
        rows: history to be filled with peaks; with one, the run goes on after the verdict.
        filled: how many of its columns are.
        u: work, shape (9,).
    """
    error, drift, peak = bounds
    i, tau = place.interval, place.fraction
    order = rules.order
    keeps = rows.shape[1] > 0
    impact_at = -1.0
    verdict_at = -1.0
    verdict_error = 0.0
    steps = 0
    # Invariant of the loop: |error of theta| + |error of theta'/p| <= error, |error of theta|
    # <= drift. The first bounds the outcome, the second, which is closer, the time of an impact

    # a step holds the truncation at rounding only up to ph_max (see `taylor.PH_MAX`)
    total = corner.p * (nodes.interval_s[i] * (1.0 - tau))
    parts, part, ph = even_parts(total, 1.0 - tau, rules.ph_max)
    for number in range(parts):
        at = tau + number * part
        step = take_step(order, u, ph, state, excitation_over(nodes.k_h, nodes.w, i, at, part))
        steps += 1
        grown = math.exp(step.growth) if step.growth > 1.0 else exponential_bound(step.growth)
        # Gronwall: what was wrong at the start grows at most so, what the step adds is added
        error = error * grown + step.truncation + step.rounding
        drift += drift_of_step(ph, error, step.theta)
        if lifting:
            # a threshold exceeded by less than rounding may seem to pull the block back
            lifting = False
            if step.theta <= 0.0 or step.u_end <= 0.0:
                impact_at = at + part
        elif eventful(
            state.theta, step.theta, step.u_start, step.v_start, step.u_end, step.v_end,
            # a history has all peaks
            -1.0 if keeps else peak.x, math.inf if keeps else drift,
        ):  # fmt: skip
            inside = examine_step(state.theta, u, order, step.theta, step.u_end, step.v_end)
            peak = higher(peak, inside.peak, error)
            if keeps and inside.peak > 0.0:
                top_s = nodes.time_s[i] + (at + part * inside.peak_at) * nodes.interval_s[i]
                filled = append_history(rows, filled, top_s, inside.peak, 0.0, EVENT)
            # no rebound: theta' of the impact is lost, and matters for the error estimate only
            if inside.impact >= 0.0:
                impact_at = at + part * inside.impact
                state = State(0.0, value(u, order, inside.impact) / ph, corner.sin, corner.cos)
            elif inside.lowest <= drift:
                # it may have touched after all, and lost the speed of the touch
                g0 = nodes.k_h[i] - nodes.w[i] * corner.kr
                g1 = nodes.k_h[i + 1] - nodes.w[i + 1] * corner.kr
                error += math.sqrt(2.0 * max(g0, g1, 0.0) * corner.cos * drift)
        if impact_at >= 0.0:
            break  # the rest of the interval begins again, from rest
        state = state_after(state, step, ph)
        # in a long interval the block could swing right round before its end
        if (
            number < parts - 1
            and verdict_at < 0.0
            and state.sin < 0.0
            and irrecoverable(state.rate, state.sin, state.cos, nodes.tail_min_q[i], error)
        ):
            verdict_at = at + part
            verdict_error = error
            if not keeps:
                break
    bounds = TrajectoryBounds(error, drift, peak)
    return ArcEnd(state, bounds, impact_at, verdict_at, verdict_error, steps, filled)


@within
def errors_after_impact(
    bounds: TrajectoryBounds, rate: float, threshold: float, corner: Corner
) -> tuple[TrajectoryBounds, bool]:
    """Carry the errors through an impact, which sets theta' to zero and with it its error.

    Args:
        bounds: what is known of the trajectory before it.
        rate: theta'/p of the impact.
        threshold: k_h - (1 + k_v) k_r there.

    Returns:
        What is known after it, and whether the error hides what comes then.
    """
    error, drift, peak = bounds
    impact = abs(rate)
    push = max(threshold * corner.cos, 0.0)  # theta''/p² at theta = 0
    if impact <= 2.0 * error or impact * impact <= 4.0 * push * drift:
        # a graze: whether it touches at all is below the error, and if it does not it
        # keeps its speed
        error += impact + math.sqrt(2.0 * push * drift)
        return TrajectoryBounds(error, drift, peak), error > 0.25 * corner.theta_c
    if threshold > 0.0:
        # motion restarts at once; only the error of its starting time is left
        late = 2.0 * drift / impact
        error = push * late
        return TrajectoryBounds(error, error * late, peak), False
    return TrajectoryBounds(0.0, 0.0, peak), False


@inner_kernel
def after_record(
    state: State, bounds: TrajectoryBounds, theta_c: float
) -> tuple[int, float, float]:
    """Return outcome, peak rotation and its error of free motion after the record, by energy."""
    error = bounds.error
    border = upright_rate(state.sin, state.cos)
    margin = state.rate - border
    # nearer to the border than the error: neither outcome is known
    if abs(margin) <= error:
        return UNDETERMINED, math.nan, error
    if margin > 0.0:
        return TOPPLED, math.nan, error
    peak = bounds.peak
    if state.rate > 0.0:
        x_top = left_at_turn(border, state.rate)
        x = math.atan2(state.sin, state.cos)
        top_error = error * ((abs(math.sin(x)) + state.rate) / math.sin(x_top))
        peak = higher(peak, theta_c - x_top, top_error)
    return STABLE, peak.x, peak.error


@inner_kernel
def end_of_run(nodes: Nodes, corner: Corner, progress: Progress) -> Run:
    """Return the result of a run that has reached its end."""
    bounds, decided_s = progress.bounds, progress.decided_s
    outcome, peak, error = TOPPLED, math.nan, progress.decided_error
    if math.isnan(decided_s):
        error = bounds.error
        if nodes.last < nodes.k_h.size - 1:
            outcome = JUMP
            decided_s = time_of_jump(nodes.time_s, nodes.interval_s, nodes.w, nodes.last)
        elif progress.is_hidden:  # a graze within the error bound: two trajectories may follow it
            outcome = UNDETERMINED
        elif progress.moving:
            outcome, peak, error = after_record(progress.state, bounds, corner.theta_c)
            decided_s = math.nan if outcome == STABLE else nodes.time_s[nodes.last]
        else:
            outcome, peak, error = STABLE, bounds.peak.x, bounds.peak.error
    return Run(
        outcome, peak, progress.started_s, decided_s, error, progress.steps, progress.samples,
        progress.filled,
    )  # fmt: skip


@inner_kernel
def advance(
    nodes: Nodes,
    corner: Corner,
    rules: StepRules,
    progress: Progress,
    pauses: bool,
    rows: FloatArray,
    u: FloatArray,
) -> Progress:
    """Continue a run to its end, or to the next node at which the block moves.

    Args:
        nodes: the excitation.
        corner: the toe.
        progress: how far the run is.
        pauses: whether it is left as soon as the block moves at a node beyond; not with
            a history.
        rows: history, as in :func:`run_toppling`.
        u: work, shape (9,).
    """
    # Invariant of the loop: `state` is the state at the position (i, tau) if `moving`; otherwise
    # the block rests there. Rest ends where k_h rises above (1 + k_v) k_r; an impact, where theta
    # returns to 0, takes all of theta', so that the block rests again from that instant on
    time_s, interval_s, last = nodes.time_s, nodes.interval_s, nodes.last
    level = Thresholds(1.0, corner.kr, 0.0, 0.0, False)
    keeps = rows.shape[1] > 0
    (
        i, moving, state, bounds, started_s, is_hidden, steps, samples, decided_s, decided_error,
        filled,
    ) = progress  # fmt: skip
    tau = 0.0  # position inside interval i
    counted = -1  # interval counted last
    lifting = False  # starting at an upward crossing: no impact is possible in the first step
    barred = 0  # 1 where rounding has just undone a start

    # only a history goes on after the verdict
    while i < last and (keeps or math.isnan(decided_s)):
        # only at a node and in motion: the batch knows plain steps of whole intervals alone
        if pauses and moving and tau == 0.0 and not lifting and i > progress.node:
            break
        if not moving:
            start = depart(nodes, level, Place(i, tau), barred)
            at_once = start.place.interval == i and start.place.fraction == tau
            i, tau = start.place.interval, start.place.fraction
            if i >= last:
                break
            moving, lifting, barred = True, start.smooth, 0
            state = state_at_rest(corner)
            lifted_s = time_s[i] + tau * interval_s[i]
            if math.isnan(started_s):
                started_s = lifted_s
            if not at_once:  # what closes its contact and opens it again has one entry
                filled = append_history(rows, filled, lifted_s, 0.0, 0.0, EVENT)
        if interval_s[i] * (1.0 - tau) <= 0.0:
            # a jump, or a start at the very end of the interval: what follows decides
            moving = state.theta != 0.0 or state.rate != 0.0
        else:
            # an impact and a new start in one interval count it once
            if i != counted:
                counted = i
                samples += 1
            arc = cross_interval(
                nodes, corner, rules, Place(i, tau), state, bounds, lifting, rows, filled, u
            )
            state, bounds, filled = arc.state, arc.bounds, arc.filled
            steps += arc.steps
            if arc.verdict_at >= 0.0 and math.isnan(decided_s):
                decided_s = time_s[i] + arc.verdict_at * interval_s[i]
                decided_error = arc.verdict_error
            if arc.impact_at >= 0.0:
                # back where it was lifted: the threshold is exceeded by less than rounding
                barred = 1 if arc.impact_at <= tau else 0
                tau = min(arc.impact_at, 1.0)
                # k_h - (1 + k_v) k_r, a straight line between both ends of the interval
                threshold = nodes.k_h[i] - nodes.w[i] * corner.kr
                threshold += (nodes.k_h[i + 1] - nodes.w[i + 1] * corner.kr - threshold) * tau
                bounds, hidden = errors_after_impact(bounds, state.rate, threshold, corner)
                is_hidden = is_hidden or hidden
                filled = append_history(
                    rows, filled, time_s[i] + tau * interval_s[i], 0.0, 0.0, EVENT
                )
                moving = lifting = False
                if tau >= 1.0:
                    i, tau = i + 1, 0.0
                continue
        lifting = False
        i, tau = i + 1, 0.0
        filled = append_history(rows, filled, time_s[i], state.theta, state.rate * corner.p, i)
        # Toppling is certain from the node on where `irrecoverable` holds (sin < 0, past balance,
        # is the cheap half of the test). tail_min_q[i] is the minimum from this node on, rest after
        # the record included. A history shows the fall until the block lies on its face
        if not math.isnan(decided_s):
            if state.theta > corner.theta_c + 0.5 * math.pi:
                break
        elif state.sin < 0.0 and irrecoverable(
            state.rate, state.sin, state.cos, nodes.tail_min_q[i], bounds.error
        ):
            decided_s = time_s[i]
            decided_error = bounds.error

    return Progress(
        i, moving, state, bounds, started_s, is_hidden, steps, samples, decided_s, decided_error,
        filled,
    )  # fmt: skip


@bare_kernel
def run_toppling(
    nodes: Nodes,
    kr: float,
    p: float,
    order: int,
    ph_max: float,
    rows: FloatArray,
    u: FloatArray,
) -> tuple[int, float, float, float, float, int, int, int]:
    """Run one block over one record; the fields of :class:`Run` in order.

    Args:
        nodes: the excitation.
        kr: rocking acceleration coefficient k_r.
        p: frequency parameter [1/s].
        order: degree of the Taylor step: 4, 5, 6 or 8.
        ph_max: greatest p·h of one step.
        rows: history to be filled with time, theta, theta' and node (`EVENT` between nodes), shape
            (4, m); (4, 0) for none. With one, the run goes on after the verdict until the block
            lies beyond 90 degrees.
        u: work, shape (9,).
    """
    # restitution 0: the block is backed, and an impact leaves no speed
    corner = kernel_corner(kr, p, 0.0)
    rules = StepRules(order, ph_max)
    progress = advance(nodes, corner, rules, beginning(corner), False, rows, u)
    run = end_of_run(nodes, corner, progress)
    # not the tuple itself: numba takes longer to give that back than this and making it there
    return (
        run.outcome, run.peak_rad, run.started_s, run.verdict_s, run.error_rad, run.steps,
        run.samples_moved, run.history_length,
    )  # fmt: skip
