"""Part `above`: no block stronger than the bracket topples, proven in ball arithmetic.

The rules are those of docs/theory/critical.md (A to D and F), written a second time: without a
margin, since nothing is rounded. k_r, the crossings of q and all comparisons of samples are exact;
the two trajectories that bound the blocks of an interval of k_r are balls. What the balls do not
decide is split, and what is left at a relative width of `DEPTH` counts as not proven.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from flint import arb, ctx, fmpq

from benchmarks.proof.enclosed_run import (
    IMPACT,
    LOST,
    RETURNS,
    STOPPED,
    TOPPLES,
    Block,
    NotEnclosedError,
    Place,
    exact,
)
from rbfrag.solver.excitation import Excitation

SAFE, TOPPLE, SPLIT = "safe", "topple", "split"

DEPTH = 1e-10
"""Relative width of k_r below which an interval without a verdict is left."""

BITS = 96
"""Precision: what decides here is the width of the interval, not that of the balls."""


@dataclass(frozen=True)
class Above:
    """What is proven of all blocks stronger than one.

    Args:
        proven: no block with a k_r of at least this one topples, but for `undecided`.
        reached: least k_r that this is proven for.
        undecided: length of k_r in intervals that were left, relative.
        intervals: intervals of k_r with a verdict of their own.
        steps: Taylor steps taken.
        seconds: processor time.
        reason: why no more is proven.
    """

    proven: bool
    reached: float
    undecided: float
    intervals: int
    steps: int
    seconds: float
    reason: str = ""


class Stretch(NamedTuple):
    """A stretch of q > k_r and its excursion from rest.

    Args:
        first: its first node.
        end: the node after its last.
        over: first node at which the excursion is over; twice the number of nodes for never.
        fails: it topples, or is not enclosed.
    """

    first: int
    end: int
    over: int
    fails: bool


def keeps_order(excited: Excitation) -> bool:
    """Whether D >= 0 by the record alone: no q is followed by one below minus its inverse."""
    highest = fmpq(0)
    for a, w in zip(excited.k_h.tolist(), excited.w.tolist(), strict=True):
        q = exact(a) / exact(w)
        if highest * -q > 1:
            return False
        highest = max(highest, q)
    return True


class Record:
    """Blocks of one size under one excitation, and exact comparisons of its samples."""

    def __init__(self, excited: Excitation, p2: float) -> None:
        self.excited, self.p2 = excited, p2
        self.n = excited.k_h.size
        self.steps = 0

    def block(self, kr: fmpq) -> Block:
        return Block(self.excited, self.p2, kr)

    def q(self, node: int) -> fmpq:
        return exact(self.excited.k_h[node]) / exact(self.excited.w[node])


class Table:
    """Rule D: excursions from rest of one k_r, each when it is needed."""

    def __init__(self, record: Record, kr: fmpq, first: int = 0) -> None:
        self.record, self.kr = record, kr
        self.block = record.block(kr)
        self.stretches: list[Stretch] = []
        self.next = first
        self.failing_end = -1

    def one_more(self) -> bool:
        """Look at the next stretch; False where there is none."""
        n, block = self.record.n, self.block
        node = self.next
        while node < n and block.sign(node) <= 0:
            node += 1
        if node >= n:
            self.next = n
            return False
        end = node
        while end < n and block.sign(end) > 0:
            end += 1
        over, fails = 2 * n, False
        start = block.next_start(Place(max(node - 1, 0), arb(0)))
        if start is not None:
            before = block.steps
            try:
                trajectory = block.integrate(start, arb(0), arb(0), lifted=True)
                fails = trajectory.event in (LOST, TOPPLES)
                if trajectory.event == IMPACT:
                    over = trajectory.place.interval + 1
            except NotEnclosedError:
                fails = True
            self.record.steps += block.steps - before
        self.stretches.append(Stretch(node, end, over, fails))
        self.next = end
        if fails:
            self.failing_end = end
        return True

    def fails_after(self, node: int) -> bool:
        """Whether any stretch that ends after a node has an excursion that topples."""
        while self.failing_end <= node:
            if not self.one_more():
                return False
        return True

    def last_rest(self, interval: int, rest_from: int, rest: int) -> tuple[int, bool]:
        """The last node of rest before the first failing stretch to come; whether there is one."""
        latest, covered, k = rest, rest_from, 0
        while k < len(self.stretches) or self.one_more():
            stretch = self.stretches[k]
            if stretch.end > interval:
                if stretch.first - 1 >= covered:
                    latest = stretch.first - 1
                if stretch.fails:
                    return latest, True
                covered = max(covered, stretch.over)
            k += 1
        return latest, False


@dataclass
class Impacts:
    """Between which instants every block of an interval of k_r closes its contact."""

    first: Place
    last: Place
    in_air: bool = False


class Decision(NamedTuple):
    """A verdict; for SPLIT the k_r of a peak to split at, if that is why."""

    verdict: str
    split_at: fmpq | None = None


def decide(record: Record, k1: fmpq, k2: fmpq, table: Table, rest: int) -> Decision:
    """Decide whether no block with k1 <= k_r < k2 topples, or all do, if that can be told.

    Args:
        record: the blocks' size and excitation.
        k1: smallest k_r.
        k2: greatest k_r; the block of exactly this one belongs to the interval above.
        table: excursions from rest of a k_r <= k1.
        rest: node at which all blocks are at rest, and from which on the table counts.
    """
    n = record.n
    weak, strong = record.block(k1), record.block(k2)
    try:
        return _decide(record, weak, strong, table, rest, n)
    except NotEnclosedError:
        return Decision(SPLIT)
    finally:
        record.steps += weak.steps + strong.steps


def _decide(
    record: Record, weak: Block, strong: Block, table: Table, rest: int, n: int
) -> Decision:
    node, fails = table.last_rest(rest, rest, rest)
    if not fails:
        return Decision(SAFE)
    impacts = Impacts(Place(node, arb(0)), Place(node, arb(0)))
    for _ in range(4 * n + 16):
        earliest = weak.next_start(impacts.first)
        if earliest is None or not table.fails_after(earliest.interval):
            return Decision(SAFE)
        latest: Place | None = None
        lifted, peak = False, None
        if not impacts.in_air:
            latest, lifted, peak = common_start(record, strong, earliest, impacts.last)
        if latest is not None:
            decision, impacts = carried_on(record, weak, strong, impacts, earliest, latest, lifted)
            if decision is not None:
                return decision
            continue
        # D: a later instant at which all are at rest
        rest_from = 2 * n if impacts.in_air else impacts.last.interval + 1
        node, fails = table.last_rest(impacts.first.interval, rest_from, -1)
        if not fails:
            return Decision(SAFE)
        if node > impacts.first.interval:
            impacts = Impacts(Place(node, arb(0)), Place(node, arb(0)))
            continue
        # F: this stretch alone; B: where to split if that does not help
        trajectory = weak.integrate(earliest, arb(0), arb(0), lifted=True)
        if trajectory.event in (LOST, TOPPLES):
            inside = peak is not None and weak.kr < peak < strong.kr
            return Decision(SPLIT, peak if inside else None)
        after = earliest.interval + 1
        while after < n and weak.sign(after) > 0:
            after += 1
        last = not_before(later(impacts.last, trajectory.place), after)
        in_air = impacts.in_air or trajectory.event == RETURNS
        impacts = Impacts(Place(after, arb(0)), last, in_air)
    return Decision(SPLIT)


def common_start(
    record: Record, strong: Block, earliest: Place, last_impact: Place
) -> tuple[Place | None, bool, fmpq | None]:
    """Rule A: where a trajectory starts that bounds all blocks from below, and whether it lifts.

    That is the first instant with q >= k2 after the last impact, if min(q, k2) does not fall
    between the first start and it. Else None, and the q at which it turns.
    """
    n = record.n
    i, at = last_impact
    while i < n - 1 and at.is_zero() and record.excited.interval_s[i] == 0.0:
        i += 1
    latest, lifts = None, False
    sign = strong.sign_at(Place(i, at)) if i < n - 1 else -1
    if sign >= 0:
        latest, lifts = Place(i, at), sign > 0 or strong.sign(i + 1) > 0
    else:
        latest, lifts = strong.next_start(Place(i, at)), True
        # a peak that just touches k2, which blocks of less than k2 are lifted by
        for node in range(i + 1, n - 1 if latest is None else latest.interval + 1):
            if strong.sign(node) == 0:
                latest, lifts = Place(node, arb(0)), strong.sign(node + 1) > 0
                break
    # q is monotone between nodes, and so is what is left of the last interval: it rises there, or
    # is above k2 at its end
    for node in range(earliest.interval, n - 1 if latest is None else latest.interval):
        if strong.sign(node + 1) < 0 and record.q(node + 1) < record.q(node):
            return None, False, record.q(node)
    return latest, lifts, None


def carried_on(
    record: Record,
    weak: Block,
    strong: Block,
    impacts: Impacts,
    earliest: Place,
    latest: Place,
    lifted: bool,
) -> tuple[Decision | None, Impacts]:
    """Carry a pair of trajectories to the verdict, or to the impacts of both."""
    lower, lower_event = latest, IMPACT
    if lifted:
        trajectory = strong.integrate(latest, arb(0), arb(0), lifted=True)
        lower, lower_event = trajectory.place, trajectory.event
        if lower_event in (LOST, TOPPLES):
            return Decision(TOPPLE), impacts
    stop = lower if lower_event == IMPACT else None
    meeting = weak.integrate(earliest, arb(0), arb(0), lifted=True, stop=stop)
    if meeting.event == RETURNS and stop is None:
        return Decision(SAFE), impacts
    if meeting.event != STOPPED:
        return Decision(SPLIT), impacts
    lifting = bool(meeting.rate >= 0) and weak.sign_at(lower) >= 0
    trajectory = weak.integrate(lower, meeting.theta, meeting.rate, lifted=lifting)
    if trajectory.event in (LOST, TOPPLES):
        return Decision(SPLIT), impacts
    floor = restart_floor(record, weak, strong, latest.interval)
    return None, Impacts(
        not_before(lower, floor), not_before(trajectory.place, floor), trajectory.event == RETURNS
    )


def restart_floor(record: Record, weak: Block, strong: Block, i: int) -> int:
    """Rule C: the first node at which a block lifted in interval i may start anew; -1 for none."""
    n = record.n
    node = i + 1
    while node < n and strong.sign(node) >= 0:
        node += 1
    first = node
    while node < n and weak.sign(node) > 0:
        if node > first and record.q(node) > record.q(node - 1):
            return -1
        node += 1
    return node


def not_before(place: Place, node: int) -> Place:
    """A place, or the node if that comes later."""
    return Place(node, arb(0)) if place.interval < node else place


def later(first: Place, other: Place) -> Place:
    """The later of two places; a ball that holds both where they overlap."""
    if first.interval != other.interval:
        return first if first.interval > other.interval else other
    return Place(first.interval, first.at.max(other.at))


def nothing_above(
    excited: Excitation,
    *,
    p2: float,
    kr: float,
    k_up: float,
    seconds: float,
    watch: Callable[[str], object] = str,
) -> Above:
    """Prove that no block with a k_r from `kr` on topples.

    Args:
        excited: the excitation, 1 + k_v > 0.
        p2: frequency parameter p² [1/s²].
        kr: the k_r, the upper end of a bracket.
        k_up: a k_r from which on no excursion from rest topples, as a search says; proven here.
        seconds: processor time after which the proof is given up.
        watch: told of each verdict.
    """
    started = time.process_time()
    record = Record(excited, p2)
    intervals, undecided = 0, 0.0

    def result(reached: fmpq, reason: str = "") -> Above:
        return Above(
            not reason, float(arb(reached)), undecided / kr, intervals, record.steps,
            time.process_time() - started, reason,
        )  # fmt: skip

    if not keeps_order(excited):
        return result(exact(k_up), "D >= 0 is not certain from the record alone")
    with ctx.workprec(BITS):
        bottom, high = exact(kr), exact(max(k_up, kr))
        top = Table(record, high)
        if top.fails_after(-1):
            return result(high, "an excursion from rest topples at K_up, or is not enclosed")
        coarse = Table(record, bottom)
        if not coarse.fails_after(-1):
            return result(bottom)
        window = coarse.last_rest(0, 0, 0)[0]
        fine, patience = coarse, 2
        wide = min(exact(1e-3) * high, high - bottom)
        while high > bottom:
            if time.process_time() - started > seconds:
                return result(high, f"not finished in {seconds:.0f} s")
            low = max(high - wide, bottom)
            near = fine.kr <= low
            decision = decide(record, low, high, fine if near else coarse, window if near else 0)
            watch(f"{float(arb(low)):.9f} {float(arb(high)):.9f} {decision.verdict}")
            if decision.verdict == TOPPLE:
                return result(high, f"blocks from {float(arb(low)):.9g} on topple")
            if decision.verdict == SAFE:
                intervals += 1
                wide = 2 * (high - low)
                high = low
                continue
            if decision.split_at is not None:
                wide = high - decision.split_at
                continue
            table_kr = fine.kr if near else coarse.kr
            if low - table_kr > patience * (high - low):
                state = (len(fine.stretches), fine.failing_end)
                fine = Table(record, max(low - (high - low) / 2, bottom), window)
                fine.last_rest(window, window, window)
                gained = state != (len(fine.stretches), fine.failing_end)
                patience = 2 if gained else patience * 8
                continue
            if high - low <= exact(DEPTH) * high:
                undecided += float(arb(high - low))
                if undecided > 10 * DEPTH * kr:
                    return result(high, "intervals of k_r that no split decides")
                high = low
                continue
            wide = (high - low) / 2
        return result(bottom)
