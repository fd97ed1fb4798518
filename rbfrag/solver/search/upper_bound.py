"""K_up: no block with a larger k_r topples, because no excursion from rest of one does."""

from __future__ import annotations

import math

import numpy as np

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.excursion import TRUSTED, excursion_from_rest
from rbfrag.solver.integrator.state import Place
from rbfrag.solver.integrator.toppling_kernel import next_lifting_node
from rbfrag.solver.search.borders import Border, narrowed, next_trial
from rbfrag.solver.search.from_rest import linear_distance
from rbfrag.solver.search.renewal import ExcursionTable, add_work, all_known, begin
from rbfrag.solver.search.rises import next_start

NOTHING_FAILS, BORDER, AT_THE_TOP = 0, 1, 2


@within
def distance_of_stretches(
    excitation: BlockExcitation, kr: float, margin: float, first: int, stop: int, work: np.void
) -> float:
    """Return the distance in k_r from toppling of the excursions from rest that begin in [first,
    stop).

    Positive if one topples. The size is the linear model's estimate of the distance in k_r:
    good for a secant, and nothing is concluded from it.
    """
    q = excitation.q
    n = q.size
    best = -math.inf
    node = next_lifting_node(q, excitation.block_max_q, first, stop, kr)
    # a stretch that has begun before `first` is that of its first node
    while node > 0 and node < stop and q[node - 1] > kr:
        node -= 1
    while node < stop:
        start = next_start(excitation, kr, Place(max(node - 1, 0), 0.0))
        if start.interval >= n:
            break
        # less by the margin: what does not topple here is safe in spite of the errors of steps
        excursion = excursion_from_rest(excitation, kr * (1.0 - margin), start, TRUSTED)
        work["steps"] += excursion.steps
        work["trajectories"] += 1
        best = max(best, linear_distance(excitation, start, excursion))
        while node < n and q[node] > kr:
            node += 1
        node = next_lifting_node(q, excitation.block_max_q, node, stop, kr)
    if math.isinf(best):  # nothing starts there
        best = -kr
    return best


@inner_kernel
def border_of_stretches(
    excitation: BlockExcitation,
    bottom: float,
    guess: float,
    top: float,
    margin: float,
    width: float,
    first: int,
    stop: int,
    work: np.void,
) -> tuple[float, bool]:
    """Find the k_r below which an excursion from rest that begins in [first, stop) topples.

    Returns:
        The least k_r known not to fail (`top` where all do), and whether any fails.
    """
    # By the lemma "order" a block of larger k_r starts later in a stretch and accelerates less: its
    # fresh excursion topples only if those of smaller k_r do, and there is one border

    # neither end has been looked at: the guess is near the root, its sides are found from there
    b = Border(bottom, top, True, math.inf, -math.inf, 0, 0, top - bottom)
    reach = 0.004
    k = guess
    while b.high - b.low > width * b.high:
        b = narrowed(b, k, distance_of_stretches(excitation, k, margin, first, stop, work))
        # below the least k_r of interest nothing is asked
        if k <= bottom and b.high == k:
            return bottom, False
        if not math.isinf(b.at_low) and not math.isinf(b.at_high):
            b, k = next_trial(b, width)
            continue
        # one side only so far: go on to the other, further each time
        reach *= 4.0
        k = b.low * (1.0 + reach) if math.isinf(b.at_high) else b.high * (1.0 - reach)
        if k >= top:
            k = 0.5 * (b.low + top)
        k = max(k, bottom)
    return b.high, not math.isinf(b.at_low)


@bare_kernel
def upper_bound(
    excitation: BlockExcitation,
    bottom: float,
    top: float,
    margin: float,
    width: float,
    check: bool,
    table: ExcursionTable,
    work: np.void,
) -> tuple[int, float]:
    """Find K_up between two k_r.

    Args:
        bottom: least k_r of interest.
        top: greatest q of the record.
        margin: the excursions are integrated with k_r (1 - margin).
        width: relative width to which K_up is bisected.
        check: check D >= 0; where it fails the answer is `top`.
        table: the excursion table, filled anew.
        work: counts what it costs.

    Returns:
        NOTHING_FAILS (no excursion from rest at `bottom` topples), BORDER or AT_THE_TOP, and K_up.
    """
    q = excitation.q
    n = q.size
    # K_up is the largest k_r for which the fresh excursion of some stretch of q > k_r topples. By
    # the lemma "lift" every start lies behind the fresh one of its stretch, so that no block above
    # K_up topples. In the linear model K_up is the maximum of the remaining excitation

    # an excursion that topples at the top itself leaves no bound below it
    begin(table, top, margin, top, check, 0, n)
    failing = all_known(excitation, table)
    add_work(table, work)
    if failing > 0:
        return AT_THE_TOP, top
    high = bottom
    some_topple = False
    guess = excitation.remaining_max
    first = excitation.remaining_max_node
    if guess > bottom and q[first] > bottom:
        # the stretch that decides in the linear model is the one to begin with
        stop = first + 1
        while stop < n and q[stop] > bottom:
            stop += 1
        high, some_topple = border_of_stretches(
            excitation, bottom, min(guess, top), top, margin, width, first, stop, work
        )
        if not some_topple:
            high = bottom
    while True:
        # no other stretch may fail at `high`
        begin(table, high, margin, top, check, 0, n)
        failing = all_known(excitation, table)
        add_work(table, work)
        if failing == 0:
            return BORDER if some_topple else NOTHING_FAILS, high
        if high >= top:
            return AT_THE_TOP, top
        # the bound is not that of the first stretch: the largest of those that fail here, all
        # looked at together, since each of them is monotone in k_r
        some_topple = True
        first = n
        stop = 0
        for k in range(table.about["known"]):
            stretch = table.stretches[k]
            if stretch["fails"]:
                first = min(first, stretch["first"])
                stop = max(stop, stretch["end"])
        before = high
        high, _ = border_of_stretches(
            excitation, high, high * 1.001, top, margin, width, first, stop, work
        )
        if high <= before:  # it is the order of motions that is lost
            return AT_THE_TOP, top
