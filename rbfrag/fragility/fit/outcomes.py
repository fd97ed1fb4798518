"""The methods that fit what blocks did: `logistic`, `weibull`, `bounded`, `record`, `power`.

A generalised linear model of binary outcomes on the grid of y0/PGV, which does not depend on
the outcome. Every combination weighs the same, however many of its outcomes are known. Blocks
that mechanics says cannot topple (k_r >= PGA, y >= 2 PGV, y >= X(p)) are not fitted: P is 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility import formulas
from rbfrag.fragility.fit.binomial import (
    BinomialData,
    cr3,
    effective_freedom,
    fit_by_statsmodels,
    jackknife_steps,
    maximum_likelihood,
    newton,
)
from rbfrag.fragility.fit.data import FEW_EVENTS, FitData
from rbfrag.fragility.fit.judgement import outcomes_of, score_intervals, scores_of
from rbfrag.fragility.fit.links import COMPLEMENT, LOGIT, LOGLOG, Link
from rbfrag.fragility.fit.method_result import MethodResult
from rbfrag.fragility.fit.scatter import nested_scatter
from rbfrag.fragility.measures import Term

FloatArray = NDArray[np.float64]

REPLICATES = 200
FEWEST_FAILURES = 20
LINKS_BY_CODE = {link.code: link for link in (LOGIT, LOGLOG, COMPLEMENT)}
"""The links by their numbers in the formulas."""


@dataclass(frozen=True, eq=False)
class OutcomeRows:
    """The rows of a fit, and where they stand on the grid.

    Args:
        data: features, outcomes, weights and earthquakes.
        place: flat index on the grid (n, 25) of each row.
        bounded: whether mechanics forbids the block, on the grid.
        bounded_toppled: known outcomes that toppled although mechanics forbids it (vertical
            motion, which the bounds leave out).
    """

    data: BinomialData
    place: NDArray[np.intp]
    bounded: NDArray[np.bool_]
    bounded_toppled: int


def fit_outcomes(
    data: FitData, term: Term, *, method: str, seed: int, estimate_m: bool = False
) -> MethodResult:
    """Fit one of the methods above.

    Args:
        data: the points with their outcomes.
        term: the intensity term.
        method: name of the method.
        seed: seed of the bootstrap by earthquake.
        estimate_m: give ln p a coefficient of its own (`logistic` only).

    Raises:
        FitError: no outcomes, outcomes all alike or separated, or too few failures.
    """
    if not data.has_outcomes:
        raise FitError(
            f"method {method} fits what blocks did, and no outcomes are stored: run  rbfrag "
            "simulate  again, which adds the maps of outcomes, or fit --method wls or lognormal"
        )
    shape, link = formulas.SHAPES[method, term.name], LINKS_BY_CODE[formulas.LINKS[method]]
    names = formulas.PARAMETERS[shape][: None if shape != formulas.RATIO or estimate_m else 2]
    rows = outcome_rows(data, shape, len(names))
    toppled = int((rows.data.outcome > 0.5).sum())
    if 0 < toppled < FEWEST_FAILURES:
        raise FitError(
            f"{toppled} outcomes on the grid toppled; a fit needs {FEWEST_FAILURES}: add stronger "
            "motions or more block sizes (p²)"
        )
    parameters, cr1, naive = fit_by_statsmodels(rows.data, link)
    steps = jackknife_steps(rows.data, link, parameters)
    covariance = cr3(steps)
    in_sample = _on_grid(rows, link, parameters, data.topples.shape)
    held_out = _held_out(rows, link, parameters, data.topples.shape)
    samples = _bootstrap(rows.data, link, parameters, seed)
    seen = outcomes_of(data)
    errors = np.sqrt(np.diag(covariance))
    median = median_y_m_s(shape, parameters, data)
    residual = np.log(data.y[data.found]) - np.log(median[data.found])
    usable = np.isfinite(residual)
    scatter = nested_scatter(
        residual[usable], data.event[data.found][usable], data.motion[data.found][usable]
    )
    return MethodResult(
        coefficients=dict(zip(names, parameters.tolist(), strict=True)),
        covariance=tuple(tuple(line) for line in covariance.tolist()),
        standard_errors=dict(zip(names, errors.tolist(), strict=True)),
        scores=scores_of(seen, in_sample, held_out),
        details={
            "link": link.name,
            "degrees_of_freedom": effective_freedom(steps),
            "judged_on": seen.kind,
            "score_intervals": score_intervals(data, seen, held_out, seed=seed),
            "n_outcomes": int(rows.data.outcome.size),
            "n_toppled": toppled,
            "n_bounded": int(rows.bounded.sum()),
            "n_bounded_toppled": rows.bounded_toppled,
            "standard_error_kinds": dict.fromkeys(
                names, "clustered by earthquake, CR3 (each earthquake left out in turn)"
            ),
            "cr1_standard_errors": dict(zip(names, np.sqrt(np.diag(cr1)).tolist(), strict=True)),
            "naive_standard_errors": dict(
                zip(names, np.sqrt(np.diag(naive)).tolist(), strict=True)
            ),
            "bootstrap": {
                "standard_errors": dict(
                    zip(names, samples.std(axis=0, ddof=1).tolist(), strict=True)
                ),
                "replicates": REPLICATES,
                "seed": seed,
            },
            "natural": natural_parameters(shape, parameters, covariance),
            "scatter_ln_y": None if scatter is None else vars(scatter),
        },
        warnings=tuple(_warnings(data, rows, errors, samples)),
        held_out=held_out,
    )


def fit_parameters(
    data: FitData, term: Term, method: str
) -> tuple[tuple[str, ...], FloatArray, FloatArray, int]:
    """Return names and values of the parameters, their covariance and its degrees of freedom.

    Raises:
        FitError: as for :func:`fit_outcomes`.
    """
    if not data.has_outcomes:
        raise FitError("no outcomes are stored")
    shape, link = formulas.SHAPES[method, term.name], LINKS_BY_CODE[formulas.LINKS[method]]
    names = formulas.PARAMETERS[shape]
    rows = outcome_rows(data, shape, len(names))
    parameters = maximum_likelihood(rows.data, link)
    steps = jackknife_steps(rows.data, link, parameters)
    return names, parameters, cr3(steps), effective_freedom(steps)


def outcome_rows(data: FitData, shape: int, k: int) -> OutcomeRows:
    """Return the known outcomes with their features.

    Args:
        data: the points.
        shape: formula of the model.
        k: number of parameters.
    """
    from rbfrag.fragility.compiled_formulas import feature_rows

    n, m = data.topples.shape
    columns = [np.repeat(c, m) for c in (np.sqrt(data.p2), data.x, data.pga_g, data.tm_s)]
    y = data.y0_m_s.ravel()
    features, codes = np.empty((n * m, formulas.MOST_PARAMETERS)), np.empty(n * m, dtype=np.int64)
    positive = (y > 0.0) & (columns[1] > 0.0) & (columns[2] > 0.0)
    y = np.where(positive, y, 1.0)
    columns[1], columns[2] = (np.where(positive, c, 1.0) for c in columns[1:3])
    feature_rows(shape, y, *columns, features, codes)  # type: ignore[call-arg]
    topples = data.topples.ravel()
    known = np.isfinite(topples) & positive
    used = np.flatnonzero(known & (codes == formulas.FREE) & np.isfinite(features).all(axis=1))
    per_combination = known.reshape(n, m).sum(axis=1)
    weights = np.repeat(m / np.maximum(per_combination, 1), m)
    bounded = known & (codes != formulas.FREE)
    return OutcomeRows(
        BinomialData(
            np.ascontiguousarray(features[used, :k]),
            topples[used],
            weights[used],
            np.repeat(data.event, m)[used],
        ),
        used,
        bounded.reshape(n, m),
        int((topples[bounded] > 0.5).sum()),
    )


def median_y_m_s(shape: int, parameters: FloatArray, data: FitData) -> FloatArray:
    """Return the toppling velocity at which P = 1/2 for each point [m/s], by bisection."""
    from rbfrag.fragility.compiled_formulas import probabilities

    b = np.zeros(formulas.MOST_PARAMETERS)
    b[: parameters.size] = parameters
    link = next(v for key, v in formulas.LINKS.items() if (key, shape) in _METHOD_SHAPES)
    p, out = np.sqrt(data.p2), np.empty(data.x.size)
    low, high = np.full(out.size, -30.0), np.full(out.size, 10.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        probabilities(shape, link, b, np.exp(middle), p, data.x, data.pga_g, data.tm_s, out)
        low, high = np.where(out >= 0.5, middle, low), np.where(out >= 0.5, high, middle)
    return np.asarray(np.exp(0.5 * (low + high)))


_METHOD_SHAPES = {(method, shape) for (method, _), shape in formulas.SHAPES.items()}


def natural_parameters(
    shape: int, parameters: FloatArray, covariance: FloatArray
) -> dict[str, list[float]] | None:
    """Return median, exponents and shape of the Weibull forms as [value, standard error].

    P = exp(-ln 2 [odds/(median z^e zT^f)]^shape), odds = r/(1-r) (or y/2PGV for r).
    """
    if shape not in (formulas.ODDS_PGV, formulas.ODDS_PGA, formulas.ODDS_TM):
        return None
    b, k = parameters, parameters[1]
    lift = b[0] + math.log(math.log(2.0))
    values = {
        "median": math.exp(lift / k),
        "shape": float(k),
        **dict(zip(("z_exponent", "zt_exponent"), (b[2:] / k).tolist(), strict=False)),
    }
    slopes = np.zeros((len(values), b.size))
    slopes[0, 0], slopes[0, 1] = 1.0 / k, -lift / k**2  # of ln median
    slopes[1, 1] = 1.0 / k  # of ln shape
    for i in range(2, b.size):
        slopes[i, i], slopes[i, 1] = 1.0 / k, -b[i] / k**2
    errors = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    relative = ("median", "shape")
    return {
        name: [value, float(error * value if name in relative else error)]
        for (name, value), error in zip(values.items(), errors, strict=True)
    }


def _on_grid(
    rows: OutcomeRows, link: Link, parameters: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    grid = np.zeros(shape)
    grid.flat[rows.place] = link.probability(rows.data.columns @ parameters)
    return grid


def _held_out(
    rows: OutcomeRows, link: Link, parameters: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    grid = np.zeros(shape)
    for event in np.unique(rows.data.event):
        own = rows.data.event == event
        b, _ = newton(rows.data.only(~own), link, parameters, tolerance=1e-9)
        grid.flat[rows.place[own]] = link.probability(rows.data.columns[own] @ b)
    return grid


def _bootstrap(data: BinomialData, link: Link, parameters: FloatArray, seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    events, number = np.unique(data.event, return_inverse=True)
    samples = np.empty((REPLICATES, parameters.size))
    for i in range(REPLICATES):
        drawn = np.bincount(random.integers(events.size, size=events.size), minlength=events.size)
        times = drawn[number]
        chosen = times > 0
        part = data.only(chosen)
        samples[i], _ = newton(
            part, link, parameters, weights=part.weights * times[chosen], tolerance=1e-7
        )
    return samples


def _warnings(
    data: FitData, rows: OutcomeRows, errors: FloatArray, samples: FloatArray
) -> list[str]:
    result = []
    n_events = int(np.unique(rows.data.event).size)
    if n_events < FEW_EVENTS:
        result.append(
            f"only {n_events} earthquakes: standard errors clustered by earthquake are too small"
        )
    if rows.bounded_toppled:
        result.append(
            f"{rows.bounded_toppled} of {int(rows.bounded.sum())} blocks that cannot topple "
            "without vertical motion did: the model gives them P = 0"
        )
    unknown = ~np.isfinite(data.topples)
    if unknown.any():
        result.append(
            f"{int(unknown.sum())} of {unknown.size} blocks of the grid lie below the search limit "
            "or are undecided: they are left out, and each combination keeps its weight"
        )
    if (samples.std(axis=0, ddof=1) > 2.0 * errors).any():
        result.append(
            "the bootstrap by earthquake scatters more than twice as much as the clustered errors "
            "say: a few earthquakes decide this fit"
        )
    return result
