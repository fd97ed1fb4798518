"""Iterated weighted least squares with a variance that depends on intensity.

The method of the dissertation (section 4.5.3): ordinary least squares, bin variances of the
residuals, a fitted variance v(x), least squares with the weights 1/v, and again until stable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.variance import Bins, fit_variance, powers

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-8
"""The fit is stable when mean (over the scatter) and variance (relative) change by less."""

MOST_ITERATIONS = 200

FEWEST_POINTS = 6
"""A line with a variance of three parameters needs more than five points."""


@dataclass(frozen=True, eq=False)
class LineFit:
    """A straight line with its variance.

    Args:
        parameters: c0 [m/s], c1, v0, v1[, v2].
        iterations: how many times line and variance were fitted.
        converged: whether they became stable.
    """

    parameters: FloatArray
    iterations: int
    converged: bool


def weighted_line(x: FloatArray, y: FloatArray, weights: FloatArray) -> FloatArray:
    """Return intercept and slope of the weighted least-squares line.

    Args:
        x: intensities [m/s], shape (n,).
        y: responses [m/s], shape (n,).
        weights: weights, shape (n,); zero leaves a point out.
    """
    total = weights.sum()
    x_mean, y_mean = weights @ x / total, weights @ y / total
    dx = x - x_mean
    wdx = weights * dx
    slope = wdx @ (y - y_mean) / (wdx @ dx)
    return np.array([y_mean - slope * x_mean, slope])


def iterate(
    bins: Bins,
    y: FloatArray,
    multiplicity: FloatArray,
    degree: int,
    start: FloatArray | None = None,
) -> LineFit:
    """Fit line and variance in turn until both are stable.

    Args:
        bins: bins over the rising intensities.
        y: critical toppling velocities [m/s], in the order of ``bins.x``.
        multiplicity: how many times each point counts.
        degree: degree of the variance polynomial.
        start: parameters to start from; None starts with ordinary least squares.
    """
    x = bins.x
    columns = powers(x, degree)
    if start is None:
        line, variance = weighted_line(x, y, multiplicity), None
    else:
        line, variance = start[:2], start[2:]
    ends = np.array([[1.0, x[0]], [1.0, x[-1]]])
    iterations, stable = 0, False
    while not stable and iterations < MOST_ITERATIONS:
        iterations += 1
        residuals = y - line[0] - line[1] * x
        fitted = fit_variance(bins, residuals * residuals, multiplicity, degree, variance)
        values = columns @ fitted
        new_line = weighted_line(x, y, multiplicity / values)
        stable = variance is not None and bool(
            np.all(np.abs(ends @ (new_line - line)) <= TOLERANCE * np.sqrt(values[[0, -1]]))
            and np.all(np.abs(values - columns @ variance) <= TOLERANCE * values)
        )
        line, variance = new_line, fitted
    assert variance is not None
    return LineFit(np.concatenate([line, variance]), iterations, stable)


def clustered_line(
    x: FloatArray, y: FloatArray, weights: FloatArray, events: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray, float]:
    """Fit the line by statsmodels with a covariance clustered by earthquake.

    Args:
        x: intensities [m/s], shape (n,).
        y: responses [m/s], shape (n,).
        weights: weights 1/v, shape (n,).
        events: number of each point's earthquake, shape (n,).

    Returns:
        Intercept and slope; their clustered covariance (with the usual correction
        G/(G-1)·(n-1)/(n-2) for G earthquakes); and the weighted R².
    """
    import statsmodels.api as sm

    result = sm.WLS(y, sm.add_constant(x, has_constant="add"), weights=weights).fit(
        cov_type="cluster", cov_kwds={"groups": events}
    )
    return np.asarray(result.params), np.asarray(result.cov_params()), float(result.rsquared)


def naive_line_errors(x: FloatArray, weights: FloatArray, residuals: FloatArray) -> FloatArray:
    """Return the standard errors of the line that take all points for independent, shape (2,)."""
    columns = np.column_stack([np.ones(x.size), x])
    bread = np.linalg.inv((columns * weights[:, None]).T @ columns)
    scale = float(weights @ residuals**2) / (x.size - 2)
    return np.sqrt(np.diag(bread) * scale)


def event_bootstrap(
    bins: Bins,
    y: FloatArray,
    events: NDArray[np.intp],
    degree: int,
    start: FloatArray,
    *,
    replicates: int,
    seed: int,
) -> tuple[FloatArray, int]:
    """Return parameters fitted to resampled earthquakes, shape (replicates, parameters).

    Whole earthquakes are drawn with replacement, because the points of one earthquake
    are not independent. A draw with fewer than six points, or with equal intensities, tells
    nothing about scatter and is drawn again.

    Args:
        bins: bins over the rising intensities, kept fixed.
        y: critical toppling velocities [m/s].
        events: number of each point's earthquake, 0 … G-1.
        degree: degree of the variance polynomial.
        start: parameters of the fit to all data.
        replicates: how many resamples.
        seed: seed of the random numbers.

    Returns:
        The parameters, and how many replicates did not become stable.
    """
    random = np.random.default_rng(seed)
    count = int(events.max()) + 1
    result = np.empty((replicates, start.size))
    unstable = 0
    for i in range(replicates):
        while True:
            drawn = np.bincount(random.integers(count, size=count), minlength=count)
            multiplicity = drawn[events].astype(np.float64)
            drawn_x = bins.x[multiplicity > 0.0]
            if drawn_x.size >= FEWEST_POINTS and np.ptp(drawn_x) > 0.0:
                break
        fit = iterate(bins, y, multiplicity, degree, start)
        result[i] = fit.parameters
        unstable += not fit.converged
    return result, unstable
