"""Whether any excursion from rest topples: the bisection that bounds of k_r are checked against."""

from __future__ import annotations

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.block_excitation import block_excitation
from rbfrag.solver.search.renewal import all_known, begin, no_starts


def fails(drive: Excitation, p2: float, linear: bool, kr: float) -> bool:
    """Whether a block that starts from rest at any rise of the drive above k_r topples."""
    n = drive.q.size
    ground = block_excitation(drive, p2=p2, linear=linear)
    starts = no_starts(n)
    begin(starts, kr, kr, kr, False, 0, n)
    return all_known(ground, starts)[1] > 0


def largest_failing(drive: Excitation, p2: float, linear: bool, width: float = 1e-12) -> float:
    """Bisect, from all k_r, for the largest one with a failing excursion from rest."""
    low, high = 0.0, drive.max_q
    while high - low > width * high and high > 0.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fails(drive, p2, linear, middle) else (low, middle)
    return low
