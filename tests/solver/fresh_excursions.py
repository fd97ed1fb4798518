"""Whether any fresh excursion topples: the bisection that bounds of k_r are checked against."""

from __future__ import annotations

import math

import numpy as np

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.renewal import fresh_starts
from rbfrag.solver.taylor import PH_MAX


def fails(drive: Excitation, p2: float, linear: bool, kr: float) -> bool:
    """Whether a block that starts from rest at any rise of the drive above k_r topples."""
    n = drive.q.size
    u, us, uc = np.empty(9), np.empty(9), np.empty(9)
    _, failing, _ = fresh_starts(
        drive.interval_s, drive.k_h, drive.w, drive.q, drive.tail_min_q, drive.block_max_q,
        math.sqrt(p2), PH_MAX, linear, kr, kr, kr, False, 0, n,
        np.empty((4, n), dtype=np.int64), u, us, uc,
    )  # fmt: skip
    return failing > 0


def largest_failing(drive: Excitation, p2: float, linear: bool, width: float = 1e-12) -> float:
    """Bisect, from the whole range of k_r, for the largest one with a failing fresh excursion."""
    low, high = 0.0, drive.max_q
    while high - low > width * high and high > 0.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fails(drive, p2, linear, middle) else (low, middle)
    return low
