"""Excursions from rest that topple: the bisection that bounds of k_r are checked against."""

from __future__ import annotations

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.block_excitation import BlockExcitation, block_excitation
from rbfrag.solver.integrator.compiled import bare_kernel
from rbfrag.solver.search.renewal import ExcursionTable, all_known, begin, excursion_table


@bare_kernel
def failing(excitation: BlockExcitation, table: ExcursionTable, kr: float) -> int:
    """Number of excursions from rest that topple, of all of the record."""
    begin(table, kr, 0.0, kr, False, 0, excitation.q.size)
    return all_known(excitation, table)


def fails(excitation: Excitation, p2: float, kr: float) -> bool:
    """Return whether a block at rest at any rise of k_h/(1 + k_v) above k_r topples."""
    table = excursion_table(excitation.q.size)
    return failing(block_excitation(excitation, p2=p2), table, kr) > 0


def largest_failing(excitation: Excitation, p2: float, width: float = 1e-12) -> float:
    """Bisect, from all k_r, for the largest one with a failing excursion from rest."""
    low, high = 0.0, excitation.max_q
    while high - low > width * high and high > 0.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fails(excitation, p2, middle) else (low, middle)
    return low
