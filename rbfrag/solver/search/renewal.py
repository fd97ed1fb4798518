"""Starts of motion and instants of rest, for one k_r or a range.

Motion starts at upcrossings of k_r by q = k_h/(1 + k_v) (rules A and C of the search); rule D finds
instants at which every block of a range of k_r is certain to be at rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.excursion import (
    IMPACT,
    IN_AIR,
    ORDER_TO_REST,
    ORDER_TRUSTED,
    Rules,
    excursion_from_rest,
)
from rbfrag.solver.integrator.state import Place
from rbfrag.solver.integrator.toppling_kernel import next_lifting_node
from rbfrag.solver.results import FloatArray

LIFTED, TURNED_BACK, APART = 0, 1, 2


class CommonStart(NamedTuple):
    """Start of one pair of trajectories that encloses all blocks of an interval, if there is one.

    Args:
        kind: LIFTED where it does; TURNED_BACK where all blocks are lifted but q turns before the
            lower trajectory starts; APART where q turns lower.
        latest: start of the lower trajectory; LIFTED or TURNED_BACK.
        peak: q where it turns; NaN where it turns at the earliest start.
    """

    kind: int
    latest: Place
    peak: float


@inner_kernel
def crossing(excitation: BlockExcitation, i: int, kr: float) -> float:
    """Return the fraction of interval i at which k_h - (1 + k_v) k_r rises through zero."""
    # k_h - (1 + k_v) k_r is linear in the interval as q itself is not
    g0 = excitation.k_h[i] - excitation.w[i] * kr
    g1 = excitation.k_h[i + 1] - excitation.w[i + 1] * kr
    if g0 >= 0.0 or g1 <= g0:
        return 0.0
    fraction: float = min(-g0 / (g1 - g0), 1.0)
    return fraction


@inner_kernel
def next_start(excitation: BlockExcitation, kr: float, place: Place) -> Place:
    """Return the first position from one on with q > kr; interval n if there is none.

    A start at the last node counts as none: the ground is at rest from there on.
    """
    k_h, w, q = excitation.k_h, excitation.w, excitation.q
    n = q.size
    i, tau = place
    if tau > 0.0 and i < n - 1:
        # inside an interval: lifted at once where q > k_r, or at the crossing that is still to come
        k_h_there = k_h[i] + (k_h[i + 1] - k_h[i]) * tau
        if k_h_there > (w[i] + (w[i + 1] - w[i]) * tau) * kr:
            return place
        if q[i + 1] > kr:
            return Place(i, max(tau, crossing(excitation, i, kr)))
        i += 1
    if i >= n - 1:
        return Place(n, 0.0)
    if q[i] > kr:
        return Place(i, 0.0)
    j = next_lifting_node(q, excitation.block_max_q, i + 1, n, kr)
    if j >= n:
        return Place(n, 0.0)
    return Place(j - 1, crossing(excitation, j - 1, kr))


@inner_kernel
def common_start(
    excitation: BlockExcitation, k2: float, k_lower: float, earliest: Place, last_impact: Place
) -> CommonStart:
    """Rule A: the start of one trajectory that bounds all blocks with k_r <= k2 from below.

    It is there if min(q, k2) does not fall between the first start and the last.

    Args:
        k2: greatest k_r.
        k_lower: k_r of the lower bounding trajectory, >= k2.
        earliest: start e of the weakest block.
        last_impact: by when all have closed their contact.
    """
    # q is scanned at the nodes from e on: a quotient of straight lines, it is monotone between them

    # A holds if min(q, k2) does not decrease from the first start to the last. When a block k
    # starts in between, q >= k1 since e: the upper trajectory has been lifted, and bounds it.
    # And q >= k from there until the lower one starts: by then the block has been lifted itself
    k_h, w, q = excitation.k_h, excitation.w, excitation.q
    n = q.size
    e, tau_e = earliest
    previous = q[e]
    if tau_e > 0.0:
        previous = k_h[e] + (k_h[e + 1] - k_h[e]) * tau_e
        previous /= w[e] + (w[e + 1] - w[e]) * tau_e
    peak = math.nan
    node = e + 1
    while True:
        i = node - 1
        # the last start is the first place with q >= k2 after the last impact: before that
        # impact only a fall matters
        if i >= last_impact.interval:
            low = 0.0
            if i == e:
                low = tau_e
            if i == last_impact.interval:
                low = max(low, last_impact.fraction)
            if node >= n:
                # the record ends above k2: all are lifted, and the ground is at rest from there
                if previous >= k2:
                    return CommonStart(TURNED_BACK, Place(n - 1, 0.0), peak)
                return CommonStart(APART, Place(n, 0.0), peak)
            k_h_there = k_h[i] + (k_h[node] - k_h[i]) * low
            if k_h_there >= (w[i] + (w[node] - w[i]) * low) * k_lower:
                return CommonStart(LIFTED, Place(i, low), peak)
            if q[node] >= k_lower:
                latest = max(low, crossing(excitation, i, k_lower))
                return CommonStart(LIFTED, Place(i, latest), peak)
            if q[node] < previous:
                # between k2 and the lower trajectory's k_r, greater by the margin: every block is
                # lifted by then, and that trajectory falls back at once
                kind = TURNED_BACK if previous >= k2 and low == 0.0 else APART
                return CommonStart(kind, Place(i, 0.0), peak)
        elif q[node] < min(previous, k_lower):
            # A fails: min(q, k2) falls, and some blocks are lifted before and some after
            return CommonStart(APART, Place(i, 0.0), peak)
        previous = q[node]
        peak = previous
        node += 1


@inner_kernel
def restart_floor(q: FloatArray, k1: float, k2: float, i: int) -> int:
    """Rule C: the first node at which a block lifted in interval i may restart.

    If q stays >= k2 after the common start and then falls without a rise to <= k1, no block
    with k_r in [k1, k2] impacts before q has fallen below its k_r (by lift), nor starts before
    that node. -1 where q does otherwise; n if the record ends first.
    """
    n = q.size
    node = i + 1
    while node < n and q[node] >= k2:
        node += 1
    # a rise between k2 and k1 would lift some of those that have closed their contact there
    first = node
    while node < n and q[node] > k1:
        if node > first and q[node] > q[node - 1]:
            return -1
        node += 1
    return node


WORK = np.dtype([("trajectories", np.int64), ("steps", np.int64)])
"""What a search has cost."""

STRETCH = np.dtype(
    [
        # first node of a stretch of q > k_r, and the node after its last
        ("first", np.int64),
        ("end", np.int64),
        # first node at which its excursion from rest is over, n for never
        ("over", np.int64),
        # whether that topples
        ("fails", np.bool_),
    ],
    align=True,
)

ABOUT = np.dtype(
    [
        # how many stretches are known; where the next is looked for, and where none is any more
        ("known", np.int64),
        ("next", np.int64),
        ("stop", np.int64),
        # how many of them topple, and the node after the last of these
        ("failing", np.int64),
        ("failing_end", np.int64),
        ("steps", np.int64),
        # what of D >= 0 is checked: a constant of `Rules`
        ("order", np.int64),
        # k_r of the stretches; that of the excursions, less by the margin, so that they bound
        # those of all larger k_r; the largest k_r that conclusions are drawn for
        ("kr", np.float64),
        ("k_upper", np.float64),
        ("kr_other", np.float64),
    ]
)


class ExcursionTable(NamedTuple):
    """Excursions from rest of one k_r, each integrated only when it is needed.

    Every excursion of a block with a larger k_r starts in a stretch of q above this one and is
    bounded from above by the one from rest: it is over when that is, and topples only if that does.

    Args:
        stretches: of dtype STRETCH, shape (n,).
        about: of dtype ABOUT.
    """

    stretches: NDArray[np.void]
    about: np.void


class Renewal(NamedTuple):
    """The last instant of rest before an excursion that topples.

    Args:
        node: its node; -1 where none is known.
        failing: number of the stretch that topples; -1 where none is to come.
    """

    node: int
    failing: int


def no_work() -> np.void:
    """Return a count of work at zero."""
    count: np.void = np.zeros(1, dtype=WORK)[0]
    return count


def excursion_table(n: int) -> ExcursionTable:
    """Return a table for a record of n nodes; until it is begun, anything may topple."""
    # the end of the last that topples is beyond every node: `fails_after` says yes to any
    table = ExcursionTable(np.empty(n, dtype=STRETCH), np.zeros(1, dtype=ABOUT)[0])
    table.about["failing_end"] = np.iinfo(np.int64).max
    return table


@inner_kernel
def begin(
    table: ExcursionTable,
    kr: float,
    margin: float,
    kr_other: float,
    check: bool,
    first: int,
    stop: int,
) -> None:
    """Restart a table at another k_r.

    Args:
        kr: the stretches are those of q > kr.
        margin: their excursions are integrated with kr (1 - margin).
        kr_other: the largest k_r that conclusions are drawn for.
        check: check D >= 0.
        first: look at stretches from this node on ...
        stop: ... that begin before this one.
    """
    about = table.about
    about["known"] = 0
    about["next"] = first
    about["stop"] = stop
    about["failing"] = 0
    about["failing_end"] = 0
    about["steps"] = 0
    about["order"] = ORDER_TO_REST if check else ORDER_TRUSTED
    about["kr"] = kr
    about["k_upper"] = kr * (1.0 - margin)
    about["kr_other"] = kr_other


@inner_kernel
def one_more(excitation: BlockExcitation, table: ExcursionTable) -> bool:
    """Rule D: integrate the excursion from rest of the next stretch; False where there is none.

    It bounds every excursion of that stretch, of any larger k_r, from above.
    """
    about = table.about
    q = excitation.q
    n = q.size
    kr = about["kr"]
    node = next_lifting_node(q, excitation.block_max_q, about["next"], about["stop"], kr)
    if node >= about["stop"]:
        about["next"] = node
        return False
    # a block of larger k_r that starts in this stretch does so at the crossing or later, where
    # the excursion from the crossing has been lifted (theta, theta' >= 0): that one bounds it
    end = node
    while end < n and q[end] > kr:
        end += 1
    start = next_start(excitation, kr, Place(max(node - 1, 0), 0.0))
    over = n
    fails = False
    # no start at the last node: the ground is at rest from there on, and no block lifts off
    if start.interval < n:
        rules = Rules(True, about["order"], about["kr_other"])
        excursion = excursion_from_rest(excitation, about["k_upper"], start, rules)
        about["steps"] += excursion.steps
        if excursion.event == IMPACT:
            over = excursion.place.interval + (1 if excursion.place.fraction > 0.0 else 0)
        else:
            # still in motion at the end without the energy to topple is safe; where the order of
            # motions is lost nothing is proven, and that counts as toppling
            fails = excursion.event != IN_AIR
    stretch = table.stretches[about["known"]]
    stretch["first"] = node
    stretch["end"] = end
    stretch["over"] = over
    stretch["fails"] = fails
    about["known"] += 1
    about["next"] = end
    if fails:
        about["failing"] += 1
        about["failing_end"] = end
    return True


@within
def all_known(excitation: BlockExcitation, table: ExcursionTable) -> int:
    """Integrate all remaining excursions; return the number of those that topple."""
    while one_more(excitation, table):
        pass
    failing: int = table.about["failing"]
    return failing


@within
def add_work(table: ExcursionTable, work: np.void) -> None:
    """Add the work spent on the excursions of a table."""
    work["trajectories"] += table.about["known"]
    work["steps"] += table.about["steps"]


@within
def fails_after(excitation: BlockExcitation, table: ExcursionTable, node: int) -> bool:
    """Rule D: whether any stretch that ends after a node has an excursion that topples."""
    # a stretch that has ended before this node cannot lift a block that is at rest there; how far
    # the table is filled in is left to who asks, most never need the end of the record
    while table.about["failing_end"] <= node:
        if not one_more(excitation, table):
            return False
    return True


@inner_kernel
def last_rest(
    excitation: BlockExcitation, table: ExcursionTable, interval: int, rest_from: int, rest: int
) -> Renewal:
    """Rule D: the last instant of rest before the first failing stretch that is still to come.

    Args:
        interval: interval of the first impact: stretches that end before it are past.
        rest_from: node by which the present excursions are over; larger than any for never.
        rest: node at which all are known to be at rest; -1 for none.
    """
    latest_rest = rest
    covered = rest_from
    k = 0
    while k < table.about["known"] or one_more(excitation, table):
        stretch = table.stretches[k]
        if stretch["end"] > interval:
            # nothing covers the node before this stretch: every block is at rest there
            if stretch["first"] - 1 >= covered:
                latest_rest = stretch["first"] - 1
            if stretch["fails"]:
                # later rests do not help: blocks may be lost by then
                return Renewal(latest_rest, k)
            covered = max(covered, stretch["over"])
        k += 1
    return Renewal(latest_rest, -1)
