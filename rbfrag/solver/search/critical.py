"""Critical block of a ground motion: the strongest one that it topples, with a proof.

The set of k_r that topple is often not one interval: an earlier pulse may leave the block
rocking so that the decisive one misses. No search by single blocks can promise that it has
stepped over none. The search here decides whole intervals of k_r at a time, by two trajectories
that enclose those of every block between (`rbfrag.solver.search.envelopes`), from an upper bound
K_up downwards. Where the argument does not hold, the answer is an interval: from what was seen to
topple to K_up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, kept_excitation, motion_remarks
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.block_excitation import block_excitation
from rbfrag.solver.integrator.toppling_kernel import TOPPLED, Run
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import (
    MAP_DEPTH,
    RESOLUTION,
    SEARCH_LIMIT,
    FloatArray,
    IntArray,
    Polarity,
    SearchPoints,
)
from rbfrag.solver.search.certified import (
    BRACKET_WIDTH,
    MAP_SPAN_ERROR,
    MAP_SPAN_PH,
    Bracket,
    CertifiedMap,
    bracket_of,
    certified_map,
    islands_by_blocks,
    islands_of_map,
    outcome_intervals,
    surely_topples_below,
)
from rbfrag.solver.search.march import TOPPLES
from rbfrag.solver.toppling_run import OUTCOMES, reject_endless, runner

SLIVERS = 1e-9
"""Undecided length of k_r/PGA up to which an answer still counts as certified."""


CLEARANCES = (2e-11, 1e-10, 1e-9, 5e-9)
"""Distances of the lower end from the border, over the upper end, that are tried in turn."""


def critical(
    motion: GroundMotion,
    *,
    p2: float,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    kind: str = "toppling",
    search_limit: float = SEARCH_LIMIT,
    full_map: bool = False,
    map_depth: float = MAP_DEPTH,
) -> CriticalResult:
    """Return the largest k_r/PGA that a ground motion topples, with its bracket.

    Args:
        motion: horizontal ground motion.
        p2: frequency parameter p² of the block [1/s²], > 0.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.
        kind: name of the model, for the answer.
        search_limit: smallest k_r/PGA looked at.
        full_map: go on below the critical value and map every toppling and safe interval down
            to the limit.
        map_depth: width of k_r/PGA at which the map leaves an interval undecided. The bracket
            does not depend on it; a finer map costs more.

    Raises:
        InputError: a value that is not a positive finite number, an unknown polarity,
            components that cannot be brought together.

    Definition of section 4.3.4 of Gibson's dissertation: the largest k_r/PGA that topples.
    """
    p2 = positive(p2, "p2", "1/s²")
    search_limit = positive(search_limit, "search_limit", "k_r/PGA")
    map_depth = positive(map_depth, "map_depth", "k_r/PGA")
    excitation = kept_excitation(motion, vertical, polarity)
    reject_endless(excitation, p2)
    blocks = SingleBlocks(excitation, p2=p2)
    pga = excitation.pga_g
    answer = CriticalResult(
        kind=kind, p2=p2, polarity=polarity, pga_g=pga, status="below_limit",
        search_limit=search_limit, warnings=motion_remarks(motion, vertical, excitation),
        points=blocks.points(),
    )  # fmt: skip
    # condition 1 of the proof
    if excitation.jump_node < excitation.w.size:
        jump = Diagnostic(
            f"1 + k_v <= 0 at {excitation.time_s[excitation.jump_node]:.3f} s: the vertical motion "
            "throws every block; search with the horizontal motion alone",
            "vertical_jump",
        )
        return replace(answer, status="outside_model", warnings=(*answer.warnings, jump))
    # no block starts whose k_r no q exceeds: with vertical motion q may exceed PGA
    bottom = search_limit * pga
    if pga == 0.0 or excitation.max_q <= bottom:
        return replace(answer, status="no_motion", certified=True)
    of_map = certified_map(excitation, p2=p2, bottom=bottom, full=full_map, map_depth=map_depth)
    # certified: the lower end topples, and no block above the upper one does, but for undecided
    # slivers. Else the lower end is the strongest block found to topple, and the upper one K_up
    ends = _ends(blocks, excitation, p2, of_map, bottom)
    answer = replace(
        answer,
        certified=ends.certified,
        upper=None if ends.upper is None else ends.upper / pga,
        k_up_over_pga=of_map.k_up / pga if of_map.k_up > bottom else None,
        undecided=ends.undecided / pga,
        n_runs=of_map.runs + ends.runs,
        warnings=(*answer.warnings, *_doubts(of_map, pga, ends, full_map)),
    )
    if full_map:
        intervals = outcome_intervals(of_map, pga, excitation.max_q, bottom)
        answer = replace(answer, reentrant=False, intervals=intervals)
    if ends.lower is not None:
        kr = ends.lower * pga
        y_m_s = kr * STANDARD_GRAVITY_M_S2 / math.sqrt(p2)
        answer = replace(
            answer, status="found", kr_over_pga=ends.lower, lower=ends.lower, kr=kr, y_m_s=y_m_s
        )
        if full_map:
            resolution = RESOLUTION * pga
            if of_map.complete:
                block = block_excitation(excitation, p2=p2)
                islands, runs = islands_of_map(of_map, block, kr, resolution)
            else:
                # no proof is wanted of single blocks: spans as long as those of a map will do
                block = block_excitation(
                    excitation, p2=p2, span_ph=MAP_SPAN_PH, span_error=MAP_SPAN_ERROR
                )
                floor = surely_topples_below(block, excitation, bottom, kr)
                islands, runs = islands_by_blocks(block, kr, floor, bottom, resolution)
            answer = replace(
                answer,
                island_width=islands.width / pga,
                kr_over_pga_resolved=None if islands.resolved is None else islands.resolved / pga,
                reentrant=islands.reentrant,
                n_runs=answer.n_runs + runs,
            )
    # blocks run for themselves are kept with the answer, and count
    points = blocks.points()
    return replace(answer, points=points, n_runs=answer.n_runs + len(points.outcome))


class Ends(NamedTuple):
    """Bounds of the critical value.

    Args:
        lower: k_r/PGA of a block that topples; None where none was seen to.
        upper: k_r above which nothing topples, where it is not certified as far as single blocks
            show; None where that is the least one of interest.
        certified: whether nothing topples above the two.
        undecided: length of k_r that is neither proven safe nor to topple, above the two or where
            they are not certified above the lower one.
        runs: number of blocks, those apart that are kept with the answer.
        gaps: where it is not certified, gaps between blocks that may hide one that topples.
    """

    lower: float | None
    upper: float | None
    certified: bool
    undecided: float
    runs: int
    gaps: int = 0


def _ends(
    blocks: SingleBlocks, excitation: Excitation, p2: float, of_map: CertifiedMap, bottom: float
) -> Ends:
    """Return the bounds of the critical value: proven, or the strongest toppling block found and
    K_up.
    """
    pga = excitation.pga_g
    bracket = bracket_of(of_map)
    undecided = bracket.undecided if bracket else of_map.undecided_above(bottom)
    upper: float | None = of_map.k_up if of_map.k_up > bottom else None
    strongest, runs = bracket and bracket.lower, 0
    if undecided <= SLIVERS * pga:
        if bracket is None:
            return Ends(None, None, True, undecided, 0)
        lower, runs = _lower_end(blocks, excitation, p2, bracket, bottom)
        if lower is not None:
            return Ends(lower, bracket.upper, True, undecided, runs)
        # nothing topples above, but of no block just below is it sure
        strongest, upper = None, bracket.upper
    low, high = of_map.open_above(strongest or bottom)
    seen = strongest_seen(excitation, p2, low, high, strongest)
    lower = None
    if seen.kr is not None:
        lower, upper = seen.kr / pga, seen.upper
        blocks.outcome_at(lower)
    open_length = of_map.undecided_above(seen.kr or bottom)
    return Ends(lower, upper, False, open_length, runs + seen.runs, seen.gaps)


def _lower_end(
    blocks: SingleBlocks, excitation: Excitation, p2: float, bracket: Bracket, bottom: float
) -> tuple[float | None, int]:
    """Return the k_r/PGA of a block below a border that certainly topples, and a number of blocks.

    The border is known to the width it was closed in to, by runs without an error estimate: the
    block there may stay. A distance of 2e-11 is beyond that and means nothing to anybody. Its own
    run tells, clear of its error; where runs cannot, an interval that is proven to topple does.
    """
    pga = excitation.pga_g
    # the other end is run for the record: its peak says how near it came
    blocks.outcome_at(bracket.upper / pga)
    for step in CLEARANCES:
        ratio = max(bracket.lower - step * bracket.upper, bottom) / pga
        if blocks.outcome_at(ratio) == TOPPLED:
            return ratio, 0
    near = max(bottom, bracket.lower * (1.0 - BRACKET_WIDTH))
    below = certified_map(excitation, p2=p2, bottom=near, full=True)
    topples = below.high[below.verdict == TOPPLES]
    if topples.size == 0:
        return None, below.runs
    ratio = float(topples.max()) / pga
    blocks.outcome_at(ratio)
    return ratio, below.runs


def _doubts(of_map: CertifiedMap, pga: float, ends: Ends, full_map: bool) -> Iterator[str]:
    """Yield the parts of the answer that are not proven."""
    if not ends.certified:
        # the first that applies: where the order is lost the budget is spent on it, too
        if of_map.order_lost:
            reason = (
                "k_h/(1 + k_v) exceeds 1 both ways so far that blocks may overtake one another, "
                "and the proof does not hold"
            )
        elif not of_map.complete:
            reason = f"the search was given up at {of_map.reached / pga:.6g} PGA, after its budget"
        else:
            reason = "grazing contacts left intervals that no refinement decided"
        yield Diagnostic(
            f"not certified: {reason}; {ends.undecided / pga:.3g} of k_r/PGA above the answer is "
            "not proven safe",
            "not_certified",
        )
        if ends.lower is not None:
            yield Diagnostic(
                "the upper end is that of a dense scan of single blocks; proven is only that "
                f"nothing topples above {of_map.k_up / pga:.6g} PGA",
                "not_certified",
            )
        if ends.lower is not None and ends.gaps:
            yield Diagnostic(
                f"{ends.gaps} gaps between blocks below the upper end may hide a block that "
                "topples: its rotation changes too steeply with k_r",
                "not_certified",
            )
    elif full_map and not of_map.complete:
        # only the map below the answer is open, which the proof does not rest on
        yield Diagnostic(
            f"the map was given up at {of_map.reached / pga:.6g} PGA, at the limit of its runs: "
            "strengths below are undecided; the critical value does not depend on them",
            "map_incomplete",
        )


class SingleBlocks:
    """Single blocks of one p² under one excitation, each run once; k_r is not scaled by PGA.

    Args:
        p2: frequency parameter p² [1/s²].
    """

    def __init__(self, excitation: Excitation, *, p2: float) -> None:
        self._pga_g = excitation.pga_g
        self._run = runner(excitation, p2=p2)
        self._runs: dict[float, Run] = {}
        self._ratio: dict[float, float] = {}

    def outcome_at(self, ratio: float) -> int:
        """Return the kernel's outcome code at a k_r/PGA, which :meth:`points` repeats exactly."""
        # the quotient of the product may be another number than the ratio
        kr = ratio * self._pga_g
        self._ratio[kr] = ratio
        if kr not in self._runs:
            self._runs[kr] = self._run(kr)
        return self._runs[kr].outcome

    def points(self) -> SearchPoints:
        """Return every block that was run, by falling k_r/PGA."""
        strengths = sorted(self._runs, reverse=True)
        runs = [self._runs[kr] for kr in strengths]
        return SearchPoints(
            kr_over_pga=np.array([self._ratio.get(k, k / self._pga_g) for k in strengths]),
            theta_n=np.array([run.peak_rad for run in runs]) / np.arctan(strengths),
            outcome=tuple(OUTCOMES[run.outcome].value for run in runs),
        )


FIRST_RUNS = 3000
"""Blocks that are run first, equally spaced in ln k_r over all that has no verdict."""

DENSE_RUNS = 8000
"""Blocks that are run then, equally spaced over what has no verdict above the strongest of them."""

ROUNDS = 4
"""How often gaps that may hide an island are looked into more closely: to 1e-8 of k_r and below."""

GAPS = 2000
"""Gaps that a round looks into, the highest first."""

BETWEEN = 8
"""Blocks within such a gap; on either side where a border is closed in on."""

JUMP = 0.02
"""Change of theta_n over a gap, beyond four times that at the adjacent slopes, that is a jump."""

BORDER = 1e-9
"""Relative width to which the border above the strongest block is closed in on."""


class Seen(NamedTuple):
    """Findings from single blocks.

    Args:
        kr: greatest k_r seen to topple; None where none was.
        upper: k_r from which on no block was seen to topple, and no gap between blocks may hide one
            that does; None where no block was seen to topple.
        gaps: gaps left between `kr` and `upper` that may hide an island.
        runs: number of blocks.
    """

    kr: float | None
    upper: float | None
    gaps: int
    runs: int


def strongest_seen(
    excitation: Excitation, p2: float, low: FloatArray, high: FloatArray, toppling_kr: float | None
) -> Seen:
    """Return the strongest block found to topple among those without a verdict.

    An island between two blocks is betrayed by the rotation of the blocks next to it. Gaps towards
    which theta_n rises ever more steeply from both sides, and jumps, are divided until they are
    none, or narrower than what matters of a recorded motion.

    Args:
        p2: frequency parameter p² [1/s²].
        low: lower ends of the intervals of k_r without a verdict, shape (n,).
        high: their upper ends, shape (n,).
        toppling_kr: a k_r that topples; None for none.
    """
    # invariant: kr is sorted, theta_n holds the normalised peaks of these blocks, and `best` is the
    # strongest block seen to topple; only what lies above it is of interest from then on
    runs, gaps = 0, np.empty(0, dtype=np.int64)
    kr, theta_n = np.empty(0), np.empty(0)
    best = toppling_kr
    trials = _spread(low, high, FIRST_RUNS)
    for round_number in range(ROUNDS + 2):
        if best is not None:
            trials = trials[trials > best]
        if trials.size:
            ends = simulate_many(excitation, p2=p2, kr=trials)
            runs += trials.size
            toppled = trials[ends.outcome == TOPPLED]
            if toppled.size:
                best = max(float(toppled.max()), best or 0.0)
            # what is neither known to stay nor to topple counts as near to toppling
            peak = np.where(np.isfinite(ends.theta_n), ends.theta_n, 1.0)
            kr, first = np.unique(np.concatenate([kr, trials]), return_index=True)
            theta_n = np.concatenate([theta_n, peak])[first]
        if best is not None:
            theta_n, kr = theta_n[kr > best], kr[kr > best]
        if round_number == 0:
            above = high > (best or 0.0)
            trials = _spread(np.maximum(low, best or 0.0)[above], high[above], DENSE_RUNS)
            continue
        gaps = _gaps(kr, theta_n)
        if round_number <= ROUNDS:
            part = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
            chosen = gaps[-GAPS:]
            trials = (kr[chosen, None] + (kr[chosen + 1] - kr[chosen])[:, None] * part).ravel()
    if best is None:
        return Seen(None, None, gaps.size, runs)
    # the border above: the next block that stays, or the end of what has no verdict
    above_k = float(kr[0]) if kr.size else max(best, float(high.max(initial=best)))
    upper = float(kr[gaps[-1] + 1]) if gaps.size else None
    while above_k - best > BORDER * above_k:
        trials = np.linspace(best, above_k, 2 * BETWEEN + 2)[1:-1]
        toppled = trials[simulate_many(excitation, p2=p2, kr=trials).outcome == TOPPLED]
        runs += trials.size
        width = above_k - best
        if toppled.size:
            best = float(toppled[-1])
        above_k = min(best + width / (2 * BETWEEN + 1), above_k)
    return Seen(best, max(above_k, upper or 0.0), gaps.size, runs)


def _gaps(kr: FloatArray, theta_n: FloatArray) -> IntArray:
    """Return the gaps above blocks i that may contain an island, by rising k_r.

    Towards a block that topples the peak rotation falls short of balance by the square root of the
    distance in k_r, so that it rises ever more steeply: a cusp, where a peak without an island is
    round. A gap narrower than `RESOLUTION` of its k_r does not matter.
    """
    if kr.size < 6:
        return np.empty(0, dtype=np.int64)
    width = np.diff(kr)
    slope = np.diff(theta_n) / width
    # of the gaps 2 to n - 3: the two slopes before each from below, and from above
    below, further_below = slope[1:-3], slope[:-4]
    above, further_above = -slope[3:-1], -slope[4:]
    cusp = (below > 0.0) & (above > 0.0) & (below > further_below) & (above > further_above)
    inner = slice(2, -2)
    change = np.abs(theta_n[3:-2] - theta_n[2:-3])
    expected = 4.0 * np.maximum(np.abs(below), np.abs(above)) * width[inner]
    hides = (cusp | (change > JUMP + expected)) & (width[inner] > RESOLUTION * kr[3:-2])
    return 2 + np.flatnonzero(hides)


def _spread(low: FloatArray, high: FloatArray, number: int) -> FloatArray:
    """Return points of intervals, equally spaced in ln k_r, at least one in each of the widest."""
    widest = np.argsort(low - high, kind="stable")[:number]
    low, width = low[widest], np.log(high[widest] / low[widest])
    counts = np.maximum(np.ceil(number * width / width.sum()), 1.0).astype(np.int64)
    of = np.repeat(np.arange(counts.size), counts)
    place = np.arange(of.size) - np.repeat(np.cumsum(counts) - counts, counts)
    points: FloatArray = low[of] * np.exp(width[of] * (place + 0.5) / counts[of])
    return points
