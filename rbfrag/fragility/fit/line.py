"""Iterated weighted least squares with an intensity-dependent variance.

The method of the dissertation (section 4.5.3): ordinary least squares, bin variances of the
residuals, a fitted variance v(x), least squares with the weights 1/v, and again until stable.

    s_j² = Σ w r² / Σ w  over bin j,    v(x) = v0 + v1 x (+ v2 x²),    all v_i >= 0

v0 has a floor, so that v(x) > 0 for every x >= 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.maximum_likelihood import held_out_probabilities, probabilities
from rbfrag.fragility.fit.result import Estimates, MethodResult, bootstrap, left_out, method_result
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import Method, arrays
from rbfrag.fragility.methods.wls import (
    NEGATIVE_LIMIT,
    mean_m_s,
    negative_probability,
    variance_m2_s2,
)
from rbfrag.results.numbers import exact_percent, percent
from rbfrag.solver.results import FloatArray

REPLICATES = 400

TOLERANCE = 1e-8
"""The fit is stable when mean (over the scatter) and variance (relative) change by less."""

MOST_ITERATIONS = 200

FEWEST_POINTS = 6
"""A line with a variance of three parameters needs more than five points."""

FLOOR_FRACTION = 1e-4
"""Floor of v0 as a share of the smallest non-zero bin variance (1 % in standard deviation)."""

POINTS_PER_BIN = 20
MOST_BINS = 20
FEWEST_BINS = 4


@dataclass(frozen=True, eq=False)
class Bins:
    """Bins over sorted intensities.

    Args:
        x: intensities [m/s], rising, shape (n,).
        starts: first index of each bin.
    """

    x: FloatArray
    starts: NDArray[np.intp]

    @classmethod
    def equal_count(cls, x: FloatArray) -> Bins:
        """Cut rising intensities into bins of equal count, about 20 points each.

        Points of equal intensity share a bin: it ends with the last of them once it has its count.
        """
        count = max(FEWEST_BINS, min(MOST_BINS, x.size // POINTS_PER_BIN))
        count = min(count, x.size)
        ends = np.arange(1, count, dtype=np.intp) * x.size // count
        starts = np.searchsorted(x, x[ends - 1], side="right")
        return cls(x, np.unique(np.append(0, starts[starts < x.size])))

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum of the values in each bin."""
        result: FloatArray = np.add.reduceat(values, self.starts)
        return result


class BinVariances(NamedTuple):
    """Variances of residuals in the bins that hold points, shape (m,).

    Args:
        centre: mean intensity of the points of each [m/s].
        variance: mean square of their residuals, with the two parameters of the line taken off the
            degrees of freedom [m²/s²].
    """

    counts: FloatArray
    centre: FloatArray
    variance: FloatArray


def bin_variances(
    bins: Bins, squared_residuals: FloatArray, multiplicity: FloatArray
) -> BinVariances:
    """Return the variances of the residuals in bins.

    Args:
        squared_residuals: r² [m²/s²] of each point, in the order of ``bins.x``.
        multiplicity: how many times each point counts.
    """
    counts = bins.sums(multiplicity)
    used = counts > 0.0
    counts = counts[used]
    centres = bins.sums(multiplicity * bins.x)[used] / counts
    spread = bins.sums(multiplicity * squared_residuals)[used] / counts
    # Least squares takes two parameters from the residuals.
    spread = spread * (counts.sum() / max(counts.sum() - 2.0, 1.0))
    return BinVariances(counts, centres, spread)


def powers(x: FloatArray, degree: int) -> FloatArray:
    """Return the columns 1, x, …, x^degree, shape (n, degree + 1)."""
    return np.vander(x, degree + 1, increasing=True)


def fit_variance(
    bins: Bins, squared_residuals: FloatArray, multiplicity: FloatArray, degree: int
) -> FloatArray:
    """Return v0, v1[, v2] [m²/s²]: non-negative least squares through the bin variances.

    All bins count alike, as in the dissertation: with the inverse variance of a bin variance as its
    weight, weak motions alone would set the line, and the scatter of strong ones would be half of
    what it is.

    Args:
        squared_residuals: r² [m²/s²] of each point, in the order of ``bins.x``.
        multiplicity: how many times each point counts (a resampled earthquake counts
            several times or not at all).
        degree: degree of v(x).
    """
    from scipy.optimize import nnls

    _, centres, spread = bin_variances(bins, squared_residuals, multiplicity)
    columns = powers(centres, degree)
    floor = FLOOR_FRACTION * spread[spread > 0.0].min()
    # Columns of like size keep the active set free of rounding.
    size = np.abs(columns).max(axis=0)
    solution, _ = nnls(columns / size, spread - floor)
    coefficients: FloatArray = solution / size
    coefficients[0] += floor
    return coefficients


@dataclass(frozen=True, eq=False)
class LineFit:
    """Straight line with its variance function.

    Args:
        parameters: c0 [m/s], c1, v0, v1[, v2].
        iterations: how many times line and variance were fitted.
        converged: whether they became stable.
    """

    parameters: FloatArray
    iterations: int
    converged: bool


def weighted_line(x: FloatArray, y: FloatArray, weights: FloatArray) -> FloatArray:
    """Return intercept and slope of the weighted least-squares line; weight 0 excludes a point.

    A fit does this some thousand times: 3,000 points take 8 µs, 68 by numpy's polyfit.
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
    """Fit the line and the variance alternately until both converge.

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
        fitted = fit_variance(bins, residuals * residuals, multiplicity, degree)
        values = columns @ fitted
        new_line = weighted_line(x, y, multiplicity / values)
        stable = variance is not None and bool(
            np.all(np.abs(ends @ (new_line - line)) <= TOLERANCE * np.sqrt(values[[0, -1]]))
            and np.all(np.abs(values - columns @ variance) <= TOLERANCE * values)
        )
        line, variance = new_line, fitted
    assert variance is not None
    return LineFit(np.concatenate([line, variance]), iterations, stable)


class ClusteredLine(NamedTuple):
    """A weighted least-squares line, intercept before slope.

    Args:
        line: the two parameters, shape (2,).
        covariance: clustered by earthquake, with the usual correction G/(G-1)·(n-1)/(n-2) for G
            earthquakes, shape (2, 2).
        naive_errors: standard errors that take all points for independent, shape (2,).
    """

    line: FloatArray
    covariance: FloatArray
    naive_errors: FloatArray
    r_squared: float


def clustered_line(
    x: FloatArray, y: FloatArray, weights: FloatArray, events: NDArray[np.intp]
) -> ClusteredLine:
    """Fit the line by statsmodels with a covariance clustered by earthquake.

    Args:
        x: intensities [m/s], shape (n,).
        y: responses [m/s], shape (n,).
        weights: weights 1/v, shape (n,).
        events: number of each point's earthquake, shape (n,).
    """
    from statsmodels.regression.linear_model import WLS
    from statsmodels.tools import add_constant

    naive = WLS(y, add_constant(x, has_constant="add"), weights=weights).fit()
    clustered = naive.get_robustcov_results(cov_type="cluster", groups=events)
    return ClusteredLine(
        np.asarray(naive.params),
        np.asarray(clustered.cov_params()),
        np.asarray(naive.bse),
        float(naive.rsquared),
    )


def fit_wls(
    data: FitData, method: Method, term: Term, *, seed: int, resample: bool = True
) -> MethodResult:
    """Fit y* = c0 + c1 x with variance v(x), the method of the dissertation.

    Censored points are left out of the fit (and bias it upwards). The covariance is that of the
    fits that each leave an earthquake out; a bootstrap by earthquake is reported on request.

    Args:
        term: the intensity term, which sets the degree of v(x).
        seed: seed of the bootstrap.
        resample: whether there is one.

    Raises:
        FitError: the line does not rise with intensity, or there is no scatter.
    """
    # E[y*] = c0 + c1 x, Var[y*] = v(x). The weights 1/v depend on the residuals and these on the
    # line, so both are fitted in turn until neither changes (Carroll and Ruppert 1988).
    form, degree = method.forms[term.name], term.variance_degree
    x, y, events = data.x[data.observed], data.y[data.observed], data.event[data.observed]
    # Sums follow the values alone, so that names and order of the rows alter no bit.
    order = np.lexsort((events, y, x))
    x, y, events = x[order], y[order], events[order]
    bins = Bins.equal_count(x)
    if (y - np.polynomial.Polynomial.fit(x, y, 1)(x)).std() <= 1e-9 * np.abs(y).max():
        raise FitError(
            "the critical values lie exactly on a line: without dispersion no probability can be "
            "fitted; use recorded motions instead of scaled copies of one"
        )
    fit = iterate(bins, y, np.ones(x.size), degree)
    if fit.parameters[1] <= 0.0:
        raise FitError(
            f"the fitted critical velocity does not rise with {term.title} (slope "
            f"{fit.parameters[1]:.4g}): no fragility model in {term.symbol} can be fitted; use "
            "another term or more motions"
        )
    parameters = fit.parameters.tolist()
    variance = variance_m2_s2(parameters, x)
    residuals = y - mean_m_s(parameters, x)
    # The same line by statsmodels, with a covariance clustered by earthquake, as an independent
    # check.
    clustered = clustered_line(x, y, 1.0 / variance, events)
    in_sample = probabilities(method, form, data, fit.parameters)
    # An earthquake with censored points only has no share in the fit: it is left out already.
    density = np.empty(y.size)
    jackknife = left_out(
        events, lambda rest: iterate(bins, y, rest.astype(float), degree, fit.parameters).parameters
    )
    for event, part in jackknife.items():
        fitted_rows = events == event
        density[fitted_rows] = _log_density(part, x[fitted_rows], y[fitted_rows])
    steps = np.array(list(jackknife.values())) - fit.parameters
    samples, unstable = None, 0
    if resample:
        samples, unstable = event_bootstrap(
            bins, y, events, degree, fit.parameters, replicates=REPLICATES, seed=seed
        )
    mean = mean_m_s(parameters, data.x)
    with np.errstate(divide="ignore", invalid="ignore"):
        ln_residual = np.where(data.observed & (mean > 0.0) & (data.y > 0.0),
                               np.log(data.y / mean), np.nan)  # fmt: skip
    result = method_result(
        data,
        Estimates(form.parameters, fit.parameters, steps, samples, seed),
        in_sample,
        held_out_probabilities(method, form, data, in_sample, jackknife),
        ln_residual=ln_residual,
        scores={
            "log_density_in_sample": float(_log_density(fit.parameters, x, y).mean()),
            "log_density_held_out": float(density.mean()),
        },
        details={
            "naive_standard_errors": dict(
                zip(("c0", "c1"), clustered.naive_errors.tolist(), strict=True)
            ),
            "intercept_m_s": float(clustered.line[0]),
            "slope": float(clustered.line[1]),
            "cr1_standard_errors": dict(
                zip(("c0", "c1"), np.sqrt(np.diag(clustered.covariance)).tolist(), strict=True)
            ),
            "r_squared_weighted": clustered.r_squared,
            "residual_sd_m_s": float(residuals.std(ddof=2)),
            "standardised_residual_sd": float((residuals / np.sqrt(variance)).std(ddof=2)),
            "iterations": fit.iterations,
            "converged": fit.converged,
            "tolerance": TOLERANCE,
            "variance_bins": int(bins.starts.size),
            "variance_floor_share": FLOOR_FRACTION,
        },
        warnings=_warnings(data, fit, x, unstable),
    )
    if samples is not None:
        cast("dict[str, object]", result.details["bootstrap"])["not_stable"] = unstable
    return result


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

    A draw with fewer than six points, or with equal intensities, tells nothing about scatter and
    is drawn again. The bins are kept.

    Args:
        bins: bins over the rising intensities.
        y: critical toppling velocities [m/s].
        events: number of each point's earthquake.
        degree: degree of the variance polynomial.
        start: parameters of the fit to all data.

    Returns:
        The parameters, and how many replicates did not become stable.
    """
    stable = []

    def fit(times: FloatArray) -> FloatArray:
        line = iterate(bins, y, times, degree, start)
        stable.append(line.converged)
        return line.parameters

    def enough(times: FloatArray) -> bool:
        drawn = bins.x[times > 0.0]
        return drawn.size >= FEWEST_POINTS and float(np.ptp(drawn)) > 0.0

    samples = bootstrap(events, fit, replicates=replicates, seed=seed, enough=enough)
    return samples, stable.count(False)


def _log_density(b: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    parameters = b.tolist()
    variance = variance_m2_s2(parameters, x)
    squares = (y - mean_m_s(parameters, x)) ** 2 / variance
    return np.asarray(-0.5 * (np.log(2.0 * np.pi * variance) + squares), dtype=np.float64)


def _warnings(data: FitData, fit: LineFit, x: FloatArray, unstable: int) -> list[str]:
    result = data.between_words("are left out of this fit")
    between = 0 if data.least_y_m_s is None else int(np.isfinite(data.least_y_m_s).sum())
    n_censored = int(data.censored.sum()) - between
    if n_censored:
        result.append(
            f"{n_censored} combinations without a critical value above the search limit are left "
            "out, as in the dissertation: the mean is biased upwards for small p² and weak motions"
        )
    if not fit.converged:
        result.append(f"line and variance did not become stable in {fit.iterations} iterations")
    if unstable > 0.05 * REPLICATES:
        result.append(
            f"{unstable} of {REPLICATES} bootstrap fits did not become stable: the standard "
            "errors of the bootstrap are rough"
        )
    # A normal y* gives negative critical velocities the probability Phi(-mean/sd), which is no
    # physics.
    doubtful = negative_probability(fit.parameters.tolist(), x, arrays()) > NEGATIVE_LIMIT
    doubtful_part = float(np.mean(doubtful))
    if doubtful_part > 0.0:
        low, high = x[doubtful][[0, -1]]
        result.append(
            f"for intensities of {low:.3g} to {high:.3g} m/s ({percent(doubtful_part)} of the "
            "points) "
            f"the straight-line normal model gives more than {exact_percent(NEGATIVE_LIMIT)} "
            "probability to negative critical velocities: it does not make sense there"
        )
    if fit.parameters[0] > 0.0:
        result.append(
            f"the line starts above zero, at {fit.parameters[0]:.3g} m/s: for blocks weaker than "
            "that the probability may fall with growing intensity"
        )
    return result
