"""Rest of a block, and the instant at which it ends.

At rest the two equations, for motion forward and in reverse, give an acceleration each; rest ends
where one of them has the sense of its equation. Both are proportional to straight lines between
samples, so that the crossing is a division.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.excitation import BLOCK, Nodes
from rbfrag.solver.integrator.compiled import within
from rbfrag.solver.integrator.state import Line, Place, line_at

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
    # the crossing of a straight line; where it was barred above zero, it starts anew at once
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
