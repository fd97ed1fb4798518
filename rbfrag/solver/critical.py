"""The critical block: the strongest one that a ground motion topples.

The set of k_r that topple is often not one interval: an earlier pulse may leave the block
rocking so that the decisive one misses. A bisection from "topples" to "safe" may therefore
land on a lower boundary. The search here

1. bounds the answer from above by K_up: over all *fresh starts* (one excursion from each
   rise of k_h/(1 + k_v) above k_r) whether an excursion topples is monotone in k_r, and
   every true excursion is behind a fresh one of the same stretch, so nothing above the
   largest k_r with a toppling fresh start can topple;
2. scans down from K_up to the search limit, keeping every simulated point;
3. refines the first step from safe to toppling.

Where the block at K_up itself topples, the bracket is proven. Where it does not, the scan
may have stepped over a narrow toppling interval between the answer and K_up; the result
says so and gives the length that is not proven safe.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.respond import OUTCOMES, positive, refuse_endless, runner
from rbfrag.solver.results import (
    RESOLUTION,
    SEARCH_LIMIT,
    CriticalResult,
    Polarity,
    SearchPoints,
    Status,
)
from rbfrag.solver.taylor import ORDER, PH_MAX
from rbfrag.solver.toppling import TOPPLED, UNDETERMINED, Run, fresh_starts_that_topple

SCAN_POINTS = 160
"""Points of the descending scan, equally spaced in ln k_r between K_up and the limit."""

CLEARANCE = 1e-9
"""How far below K_up, relatively, a toppling run still closes the bracket."""

BRACKET = 1e-12
"""Relative width to which a bracket is refined."""


def critical(
    motion: GroundMotion,
    *,
    p2: float,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    linear: bool = False,
    search_limit: float = SEARCH_LIMIT,
) -> CriticalResult:
    """Return the largest k_r/PGA that a ground motion topples, with its bracket.

    Args:
        motion: horizontal ground motion.
        p2: frequency parameter p² of the block [1/s²], > 0.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.
        linear: the linear model, for verification only.
        search_limit: smallest k_r/PGA looked at.

    Raises:
        InputError: a value that is not a positive finite number, an unknown polarity,
            components that cannot be brought together.

    Definition of section 4.3.4 of Gibson's dissertation: the largest k_r/PGA that topples.
    """
    p2 = positive(p2, "p2", "1/s²")
    search_limit = positive(search_limit, "search_limit", "the smallest k_r/PGA looked at")
    drive = excitation(motion, vertical, polarity)
    refuse_endless(drive, p2)
    said = [*motion.remarks, *(flag.sentence for flag in quality_flags(motion)), *drive.warnings]
    if vertical is not None:
        said += [f"vertical: {flag.sentence}" for flag in quality_flags(vertical)]
    search = _Search(drive, p2, linear, search_limit)
    search.run()
    found = search.status == "found"
    kr = search.lower * drive.pga_g if found else None
    return CriticalResult(
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
        n_runs=search.n_runs,
        warnings=(*said, *search.warnings),
        points=search.points(),
    )


class _Search:
    """The steps of one critical search; ratios are k_r/PGA."""

    def __init__(self, drive: Excitation, p2: float, linear: bool, limit: float) -> None:
        self.drive = drive
        self.p = math.sqrt(p2)
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
        self.reentrant = False
        self.warnings: list[str] = []
        self.n_runs = 0
        self._run: Callable[[float], Run] = runner(drive, p2=p2, linear=linear)
        self._tried: dict[float, Run] = {}

    def run(self) -> None:
        """Make the search; the answer is left in the attributes."""
        drive = self.drive
        if drive.jump_node < drive.w.size:
            self.status = "outside_model"
            self.warnings.append(
                f"1 + k_v <= 0 at {drive.time_s[drive.jump_node]:.3f} s: the vertical motion "
                "throws every block; search with the horizontal motion alone"
            )
            return
        if drive.pga_g == 0.0 or drive.max_q <= self.limit * drive.pga_g:
            self.status = "no_motion"
            self.certified = True
            return
        if not self._bound_from_above():
            self._certify(self.limit)
            return
        ratios = np.geomspace(self._top, self.limit, SCAN_POINTS)
        ratios[0], ratios[-1] = self._top, self.limit
        topples = [self._topples(float(ratio)) for ratio in ratios]
        self._report_islands(ratios, topples)

    def points(self) -> SearchPoints:
        """Return every simulated point by falling k_r/PGA."""
        ratios = np.array(sorted(self._tried, reverse=True))
        runs = [self._tried[float(ratio)] for ratio in ratios]
        theta_c = ratios * self.drive.pga_g
        if not self.linear:
            theta_c = np.arctan(theta_c)
        return SearchPoints(
            kr_over_pga=ratios,
            theta_n=np.array([run.peak_rad for run in runs]) / theta_c,
            outcome=tuple(OUTCOMES[run.outcome].value for run in runs),
        )

    def _topples(self, ratio: float) -> bool:
        run = self._tried.get(ratio)
        if run is None:
            run = self._tried[ratio] = self._run(ratio * self.drive.pga_g)
            self.n_runs += 1
        return run.outcome == TOPPLED

    def _fresh(self, ratio: float, windows: NDArray[np.int64]) -> NDArray[np.int64]:
        self.n_runs += 1
        drive = self.drive
        return fresh_starts_that_topple(
            drive.time_s,
            drive.interval_s,
            drive.k_h,
            drive.w,
            drive.q,
            drive.tail_min_q,
            drive.block_max_q,
            ratio * drive.pga_g,
            self.p,
            self.linear,
            ORDER,
            PH_MAX,
            windows,
        )

    def _bound_from_above(self) -> bool:
        """Find K_up by bisection; False when no fresh start topples at the limit."""
        windows = self._fresh(self.limit, np.array([[0, self.drive.q.size]], dtype=np.int64))
        if not windows.size:
            return False
        low = self.limit
        high = self.drive.max_q / self.drive.pga_g
        while high - low > BRACKET * high:
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            found = self._fresh(middle, windows)
            if found.size:
                # a stretch that does not topple now cannot at a larger k_r
                low, windows = middle, found
            else:
                high = middle
        self.k_up = high
        self._top = self._just_below(low, high)
        return True

    def _just_below(self, low: float, high: float) -> float:
        """Largest ratio below K_up at which a run of the block itself is clear of its error.

        Within 1e-9 of critical the error of the run may exceed the distance; without this
        step an answer that is proven would be reported as undetermined.
        """
        for step in (0.0, 1e-12, 1e-11, 1e-10, CLEARANCE):
            ratio = max(low - step * high, self.limit)
            self._topples(ratio)
            if self._tried[ratio].outcome != UNDETERMINED:
                break
        return ratio

    def _report_islands(self, ratios: NDArray[np.float64], topples: list[bool]) -> None:
        assert self.k_up is not None
        if not any(topples):
            self.undecided = self.k_up - self.limit
            self.warnings.append(
                f"no scanned block topples, but none between {self.limit:g} and "
                f"{self.k_up:.6g} PGA is proven safe"
            )
            return
        self.status = "found"
        first = topples.index(True)
        if first == 0:
            self.lower, self.upper = float(ratios[0]), self.k_up
            self._certify(self.upper)
        else:
            self.lower, self.upper = self._refine(float(ratios[first]), float(ratios[first - 1]))
            self.undecided = self.k_up - self.upper
            self.warnings.append(
                f"not certified: a narrow toppling interval between {self.upper:.6g} and "
                f"{self.k_up:.6g} PGA may have been stepped over"
            )
        bottom, below = self._island_floor(ratios, topples, first)
        self.island_width = self.lower - bottom
        self.reentrant = below is not None and self._wider_than_resolution(below)
        self.resolved = self.lower
        if self.island_width < RESOLUTION and below is not None:
            self.resolved = self._next_island(ratios, topples, below)

    def _certify(self, safe_above: float) -> None:
        """Call the bracket proven, unless the record is too strong for the argument.

        That an excursion topples is monotone in k_r as long as the drive grows with theta;
        max(q) max(-q) <= 1 is enough for that in every state short of the verdict.
        """
        drive = self.drive
        self.certified = self.linear or drive.max_q * float(-drive.q.min()) <= 1.0
        self.undecided = 0.0
        if not self.certified:
            self.undecided = drive.max_q / drive.pga_g - safe_above
            self.warnings.append(
                "not certified: the record exceeds 1 g both ways, beyond what the proof covers"
            )

    def _refine(self, topples: float, safe: float) -> tuple[float, float]:
        """Bisect between a toppling ratio and a safer one to the bracket width."""
        while abs(safe - topples) > BRACKET * abs(safe):
            middle = 0.5 * (topples + safe)
            if middle in (topples, safe):
                break
            if self._topples(middle):
                topples = middle
            else:
                safe = middle
        return topples, safe

    def _island_floor(
        self, ratios: NDArray[np.float64], topples: list[bool], first: int
    ) -> tuple[float, float | None]:
        """Lower end of the top toppling interval, and the scanned safe ratio below it."""
        for index in range(first + 1, len(topples)):
            if not topples[index]:
                floor, _ = self._refine(float(ratios[index - 1]), float(ratios[index]))
                return floor, float(ratios[index])
        return self.limit, None

    def _wider_than_resolution(self, safe: float) -> bool:
        half = 0.5 * RESOLUTION
        return not (self._topples(safe - half) or self._topples(safe + half))

    def _next_island(
        self, ratios: NDArray[np.float64], topples: list[bool], below: float
    ) -> float | None:
        for ratio, fails in zip(ratios, topples, strict=True):
            if fails and ratio < below:
                return self._refine(float(ratio), below)[0]
        return None
