"""Rule D: instants at which every block of a range of k_r is certain to be at rest."""

from __future__ import annotations

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
from rbfrag.solver.search.rises import next_start

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
