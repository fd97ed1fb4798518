"""The critical block: the strongest one that a ground motion topples, with a proof.

The set of k_r that topple is often not one interval: an earlier pulse may leave the block
rocking so that the decisive one misses. No search by single blocks can promise that it has
stepped over none. The search here decides whole intervals of k_r at a time, by two motions
that enclose those of every block between (`rbfrag.solver.search.envelopes`), from an upper bound
K_up downwards. Where the argument does not hold, the answer is that of a scan, and says so.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

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
    OutcomeIntervals,
    Polarity,
    SearchPoints,
    Status,
    no_intervals,
)
from rbfrag.solver.search.certified import (
    MAP_SPAN_PH,
    CertifiedMap,
    bracket_of,
    certified_map,
    surely_topples_below,
)
from rbfrag.solver.search.islands import islands_by_blocks, islands_of_map, outcome_intervals
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
    linear: bool = False,
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
        linear: the linear model, for verification only.
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
    drive = kept_excitation(motion, vertical, polarity)
    refuse_endless(drive, p2)
    search = _Search(drive, p2, linear, search_limit)
    search.run(full_map, map_depth)
    points = search.points()
    found = search.status == "found"
    kr = search.lower * drive.pga_g if found else None
    return CriticalResult(
        kind=kind,
        p2=p2,
        polarity=polarity,
        linear=linear,
        pga_g=drive.pga_g,
        status=search.status,
        search_limit=search_limit,
        kr_over_pga=search.lower if found else None,
        lower=search.lower if found else None,
        upper=search.upper if found else None,
        kr=kr,
        y_m_s=None if kr is None else kr * STANDARD_GRAVITY_M_S2 / math.sqrt(p2),
        certified=search.certified,
        k_up_over_pga=search.k_up,
        undecided=search.undecided,
        island_width=search.island_width,
        kr_over_pga_resolved=search.resolved,
        reentrant=search.reentrant,
        n_runs=search.n_runs + len(points.outcome),
        warnings=(*motion_remarks(motion, vertical, drive), *search.warnings),
        points=points,
        intervals=search.intervals,
    )


class _Search:
    """The steps of one critical search; attributes are in k_r/PGA."""

    def __init__(self, drive: Excitation, p2: float, linear: bool, limit: float) -> None:
        self.drive = drive
        self.p2 = p2
        self.linear = linear
        self.limit = limit
        self.status: Status = "below_limit"
        self.lower = math.nan
        self.upper = math.nan
        self.k_up: float | None = None
        self.certified = False
        self.undecided: float | None = None
        self.island_width: float | None = None
        self.resolved: float | None = None
        self.reentrant: bool | None = None
        self.intervals: OutcomeIntervals = no_intervals()
        self.warnings: list[str] = []
        self.n_runs = 0
        self._scan = BlockScan(drive, p2=p2, linear=linear)

    def run(self, full_map: bool, map_depth: float) -> None:
        """Make the search; the answer is left in the attributes."""
        drive = self.drive
        if drive.jump_node < drive.w.size:
            self.status = "outside_model"
            self.warnings.append(
                f"1 + k_v <= 0 at {drive.time_s[drive.jump_node]:.3f} s: the vertical motion "
                "throws every block; search with the horizontal motion alone"
            )
            return
        pga = drive.pga_g
        if pga == 0.0 or drive.max_q <= self.limit * pga:
            self.status = "no_motion"
            self.certified = True
            return
        bottom = self.limit * pga
        found = certified_map(
            drive,
            p2=self.p2,
            linear=self.linear,
            bottom=bottom,
            full=full_map,
            map_depth=map_depth,
        )
        self.n_runs += found.runs
        if full_map:
            self.intervals = outcome_intervals(found, pga, drive.max_q, bottom)
            self.reentrant = False
        bracket = bracket_of(found)
        scan = self._scan
        if found.k_up > bottom:
            self.k_up = found.k_up / pga
        if bracket is None:
            undecided = float((found.high - found.low)[found.undecided].sum())
            undecided += max(found.reached - bottom, 0.0)
        else:
            undecided = bracket[2]
        self.undecided = undecided / pga
        self.certified = bool(self.undecided <= SLIVERS)
        if not self.certified:
            self._say_why(found)
            bracket = self._by_scan(scan, found, bottom, bracket)
        elif full_map and not found.complete:
            self.warnings.append(
                f"the map was given up at {found.reached / pga:.6g} PGA, after its budget: what "
                "lies below is undecided; the critical value is not touched by this"
            )
        if bracket is None:
            return
        self.status = "found"
        self._take_bracket(bracket)
        if full_map:
            self._islands(found, bottom)

    def _islands(self, found: CertifiedMap, bottom: float) -> None:
        """Look for what lies below the critical value: in the map, or by single blocks."""
        drive, pga = self.drive, self.drive.pga_g
        resolution = RESOLUTION * pga
        lower = self.lower * pga
        if found.complete:
            g = block_excitation(drive, p2=self.p2, linear=self.linear)
            islands, made = islands_of_map(found, g, lower, resolution)
        else:
            g = block_excitation(drive, p2=self.p2, linear=self.linear, span_ph=MAP_SPAN_PH)
            floor = surely_topples_below(g, drive, bottom, lower)
            islands, made = islands_by_blocks(g, lower, floor, bottom, resolution)
        self.n_runs += made
        self.island_width = islands.width / pga
        self.resolved = None if islands.resolved is None else islands.resolved / pga
        self.reentrant = islands.reentrant

    def points(self) -> SearchPoints:
        """Return every block that was run itself, by falling k_r/PGA."""
        return self._scan.points()

    def _take_bracket(self, bracket: tuple[float, float, float]) -> None:
        """Run the critical block itself, clear of the error of its run where need be.

        A step of 1e-8 further from the border costs nothing that means anything, and spares
        an answer that is proven from being reported as undetermined.
        """
        pga = self.drive.pga_g
        self.lower, self.upper = bracket[0] / pga, bracket[1] / pga
        for step in (0.0, 1e-10, 1e-9, 5e-9):
            ratio = max(self.lower - step * self.upper, self.limit)
            if self._scan.outcome_at(ratio) == TOPPLED:
                self.lower = ratio
                break
        self._scan.outcome_at(self.upper)

    def _by_scan(
        self,
        scan: BlockScan,
        found: CertifiedMap,
        bottom: float,
        bracket: tuple[float, float, float] | None,
    ) -> tuple[float, float, float] | None:
        """Take the higher of the answers of the search and of a scan."""
        scanned = scan_down(scan, found.k_up, bottom)
        if scanned is None or (bracket is not None and bracket[0] >= scanned[0]):
            return bracket
        return (*scanned, 0.0)

    def _say_why(self, found: CertifiedMap) -> None:
        pga = self.drive.pga_g
        if found.order_lost:
            reason = (
                "k_h/(1 + k_v) exceeds 1 both ways so far that blocks may overtake one another, "
                "and the proof does not hold"
            )
        elif not found.complete:
            reason = f"the search was given up at {found.reached / pga:.6g} PGA, after its budget"
        else:
            reason = "grazing contacts left intervals that no refinement decided"
        self.warnings.append(
            f"not certified: {reason}; {self.undecided:.3g} of k_r/PGA above the answer is not "
            "proven safe"
        )


FloatArray = NDArray[np.float64]

SCAN_POINTS = 160
"""Blocks of a descending scan, equally spaced in ln k_r."""

BORDER = 1e-9
"""Relative width to which a border is bisected."""


class BlockScan:
    """Single blocks of one p² under one excitation; k_r is k_r itself.

    Args:
        drive: the excitation.
        p2: frequency parameter p² [1/s²].
        linear: the linear model.
    """

    def __init__(self, drive: Excitation, *, p2: float, linear: bool) -> None:
        self._drive = drive
        self._linear = linear
        self._run = runner(drive, p2=p2, linear=linear)
        self._tried: dict[float, Run] = {}
        self._ratio: dict[float, float] = {}

    def outcome(self, kr: float) -> int:
        """Return the kernel's outcome code of one block, run once and kept."""
        run = self._tried.get(kr)
        if run is None:
            run = self._tried[kr] = self._run(kr)
        return run.outcome

    def outcome_at(self, ratio: float) -> int:
        """Return the outcome code at a k_r/PGA, which :meth:`points` repeats exactly."""
        kr = ratio * self._drive.pga_g
        self._ratio[kr] = ratio
        return self.outcome(kr)

    def first(self, kr: FloatArray, *, topples: bool) -> int | None:
        """Return the number of the first of these blocks that topples (or that stays)."""
        for number, strength in enumerate(kr.tolist()):
            if self.topples(strength) == topples:
                return number
        return None

    def topples(self, kr: float) -> bool:
        """Return whether one block topples."""
        return self.outcome(kr) == TOPPLED

    def points(self) -> SearchPoints:
        """Return every block that was run, by falling k_r/PGA."""
        strengths = sorted(self._tried, reverse=True)
        runs = [self._tried[kr] for kr in strengths]
        kr = np.array(strengths)
        theta_c = kr if self._linear else np.arctan(kr)
        return SearchPoints(
            kr_over_pga=np.array([self._ratio.get(k, k / self._drive.pga_g) for k in strengths]),
            theta_n=np.array([run.peak_rad for run in runs]) / theta_c,
            outcome=tuple(OUTCOMES[run.outcome].value for run in runs),
        )

    def border(self, one: float, other: float) -> tuple[float, float]:
        """Bisect between a block that topples and one that stays; first the kind of `one`."""
        kind = self.topples(one)
        while abs(one - other) > BORDER * max(one, other):
            middle = 0.5 * (one + other)
            if self.topples(middle) == kind:
                one = middle
            else:
                other = middle
        return one, other


def scan_down(scan: BlockScan, top: float, bottom: float) -> tuple[float, float] | None:
    """Return a toppling k_r and a safe one just above it, from the first found below `top`.

    Args:
        scan: the blocks.
        top: k_r at and above which nothing topples.
        bottom: least k_r of interest.
    """
    kr = np.geomspace(top, bottom, SCAN_POINTS)
    first = scan.first(kr, topples=True)
    if first is None:
        return None
    if first == 0:
        return float(kr[0]), top
    return scan.border(float(kr[first]), float(kr[first - 1]))
