"""Blocks run for themselves at stated strengths: the curves of θ_n over k_r/PGA."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rbfrag.errors import InputError
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.results import SEARCH_LIMIT, SearchPoints
from rbfrag.solver.toppling_run import OUTCOMES, positive

GRID_TOP = 0.99
"""Largest k_r/PGA of a grid given by its number of values: the dissertation's first."""

MOST_VALUES = 10_000


def grid_of(number: int) -> tuple[float, ...]:
    """Return a grid that does not depend on any outcome: equal steps of ln(k_r/PGA).

    Args:
        number: how many values, from 0.99 down to the search limit 0.01; at least 2.

    Raises:
        InputError: fewer than 2, or absurdly many.
    """
    if not 2 <= number <= MOST_VALUES:
        raise InputError(f"--grid: the number of values must be 2 to {MOST_VALUES}, not {number}")
    values = np.geomspace(GRID_TOP, SEARCH_LIMIT, number)
    values[[0, -1]] = GRID_TOP, SEARCH_LIMIT
    return tuple(values.tolist())


def checked_ratios(values: Sequence[float], what: str) -> tuple[float, ...]:
    """Return k_r/PGA values as they are stored, falling, each once.

    Args:
        values: as the user gave them.
        what: the option, for the message.

    Raises:
        InputError: a value that is not positive and finite, or one that repeats.
    """
    ratios = sorted((positive(value, what, "k_r/PGA") for value in values), reverse=True)
    for one, next_one in pairwise(ratios):
        if one == next_one:
            raise InputError(f"{what}: {one:g} is in the list twice: name each value once")
    return tuple(ratios)


def run_grid(drive: Excitation, p2: float, kr_over_pga: Sequence[float]) -> SearchPoints:
    """Run one block at each strength, by the solver that every command uses.

    Args:
        drive: the excitation; its PGA must be positive.
        p2: frequency parameter p² [1/s²].
        kr_over_pga: block strengths over PGA, falling.
    """
    ratio = np.array(kr_over_pga, dtype=np.float64)
    runs = simulate_many(drive, p2=p2, kr=ratio * drive.pga_g)
    return SearchPoints(
        kr_over_pga=ratio,
        theta_n=runs.theta_n,
        outcome=tuple(OUTCOMES[code].value for code in runs.outcome.tolist()),
    )
