"""Certified search: verdicts for whole intervals of k_r, from K_up downwards, and the toppling and
safe islands that they show below the critical value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.block_excitation import BlockExcitation, block_excitation
from rbfrag.solver.results import MAP_DEPTH, RESOLUTION, FloatArray, OutcomeIntervals
from rbfrag.solver.search.borders import (
    NOTHING_FAILS,
    all_topple_below,
    border,
    first_change,
    upper_bound,
)
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


PROBES = 12
"""Single blocks looked at below the critical one, equally spaced in ln k_r."""

BORDER = 1e-9
"""Relative width to which the floor of an island is closed in on."""

OUTCOMES = {SAFE: "safe", TOPPLES: "topples"}


class Islands(NamedTuple):
    """Islands below the critical value; lengths and values in k_r.

    `resolved` is None where no toppling interval is as wide as the resolution.
    """

    width: float
    resolved: float | None
    reentrant: bool


def outcome_intervals(
    certified: CertifiedMap, pga_g: float, max_q: float, bottom: float | None = None
) -> OutcomeIntervals:
    """Return the map over k_r/PGA, rising, up to the k_r that q never exceeds.

    Args:
        certified: verdicts in k_r, falling.
        pga_g: PGA [g].
        max_q: greatest k_h/(1 + k_v).
        bottom: k_r down to which the map reaches, undecided where the search was given up
            above it; None for where the search ended.
    """
    # a partition: `edges` has one element more than `outcomes`, and outcome i holds between edges
    # i and i + 1. Above max q no block uplifts, and above K_up none topples: both are safe
    low = certified.low[::-1]
    high = certified.high[::-1]
    outcomes = [OUTCOMES.get(int(v), "undecided") for v in certified.verdict[::-1]]
    edges = [*low.tolist(), *high.tolist()[-1:]] or [certified.k_up]
    if bottom is not None and edges[0] > bottom:
        edges.insert(0, bottom)
        outcomes.insert(0, "undecided")
    top = max(max_q, certified.k_up)
    if top > certified.k_up:
        edges.append(top)
        outcomes.append("safe")
    kept_edges = edges[:1]
    kept_outcomes: list[str] = []
    for outcome, edge in zip(outcomes, edges[1:], strict=True):
        if kept_outcomes and kept_outcomes[-1] == outcome:
            kept_edges[-1] = edge
        else:
            kept_outcomes.append(outcome)
            kept_edges.append(edge)
    ratio = np.array(kept_edges) / pga_g
    # ends one rounding apart may fall together in the quotient, and such an interval is none
    wide = ratio[1:] > ratio[:-1]
    return OutcomeIntervals(
        k_lo=ratio[:-1][wide],
        k_hi=ratio[1:][wide],
        outcome=tuple(name for name, is_wide in zip(kept_outcomes, wide, strict=True) if is_wide),  # type: ignore[misc]
    )


def islands_of_map(
    certified: CertifiedMap, block: BlockExcitation, lower: float, resolution: float
) -> tuple[Islands, int]:
    """Return the islands of a full map.

    Undecided slivers count to the interval above them; the lower end of the deciding island,
    which lies in one, is closed in on by single blocks. A safe gap narrower than the resolution
    does not end a toppling island for `resolved`, nor make the set reentrant.

    Args:
        certified: the map, in k_r.
        block: the excitation of the blocks.
        lower: greatest k_r that topples.
        resolution: width of k_r below which islands are ignored.

    Returns:
        What was read, and the number of blocks.
    """
    # down through the map; island_top is the top of the toppling island being passed, gap_top that
    # of the safe gap (None inside an island). Gaps up to the resolution are bridged for `resolved`
    work = no_work()
    width: float | None = None
    resolved: float | None = None
    reentrant = False
    island_top = lower
    gap_top: float | None = None
    bottom = lower
    for low, high, verdict in zip(
        certified.low.tolist(), certified.high.tolist(), certified.verdict.tolist(), strict=True
    ):
        # what lies above the answer is no island below it
        if high > lower and low >= lower:
            continue
        if verdict == SAFE:
            if gap_top is None:
                gap_top = high
            if width is None:
                # the island of the answer ends in the sliver between the two verdicts
                _, floor = border(block, high, -1.0, bottom, BORDER, 0, excursion_table(0), work)
                width = lower - floor
            if gap_top - low > resolution:
                reentrant = True
        elif verdict == TOPPLES:
            if gap_top is not None and gap_top - high > resolution:
                island_top = high
            gap_top = None
            bottom = low
            if resolved is None and island_top - bottom >= resolution:
                resolved = island_top
    # no safe interval below: it reaches down to the end of the map
    if width is None:
        width = lower - certified.reached
        if resolved is None and width >= resolution:
            resolved = lower
    return Islands(width, resolved, reentrant), int(work["trajectories"])


def islands_by_blocks(
    block: BlockExcitation, lower: float, floor: float, bottom: float, resolution: float
) -> tuple[Islands, int]:
    """Search for islands below the critical value by single blocks: evidence, not a proof.

    Args:
        block: the excitation of the blocks.
        lower: greatest k_r that topples.
        floor: least k_r to look at; every one below it topples, or is below `bottom`.
        bottom: least k_r of interest.
        resolution: width of k_r below which islands are ignored.

    Returns:
        What was found, and the number of blocks.
    """
    # every block below the answer topples: one island, as wide as it can be
    if lower <= floor:
        return Islands(lower - bottom, lower, False), 0
    kr = np.geomspace(lower, floor, PROBES)
    # the island of the critical value itself may be narrower than the spacing
    near = lower - resolution * np.array([0.25, 1.0])
    kr = np.concatenate([[lower], near[near > kr[1]], kr[1:]])
    nothing_known = excursion_table(0)
    work = no_work()
    at = 1
    inside = True  # of an island
    edges = [lower]  # tops and floors of islands in turn
    resolved: float | None = None
    reentrant = False
    while resolved is None or not reentrant:
        turn = first_change(block, kr, at, inside, nothing_known, work)
        # all the rest do the same, down to the limit
        if turn == kr.size:
            edge = bottom
            if not inside:
                break
        else:
            low_side, high_side = border(
                block, float(kr[turn]), -1.0 if inside else 1.0, float(kr[turn - 1]), BORDER,
                0, nothing_known, work,
            )  # fmt: skip
            edge = high_side if inside else low_side
        if inside and resolved is None and edges[-1] - edge >= resolution:
            resolved = edges[-1]
        if not inside:
            reentrant = reentrant or edges[-1] - edge > resolution
        edges.append(edge)
        if turn == kr.size:
            break
        if inside and resolved is not None and floor > bottom and edge - kr[turn] > resolution:
            reentrant = True  # the lowest block is known to topple
        inside = not inside
        at = turn + 1
    return Islands(lower - edges[1], resolved, reentrant), int(work["trajectories"])
