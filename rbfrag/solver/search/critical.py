"""The critical block: the strongest one that a ground motion topples, with a proof.

The set of k_r that topple is often not one interval: an earlier pulse may leave the block
rocking so that the decisive one misses. No search by single blocks can promise that it has
stepped over none. The search here decides whole intervals of k_r at a time, by two trajectories
that enclose those of every block between (`rbfrag.solver.search.envelopes`), from an upper bound
K_up downwards. Where the argument does not hold, the answer is that of a scan, and says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import Excitation, kept_excitation, motion_remarks
from rbfrag.solver.integrator.block_excitation import block_excitation
from rbfrag.solver.integrator.single_run import TOPPLED, Run
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import (
    MAP_DEPTH,
    RESOLUTION,
    SEARCH_LIMIT,
    CriticalResult,
    Polarity,
    SearchPoints,
)
from rbfrag.solver.search.certified import (
    MAP_SPAN_PH,
    Bracket,
    CertifiedMap,
    bracket_of,
    certified_map,
    surely_topples_below,
)
from rbfrag.solver.search.islands import (
    Islands,
    islands_by_blocks,
    islands_of_map,
    outcome_intervals,
)
from rbfrag.solver.toppling_run import OUTCOMES, refuse_endless, runner

SLIVERS = 1e-9
"""Undecided length of k_r/PGA up to which an answer still counts as certified."""


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
    refuse_endless(excitation, p2)
    blocks = SingleBlocks(excitation, p2=p2)
    pga = excitation.pga_g
    answer = CriticalResult(
        kind=kind, p2=p2, polarity=polarity, pga_g=pga, status="below_limit",
        search_limit=search_limit, warnings=motion_remarks(motion, vertical, excitation),
        points=blocks.points(),
    )  # fmt: skip
    # condition 1 of the proof
    if excitation.jump_node < excitation.w.size:
        thrown = (
            f"1 + k_v <= 0 at {excitation.time_s[excitation.jump_node]:.3f} s: the vertical motion "
            "throws every block; search with the horizontal motion alone"
        )
        return replace(answer, status="outside_model", warnings=(*answer.warnings, thrown))
    # no block starts whose k_r no q exceeds: with vertical motion q may exceed PGA
    bottom = search_limit * pga
    if pga == 0.0 or excitation.max_q <= bottom:
        return replace(answer, status="no_motion", certified=True)
    of_map = certified_map(excitation, p2=p2, bottom=bottom, full=full_map, map_depth=map_depth)
    bracket = bracket_of(of_map)
    undecided = (bracket.undecided if bracket else of_map.undecided_above(bottom)) / pga
    answer = replace(
        answer,
        certified=undecided <= SLIVERS,
        k_up_over_pga=of_map.k_up / pga if of_map.k_up > bottom else None,
        undecided=undecided,
        n_runs=of_map.runs,
        warnings=(*answer.warnings, *_doubts(of_map, pga, undecided, full_map)),
    )
    if not answer.certified:
        # a scan may have found what the search could not decide; neither is a proof
        bracket = _better(bracket, scan_down(blocks, of_map.k_up, bottom))
    if full_map:
        intervals = outcome_intervals(of_map, pga, excitation.max_q, bottom)
        answer = replace(answer, reentrant=False, intervals=intervals)
    if bracket is not None:
        # from here on in k_r/PGA, of which blocks are run again by those who check the answer
        lower, upper = bracket.lower / pga, bracket.upper / pga
        lower = _clear_of_error(blocks, lower, upper, search_limit)
        kr = lower * pga
        y_m_s = kr * STANDARD_GRAVITY_M_S2 / math.sqrt(p2)
        answer = replace(
            answer, status="found", kr_over_pga=lower, lower=lower, upper=upper, kr=kr, y_m_s=y_m_s
        )
        if full_map:
            islands, runs = _islands(excitation, p2, of_map, kr, bottom)
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


def _doubts(of_map: CertifiedMap, pga: float, undecided: float, full_map: bool) -> Iterator[str]:
    """Yield what is not proven; `undecided` is the length of k_r/PGA above the answer."""
    if undecided > SLIVERS:
        yield (
            f"not certified: {_reason(of_map, pga)}; {undecided:.3g} of k_r/PGA above the answer "
            "is not proven safe"
        )
    elif full_map and not of_map.complete:
        # only the map below the answer is open, which the proof does not rest on
        yield (
            f"the map was given up at {of_map.reached / pga:.6g} PGA, after its budget: what "
            "lies below is undecided; the critical value is not touched by this"
        )


def _reason(of_map: CertifiedMap, pga_g: float) -> str:
    """Why a search is not certified."""
    # the first that applies: where the order is lost the budget is spent on it, too
    if of_map.order_lost:
        return (
            "k_h/(1 + k_v) exceeds 1 both ways so far that blocks may overtake one another, "
            "and the proof does not hold"
        )
    if not of_map.complete:
        return f"the search was given up at {of_map.reached / pga_g:.6g} PGA, after its budget"
    return "grazing contacts left intervals that no refinement decided"


def _better(bracket: Bracket | None, scanned: tuple[float, float] | None) -> Bracket | None:
    """The higher of the answers of the search and of a scan."""
    if scanned is None or (bracket is not None and bracket.lower >= scanned[0]):
        return bracket
    return Bracket(*scanned, undecided=0.0)


def _clear_of_error(blocks: SingleBlocks, lower: float, upper: float, limit: float) -> float:
    """Run the critical block itself, clear of the error of its run where need be.

    A step of 1e-8 further from the border costs nothing that means anything, and spares
    an answer that is proven from being reported as undetermined. k_r/PGA throughout.
    """
    for step in (0.0, 1e-10, 1e-9, 5e-9):
        ratio = max(lower - step * upper, limit)
        if blocks.outcome_at(ratio) == TOPPLED:
            lower = ratio
            break
    # the other end is run for the record: its peak says how near it came
    blocks.outcome_at(upper)
    return lower


def _islands(
    excitation: Excitation, p2: float, of_map: CertifiedMap, lower: float, bottom: float
) -> tuple[Islands, int]:
    """What lies below the critical k_r: from the map, or from single blocks; and their number."""
    resolution = RESOLUTION * excitation.pga_g
    if of_map.complete:
        block = block_excitation(excitation, p2=p2)
        return islands_of_map(of_map, block, lower, resolution)
    # no proof is wanted of single blocks: spans as long as those of a map will do
    block = block_excitation(excitation, p2=p2, span_ph=MAP_SPAN_PH)
    floor = surely_topples_below(block, excitation, bottom, lower)
    return islands_by_blocks(block, lower, floor, bottom, resolution)


SCAN_POINTS = 160
"""Blocks of a descending scan, equally spaced in ln k_r."""

BORDER = 1e-9
"""Relative width to which a border is bisected."""


class SingleBlocks:
    """Single blocks of one p² under one excitation, each run once; k_r is k_r itself.

    Args:
        p2: frequency parameter p² [1/s²].
    """

    def __init__(self, excitation: Excitation, *, p2: float) -> None:
        self._pga_g = excitation.pga_g
        self._run = runner(excitation, p2=p2)
        self._runs: dict[float, Run] = {}
        self._ratio: dict[float, float] = {}

    def outcome(self, kr: float) -> int:
        """Return the kernel's outcome code of one block."""
        run = self._runs.get(kr)
        if run is None:
            run = self._runs[kr] = self._run(kr)
        return run.outcome

    def outcome_at(self, ratio: float) -> int:
        """Return the outcome code at a k_r/PGA, which :meth:`points` repeats exactly."""
        # the quotient of the product may be another number than the ratio
        kr = ratio * self._pga_g
        self._ratio[kr] = ratio
        return self.outcome(kr)

    def points(self) -> SearchPoints:
        """Return every block that was run, by falling k_r/PGA."""
        strengths = sorted(self._runs, reverse=True)
        runs = [self._runs[kr] for kr in strengths]
        return SearchPoints(
            kr_over_pga=np.array([self._ratio.get(k, k / self._pga_g) for k in strengths]),
            theta_n=np.array([run.peak_rad for run in runs]) / np.arctan(strengths),
            outcome=tuple(OUTCOMES[run.outcome].value for run in runs),
        )


def scan_down(blocks: SingleBlocks, top: float, bottom: float) -> tuple[float, float] | None:
    """Return a toppling k_r and a safe one just above it, from the first found below `top`.

    Args:
        top: k_r at and above which nothing topples.
        bottom: least k_r of interest.
    """
    safe = top
    for kr in np.geomspace(top, bottom, SCAN_POINTS).tolist():
        if blocks.outcome(kr) == TOPPLED:
            break
        safe = kr
    else:
        return None
    # nothing safe was met above it
    if kr == top:
        return kr, top
    while abs(kr - safe) > BORDER * max(kr, safe):
        middle = 0.5 * (kr + safe)
        if blocks.outcome(middle) == TOPPLED:
            kr = middle
        else:
            safe = middle
    return kr, safe
