"""Single blocks, each kept with what it did: where nothing can be proven, and what lies below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.single_run import TOPPLED, Run
from rbfrag.solver.results import SearchPoints
from rbfrag.solver.toppling_run import OUTCOMES, runner

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
