"""The method ``wls``: the dissertation's fragility model with its uncertainty and scores."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility.checks import NEGATIVE_SHARE_LIMIT
from rbfrag.fragility.fit import scores
from rbfrag.fragility.fit.data import FEW_EVENTS, FitData
from rbfrag.fragility.fit.judgement import Outcomes, outcomes_of, score_intervals, scores_of
from rbfrag.fragility.fit.method_result import MethodResult
from rbfrag.fragility.fit.scatter import nested_scatter
from rbfrag.fragility.fit.straight_line import mean_m_s, negative_share, score, variance_m2_s2
from rbfrag.fragility.fit.variance import FLOOR_SHARE, Bins
from rbfrag.fragility.fit.wls import (
    TOLERANCE,
    LineFit,
    clustered_line,
    event_bootstrap,
    iterate,
    naive_line_errors,
)
from rbfrag.fragility.functions import array_functions
from rbfrag.fragility.measures import Term

FloatArray = NDArray[np.float64]

REPLICATES = 400


def fit_wls(data: FitData, term: Term, *, seed: int) -> MethodResult:
    """Fit y* = c0 + c1 x with variance v(x), as the dissertation does.

    Censored points are left out of the fit (and bias it upwards); standard errors of the
    line are clustered by earthquake; the covariance of all parameters comes from a
    bootstrap by earthquake.

    Args:
        data: the points.
        term: the intensity term, which sets the degree of v(x).
        seed: seed of the bootstrap.

    Raises:
        FitError: the line does not rise with intensity, or there is no scatter.
    """
    found = data.found
    x, y = data.x[found], data.y[found]
    names, events = np.unique(data.event[found], return_inverse=True)
    events = events.astype(np.intp)
    bins = Bins.equal_count(x)
    ones = np.ones(x.size)
    _refuse_without_scatter(x, y)
    fit = iterate(bins, y, ones, term.variance_degree)
    if fit.parameters[1] <= 0.0:
        raise FitError(
            f"the fitted critical velocity does not rise with {term.title} (slope "
            f"{fit.parameters[1]:.4g}): these motions cannot carry a fragility model in "
            f"{term.symbol}; use another term or more motions"
        )
    parameters = tuple(fit.parameters.tolist())
    variance = variance_m2_s2(parameters, x)
    line, clustered, r_squared = clustered_line(x, y, 1.0 / variance, events)
    naive = naive_line_errors(x, 1.0 / variance, y - mean_m_s(parameters, x))
    samples, unstable = event_bootstrap(
        bins, y, events, term.variance_degree, fit.parameters, replicates=REPLICATES, seed=seed
    )
    covariance = np.cov(samples, rowvar=False)
    labels = ["c0", "c1", *(f"v{i}" for i in range(term.variance_degree + 1))]
    spread = dict(zip(labels, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    residuals = y - mean_m_s(parameters, x)
    seen = outcomes_of(data)
    in_sample, held_out, density = _judged(data, seen, bins, y, events, names, fit, term)
    return MethodResult(
        coefficients=dict(zip(labels, parameters, strict=True)),
        covariance=tuple(tuple(row) for row in covariance.tolist()),
        standard_errors={
            **spread,
            "c0": math.sqrt(clustered[0, 0]),
            "c1": math.sqrt(clustered[1, 1]),
        },
        scores={
            "log_density_in_sample": float(_log_density(fit.parameters, bins.x, y).mean()),
            "log_density_held_out": float(density.mean()),
            **scores_of(seen, in_sample, held_out),
        },
        details={
            "judged_on": seen.kind,
            "score_intervals": score_intervals(data, seen, held_out, seed=seed),
            "scatter_ln_y": _scatter(data, parameters),
            "naive_standard_errors": dict(zip(("c0", "c1"), naive.tolist(), strict=True)),
            "intercept_m_s": float(line[0]),
            "slope": float(line[1]),
            "standard_error_kinds": {
                name: "clustered by earthquake" if name in ("c0", "c1") else "bootstrap"
                for name in labels
            },
            "bootstrap": {
                "standard_errors": spread,
                "replicates": REPLICATES,
                "not_stable": unstable,
                "seed": seed,
            },
            "r_squared_weighted": r_squared,
            "residual_sd_m_s": float(residuals.std(ddof=2)),
            "standardised_residual_sd": float((residuals / np.sqrt(variance)).std(ddof=2)),
            "iterations": fit.iterations,
            "converged": fit.converged,
            "tolerance": TOLERANCE,
            "variance_bins": int(bins.starts.size),
            "variance_floor_share": FLOOR_SHARE,
        },
        warnings=tuple(_warnings(data, fit, x, names.size, unstable)),
        held_out=held_out,
    )


def _refuse_without_scatter(x: FloatArray, y: FloatArray) -> None:
    residuals = y - np.polynomial.Polynomial.fit(x, y, 1)(x)
    if residuals.std() <= 1e-9 * np.abs(y).max():
        raise FitError(
            "the critical values lie exactly on a line: without scatter there is no "
            "probability to fit; use recorded motions instead of scaled copies of one"
        )


def _judged(
    data: FitData,
    seen: Outcomes,
    bins: Bins,
    y: FloatArray,
    events: NDArray[np.intp],
    names: NDArray[np.intp],
    fit: LineFit,
    term: Term,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    inside = _probability(fit.parameters, data.x, seen.y0_m_s)
    held_out = inside.copy()
    # An earthquake with censored points only has no share in the fit: it is held out already.
    density = np.empty(y.size)
    for number, name in enumerate(names.tolist()):
        left_out = events == number
        rest = (~left_out).astype(np.float64)
        part = iterate(bins, y, rest, term.variance_degree, fit.parameters)
        judged = data.event == name
        held_out[judged] = _probability(part.parameters, data.x[judged], seen.y0_m_s[judged])
        density[left_out] = _log_density(part.parameters, bins.x[left_out], y[left_out])
    return inside, held_out, density


def _scatter(data: FitData, parameters: tuple[float, ...]) -> dict[str, float] | None:
    mean = mean_m_s(parameters, data.x)
    used = data.found & (mean > 0.0) & (data.y > 0.0)
    residual = np.log(data.y[used] / mean[used])
    scatter = nested_scatter(residual, data.event[used], data.motion[used])
    return None if scatter is None else vars(scatter)


def _probability(parameters: FloatArray, x: FloatArray, y0: FloatArray) -> FloatArray:
    from scipy.special import ndtr

    z, _ = score(
        tuple(parameters.tolist()), np.broadcast_to(x[:, None], y0.shape), y0, array_functions()
    )
    return np.asarray(ndtr(z), dtype=np.float64)


def _log_density(parameters: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    values = tuple(parameters.tolist())
    return scores.normal_log_density(y, mean_m_s(values, x), variance_m2_s2(values, x))


def _warnings(
    data: FitData, fit: LineFit, x: FloatArray, n_events: int, unstable: int
) -> list[str]:
    result = []
    n_censored = int((~data.found).sum())
    if n_censored:
        result.append(
            f"{n_censored} combinations without a critical value above the search limit are left "
            "out, as in the dissertation: the mean is biased upwards for small p² and weak motions"
        )
    if not fit.converged:
        result.append(f"line and variance did not become stable in {fit.iterations} iterations")
    if unstable > 0.05 * REPLICATES:
        result.append(
            f"{unstable} of {REPLICATES} bootstrap fits did not become stable: the confidence "
            "intervals are rough"
        )
    if n_events < FEW_EVENTS:
        result.append(
            f"only {n_events} earthquakes: standard errors clustered by earthquake are too small"
        )
    doubtful = negative_share(tuple(fit.parameters.tolist()), x, array_functions())
    share = float(np.mean(doubtful > NEGATIVE_SHARE_LIMIT))
    if share > 0.0:
        low, high = x[doubtful > NEGATIVE_SHARE_LIMIT][[0, -1]]
        result.append(
            f"for intensities of {low:.3g} to {high:.3g} m/s ({100 * share:.0f} % of the points) "
            f"the straight-line normal model gives more than {100 * NEGATIVE_SHARE_LIMIT:g} % "
            "probability to negative critical velocities: it does not make sense there"
        )
    if fit.parameters[0] > 0.0:
        result.append(
            f"the line starts above zero, at {fit.parameters[0]:.3g} m/s: for blocks weaker than "
            "that the probability may fall with growing intensity"
        )
    return result
