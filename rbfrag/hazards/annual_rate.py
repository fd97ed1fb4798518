"""How often per year a block fails: fragility integrated over a hazard curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve
from rbfrag.solver.results import FloatArray

Fragility = Callable[[FloatArray], FloatArray]
"""From levels of the curve's measure, shape (n,), to probabilities of failure, shape (m, n)."""

TOLERANCE = 1e-5
"""Relative error of the integral above which panels are halved where the fragility is abrupt."""

PANEL = 0.1
"""Greatest width of a panel in ln x."""

_MOST_HALVINGS = 30

# the 5-point rule of Kronrod (1965) about the 2-point rule of Gauss and Legendre, on [-1, 1]
_OUTER, _INNER = np.sqrt(6.0 / 7.0), np.sqrt(1.0 / 3.0)
_POINTS = np.array([-_OUTER, -_INNER, 0.0, _INNER, _OUTER])
_WEIGHTS = np.array([98.0 / 495.0, 27.0 / 55.0, 28.0 / 45.0, 27.0 / 55.0, 98.0 / 495.0])
_OF_GAUSS = np.array([1, 3])


@dataclass(frozen=True, eq=False)
class FailureRate:
    """Annual failure rates of m fragilities and where they come from.

    Args:
        annual_rate: rates [1/a], shape (m,).
        numerical_error: how far quadrature may be off, relative to the rates, shape (m,).
        edges: levels between which contributions are given, shape (k + 1,).
        contribution: part of the rate from each interval [1/a], shape (m, k).
        above: rate that shaking beyond the last level of the curve adds at least [1/a],
            shape (m,); part of `annual_rate`.
        above_at_most: the same at most; the difference is not in `annual_rate`.
        below: probability of failure at the lowest level of the curve, shape (m,).
    """

    annual_rate: FloatArray
    numerical_error: FloatArray
    edges: FloatArray
    contribution: FloatArray
    above: FloatArray
    above_at_most: FloatArray
    below: FloatArray


def failure_rate(
    curve: HazardCurve, fragility: Fragility, coarse: Fragility | None = None
) -> FailureRate:
    """Return the annual rate of failure, the integral of P(failure | x) over -dλ(x).

    Panels of at most `PANEL` in ln x between the levels of the curve are integrated by Kronrod's
    5-point rule. What it differs by from Gauss and Legendre's of 2 of these points is taken for its
    error, which is that of the far worse rule. Shaking beyond the last level counts with the
    probability at that level, the least it can be; below the first level nothing is counted.

    Args:
        fragility: probabilities of failure at levels of its measure; rows are blocks.
        coarse: the same from a table of twice the step, whose error then is part of the estimate;
            None for a fragility that is known at every level: panels where it is abrupt are halved.
    """
    u = np.log(curve.levels)
    number = np.maximum(np.ceil(np.diff(u) / PANEL), 1.0).astype(np.intp)
    width = np.repeat(np.diff(u) / number, number)
    within = np.arange(width.size) - np.repeat(np.cumsum(number) - number, number)
    left = np.repeat(u[:-1], number) + within * width
    edges = np.append(left, u[-1])
    right, home = edges[1:], np.arange(left.size)

    ends = _checked(fragility, np.array([curve.levels[0], curve.levels[-1]]))
    last = float(curve.annual_rate[-1])
    above = last * ends[:, 1]
    if curve.end_level is None:
        above_at_most = np.full(ends.shape[0], last)
    else:
        above_at_most = last * _checked(fragility, np.array([curve.end_level]))[:, 0]

    contribution = np.zeros((ends.shape[0], left.size))
    error = np.zeros(ends.shape[0])
    scale: FloatArray | None = None
    for halving in range(_MOST_HALVINGS + 1):
        fine, rough = _masses(curve, fragility, coarse, left, right)
        apart = np.abs(fine - rough)
        if scale is None:
            scale = np.maximum(fine.sum(axis=1) + above, np.finfo(np.float64).tiny)
        last_time = coarse is not None or halving == _MOST_HALVINGS
        settled = (apart <= TOLERANCE / edges.size * scale[:, None]).all(axis=0) | last_time
        np.add.at(contribution.T, home[settled], fine[:, settled].T)
        error += apart[:, settled].sum(axis=1)
        todo = ~settled
        if not todo.any():
            break
        middle = 0.5 * (left[todo] + right[todo])
        left = np.concatenate([left[todo], middle])
        right = np.concatenate([middle, right[todo]])
        home = np.tile(home[todo], 2)
    rate = contribution.sum(axis=1) + above
    return FailureRate(
        annual_rate=rate,
        numerical_error=error / np.maximum(rate, np.finfo(np.float64).tiny),
        edges=np.exp(edges),
        contribution=contribution,
        above=above,
        above_at_most=above_at_most,
        below=ends[:, 0],
    )


def _masses(
    curve: HazardCurve,
    fragility: Fragility,
    coarse: Fragility | None,
    left: FloatArray,
    right: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return integrals over panels, shape (m, k), by the better and by the worse rule."""
    half = 0.5 * (right - left)
    nodes = (left + half)[:, None] + half[:, None] * _POINTS
    mass = half[:, None] * curve.density(nodes.ravel()).reshape(nodes.shape)
    probability = _checked(fragility, np.exp(nodes).ravel()).reshape(-1, *nodes.shape)
    of_gauss = (
        probability[:, :, _OF_GAUSS]
        if coarse is None
        else _checked(coarse, np.exp(nodes[:, _OF_GAUSS]).ravel()).reshape(-1, half.size, 2)
    )
    fine = np.einsum("mkj,kj->mk", probability, mass * _WEIGHTS)
    rough = np.einsum("mkj,kj->mk", of_gauss, mass[:, _OF_GAUSS])
    return fine, rough


def probability_in(years: float, annual_rate: FloatArray) -> FloatArray:
    """Return the probability of at least one failure in T years, 1 - exp(-λT) (Poisson)."""
    return np.asarray(-np.expm1(-annual_rate * checked_years(years)))


def checked_years(years: float) -> float:
    """Return a period [a], or refuse what is none."""
    if not np.isfinite(years) or years <= 0.0:
        raise InputError(f"years = {years:g}: give a period above 0 years")
    return years


def _checked(fragility: Fragility, levels: FloatArray) -> FloatArray:
    probabilities = np.atleast_2d(np.asarray(fragility(levels), dtype=np.float64))
    if np.isnan(probabilities).any():
        level = float(levels[np.argwhere(np.isnan(probabilities))[0][1]])
        raise InputError(f"the probability of failure at the level {level:g} is not a number")
    return probabilities
