"""The method `lognormal`: ln y* on ln x, with censored points, by maximum likelihood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from rbfrag.errors import FitError
from rbfrag.fragility.fit.binomial import cr3, effective_freedom
from rbfrag.fragility.fit.censored_normal import (
    CensoredData,
    clustered_covariance,
    jackknife_steps,
    log_density,
    maximise,
    naive_covariance,
)
from rbfrag.fragility.fit.data import FEW_EVENTS, FitData
from rbfrag.fragility.fit.judgement import Outcomes, outcomes_of, score_intervals, scores_of
from rbfrag.fragility.fit.method_result import MethodResult
from rbfrag.fragility.fit.scatter import nested_scatter
from rbfrag.fragility.measures import Term

FloatArray = NDArray[np.float64]

REPLICATES = 400


def fit_lognormal(
    data: FitData, term: Term, *, seed: int, estimate_m: bool = False
) -> MethodResult:
    """Fit ln y* = a + b ln x (+ (M-1) ln p) with normal scatter sigma.

    Combinations without a critical value above the search limit count as "below the limit".
    Standard errors and covariance are clustered by earthquake; a bootstrap by earthquake is
    reported beside them.

    Args:
        data: the points, found and censored.
        term: the intensity term.
        seed: seed of the bootstrap.
        estimate_m: estimate M instead of M = 1: ln p enters with the coefficient M - 1.

    Raises:
        FitError: the median does not rise with intensity, or there is no scatter.
    """
    points, usable = _points(data, estimate_m)
    parameters = maximise(points)
    if parameters[1] <= 0.0:
        raise FitError(
            f"the fitted critical velocity does not rise with {term.title} (exponent "
            f"{parameters[1]:.4g}): these motions cannot carry a fragility model in "
            f"{term.symbol}; use another term or more motions"
        )
    if parameters[-1] < np.log(1e-9):
        raise FitError(
            "the critical values lie exactly on a power law: without scatter there is no "
            "probability to fit; use recorded motions instead of scaled copies of one"
        )
    order = [0, 1, 3, 2] if estimate_m else [0, 1, 2]  # ln sigma stands before M - 1
    names = ["ln_median", "slope", "ln_sigma", "m_minus_1"][: parameters.size]
    steps = jackknife_steps(points, parameters)[:, order]
    covariance = cr3(steps)
    cr1 = np.sqrt(np.diag(clustered_covariance(points, parameters)))[order]
    naive = np.sqrt(np.diag(naive_covariance(points, parameters)))[order]
    samples = _bootstrap(points, parameters, seed)[:, order]
    errors = np.sqrt(np.diag(covariance))
    seen = outcomes_of(data)
    in_sample = _probability(data, seen, parameters, estimate_m)
    held_out = in_sample.copy()
    density = log_density(points, parameters)
    left_out_density = density.copy()
    for event in np.unique(points.event):
        own = points.event == event
        part = maximise(points.only(~own), parameters)
        left_out_density[own] = log_density(points.only(own), part)
        judged = data.event == event
        held_out[judged] = _probability(data, seen, part, estimate_m)[judged]
    residual = (points.y - points.columns @ parameters[:-1])[points.found]
    scatter = nested_scatter(
        residual, points.event[points.found], data.motion[usable][points.found]
    )
    return MethodResult(
        coefficients=dict(zip(names, parameters[order].tolist(), strict=True)),
        covariance=tuple(tuple(line) for line in covariance.tolist()),
        standard_errors=dict(zip(names, errors.tolist(), strict=True)),
        scores={
            "log_density_in_sample": float(density.mean()),
            "log_density_held_out": float(left_out_density.mean()),
            **scores_of(seen, in_sample, held_out),
        },
        details={
            "judged_on": seen.kind,
            "degrees_of_freedom": effective_freedom(steps),
            "score_intervals": score_intervals(data, seen, held_out, seed=seed),
            "sigma_ln": float(np.exp(parameters[-1])),
            "exponent_m_estimated": estimate_m,
            "standard_error_kinds": dict.fromkeys(
                names, "clustered by earthquake, CR3 (each earthquake left out in turn)"
            ),
            "cr1_standard_errors": dict(zip(names, cr1.tolist(), strict=True)),
            "naive_standard_errors": dict(zip(names, naive.tolist(), strict=True)),
            "bootstrap": {
                "standard_errors": dict(
                    zip(names, samples.std(axis=0, ddof=1).tolist(), strict=True)
                ),
                "replicates": REPLICATES,
                "seed": seed,
            },
            "scatter_ln_y": None if scatter is None else vars(scatter),
        },
        warnings=tuple(_warnings(points)),
        held_out=held_out,
    )


def _points(data: FitData, estimate_m: bool) -> tuple[CensoredData, NDArray[np.bool_]]:
    usable = (data.x > 0.0) & (data.y > 0.0)
    ln_x, ln_p = np.log(data.x[usable]), 0.5 * np.log(data.p2[usable])
    columns = [np.ones(ln_x.size), ln_x, *([ln_p] if estimate_m else [])]
    points = CensoredData(
        np.column_stack(columns),
        np.log(data.y[usable]),
        data.found[usable],
        data.event[usable],
    )
    return points, usable


def _probability(
    data: FitData, seen: Outcomes, parameters: FloatArray, estimate_m: bool
) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = parameters[0] + parameters[1] * np.log(data.x)
        if estimate_m:
            mean = mean + parameters[2] * 0.5 * np.log(data.p2)
        z = (mean[:, None] - np.log(seen.y0_m_s)) / np.exp(parameters[-1])
    return np.asarray(np.nan_to_num(np.asarray(ndtr(z)), nan=0.0))


def _bootstrap(points: CensoredData, parameters: FloatArray, seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    events, number = np.unique(points.event, return_inverse=True)
    samples = np.empty((REPLICATES, parameters.size))
    for i in range(REPLICATES):
        drawn = np.bincount(random.integers(events.size, size=events.size), minlength=events.size)
        times = drawn[number].astype(np.float64)
        samples[i] = maximise(points, parameters, times)
    return samples


def _warnings(points: CensoredData) -> list[str]:
    result = [
        "this is the probability that the critical value is at least the block's: safe islands "
        "below it are not seen, and the model is over-confident about outcomes"
    ]
    n_events = int(np.unique(points.event).size)
    if n_events < FEW_EVENTS:
        result.append(
            f"only {n_events} earthquakes: standard errors clustered by earthquake are too small"
        )
    return result
