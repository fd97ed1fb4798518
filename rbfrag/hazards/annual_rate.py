"""Annual rate of failure for a user-supplied fragility function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.rate_density import Grid, under
from rbfrag.solver.results import FloatArray

Fragility = Callable[[FloatArray], FloatArray]
"""From levels of the curve's measure, shape (n,), to probabilities of failure, shape (m, n)."""

STEP = 5e-4
"""Step of ln(level): where a fragility jumps, its rate is right to half of it times the slope of
the curve."""


@dataclass(frozen=True, eq=False)
class FailureRate:
    """Annual failure rates of m fragility functions, and what lies beyond the ends of the curve.

    Args:
        annual_rate: rates [1/a], shape (m,).
        above: rate that shaking beyond the last level of the curve adds at least [1/a],
            shape (m,); part of `annual_rate`.
        above_at_most: the same at most; the difference is not in `annual_rate`.
        below: probability of failure at the lowest level of the curve, shape (m,).
    """

    annual_rate: FloatArray
    above: FloatArray
    above_at_most: FloatArray
    below: FloatArray


def failure_rate(curve: HazardCurve, fragility: Fragility) -> FailureRate:
    """Return the annual rate of failure, the integral of P(failure | x) over -dλ(x).

    Shaking beyond the last level counts with the probability at that level, the least it can be;
    below the first level nothing is counted.

    Args:
        fragility: probabilities of failure at levels of its measure; rows are blocks.

    Raises:
        InputError: a probability is not a number.
    """
    first, last = curve.levels[[0, -1]].tolist()
    grid = Grid.over(STEP, np.log(first), np.log(last))
    p = _checked(fragility, np.clip(np.exp(grid.u), first, last))
    ends = _checked(fragility, np.array([first, last]))
    rate = float(curve.annual_rate[-1])
    beyond = np.ones(ends.shape[0])
    if curve.end_level is not None:
        beyond = _checked(fragility, np.array([curve.end_level]))[:, 0]
    return FailureRate(p @ under([curve], grid)[0], rate * ends[:, 1], rate * beyond, ends[:, 0])


def probability_in(years: float, annual_rate: FloatArray) -> FloatArray:
    """Return the probability of at least one failure in T years, 1 - exp(-λT) (Poisson)."""
    return np.asarray(-np.expm1(-annual_rate * checked_years(years)))


def checked_years(years: float) -> float:
    """Return a period [a] after checking that it is positive and finite."""
    if not np.isfinite(years) or years <= 0.0:
        raise InputError(f"years = {years:g}: give a period above 0 years")
    return years


def _checked(fragility: Fragility, levels: FloatArray) -> FloatArray:
    probabilities = np.atleast_2d(np.asarray(fragility(levels), dtype=np.float64))
    if np.isnan(probabilities).any():
        level = float(levels[np.argwhere(np.isnan(probabilities))[0][1]])
        raise InputError(f"the probability of failure at the level {level:g} is not a number")
    return probabilities
