"""Kernel of a free-standing block that rocks about both corners: one run over one record.

theta >= 0 is the rotation about the present corner, s = 1 for the toe and -1 for the heel, each
with its own theta_c and p:

    moving: theta'' = p² [s k_h cos(theta_c - theta) - (1 + k_v) sin(theta_c - theta)]
    rest:   -(1 + k_v) tan(theta_c of the heel) <= k_h <= (1 + k_v) tan(theta_c of the toe)
    impact: theta = 0 about the other corner, with a stated part of the speed

The step is that of the toppling block (`rbfrag.solver.integrator.taylor`), rest that of the
engine for one degree of freedom. Impacts are located on the polynomial of the step. After the
record the ground is at rest: outcome and peaks follow in closed form, by energy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.excitation import Nodes
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.events import (
    Thresholds,
    depart,
    eventful,
    examine_descent,
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
    StepExcitation,
    append_history,
    excitation_over,
    higher,
    time_of_jump,
)
from rbfrag.solver.integrator.taylor import even_parts, state_after, take_step
from rbfrag.solver.results import FloatArray

UNDETERMINED, JUMP = 2, 3

PAST_BALANCE = 1.4
"""Rotation beyond the balance point at which a block has overturned [rad]."""

IMPACT = -2
"""What stands in a history for the node of what follows an impact; see `EVENT`."""


class RockingRules(NamedTuple):
    """Settings of a run.

    Args:
        order: degree of the Taylor step: 4, 5, 6 or 8.
        ph_max: greatest p·h of one step.
        slowest: speed after an impact below which the block rests [rad/s].
        most_impacts: impacts beyond which a run is given up.
    """

    order: int
    ph_max: float
    slowest: float
    most_impacts: int


class RockingRun(NamedTuple):
    """Result of a run; times are NaN for events that did not occur.

    Args:
        outcome: STABLE, TOPPLED, UNDETERMINED or JUMP.
        side: on which the block overturned, 1 or -1; 0 if it did not.
        forward: greatest rotation about the toe [rad], and its error.
        backward: the same about the heel.
        error: estimated error of the rotation where the run ended [rad].
        started_s: first motion [s].
        verdict_s: when overturning, or the jump, was certain [s].
        impacts: impacts within the record.
        steps: integration steps.
        samples_moved: sample intervals in which the block moved.
        history_length: columns of the history that are filled.
    """

    outcome: int
    side: int
    forward: Peak
    backward: Peak
    error: float
    started_s: float
    verdict_s: float
    impacts: int
    steps: int
    samples_moved: int
    history_length: int


class RockingArcEnd(NamedTuple):
    """Result of the remainder of an interval.

    Args:
        state: of the block at its end.
        off: estimated error of it.
        peak: greatest rotation about the present corner.
        impact_at: fraction of the interval at which the block hits its base, or -1; `state` then
            holds the rate of the impact.
        fallen: whether it lies beyond recovery.
        steps: integration steps taken.
        filled: columns of the history that are filled.
    """

    state: State
    off: Offset
    peak: Peak
    impact_at: float
    fallen: bool
    steps: int
    filled: int


@within
def carried(off: Offset, ph: float, stiffness: float, noise: float) -> Offset:
    """Return an error after a step, with the step's own error added in the sense that increases it.

    The linearised equation is d(theta'/p)/dt = p D d(theta), d(theta)/dt = p d(theta'/p). The
    signs are kept: a sum of sizes would grow by e^(p t) without end, since impacts reset nothing.

    Args:
        off: error at the start of the step.
        ph: p times the step length.
        stiffness: D = k_h sin(psi) + (1 + k_v) cos(psi).
        noise: truncation and rounding of the step.
    """
    # to second order in the step, which is enough for an estimate
    bend = 0.5 * ph * ph * stiffness
    theta = off.theta + ph * off.rate + bend * off.theta
    rate = off.rate + ph * stiffness * off.theta + bend * off.rate
    theta += math.copysign(noise, theta)
    rate += math.copysign(noise, rate)
    # beyond a turn of the block an error has no size any more
    return Offset(max(-1.0, min(theta, 1.0)), max(-1.0, min(rate, 1.0)))


@within
def cross_interval(
    nodes: Nodes,
    corner: Corner,
    rules: RockingRules,
    side: int,
    place: Place,
    start: tuple[State, Offset, Peak],
    lifting: bool,
    rows: FloatArray,
    filled: int,
    u: FloatArray,
) -> RockingArcEnd:
    """Integrate from a place to the end of its interval, or to an impact before it.

    Args:
        nodes: the excitation.
        corner: the corner that the block turns about.
        side: 1 for the toe, -1 for the heel.
        place: where to begin.
        start: state, its error, and the greatest rotation about this corner so far.
        lifting: the threshold is being crossed from below: the first step holds no impact.
        rows: history to be filled with peaks.
        filled: how many of its columns are.
        u: work, shape (9,).
    """
    state, off, peak = start
    i, tau = place.interval, place.fraction
    order = rules.order
    keeps = rows.shape[1] > 0
    impact_at = -1.0
    steps = 0
    fallen = False
    # theta'' = p² [side k_h cos(psi) - (1 + k_v) sin(psi)], psi = theta_c - theta: the equation of
    # the toppling block about either corner, with k_h mirrored about the heel
    total = corner.p * (nodes.interval_s[i] * (1.0 - tau))
    parts, part, ph = even_parts(total, 1.0 - tau, rules.ph_max)
    for number in range(parts):
        at = tau + number * part
        forward = excitation_over(nodes.k_h, nodes.w, i, at, part)
        # rotation about the heel is the mirror image
        shaking = StepExcitation(side * forward.k_h, side * forward.dk_h, forward.w, forward.dw)
        step = take_step(order, u, ph, state, shaking)
        steps += 1
        # D = -d(theta''/p²)/d(psi), which drives the error of theta'
        stiffness = shaking.k_h * state.sin + shaking.w * state.cos
        off = carried(off, ph, stiffness, step.truncation + step.rounding)
        least = -1.0 if keeps else peak.x  # a history has all peaks
        if lifting:
            # a threshold exceeded by less than rounding may seem to pull the block back
            lifting = False
            if step.theta <= 0.0 or step.u_end <= 0.0:
                impact_at, state = at + part, State(0.0, 0.0, corner.sin, corner.cos)
        elif eventful(
            state.theta, step.theta, step.u_start, step.v_start, step.u_end, step.v_end,
            least, math.inf if keeps else 0.0,
        ):  # fmt: skip
            inside = examine_descent(
                state.theta, u, order, step.theta, step.u_end, step.v_end, least
            )
            peak = higher(peak, inside.peak, abs(off.theta))
            if keeps and inside.peak > 0.0:
                top_s = nodes.time_s[i] + (at + part * inside.peak_at) * nodes.interval_s[i]
                filled = append_history(rows, filled, top_s, side * inside.peak, 0.0, EVENT)
            if inside.impact >= 0.0:
                impact_at = at + part * inside.impact
                state = State(0.0, inside.rate / ph, corner.sin, corner.cos)
        if impact_at >= 0.0:
            break
        state = state_after(state, step, ph)
        fallen = state.theta > corner.theta_c + PAST_BALANCE
        if fallen:
            break
    return RockingArcEnd(state, off, peak, impact_at, fallen, steps, filled)


@inner_kernel
def error_after_impact(
    off: Offset, before: Corner, after: Corner, rate: float, rate_after: float, k_h: float, w: float
) -> Offset:
    """Return an error after an impact, whose time it shifts.

    Args:
        off: error before it.
        before: the corner that the block turned about.
        after: the one that it turns about now.
        rate: theta'/p before the impact, below 0.
        rate_after: the same after it, above 0.
        k_h: driving acceleration of the corner before [g].
        w: effective gravity 1 + k_v.
    """
    # a block that is too high by d(theta) arrives later by this, in which it gains speed on both
    # sides of the impact
    late_s = -off.theta / (before.p * rate)
    pull = before.p * before.p * (k_h * before.cos - w * before.sin)
    pull_after = after.p * after.p * (-k_h * after.cos - w * after.sin)
    rate_off = -before.passed_on * (before.p * off.rate + pull * late_s) - pull_after * late_s
    return Offset(-after.p * rate_after * late_s, rate_off / after.p)


class Landed(NamedTuple):
    """State after an impact.

    Args:
        side: the new corner, 1 or -1; 0 for rest.
        state: of the block about it.
        off: error of it.
        speed: of the block [rad/s].
    """

    side: int
    state: State
    off: Offset
    speed: float


@inner_kernel
def through_impact(
    nodes: Nodes,
    place: Place,
    side: int,
    corner: Corner,
    other: Corner,
    rules: RockingRules,
    arc: RockingArcEnd,
) -> Landed:
    """Return the state after an impact: rest, or rotation about the other corner.

    Args:
        nodes: the excitation.
        side: the present corner, 1 or -1.
        rules: how to integrate.
        arc: how the block came to the impact.
    """
    rate = arc.state.rate
    # of theta' itself: theta'/p changes with the corner, whose p is its own
    speed = -rate * corner.p * corner.passed_on
    # also where the block is so stocky that angular momentum would turn it back
    if speed < rules.slowest:
        return Landed(0, State(0.0, 0.0, corner.sin, corner.cos), Offset(0.0, 0.0), 0.0)
    i, tau = place.interval, place.fraction
    k_h = side * (nodes.k_h[i] + (nodes.k_h[i + 1] - nodes.k_h[i]) * tau)
    w = nodes.w[i] + (nodes.w[i + 1] - nodes.w[i]) * tau
    rate_after = speed / other.p
    off = error_after_impact(arc.off, corner, other, rate, rate_after, k_h, w)
    return Landed(-side, State(0.0, rate_after, other.sin, other.cos), off, speed)


@within
def noted_impact(
    rows: FloatArray, filled: int, time_s: float, rate: float, rate_after: float
) -> int:
    """Append an impact to a history: the rates before and after it."""
    filled = append_history(rows, filled, time_s, 0.0, rate, EVENT)
    return append_history(rows, filled, time_s, 0.0, rate_after, IMPACT)


class RockingEnd(NamedTuple):
    """End of a run; see :class:`RockingRun`."""

    outcome: int
    side: int
    verdict_s: float
    forward: Peak
    backward: Peak


@inner_kernel
def end_of_run(
    nodes: Nodes,
    toe: Corner,
    heel: Corner,
    rules: RockingRules,
    side: int,
    state: State,
    off: Offset,
    peaks: tuple[Peak, Peak],
    impacts: int,
) -> RockingEnd:
    """Return the end of a run that is undecided at its last node."""
    forward, backward = peaks
    last = nodes.last
    if last < nodes.k_h.size - 1:  # 1 + k_v reaches zero
        jump_s = time_of_jump(nodes.time_s, nodes.interval_s, nodes.w, last)
        return RockingEnd(JUMP, 0, jump_s, forward, backward)
    if impacts > rules.most_impacts:
        return RockingEnd(UNDETERMINED, 0, math.nan, forward, backward)
    if side == 0:
        return RockingEnd(STABLE, 0, math.nan, forward, backward)
    end = after_record(toe, heel, side, state, off, rules.slowest)
    verdict_s = nodes.time_s[last] if end.outcome == TOPPLED else math.nan
    forward = higher(forward, end.forward.x, end.forward.error)
    backward = higher(backward, end.backward.x, end.backward.error)
    return RockingEnd(end.outcome, end.side, verdict_s, forward, backward)


@bare_kernel
def run_rocking(
    nodes: Nodes,
    tail_max_q: FloatArray,
    toe: Corner,
    heel: Corner,
    rules: RockingRules,
    rows: FloatArray,
    u: FloatArray,
) -> RockingRun:
    """Run one block over one record.

    Args:
        nodes: the excitation.
        tail_max_q: greatest k_h/(1 + k_v) from each node on, rest after the record included.
        toe: the corner of forward rotation.
        heel: that of backward rotation.
        rules: how to integrate.
        rows: history to be filled with time, rotation (forward positive), its rate and node
            (`EVENT` or `IMPACT` between nodes), shape (4, m); (4, 0) for none. With one, the run
            goes on after the verdict until the block lies beyond recovery.
        u: work, shape (9,).
    """
    time_s, interval_s, last = nodes.time_s, nodes.interval_s, nodes.last
    # Invariant of the loop: `state` is the rotation theta >= 0 about the corner `side` (0: rest) at
    # the position (i, tau). An impact changes the corner and keeps the fraction e of theta'
    # (conservation of angular momentum or a given restitution, docs/theory/rocking.md); one that
    # leaves less than `rules.slowest` ends in rest

    # theta'' at rest is that of k_h - w tan(theta_c) forward, of -(k_h + w tan(theta_c)) backward
    level = Thresholds(1.0, toe.kr, 1.0, -heel.kr, True)
    keeps = rows.shape[1] > 0
    filled = steps = samples = impacts = 0
    counted = -1
    started_s, decided_s = math.nan, math.nan
    i, tau = 0, 0.0  # interval, and position inside it
    side = barred = 0  # present corner; sense whose start rounding has just undone
    lifting = False
    corner = toe
    state, off = State(0.0, 0.0, toe.sin, toe.cos), Offset(0.0, 0.0)
    forward, backward = Peak(0.0, 0.0), Peak(0.0, 0.0)

    while i < last and impacts <= rules.most_impacts and (keeps or math.isnan(decided_s)):
        if side == 0:
            start = depart(nodes, level, Place(i, tau), barred)
            i, tau = start.place.interval, start.place.fraction
            if start.sense == 0 or i >= last:
                break
            side, lifting, barred = start.sense, start.smooth, 0
            corner = toe if side > 0 else heel
            state, off = State(0.0, 0.0, corner.sin, corner.cos), Offset(0.0, 0.0)
            now_s = time_s[i] + tau * interval_s[i]
            if math.isnan(started_s):
                started_s = now_s
            filled = append_history(rows, filled, now_s, 0.0, 0.0, EVENT)
        if interval_s[i] * (1.0 - tau) <= 0.0:
            # nothing moves in no time: of a jump, or a start at the very end, what follows decides
            side = 0 if state.theta == 0.0 and state.rate == 0.0 else side
            i, tau, lifting = i + 1, 0.0, False
            if side != 0:
                rate = side * state.rate * corner.p
                filled = append_history(rows, filled, time_s[i], side * state.theta, rate, i)
            continue
        # an impact and a new start in one interval count it once
        if i != counted:
            counted = i
            samples += 1
        arc = cross_interval(
            nodes, corner, rules, side, Place(i, tau),
            (state, off, forward if side > 0 else backward), lifting, rows, filled, u,
        )  # fmt: skip
        lifting = False
        steps += arc.steps
        filled = arc.filled
        if side > 0:
            forward = arc.peak
        else:
            backward = arc.peak
        if arc.impact_at >= 0.0:
            # back on its base where it was lifted: rounding has undone the start
            stuck = arc.impact_at <= tau
            tau = min(arc.impact_at, 1.0)
            other = heel if side > 0 else toe
            landed = through_impact(nodes, Place(i, tau), side, corner, other, rules, arc)
            # a start that is undone has no speed, and is no impact
            if arc.state.rate < 0.0:
                impacts += 1
                now_s = time_s[i] + tau * interval_s[i]
                rate = side * arc.state.rate * corner.p
                filled = noted_impact(rows, filled, now_s, rate, landed.side * landed.speed)
            barred = side if stuck and landed.side == 0 else 0
            side, state, off = landed.side, landed.state, landed.off
            corner = corner if side == 0 else other
            if tau >= 1.0:
                i, tau = i + 1, 0.0
            continue
        state, off = arc.state, arc.off
        i, tau = i + 1, 0.0
        filled = append_history(
            rows, filled, time_s[i], side * state.theta, side * state.rate * corner.p, i
        )
        # past all recovery, whatever the rest of the record does; a history shows the fall too
        least_q = nodes.tail_min_q[i] if side > 0 else -tail_max_q[i]
        is_irrecoverable = irrecoverable(state.rate, state.sin, state.cos, least_q, 0.0)
        if math.isnan(decided_s) and (is_irrecoverable or arc.fallen):
            decided_s = time_s[i]
        if arc.fallen:
            break

    end = RockingEnd(TOPPLED, side, decided_s, forward, backward)
    if math.isnan(decided_s):
        peaks = (forward, backward)
        end = end_of_run(nodes, toe, heel, rules, side, state, off, peaks, impacts)
    return RockingRun(
        end.outcome, end.side, end.forward, end.backward, abs(off.theta), started_s,
        end.verdict_s, impacts, steps, samples, filled,
    )  # fmt: skip


STABLE, TOPPLED = 0, 1

IMPACTS_THAT_DECIDE = 2
"""Impacts after which speeds about each corner only fall: the product of both ratios is <= 1."""


class Offset(NamedTuple):
    """Estimated error of the rotation [rad] and of theta'/p, with its sign."""

    theta: float
    rate: float


class FreeEnd(NamedTuple):
    """Outcome of the motion after the record.

    Args:
        outcome: STABLE or TOPPLED.
        side: on which it overturns, 1 or -1; 0 if it does not.
        forward: greatest rotation about the toe after the record, and its error.
        backward: the same about the heel.
    """

    outcome: int
    side: int
    forward: Peak
    backward: Peak


@within
def free_peak(corner: Corner, border: float, rate: float, error: float) -> Peak:
    """Return the rotation at which motion turns back that lacks the energy to overturn.

    Args:
        border: rate that would just bring the block upright from here; above `rate`.
        rate: theta'/p, above 0.
        error: of the rate.
    """
    x_top = left_at_turn(border, rate)
    return Peak(corner.theta_c - x_top, min(1.0, error * (border + rate) / math.sin(x_top)))


@inner_kernel
def after_record(
    toe: Corner, heel: Corner, side: int, state: State, off: Offset, slowest: float
) -> FreeEnd:
    """Return outcome and peak rotations of the free motion, impact by impact.

    Args:
        toe: the corner of forward rotation.
        heel: that of backward rotation.
        side: the present one, 1 or -1.
        state: of the block.
        off: its error.
        slowest: speed after an impact below which the block rests [rad/s].
    """
    # energy alone decides: (theta'/p)²/2 - (1 - cos x) is conserved about one corner
    forward, backward = Peak(0.0, 0.0), Peak(0.0, 0.0)
    corner = toe if side > 0 else heel
    rate, error = state.rate, abs(off.theta) + abs(off.rate)
    border = upright_rate(state.sin, state.cos)
    for number in range(IMPACTS_THAT_DECIDE + 1):
        # upright with a rate left, or past it without the rate to come back
        if rate >= border:
            return FreeEnd(TOPPLED, side, forward, backward)
        if rate > 0.0:
            peak = free_peak(corner, border, rate, error)
            if side > 0:
                forward = higher(forward, peak.x, peak.error)
            else:
                backward = higher(backward, peak.x, peak.error)
        if number == IMPACTS_THAT_DECIDE:
            break
        # it comes down with the energy it has: rate² + 2 (cos x - cos theta_c)
        full = 2.0 * math.sin(0.5 * corner.theta_c)
        hit = math.sqrt(max(0.0, full * full - (border - rate) * (border + rate)))
        speed = hit * corner.p * corner.passed_on
        if speed < slowest:  # it rests, and nothing drives it any more
            break
        side = -side
        corner = toe if side > 0 else heel
        rate = speed / corner.p
        border = 2.0 * math.sin(0.5 * corner.theta_c)
    return FreeEnd(STABLE, 0, forward, backward)
