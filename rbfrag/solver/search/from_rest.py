"""Excursion of a block from rest: whether it topples, and its distance from the border."""

from __future__ import annotations

import math

import numpy as np

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel
from rbfrag.solver.integrator.excursion import (
    IMPACT,
    TOPPLED,
    TRUSTED,
    Excursion,
    excursion_from_rest,
)
from rbfrag.solver.integrator.state import Place
from rbfrag.solver.results import FloatArray
from rbfrag.solver.search.renewal import ExcursionTable, fails_after
from rbfrag.solver.search.rises import next_start


@inner_kernel
def linear_distance(excitation: BlockExcitation, start: Place, excursion: Excursion) -> float:
    """Return the distance in k_r of an excursion from the border, by the linear model: > 0 if it
    toppled.

    The linear model says what becomes of the state at the end of the excursion under the remaining
    excitation; referred back to its start, that is a distance in k_r. Good for a secant;
    nothing is concluded from its size.
    """
    time_s, interval_s, remaining = excitation.time_s, excitation.interval_s, excitation.remaining
    i, tau = excursion.place
    psi = math.atan2(excursion.state.sin, excursion.state.cos)
    end_s = time_s[i]
    to_come = remaining[i]
    if tau > 0.0:
        end_s += tau * interval_s[i]
        to_come += (remaining[i + 1] - to_come) * tau
    start_s = time_s[start.interval]
    if start.fraction > 0.0:
        start_s += start.fraction * interval_s[start.interval]
    # a difference of states grows as exp(p t) in the linear model: seen from the start it is that
    # much smaller
    faded = math.exp(-excitation.p * (end_s - start_s))
    distance: float = (excursion.state.rate + to_come - psi) * faded
    # the sign is that of the outcome, even where the estimate rounds to the other side
    if excursion.event == TOPPLED:
        return max(distance, 1e-300)
    return min(distance, -1e-300)


@inner_kernel
def follow(
    excitation: BlockExcitation, kr: float, node: int, table: ExcursionTable, work: np.void
) -> float:
    """Follow a block at rest at a node; return its distance from toppling, > 0 if it topples.

    Args:
        kr: rocking acceleration coefficient.
        table: excursions from rest of a k_r <= kr: where none is left that fails, the run ends.
        work: counts what it costs.
    """
    # invariant: the block rests at `place`; what it did before has no influence on what follows
    n = excitation.q.size
    # a block that is never lifted is as far from toppling as it is strong
    best = -kr
    place = Place(node, 0.0)
    # an interval holds a few impacts at most: an end for a chatter that rounding keeps up
    for _ in range(4 * n + 16):
        start = next_start(excitation, kr, place)
        if start.interval >= n or not fails_after(excitation, table, start.interval):
            break
        # one block alone is no bound of others: the order of motions is not asked about
        excursion = excursion_from_rest(excitation, kr, start, TRUSTED)
        work["steps"] += excursion.steps
        distance = linear_distance(excitation, start, excursion)
        if excursion.event == TOPPLED:
            best = distance
            break
        best = max(best, distance)
        if excursion.event != IMPACT:
            break
        # renewal: after an impact it depends on the past through its next start alone
        place = excursion.place
    work["trajectories"] += 1
    return best


@bare_kernel
def first_change(
    excitation: BlockExcitation,
    kr: FloatArray,
    first: int,
    topples: bool,
    table: ExcursionTable,
    work: np.void,
) -> int:
    """Return the index of the first block from `first` on whose outcome differs from that of the
    others.

    Args:
        kr: rocking acceleration coefficients of blocks at rest when the record begins, shape (m,).
        first: number of the first block to look at.
        topples: what the others do.
        table: as for `follow`.
        work: counts what it costs.

    Returns:
        The number, m where there is none.
    """
    for j in range(first, kr.size):
        if (follow(excitation, kr[j], 0, table, work) > 0.0) != topples:
            return j
    return kr.size
