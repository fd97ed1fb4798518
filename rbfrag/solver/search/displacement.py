"""Displacement of sliding blocks of any strength in one record, and the strength for a given
displacement.

With k_y the yield acceleration and 1 + k_v = w, a block on a level plane has the velocity

    v(t) = g max over s <= t of  integral_s^t (k_h - w k_y) dt            (downslope only)

the greatest of straight lines in k_y of which each falls (w > 0): v, and with it the displacement,
falls with k_y and is convex in it, with and without vertical motion. The critical strength of a
displacement is therefore unique, and bisection finds it. On a base that dips the equation is the
same times cos(phi - beta)/cos(phi), and so is the displacement: one curve serves every dip, as long
as the block stays on its base.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.critical_result import CriticalSlide
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.quantity import not_negative, positive
from rbfrag.solver.results import SEARCH_LIMIT, Outcome, Polarity, SearchPoints, Status

TOLERANCE = 1e-9
"""Width of the bracket of a critical strength, over PGA."""


NOT_DETERMINED = Diagnostic(
    "the accelerations are so small that a block starts and stops without end: no displacement is "
    "determined",
    "undetermined",
)


@dataclass(frozen=True, eq=False)
class SlidingBlocks:
    """Blocks on a level plane under one excitation.

    Args:
        slide_m: displacement [m] of the block of a yield acceleration [g]; NaN after a jump.
    """

    excited: Excitation
    slide_m: Callable[[Excitation, float], float]

    @cached_property
    def slides_m(self) -> dict[float, float]:
        """Displacements simulated so far [m], by k_y/PGA."""
        return {}

    def displacement_m(self, ky_over_pga: float) -> float:
        """Return the permanent displacement down a level plane [m]; NaN after a jump."""
        if ky_over_pga not in self.slides_m:
            self.slides_m[ky_over_pga] = self.slide_m(
                self.excited, ky_over_pga * self.excited.pga_g
            )
        return self.slides_m[ky_over_pga]

    def points(self, ky_over_pga: Sequence[float]) -> SearchPoints:
        """Return the displacements of blocks of these strengths."""
        slid = np.array([self.displacement_m(k) for k in ky_over_pga], dtype=np.float64)
        return SearchPoints(
            kr_over_pga=np.array(ky_over_pga, dtype=np.float64),
            theta_n=np.full(slid.size, np.nan),
            outcome=(Outcome.STABLE.value,) * slid.size,
            displacement_m=slid,
        )


def critical_of(
    kind: str,
    blocks: SlidingBlocks,
    displacement_m: float,
    *,
    polarity: Polarity,
    search_limit: float = SEARCH_LIMIT,
    tolerance: float = TOLERANCE,
    warnings: tuple[str, ...] = (),
) -> CriticalSlide:
    """Return the maximum k_y/PGA with which a block slides further than a distance.

    Args:
        kind: name of the model, for the answer.
        blocks: the blocks, of which some displacements may be known.
        displacement_m: the distance on a level plane [m]; 0 for the strength that first moves.
        search_limit: least k_y/PGA looked at.
        tolerance: width of the bracket, k_y/PGA.
        warnings: sentences about the motion.
    """
    # the displacement falls with k_y and vanishes at k_y = max q: there is one root of
    # displacement(k_y) = distance between the limit and max q, and bisection brackets it
    distance = not_negative(displacement_m, "displacement_m", "m")
    limit = positive(search_limit, "search_limit", "k_y/PGA")
    width = positive(tolerance, "tolerance", "k_y/PGA")
    excited = blocks.excited
    before = len(blocks.slides_m)
    low = high = None
    ends: list[float] = []
    status: Status = "no_motion"
    top = excited.max_q / excited.pga_g if excited.pga_g > 0.0 else 0.0
    if excited.jump_node < excited.w.size:
        status = "outside_model"
    elif top > limit:
        if distance == 0.0:
            # a block moves as soon as k_h/(1 + k_v) exceeds its strength: a closed form
            status, low, high = "found", top, top
        elif math.isnan(blocks.displacement_m(limit)):
            status, warnings = "outside_model", (*warnings, NOT_DETERMINED)
        elif blocks.displacement_m(limit) <= distance:
            status = "below_limit"
        else:
            status = "found"
            low, high = _bracket(blocks, distance, limit, top, width)
            ends = sorted({low, high}, reverse=True)
    runs = len(blocks.slides_m) - before
    return CriticalSlide(
        kind=kind,
        p2=math.nan,
        polarity=polarity,
        pga_g=excited.pga_g,
        status=status,
        search_limit=limit,
        kr_over_pga=low,
        lower=low,
        upper=high,
        kr=None if low is None else low * excited.pga_g,
        # the displacement falls with the strength: there is one border, and it is bracketed
        certified=status != "outside_model",
        reentrant=False,
        n_runs=runs,
        warnings=warnings,
        points=blocks.points(ends),
        displacement_m=distance,
    )


def _bracket(
    blocks: SlidingBlocks, distance: float, low: float, high: float, width: float
) -> tuple[float, float]:
    # the displacement falls with the strength: what is known already narrows the bracket
    for k, slid in sorted(blocks.slides_m.items()):
        if slid > distance:
            low = max(low, k)
        else:
            high = min(high, k)
            break
    while high - low > width:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if blocks.displacement_m(middle) > distance:
            low = middle
        else:
            high = middle
    return low, high
