"""Looking at single blocks: what a search does where nothing can be proven."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.follow import first_block
from rbfrag.solver.taylor import PH_MAX
from rbfrag.solver.upper_bound import linear_drive

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
        p = math.sqrt(p2)
        still = np.empty(drive.q.size)
        linear_drive(drive.interval_s, drive.k_h, p, still)
        self._record = (
            drive.time_s,
            drive.interval_s,
            drive.k_h,
            drive.w,
            drive.q,
            drive.tail_min_q,
            drive.block_max_q,
            still,
            p,
            PH_MAX,
            linear,
        )
        self.runs = 0

    def first(self, kr: FloatArray, *, topples: bool) -> int | None:
        """Return the number of the first of these blocks that topples (or that stays)."""
        at: int = first_block(*self._record, kr, topples)
        self.runs += min(at + 1, kr.size)
        return None if at == kr.size else at

    def topples(self, kr: float) -> bool:
        """Return whether one block topples."""
        return self.first(np.array([kr]), topples=True) is not None

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
