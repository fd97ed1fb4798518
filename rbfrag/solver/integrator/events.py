"""Events of a block: the end of rest; peaks, dips below zero and impacts within a step; motion past
recovery.

At rest the two equations, for motion forward and in reverse, give an acceleration each; rest ends
where one of them has the sense of its equation. Both are proportional to straight lines between
samples, so that the crossing is a division.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.excitation import BLOCK, Nodes
from rbfrag.solver.integrator.compiled import fused_kernel, inner_kernel, within
from rbfrag.solver.integrator.state import Line, Place, line_at
from rbfrag.solver.integrator.taylor import (
    OF_ACCELERATION,
    OF_RATE,
    OF_ROTATION,
    bracketed_root,
    rotation,
    value,
)
from rbfrag.solver.results import FloatArray

CALM = 1e-12
"""Margin of a threshold by which a whole block of nodes must fall short of it to be passed over."""


class Thresholds(NamedTuple):
    """Factors of k_h and 1 + k_v in both equations for a block at rest.

    Args:
        driving: of k_h, forward.
        resistance: of 1 + k_v, forward.
        reverse_driving: of k_h in reverse; 0 where the block does not move in reverse.
        reverse_resistance: of 1 + k_v in reverse; 0 there.
        may_reverse: whether the block moves in reverse from where it is.
    """

    driving: float
    resistance: float
    reverse_driving: float
    reverse_resistance: float
    may_reverse: bool


class Departure(NamedTuple):
    """The end of a rest.

    Args:
        place: where in the record; the end of the record where nothing moves the block.
        sense: of the motion that sets in, 1 or -1; 0 for none.
        smooth: whether the acceleration is zero there: it grows from the crossing on.
    """

    place: Place
    sense: int
    smooth: bool


@within
def depart(nodes: Nodes, level: Thresholds, place: Place, barred: int) -> Departure:
    """Find where a block at rest starts to move.

    Args:
        nodes: the excitation.
        level: where it does.
        place: where the rest begins.
        barred: sense in which the block has just come to a standstill, 0 for none. Its motion
            ended because the acceleration opposed it: to rounding it may still seem to have its
            sense, and is not resumed within the interval.
    """
    node, tau = place.interval, place.fraction
    while node < nodes.last:
        line = line_at(nodes, node, 0.0, 0.0)
        if line.h == 0.0:  # nothing starts in no time
            node += 1
        else:
            start = first_start(level, line, tau, barred)
            if start.sense != 0:
                return Departure(Place(node, start.tau), start.sense, start.smooth)
            node = calm_until(nodes, level, node + 1)
        tau = 0.0
        barred = 0
    if nodes.last < nodes.k_h.size - 1:
        return Departure(Place(node, tau), 0, False)
    # after the record: what stands without strength starts at once, all else stays
    start = first_start(level, line_at(nodes, node, 0.0, 1.0), tau, barred)
    return Departure(Place(node, start.tau), start.sense, start.smooth)


class Start(NamedTuple):
    """First start within an interval: its position and sense (0: none); see `Departure`."""

    tau: float
    sense: int
    smooth: bool


@within
def first_start(level: Thresholds, line: Line, tau: float, barred: int) -> Start:
    """Return where motion sets in within an interval, from tau on."""
    # inertia times the acceleration that each equation gives, at both ends
    f0 = level.driving * line.a0 - level.resistance * line.w0
    f1 = level.driving * line.a1 - level.resistance * line.w1
    r0 = level.reverse_driving * line.a0 - level.reverse_resistance * line.w0
    r1 = level.reverse_driving * line.a1 - level.reverse_resistance * line.w1
    f, r = f0 + (f1 - f0) * tau, r0 + (r1 - r0) * tau
    # above a threshold already: after a jump, a standstill, or at the first sample
    if f > 0.0 and barred != 1:
        return Start(tau, 1, False)
    if level.may_reverse and r < 0.0 and barred != -1:
        return Start(tau, -1, False)
    start = Start(2.0, 0, False)
    # the crossing of a straight line; where it was barred above zero, it starts again at once
    if f1 > 0.0 and f1 > f0:
        start = Start(max(tau, -f0 / (f1 - f0)), 1, True)
    # the earlier of both senses; only one can set in where both thresholds are apart
    if level.may_reverse and r1 < 0.0 and r1 < r0:
        at = max(tau, r0 / (r0 - r1))
        if at < start.tau:
            start = Start(at, -1, True)
    if start.tau > 1.0:  # a crossing that rounding puts beyond the end is at the next node
        return Start(tau, 0, False)
    return start


@within
def calm_until(nodes: Nodes, level: Thresholds, node: int) -> int:
    """Return the first node, from one on, after which a threshold is passed; the last if none.

    Rest costs one comparison a sample, or one a block of samples.
    """
    # A block at rest moves forward where driving k_h > resistance (1 + k_v), in reverse where
    # k_h is below the corresponding bound: with 1 + k_v > 0 these are bounds of q = k_h/(1 + k_v),
    # whose extremes over blocks of nodes are tabulated. The margin CALM covers the rounding of the
    # quotient
    above = -math.inf
    below = -math.inf
    # a block without strength left, or one that k_h does not drive, is looked at node by node
    if level.driving > 0.0 and level.resistance > 0.0:
        above = level.resistance / level.driving * (1.0 - CALM)
    if level.may_reverse:
        below = math.inf
        if level.reverse_driving > 0.0 and level.reverse_resistance < 0.0:
            below = level.reverse_resistance / level.reverse_driving * (1.0 - CALM)
    k_h, w, last = nodes.k_h, nodes.w, nodes.last
    block_max_q, block_min_q = nodes.block_max_q, nodes.block_min_q
    while node < last:
        # a block of nodes is left out whole if the step into it begins at its last neighbour
        if (node + 1) % BLOCK == 0:
            block = (node + 1) // BLOCK
            while (
                node + BLOCK <= last
                and block_max_q[block] < above
                and (not level.may_reverse or block_min_q[block] > below)
            ):
                node += BLOCK
                block += 1
            if node >= last:
                break
        a1, w1 = k_h[node + 1], w[node + 1]
        if level.driving * a1 > level.resistance * w1:
            break
        if level.may_reverse and level.reverse_driving * a1 < level.reverse_resistance * w1:
            break
        node += 1
    return node


REFINEMENTS = 8
"""Steps of Newton for a landing; two are nearly always enough."""

NEWTON_TOLERANCE = 1e-17
"""Relative error of a landing time at which Newton's method stops."""


class StepEvents(NamedTuple):
    """Events within one step.

    Args:
        impact: fraction of the step at which theta returns to 0, or -1.
        peak: greatest maximum of theta before that, -1 where there is none.
        peak_at: fraction of the step at which it is.
        lowest: lowest minimum above zero, infinite where there is none.
    """

    impact: float
    peak: float
    peak_at: float
    lowest: float


@within
def keeps_direction(u_start: float, v_start: float, u_end: float, v_end: float) -> bool:
    """Return whether U keeps its sign throughout a step; V = U' is assumed monotone within it.

    U with the same sign at both ends is zero between them only if it turns there, that is if V
    changes its sign, and if the tangent at the start reaches zero. (`&` instead of `and`: no
    branches, so that a loop over runs becomes vector instructions.)
    """
    dips = (v_start < 0.0) & (v_end > 0.0) & (u_start + v_start <= 0.0)
    rises = (v_start > 0.0) & (v_end < 0.0) & (u_start + v_start >= 0.0)
    up = (u_start > 0.0) & (u_end > 0.0)
    down = (u_start < 0.0) & (u_end < 0.0)
    return (up & (not dips)) | (down & (not rises))


@within
def simple_turn(
    theta: float,
    theta_end: float,
    u_start: float,
    v_start: float,
    u_end: float,
    v_end: float,
    peak: float,
    drift: float,
) -> bool:
    """Return whether a step above zero in which U may change sign is nevertheless free of events.

    Args:
        theta: rotation at the start.
        theta_end: rotation at the end.
        u_start: U at the start.
        v_start: its derivative there.
        u_end: U at the end.
        v_end: its derivative there.
        peak: a maximum of theta counts above this one only; infinite to look for none.
        drift: a minimum that is not above this rotation may be an impact.
    """
    # a concave arc is below its end tangents: so is its peak
    rounds = (u_start > 0.0) & (v_start < 0.0) & (v_end < 0.0)
    rounds = rounds & (min(theta + u_start, theta_end - u_end) <= peak)
    # a convex arc is above them: so is its dip
    bounces = (u_start <= 0.0) & (v_start > 0.0) & (v_end > 0.0)
    bounces = bounces & (max(theta + u_start, theta_end - u_end) > drift)
    return rounds | bounces


@within
def eventful(
    theta: float,
    theta_end: float,
    u_start: float,
    v_start: float,
    u_end: float,
    v_end: float,
    peak: float,
    drift: float,
) -> bool:
    """Return whether a step may contain an impact or a relevant peak; see :func:`simple_turn`."""
    return theta_end <= 0.0 or (
        not keeps_direction(u_start, v_start, u_end, v_end)
        and not simple_turn(theta, theta_end, u_start, v_start, u_end, v_end, peak, drift)
    )


@within
def irrecoverable(rate: float, s: float, c: float, least_q: float, error: float) -> bool:
    """Return whether a block has toppled whatever follows, for a state known to `error`.

    Let psi = theta_c - theta be the angle to the balance point. Beyond it (psi < 0) and with
    theta' > 0, theta''/p² = (1 + k_v) (q cos(psi) - sin(psi)) stays positive as long as
    q > tan(psi), and psi only falls: the block falls if the minimum of q from here on exceeds
    tan(psi) (docs/theory/toppling.md, "Events").

    Args:
        rate: theta'/p.
        s: sin(psi).
        c: cos(psi).
        least_q: minimum of q = k_h/(1 + k_v) from here on, at most 0 (rest after the record).
        error: bound on |error of theta| + |error of theta'/p|.
    """
    # s < 0 is asked for itself: for c < 0 the last condition can hold with s > 0.
    # q > tan(psi) multiplied by c, which also holds at a quarter turn (c = 0). An error of psi
    # changes c q - s by at most error (|q| + 1), hence the bound on the right
    return (rate > error) & (s < 0.0) & (c * least_q - s > error * (1.0 - least_q))


@within
def upright_rate(s: float, c: float) -> float:
    """Return theta'/p of the motion that comes to rest upright, the ground at rest.

    With psi the angle to the balance point, s = sin(psi) and c = cos(psi), energy gives
    1 - cos(psi) = (theta'/p)²/2: a block that is faster falls over.
    """
    # theta'/p = 2 sin(psi/2), signed: negative beyond the balance point
    return 2.0 * math.sin(0.5 * math.atan2(s, c))


@within
def left_at_turn(border: float, rate: float) -> float:
    """Return the angle to the balance point at which motion that does not reach it turns back.

    Args:
        border: :func:`upright_rate` of where it is.
        rate: theta'/p there, above 0 and below the border.
    """
    # 1 - cos is conserved up to the kinetic energy: sin²(x_top/2) = sin²(x/2) - rate²/4
    return 2.0 * math.asin(min(1.0, 0.5 * math.sqrt((border - rate) * (border + rate))))


@inner_kernel
def examine_step(
    theta: float, u: FloatArray, order: int, theta_end: float, u_end: float, v_end: float
) -> StepEvents:
    """Find the events within one step.

    The step is cut at the turning points of theta into monotone stretches, so a peak and an
    impact in one step, or a dip below zero between two positive ends, are all seen.
    """
    # invariant: between two zeros of U theta is monotone, so that each stretch holds at most one
    # passage through theta = 0, which a sign change at its ends reveals and brackets
    v_start = u[1]
    # a start from rest has U = 0: its direction is that of the acceleration
    u_start = u[0] if u[0] != 0.0 else v_start
    # V is monotone: U has at most two zeros, one on either side of that of V
    first = -1.0
    second = -1.0
    if (v_start > 0.0 and v_end < 0.0) or (v_start < 0.0 and v_end > 0.0):
        # U turns: it may be zero on either side of its extremum
        extremum = bracketed_root(OF_ACCELERATION, theta, u, order, 0.0, 1.0)
        u_mid = value(u, order, extremum)
        if (u_start > 0.0 and u_mid <= 0.0) or (u_start < 0.0 and u_mid >= 0.0):
            first = bracketed_root(OF_RATE, theta, u, order, 0.0, extremum)
        if (u_mid > 0.0 and u_end <= 0.0) or (u_mid < 0.0 and u_end >= 0.0):
            second = bracketed_root(OF_RATE, theta, u, order, extremum, 1.0)
    elif (u_start > 0.0 and u_end <= 0.0) or (u_start < 0.0 and u_end >= 0.0):
        first = bracketed_root(OF_RATE, theta, u, order, 0.0, 1.0)

    peak = -1.0
    peak_at = -1.0
    lowest = math.inf
    rising = u_start > 0.0
    tau_left = 0.0
    theta_left = theta
    ends = (first, second, 1.0)
    for stretch in range(3):
        tau_right = ends[stretch]
        if tau_right < 0.0:
            continue
        at_end = stretch == 2
        theta_right = theta_end if at_end else rotation(theta, u, order, tau_right)
        if rising:
            if not at_end and theta_right > peak:
                peak = theta_right
                peak_at = tau_right
        elif theta_right <= 0.0:
            # a stretch that begins at 0 and falls is an impact at its beginning
            if theta_left > 0.0:
                tau_left = bracketed_root(OF_ROTATION, theta, u, order, tau_left, tau_right)
            return StepEvents(tau_left, peak, peak_at, lowest)
        elif not at_end:
            lowest = min(lowest, theta_right)
        rising = not rising
        tau_left = tau_right
        theta_left = theta_right
    return StepEvents(-1.0, peak, peak_at, lowest)


@fused_kernel
def landing(theta: float, u: FloatArray, order: int) -> tuple[float, float]:
    """Return where a concave or falling arc of a step reaches theta = 0, and U there.

    Newton's method from the root of the first terms of the series, which at the steps of a record
    are nearly all of it: two evaluations are enough, where a search between bounds takes six.

    Args:
        theta: rotation at the start, which is no landing where this is 0.
        u: coefficients of U.
        order: their degree.

    Returns:
        Fraction of the step, or -1 where the method fails; U.
    """
    u0, u1, u2 = u[0], u[1], u[2]
    if theta == 0.0:
        # U0 + U1 tau/2 + U2 tau²/3 = 0, in the form that loses nothing where U2 is small
        root = math.sqrt(max(0.25 * u1 * u1 - (4.0 / 3.0) * u0 * u2, 0.0))
        tau = 2.0 * u0 / (root - 0.5 * u1)
    else:
        # theta + U0 tau + U1 tau²/2 = 0, and two steps of Newton with the next term
        root = math.sqrt(max(u0 * u0 - 2.0 * theta * u1, 0.0))
        tau = 2.0 * theta / (root - u0) if u0 <= 0.0 else (u0 + root) / -u1
        for _ in range(2):
            height = theta + tau * (u0 + tau * (0.5 * u1 + tau * ((1.0 / 3.0) * u2)))
            tau -= height / (u0 + tau * (u1 + tau * u2))
    # written so that a NaN is a failure, too
    if not 0.0 < tau < 2.0:
        tau = 1.0
    bend = abs(u1) + 2.0 * abs(u2)
    for _ in range(REFINEMENTS):
        turned, rate, slope = u[order] / (order + 1), u[order], 0.0
        for k in range(order - 1, -1, -1):
            turned = turned * tau + u[k] / (k + 1)
            slope = slope * tau + rate
            rate = rate * tau + u[k]
        if not rate < 0.0:
            break
        step = -(theta + tau * turned) / rate
        tau += step
        if not 0.0 < tau < 2.0:
            break
        # a step of Newton leaves step² theta''/(2 theta') of the error
        if bend * (step * step) <= NEWTON_TOLERANCE * tau * -rate:
            return min(tau, 1.0), rate + slope * step
    return -1.0, 0.0


class Descent(NamedTuple):
    """Events within one step of a block that keeps part of its speed at an impact.

    Args:
        impact: fraction of the step at which theta returns to 0, or -1.
        rate: U there.
        peak: greatest maximum of theta before that, -1 where there is none that counts.
        peak_at: fraction of the step at which it is.
    """

    impact: float
    rate: float
    peak: float
    peak_at: float


@inner_kernel
def examine_descent(
    theta: float,
    u: FloatArray,
    order: int,
    theta_end: float,
    u_end: float,
    v_end: float,
    highest: float,
) -> Descent:
    """Find the events of :func:`examine_step`, and the speed at the impact.

    The arcs between the impacts of a rocking block are mostly concave over the whole step: they
    have one peak, which seldom is the greatest, and land once.

    Args:
        theta: rotation at the start.
        u: coefficients of U.
        order: their degree.
        theta_end: rotation at the end.
        u_end: U at the end.
        v_end: its derivative there.
        highest: a maximum of theta counts above this one only; below zero to have all.
    """
    u_start, v_start = u[0], u[1]
    # V < 0 at both ends, and V is monotone: theta is concave and has one zero on the way down. A
    # block that falls throughout has one as well; all else is cut into stretches
    rounds = (u_start > 0.0) & (v_start < 0.0) & (v_end < 0.0)
    falls = (theta > 0.0) & (u_start < 0.0) & keeps_direction(u_start, v_start, u_end, v_end)
    if theta_end <= 0.0 and (rounds or falls):
        at, rate = landing(theta, u, order)
        if at >= 0.0:
            peak, peak_at = -1.0, -1.0
            # a concave arc is below its tangents
            if rounds and min(theta + u_start, theta_end - u_end) > highest:
                peak_at = bracketed_root(OF_RATE, theta, u, order, 0.0, 1.0)
                peak = rotation(theta, u, order, peak_at)
            return Descent(at, rate, peak, peak_at)
    inside = examine_step(theta, u, order, theta_end, u_end, v_end)
    rate = value(u, order, inside.impact) if inside.impact >= 0.0 else 0.0
    return Descent(inside.impact, rate, inside.peak, inside.peak_at)
