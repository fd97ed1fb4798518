"""How far blocks of any strength slide in one record, and which one slides a stated distance.

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
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.quality import quality_flags
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.kind import BlockOnPlanes
from rbfrag.solver.quantity import not_negative, positive
from rbfrag.solver.results import SEARCH_LIMIT, FloatArray, Outcome, Polarity, Status

THRESHOLDS_M = (0.01, 0.05, 0.15, 0.30)
"""Displacements that are asked about when nothing else is said [m]."""

KY_OVER_PGA = (
    0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6,
    0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95,
)  # fmt: skip
"""Strengths at which displacements are stored."""

TOLERANCE = 1e-9
"""Width of the bracket of a critical strength, over PGA."""


@dataclass(frozen=True, eq=False)
class SlidingResult:
    """The strength below which a block slides further than a stated distance.

    Args:
        polarity: ``forward`` or ``reverse``.
        displacement_m: the distance, along a level plane [m]; 0 for any motion at all.
        pga_g: PGA of the horizontal motion [g].
        status: ``found``; ``below_limit`` (no block down to `search_limit` slides so far);
            ``no_motion`` (none slides at all); ``outside_model`` (the vertical motion throws it).
        search_limit: least k_y/PGA looked at.
        ky_over_pga: the critical k_y/PGA: every block below it slides further; None unless found.
        lower: lower end of its bracket (slides further), k_y/PGA.
        upper: upper end (does not), k_y/PGA.
        n_runs: number of simulations made.
        warnings: sentences about suspicious input.
    """

    polarity: Polarity
    displacement_m: float
    pga_g: float
    status: Status
    search_limit: float
    ky_over_pga: float | None
    lower: float | None
    upper: float | None
    n_runs: int
    warnings: tuple[str, ...]

    @property
    def ky(self) -> float | None:
        """The critical k_y itself [g]."""
        return None if self.ky_over_pga is None else self.ky_over_pga * self.pga_g


@dataclass(frozen=True, eq=False)
class SlidingBlocks:
    """Blocks on a level plane under one excitation.

    Args:
        drive: the excitation.
    """

    drive: Excitation

    @cached_property
    def known(self) -> dict[float, float]:
        """Displacements that were simulated, by k_y/PGA."""
        return {}

    def displacement_m(self, ky_over_pga: float) -> float:
        """Return the permanent displacement down a level plane [m]; NaN where it is thrown.

        Args:
            ky_over_pga: strength over PGA, above zero.
        """
        if ky_over_pga not in self.known:
            self.known[ky_over_pga] = _displacement_m(self.drive, ky_over_pga * self.drive.pga_g)
        return self.known[ky_over_pga]


def sliding_displacements(
    motion: GroundMotion,
    ky_over_pga: Sequence[float] = KY_OVER_PGA,
    *,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
) -> FloatArray:
    """Return how far blocks slide down a level plane, downslope only [m].

    On a base of dip beta the displacement is cos(phi - beta)/cos(phi) times this, k_y being
    tan(phi - beta).

    Args:
        motion: horizontal ground motion; its PGA must be above zero.
        ky_over_pga: strengths over PGA, shape (n,).
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.

    Returns:
        Displacements, shape (n,); NaN where the vertical motion throws the block off its base.

    Raises:
        InputError: a strength that is not above zero, a motion of no acceleration.
    """
    blocks = SlidingBlocks(excitation(motion, vertical, polarity))
    positive(blocks.drive.pga_g, "PGA", "g")
    strengths = [positive(value, "ky_over_pga", "k_y/PGA") for value in ky_over_pga]
    return np.array([blocks.displacement_m(value) for value in strengths], dtype=np.float64)


def critical_sliding(
    motion: GroundMotion,
    *,
    displacement_m: float,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    search_limit: float = SEARCH_LIMIT,
    tolerance: float = TOLERANCE,
) -> SlidingResult:
    """Return the greatest k_y/PGA with which a block slides further than a distance.

    Args:
        motion: horizontal ground motion.
        displacement_m: the distance on a level plane [m]; on a base that dips, divide yours by
            cos(phi - beta)/cos(phi). 0 asks for the strength that first moves.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.
        search_limit: least k_y/PGA looked at.
        tolerance: width of the bracket, k_y/PGA.

    Raises:
        InputError: a value outside its range.
    """
    drive = excitation(motion, vertical, polarity)
    remarks = [*motion.remarks, *(flag.sentence for flag in quality_flags(motion)), *drive.warnings]
    if vertical is not None:
        remarks += [f"vertical: {flag.sentence}" for flag in quality_flags(vertical)]
    return critical_of(
        SlidingBlocks(drive),
        displacement_m,
        polarity=polarity,
        search_limit=search_limit,
        tolerance=tolerance,
        warnings=tuple(remarks),
    )


def critical_of(
    blocks: SlidingBlocks,
    displacement_m: float,
    *,
    polarity: Polarity,
    search_limit: float = SEARCH_LIMIT,
    tolerance: float = TOLERANCE,
    warnings: tuple[str, ...] = (),
) -> SlidingResult:
    """Return the same for blocks of which some displacements may be known already.

    Arguments as for :func:`critical_sliding`.
    """
    distance = not_negative(displacement_m, "displacement_m", "m")
    limit = positive(search_limit, "search_limit", "k_y/PGA")
    width = positive(tolerance, "tolerance", "k_y/PGA")
    drive = blocks.drive
    before = len(blocks.known)
    low = high = None
    status: Status = "no_motion"
    top = drive.max_q / drive.pga_g if drive.pga_g > 0.0 else 0.0
    if drive.jump_node < drive.w.size:
        status = "outside_model"
    elif top > limit:
        if distance == 0.0:
            status, low, high = "found", top, top
        elif blocks.displacement_m(limit) <= distance:
            status = "below_limit"
        else:
            status = "found"
            low, high = _bracket(blocks, distance, limit, top, width)
    return SlidingResult(
        polarity=polarity,
        displacement_m=distance,
        pga_g=drive.pga_g,
        status=status,
        search_limit=limit,
        ky_over_pga=low,
        lower=low,
        upper=high,
        n_runs=len(blocks.known) - before,
        warnings=warnings,
    )


def _bracket(
    blocks: SlidingBlocks, distance: float, low: float, high: float, width: float
) -> tuple[float, float]:
    for k, slid in sorted(blocks.known.items()):
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


def _displacement_m(drive: Excitation, ky: float) -> float:
    from rbfrag.solver.models.sliding import mechanism

    friction_rad = math.atan(ky)
    level = BlockOnPlanes(
        block=None,
        beta_rad=0.0,
        phi_rad=friction_rad,
        phi_back_rad=friction_rad,
        back_fracture=False,
        cohesive=False,
        yield_g=ky,
        settings={},
    )
    course = follow(mechanism(level), drive)
    return course.x if course.outcome is Outcome.STABLE else math.nan
