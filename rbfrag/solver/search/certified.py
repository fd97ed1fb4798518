"""Certified search: verdicts for whole intervals of k_r, from K_up downwards."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.block_excitation import BlockExcitation, block_excitation
from rbfrag.solver.results import MAP_DEPTH, RESOLUTION, FloatArray
from rbfrag.solver.search.lower_bound import all_topple_below
from rbfrag.solver.search.march import (
    INTERVAL,
    ORDERLESS,
    SAFE,
    TO_BOTTOM,
    TO_BRACKET,
    TO_ISLAND,
    TOPPLES,
    Settings,
    march,
    new_march,
)
from rbfrag.solver.search.renewal import excursion_table, no_work
from rbfrag.solver.search.upper_bound import NOTHING_FAILS, upper_bound

MARGIN = 1e-10
"""Relative margin on k_r of the bounding trajectories: above the error of their steps."""

MAP_MARGIN = 1e-6
"""The same in a map of a depth from 100 times as much on, where spans are longer: above the error
of those."""

MAP_SPAN_PH = 0.04
"""Greatest p·T of a span there."""

MAP_SPAN_ERROR = 3e-9
"""Greatest error bound of a span there: as of `spans.SPAN_ERROR`, by the ratio of the margins."""

DEPTH = 1e-9
"""Relative width of an interval that is left undecided."""

ORDERLESS_DEPTH = 1e-3
"""The same where the order of motions is lost, which no narrower interval brings back."""

FIRST_STEP = 1e-3
"""Relative width of the first interval below K_up."""

STEP_BUDGET = 12_000_000
"""Integration steps after which a search is given up: some tenths of a second."""

MAP_STEPS = 1_500_000
"""Integration steps of a map after which it no longer waits for a wide island, and after which it
is given up: the rest of it is undecided."""

MAX_INTERVALS = 20_000

BRACKET_WIDTH = 1e-6
"""Greatest relative width of a bracket."""


@dataclass(frozen=True, eq=False)
class CertifiedMap:
    """Intervals of k_r with verdicts, by decreasing k_r, and the extent of the proof.

    Args:
        k_up: nothing at or above it topples.
        low: lower ends of the intervals, shape (n,); the first one ends at `k_up`.
        high: upper ends, shape (n,).
        verdict: SAFE, TOPPLES, UNKNOWN or ORDERLESS of `rbfrag.solver.search.march`, shape (n,).
        point: a k_r of an undecided interval whose block topples, or NaN, shape (n,).
        reached: k_r down to which verdicts were given.
        complete: False when the step budget ended the search early.
        runs: trajectories integrated.
        steps: integration steps taken.
    """

    k_up: float
    low: FloatArray
    high: FloatArray
    verdict: NDArray[np.int64]
    point: FloatArray
    reached: float
    complete: bool
    runs: int
    steps: int

    @property
    def order_lost(self) -> bool:
        """True if D < 0 occurred."""
        return bool((self.verdict == ORDERLESS).any())

    @property
    def undecided(self) -> NDArray[np.bool_]:
        """Mask of the intervals without a verdict."""
        without: NDArray[np.bool_] = (self.verdict != SAFE) & (self.verdict != TOPPLES)
        return without

    def open_above(self, bottom: float) -> tuple[FloatArray, FloatArray]:
        """Return the ends of undecided intervals above a k_r, shapes (m,), by decreasing k_r."""
        chosen = self.undecided & (self.high > bottom)
        low, high = self.low[chosen], self.high[chosen]
        if self.reached > bottom:  # the search was given up there
            low, high = np.append(low, bottom), np.append(high, self.reached)
        return np.maximum(low, bottom), high

    def undecided_above(self, bottom: float) -> float:
        """Return the total length of undecided k_r down to `bottom`."""
        low, high = self.open_above(bottom)
        return float((high - low).sum())


def keeps_order(excitation: Excitation) -> bool:
    """Return whether D >= 0 in every state short of the verdict, judged by the record alone.

    D = k_h sin(psi) + (1 + k_v) cos(psi) can only be negative where q = k_h/(1 + k_v) and
    tan(psi) have opposite signs and a product below -1. A block with tan(psi) > 0 has a k_r
    that q exceeded before; one beyond its balance point with tan(psi) < 0 has not toppled only
    if q is yet to fall below tan(psi). Either way a value of q is followed by one of the
    opposite sign, positive first.
    """
    # the greatest q so far against each q: only what follows a push can pull
    highest = np.maximum.accumulate(np.maximum(excitation.q, 0.0))
    return bool((highest * -excitation.q).max() <= 1.0)


def surely_topples_below(
    block: BlockExcitation, excitation: Excitation, bottom: float, top: float
) -> float:
    """Return a k_r below which every block topples, `bottom` if none is found."""
    # the bounds of its trajectories rest on the order, which is not checked on the way there
    if not keeps_order(excitation):
        return bottom
    return all_topple_below(block, bottom, top, MARGIN, np.empty(excitation.q.size))


def certified_map(
    excitation: Excitation, *, p2: float, bottom: float, full: bool, map_depth: float = MAP_DEPTH
) -> CertifiedMap:
    """Give verdicts from K_up down to the first toppling block, or to `bottom`.

    Args:
        excitation: the excitation; 1 + k_v > 0 throughout.
        p2: frequency parameter p² [1/s²].
        bottom: least k_r of interest.
        full: go on to `bottom`.
        map_depth: width of k_r/PGA that may be left undecided below the first toppling interval
            as wide as RESOLUTION.
    """
    # Invariant: `intervals[:count]` are adjacent, by falling k_r, from K_up down to `reached`. No
    # block above K_up topples; the verdict of an interval holds for every block in it. The
    # critical value is the upper end of the first interval that topples, or in what is undecided
    # above it
    n = excitation.q.size
    check = not keeps_order(excitation)
    block = block_excitation(excitation, p2=p2)
    total = no_work()
    intervals = np.empty(MAX_INTERVALS, dtype=INTERVAL)
    count = 0

    def give_verdicts(settings: Settings) -> float:
        """March on; return the k_r reached."""
        nonlocal count
        # its own count: the budget is that of one march
        work = no_work()
        m = new_march(settings, n, intervals[count:])
        march(block, m, work)
        count += int(m.state["count"])
        for name in ("trajectories", "steps"):
            total[name] += work[name]
        return float(m.state["high"])

    code, k_up = upper_bound(
        block, bottom, excitation.max_q, MARGIN, 0.1 * DEPTH, check, excursion_table(n), total
    )
    reached = bottom
    if code == NOTHING_FAILS:
        k_up = bottom
    else:
        first = Settings(
            top=k_up, bottom=bottom, margin=MARGIN, depth=DEPTH, least=0.0,
            order_depth=ORDERLESS_DEPTH, first_step=FIRST_STEP, check=check, goal=TO_BRACKET,
            resolution=0.0, inside=False, budget=STEP_BUDGET,
        )  # fmt: skip
        # down to the bracket without limits on islands: this part is what `certified` is about
        before = int(total["steps"])
        reached = give_verdicts(first)
        if full and reached > bottom and total["steps"] - before < STEP_BUDGET:
            # then as finely through the toppling interval that counts at the resolution ...
            below = first._replace(top=reached, inside=True, budget=MAP_STEPS)
            resolution = RESOLUTION * excitation.pga_g
            reached = give_verdicts(below._replace(goal=TO_ISLAND, resolution=resolution))
            # ... and below it to the depth of the map, with wider margins that let spans be longer
            floor = surely_topples_below(block, excitation, bottom, reached)
            if floor < reached:
                margin = MARGIN
                # wider margins must stay far below the depth, or they are what is left open
                if map_depth >= 100.0 * MAP_MARGIN:
                    margin = MAP_MARGIN
                    block = block_excitation(
                        excitation, p2=p2, span_ph=MAP_SPAN_PH, span_error=MAP_SPAN_ERROR
                    )
                least = map_depth * excitation.pga_g
                reached = give_verdicts(
                    below._replace(
                        top=reached, bottom=floor, margin=margin, least=least, goal=TO_BOTTOM
                    )
                )
            # what is left down to the bottom topples whatever came before
            if bottom < floor >= reached:
                intervals[count] = (bottom, reached, TOPPLES, math.nan)
                count, reached = count + 1, bottom
    rows = intervals[:count]
    # without a map the search ends at the first block that topples, and is complete by that
    is_complete = full or not bool(
        ((rows["verdict"] == TOPPLES) | np.isfinite(rows["point"])).any()
    )
    return CertifiedMap(
        k_up=k_up,
        low=rows["low"].copy(),
        high=rows["high"].copy(),
        verdict=rows["verdict"].copy(),
        point=rows["point"].copy(),
        reached=reached,
        complete=not is_complete or reached <= bottom,
        runs=int(total["trajectories"]),
        steps=int(total["steps"]),
    )


class Bracket(NamedTuple):
    """The answer of a search, in k_r.

    Args:
        lower: the greatest k_r known to topple.
        upper: the least known safe above it.
        undecided: length of k_r above that for which nothing is proven.
    """

    lower: float
    upper: float
    undecided: float


def bracket_of(of_map: CertifiedMap) -> Bracket | None:
    """Return the bracket of the critical value; None where nothing topples."""
    safe_from = of_map.k_up
    undecided = 0.0
    for low, high, verdict, point in zip(
        of_map.low.tolist(), of_map.high.tolist(), of_map.verdict.tolist(), of_map.point.tolist(),
        strict=True,
    ):  # fmt: skip
        if verdict == SAFE:
            safe_from = low
            continue
        # an undecided interval counts from a block in it that topples
        topples = high if verdict == TOPPLES else point
        if math.isnan(topples):
            undecided += high - low
            continue
        if safe_from - topples > BRACKET_WIDTH * safe_from:
            # safe intervals end further up: what lies between them and this one is undecided
            safe_from = high
        else:
            # the slivers inside the bracket are its own width
            inside = of_map.undecided & (high <= of_map.low) & (of_map.high <= safe_from)
            undecided -= sum((of_map.high - of_map.low)[inside].tolist())
        return Bracket(topples, safe_from, max(undecided, 0.0))
    return None
