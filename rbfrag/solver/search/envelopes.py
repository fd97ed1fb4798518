"""Verdict on all blocks of an interval of k_r, by two trajectories that enclose theirs.

With q = k_h/(1 + k_v) and D = k_h sin(psi) + (1 + k_v) cos(psi) >= 0, the acceleration of the
block grows with theta and falls with k_r. Hence a trajectory with the greater theta and theta' of
two keeps them until the other impacts, and a smaller k_r only adds to its lead (order). An *upper*
trajectory, with the smallest k_r and the earliest start, and a *lower* one, with the greatest k_r
and the latest start, enclose every block between. Rules A to F say how the enclosure is carried
through impacts and new starts; docs/theory/critical.md proves them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.excursion import (
    IN_AIR,
    NO_IMPACT,
    ORDER_LOST,
    ORDER_TO_BORDER,
    ORDER_TO_REST,
    STOPPED,
    TOPPLED,
    TRUSTED,
    Rules,
    end_of_record,
    excursion_from_rest,
    integrate_excursion,
)
from rbfrag.solver.integrator.state import Place, State, at_rest
from rbfrag.solver.integrator.taylor import OF_RATE, ORDER, bracketed_root
from rbfrag.solver.search.renewal import (
    APART,
    LIFTED,
    TURNED_BACK,
    ExcursionTable,
    common_start,
    fails_after,
    last_rest,
    next_start,
    restart_floor,
)

ALL_SAFE, ALL_TOPPLE, SPLIT, NO_ORDER, OPEN = 0, 1, 2, 3, 4

OVERTAKEN = 3
"""Beside LIFTED, TURNED_BACK and APART, of a pair of trajectories."""

ANYWHERE = math.nan


class BlockInterval(NamedTuple):
    """The blocks of an interval of k_r, and how their bounding trajectories are integrated.

    Args:
        k1: smallest k_r.
        k2: greatest k_r.
        k_upper: k_r of the upper trajectory, k1 less the margin.
        k_lower: k_r of the lower trajectory, k2 and the margin.
        upper_rules: what is checked of D >= 0 along the upper trajectory.
        lower_rules: the same along the lower one.
    """

    k1: float
    k2: float
    k_upper: float
    k_lower: float
    upper_rules: Rules
    lower_rules: Rules


class Trajectory(NamedTuple):
    """A bounding trajectory at one instant."""

    place: Place
    state: State


class Impacts(NamedTuple):
    """Instants between which every block of the interval closes its contact.

    Args:
        first: impact of the lower trajectory.
        last: impact of the upper one.
        in_air: the upper one has none before the record ends.
        mixable: some blocks start again at `first`, while others move: rule E may be tried.
        lower: the lower trajectory at its impact, for rule E.
        upper: the upper one at the same instant.
    """

    first: Place
    last: Place
    in_air: bool
    mixable: bool
    lower: Trajectory
    upper: Trajectory


class Pair(NamedTuple):
    """A pair of trajectories that encloses all blocks in motion.

    Args:
        kind: LIFTED; TURNED_BACK where the lower one falls back at once; APART where there is no
            such pair; OVERTAKEN where the upper one ends before the lower one starts.
        latest: start of the lower trajectory, from rest.
    """

    kind: int
    latest: Place
    upper: Trajectory


class Decision(NamedTuple):
    """A verdict on an interval of k_r.

    Args:
        verdict: ALL_SAFE, ALL_TOPPLE, SPLIT (none), NO_ORDER (D < 0 was met) or OPEN (go on).
        split_at: a k_r to split at, or ANYWHERE.
    """

    verdict: int
    split_at: float


@inner_kernel
def decide(
    excitation: BlockExcitation,
    k1: float,
    k2: float,
    margin: float,
    check: bool,
    table: ExcursionTable,
    rest: int,
    work: np.void,
) -> Decision:
    """Decide whether all blocks with k_r in [k1, k2] topple, or none, where this can be proven.

    Args:
        k1: smallest k_r.
        k2: greatest k_r.
        margin: the bounding trajectories are integrated with k1 (1 - margin) and k2 (1 + margin).
        check: check D >= 0 on the way.
        table: excursions from rest of a k_r <= k1.
        rest: node at which all blocks are at rest, and from which on the table counts.
        work: counts what it costs.
    """
    n = excitation.q.size
    blocks = blocks_between(k1, k2, margin, check)
    # D at the outset: what precedes the last rest before an excursion that topples cannot matter
    impacts = all_at_rest(blocks, last_rest(excitation, table, rest, rest, rest).node)
    # each turn gets past an impact, of which an interval holds a few at most
    for _ in range(4 * n + 16):
        earliest = next_start(excitation, k1, impacts.first)
        # no block starts any more, or (D) no excursion that starts from here on topples
        if earliest.interval >= n or not fails_after(excitation, table, earliest.interval):
            return Decision(ALL_SAFE, ANYWHERE)
        # the weakest block, less the margin, starts first and bounds all from above where they lift
        pair = Pair(APART, earliest, Trajectory(earliest, at_rest(blocks.k_upper)))
        peak = ANYWHERE
        if not impacts.in_air:
            # A: one pair for all, where all are lifted together. Not while the upper trajectory is
            # still off its base at the end of the record: it is not known when all are at rest
            start = common_start(excitation, k2, blocks.k_lower, earliest, impacts.last)
            pair = Pair(start.kind, start.latest, pair.upper)
            peak = start.peak
        if pair.kind == APART and impacts.mixable:
            # E: some blocks start again while others have not closed their contact
            pair = mixed_pair(excitation, blocks, impacts, work)
            if pair.kind == OVERTAKEN:
                return Decision(SPLIT, ANYWHERE)
        if pair.kind == APART:
            # D: a later instant at which all are at rest, with what covers them until then: the
            # excursions from rest, and the upper trajectory that is not over yet
            renewal = last_rest(
                excitation, table, impacts.first.interval, node_of_rest(impacts, n), -1
            )
            if renewal.failing < 0:
                return Decision(ALL_SAFE, ANYWHERE)
            if renewal.node > impacts.first.interval:
                impacts = all_at_rest(blocks, renewal.node)
                continue
            # F: this stretch alone; B: where to split if that does not help
            decision, impacts = one_stretch(excitation, blocks, impacts, earliest, peak, work)
        else:
            decision, impacts = carried_on(excitation, blocks, impacts, pair, work)
        if decision.verdict != OPEN:
            return decision
    return Decision(SPLIT, ANYWHERE)


@within
def blocks_between(k1: float, k2: float, margin: float, check: bool) -> BlockInterval:
    """Pull the ends of an interval of k_r apart by the margin."""
    # D is looked at between the upper trajectory and the least rotated block, at rest with the
    # greatest k_r; between the lower one and the border of the irrecoverable states, beyond which
    # the order no longer matters
    k_lower = k2 * (1.0 + margin)
    return BlockInterval(
        k1,
        k2,
        k1 * (1.0 - margin),
        k_lower,
        Rules(True, ORDER_TO_REST, k_lower) if check else TRUSTED,
        Rules(True, ORDER_TO_BORDER, 0.0) if check else TRUSTED,
    )


@within
def all_at_rest(blocks: BlockInterval, node: int) -> Impacts:
    """Return the pair for all blocks at rest at a node, where both trajectories may restart."""
    place = Place(node, 0.0)
    lower = Trajectory(place, at_rest(blocks.k_lower))
    return Impacts(place, place, False, False, lower, Trajectory(place, at_rest(blocks.k_upper)))


@within
def node_of_rest(impacts: Impacts, n: int) -> int:
    """Return the node by which the upper trajectory has closed its contact; beyond the record if
    never.
    """
    if impacts.in_air:
        return 2 * n
    return impacts.last.interval + (1 if impacts.last.fraction > 0.0 else 0)


@within
def mixed_pair(
    excitation: BlockExcitation, blocks: BlockInterval, impacts: Impacts, work: np.void
) -> Pair:
    """Rule E: one pair for blocks that restart at their impact and for those still in motion.

    The lower trajectory is carried on below zero, virtually, until it turns, with q > k2 all the
    while. Lifted from then on, rest bounds every block from below. From above it is the further
    rotated of two, with the faster rate of the two: the upper trajectory carried on without its
    base, for those still in motion, and a start from rest at the first impact, for the others.
    """
    # The lower one is virtual: below zero it is a motion of the same equation, for which order
    # and lift hold as they do above. Blocks whose contact closes from `landed` on start at once,
    # since q > k2: it bounds them and those still in motion from below all the while
    work["trajectories"] += 1
    q, u = excitation.q, excitation.u
    landed = impacts.lower.place
    place = landed
    state = impacts.lower.state
    while place.interval < q.size - 1 and q[place.interval + 1] > blocks.k_lower:
        i, tau = place
        carried = integrate_excursion(
            excitation, blocks.k_lower, place, state, False, Place(i + 1, 0.0), NO_IMPACT
        )
        work["steps"] += carried.steps
        place = carried.place
        state = carried.state
        if state.rate < 0.0:
            continue
        turn = Place(place.interval, 0.0)
        remaining = 1.0 - tau
        if excitation.p * excitation.interval_s[i] * remaining <= excitation.ph_max and u[0] < 0.0:
            # the interval was one step, whose series is still there: the root of its rate, and
            # a little later, where theta' >= 0 is certain
            turned = bracketed_root(OF_RATE, state.theta, u, ORDER, 0.0, 1.0)
            turn = Place(i, min(tau + turned * remaining + 1e-13, 1.0))
        # from above: a block that starts again is bounded by a start at `landed`, which is not
        # later; one still in motion by the upper trajectory, which must not end before
        restarted = integrate_excursion(
            excitation, blocks.k_upper, landed, at_rest(blocks.k_upper), True, turn, TRUSTED
        )
        upper = integrate_excursion(
            excitation, blocks.k_upper, landed, impacts.upper.state, False, turn, NO_IMPACT
        )
        work["steps"] += restarted.steps + upper.steps
        # what has rotated further and faster than both bounds both
        furthest = restarted.state if restarted.state.theta > upper.state.theta else upper.state
        rate = max(upper.state.rate, restarted.state.rate, 0.0)
        state = State(furthest.theta, rate, furthest.sin, furthest.cos)
        kind = LIFTED if upper.event == STOPPED else OVERTAKEN
        return Pair(kind, turn, Trajectory(upper.place, state))
    return Pair(APART, place, impacts.upper)


@within
def one_stretch(
    excitation: BlockExcitation,
    blocks: BlockInterval,
    impacts: Impacts,
    earliest: Place,
    peak: float,
    work: np.void,
) -> tuple[Decision, Impacts]:
    """Rule F: the blocks that start in one stretch of q > k1 are over when its first one is.

    The excursion from rest at its first crossing bounds them all from above: once that is over,
    all have closed their contact, and the next start is looked for after the stretch.
    """
    q = excitation.q
    excursion = excursion_from_rest(excitation, blocks.k_upper, earliest, blocks.upper_rules)
    work["steps"] += excursion.steps
    work["trajectories"] += 1
    if excursion.event == ORDER_LOST:
        return Decision(NO_ORDER, ANYWHERE), impacts
    if excursion.event == TOPPLED:
        return Decision(SPLIT, border_of_lift(blocks, peak)), impacts
    # the next start of any block is after this stretch, since q <= k1 where it ends; the impacts
    # of both this excursion and those before it are by the later of the two
    node = earliest.interval + 1
    while node < q.size and q[node] > blocks.k1:
        node += 1
    last = not_before(later(impacts.last, excursion.place), node)
    in_air = impacts.in_air or excursion.event == IN_AIR
    after = Impacts(Place(node, 0.0), last, in_air, False, impacts.lower, impacts.upper)
    return Decision(OPEN, ANYWHERE), after


@within
def border_of_lift(blocks: BlockInterval, peak: float) -> float:
    """Rule B: the k_r to split at is that of the peak of q at which A failed.

    It lifts the weaker blocks and not the stronger, if it lies between them.
    """
    return peak if blocks.k1 < peak < blocks.k2 else ANYWHERE


@within
def carried_on(
    excitation: BlockExcitation, blocks: BlockInterval, impacts: Impacts, pair: Pair, work: np.void
) -> tuple[Decision, Impacts]:
    """Integrate a pair of trajectories to the verdict, or to the impacts of both.

    All topple if the lower one does, and none does in this excursion if the upper one does not.
    """
    k_h, w = excitation.k_h, excitation.w
    # a lower trajectory that is never lifted impacts where it starts: rest bounds all
    lower = Trajectory(pair.latest, at_rest(blocks.k_lower))
    if pair.kind != TURNED_BACK:
        excursion = excursion_from_rest(excitation, blocks.k_lower, pair.latest, blocks.lower_rules)
        work["steps"] += excursion.steps
        work["trajectories"] += 1
        if excursion.event == ORDER_LOST:
            return Decision(NO_ORDER, ANYWHERE), impacts
        if excursion.event == TOPPLED:
            # by order every block of the interval topples with the one that bounds it from below
            return Decision(ALL_TOPPLE, ANYWHERE), impacts
        lower = Trajectory(excursion.place, excursion.state)
    # the upper one as far as the lower one went
    meeting = integrate_excursion(
        excitation, blocks.k_upper, pair.upper.place, pair.upper.state, True, lower.place,
        blocks.upper_rules,
    )  # fmt: skip
    work["steps"] += meeting.steps
    work["trajectories"] += 1
    if meeting.event == ORDER_LOST:
        return Decision(NO_ORDER, ANYWHERE), impacts
    if meeting.event == IN_AIR:
        # the record ends before any block comes down, and none has the energy to topple
        return Decision(ALL_SAFE, ANYWHERE), impacts
    if meeting.event != STOPPED:
        # it topples, or rounding lets it impact before the lower one
        return Decision(SPLIT, ANYWHERE), impacts
    # and on to its own impact: by lift none is looked for while q >= k1
    i, tau = lower.place
    q_there = k_h[i] + (k_h[i + 1] - k_h[i]) * tau
    q_there /= w[i] + (w[i + 1] - w[i]) * tau
    lifting = meeting.state.rate >= 0.0 and q_there >= blocks.k1
    excursion = integrate_excursion(
        excitation, blocks.k_upper, meeting.place, meeting.state, lifting,
        end_of_record(excitation), blocks.upper_rules,
    )  # fmt: skip
    work["steps"] += excursion.steps
    if excursion.event == ORDER_LOST:
        return Decision(NO_ORDER, ANYWHERE), impacts
    if excursion.event == TOPPLED:
        return Decision(SPLIT, ANYWHERE), impacts
    # C: none starts again before q has fallen below k1
    floor = restart_floor(excitation.q, blocks.k1, blocks.k2, pair.latest.interval)
    # E can help next where some blocks start again at once, as all do in a stretch of q > k2
    after = Impacts(
        not_before(lower.place, floor),
        not_before(excursion.place, floor),
        excursion.event == IN_AIR,
        q_there > blocks.k_lower and pair.kind != TURNED_BACK and i >= floor,
        lower,
        Trajectory(lower.place, meeting.state),
    )
    return Decision(OPEN, ANYWHERE), after


@within
def not_before(place: Place, node: int) -> Place:
    """Return a position in the record, or the node if it comes later."""
    return Place(node, 0.0) if place.interval < node else place


@within
def later(first: Place, second: Place) -> Place:
    """Return the later of two positions."""
    if second.interval > first.interval:
        return second
    return (
        second if second.interval == first.interval and second.fraction > first.fraction else first
    )
