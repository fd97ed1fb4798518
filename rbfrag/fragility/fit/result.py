"""Result of a fitting method: errors clustered by earthquake, and scores.

Errors: sandwich covariance, bootstrap and jackknife over earthquakes. Scores compare predicted with
observed outcomes, on a grid that does not depend on the outcome. Where outcomes are stored, scores
are computed from them. Otherwise the outcome is "the critical value is at least the block's", which
does not see the safe islands below the critical value; a censored combination then counts where its
limit decides.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.data import FitData, ScoredBlocks
from rbfrag.fragility.fit.likelihood import Likelihood
from rbfrag.solver.results import FloatArray

Mask = NDArray[np.bool_]

CLIP = 1e-4
"""Probabilities are clipped to this distance from 0 and 1 before the logarithm."""

RESAMPLES = 1000

FEW_EVENTS = 10
"""Below this number of earthquakes clustered standard errors are too small."""


def log_loss(probability: FloatArray, outcome: FloatArray, is_known: Mask) -> float:
    """Return the mean log loss of the known outcomes."""
    p = np.clip(probability[is_known], CLIP, 1.0 - CLIP)
    return float(-np.log(np.where(outcome[is_known] > 0.0, p, 1.0 - p)).mean())


def brier(probability: FloatArray, outcome: FloatArray, is_known: Mask) -> float:
    """Return the Brier score, the mean squared error of the probability."""
    return float(((probability[is_known] - outcome[is_known]) ** 2).mean())


@dataclass(frozen=True)
class Calibration:
    """Logistic regression of outcomes on the logit of the probability: intercept 0 and slope 1 are
    perfect.

    Args:
        intercept: above 0 where too few failures are predicted.
        slope: below 1 where the model is over-confident.
    """

    intercept: float
    slope: float


def calibration(probability: FloatArray, outcome: FloatArray, is_known: Mask) -> Calibration:
    """Return intercept and slope of the outcomes on the clipped logit of the probability.

    Args:
        probability: predicted, shape (n, m).
        outcome: 0 or 1, same shape.
        is_known: where the outcome is known.
    """
    from statsmodels.genmod.families import Binomial
    from statsmodels.genmod.generalized_linear_model import GLM
    from statsmodels.tools.sm_exceptions import PerfectSeparationWarning

    p = np.clip(probability[is_known], CLIP, 1.0 - CLIP)
    x, t = np.log(p / (1.0 - p)), outcome[is_known]
    hits, misses = x[t > 0.5], x[t <= 0.5]
    if not (hits.size and misses.size) or hits.min() > misses.max() or np.ptp(x) == 0.0:
        return Calibration(np.nan, np.nan)
    columns = np.column_stack([np.ones(x.size), x])
    model = GLM(t, columns, family=Binomial())
    with warnings.catch_warnings():
        # said of good models, whose slope is finite
        warnings.simplefilter("ignore", PerfectSeparationWarning)
        b = model.fit(tol=1e-14).params
    return Calibration(float(b[0]), float(b[1]))


def scores_of(
    judged: ScoredBlocks, in_sample: FloatArray, held_out: FloatArray
) -> dict[str, float]:
    """Return the scores of a report.

    Args:
        in_sample: probabilities by the fit to all data, shape (n, m).
        held_out: probabilities by fits without the earthquake concerned.
    """
    outcomes = judged.failed, judged.is_known
    line, p = calibration(held_out, *outcomes), held_out[judged.is_known]
    result = {
        "log_loss_in_sample": log_loss(in_sample, *outcomes),
        "log_loss_held_out": log_loss(held_out, *outcomes),
        "brier_in_sample": brier(in_sample, *outcomes),
        "brier_held_out": brier(held_out, *outcomes),
        "calibration_slope_held_out": line.slope,
        "calibration_intercept_held_out": line.intercept,
        # the Brier score of a perfectly calibrated model
        "sharpness_held_out": float((p * (1.0 - p)).mean()),
    }
    return {name: value for name, value in result.items() if np.isfinite(value)}


def score_intervals(
    judged: ScoredBlocks, held_out: FloatArray, *, seed: int
) -> dict[str, list[float]]:
    """Return 95 % intervals of the mean held-out scores, by resampling whole earthquakes."""
    random = np.random.default_rng(seed)
    g = int(judged.event.max()) + 1
    drawn = random.multinomial(g, np.full(g, 1.0 / g), size=RESAMPLES).astype(np.float64)
    count = np.bincount(judged.event, judged.is_known.sum(axis=1), minlength=g)
    p = np.clip(held_out, CLIP, 1.0 - CLIP)
    losses = {
        "log_loss_held_out": -np.where(judged.failed > 0.5, np.log(p), np.log1p(-p)),
        "brier_held_out": (held_out - judged.failed) ** 2,
    }
    result = {}
    for name, loss in losses.items():
        lost = np.where(judged.is_known, loss, 0.0).sum(axis=1)
        means = (drawn @ np.bincount(judged.event, lost, minlength=g)) / np.maximum(
            drawn @ count, 1.0
        )
        result[name] = [float(v) for v in np.quantile(means, [0.025, 0.975])]
    return result


EDGES = np.array([0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0])
"""Edges of the bins of predicted probability."""

REPLICATIONS = 500
FEWEST_BLOCKS = 20


@dataclass(frozen=True, eq=False)
class CalibrationBins:
    """Predicted and observed failure fractions of held-out earthquakes, by predicted probability.

    Args:
        predicted: mean predicted probability of each bin, shape (m,).
        observed: share that failed, shape (m,).
        low: lower end of its 95 % interval, whole earthquakes drawn with replacement.
    """

    predicted: FloatArray
    observed: FloatArray
    low: FloatArray
    high: FloatArray
    blocks: NDArray[np.intp]
    events: int


def calibration_bins(
    judged: ScoredBlocks, held_out: FloatArray, *, seed: int = 0
) -> CalibrationBins:
    """Bin the blocks of known outcome by their held-out probability.

    Args:
        held_out: probabilities by fits without the earthquake concerned, shape (n, m).

    Bins with fewer than 20 blocks are left out.
    """
    # Blocks are counted in a table (earthquake, bin of P). In a calibrated model the fraction that
    # fails in a bin equals its mean P. The range comes from resampled earthquakes, which, unlike
    # blocks, are independent.
    used = judged.is_known & np.isfinite(held_out)
    event = np.broadcast_to(judged.event[:, None], held_out.shape)[used]
    p, failed = held_out[used], judged.failed[used]
    number = np.clip(np.searchsorted(EDGES, p, side="right") - 1, 0, EDGES.size - 2)
    events, which = np.unique(event, return_inverse=True)
    shape = (events.size, EDGES.size - 1)
    cell = which * shape[1] + number

    def table(weights: FloatArray | None) -> FloatArray:
        counted = np.bincount(cell, weights, minlength=shape[0] * shape[1])
        return counted.reshape(shape).astype(np.float64)

    count, failures, expected = table(None), table(failed), table(p)

    def failed_fraction(chosen: NDArray[np.int64]) -> FloatArray:
        total = count[chosen].sum(axis=0)
        none = np.full(total.shape, np.nan)
        fraction: FloatArray = np.divide(
            failures[chosen].sum(axis=0), total, out=none, where=total > 0
        )
        return fraction

    rng = np.random.default_rng(seed)
    draws = [
        failed_fraction(rng.integers(events.size, size=events.size)) for _ in range(REPLICATIONS)
    ]
    total = count.sum(axis=0)
    is_filled = total >= FEWEST_BLOCKS
    low, high = np.nanquantile(np.array(draws)[:, is_filled], (0.025, 0.975), axis=0)
    return CalibrationBins(
        predicted=expected.sum(axis=0)[is_filled] / total[is_filled],
        observed=failures.sum(axis=0)[is_filled] / total[is_filled],
        low=low,
        high=high,
        blocks=total[is_filled].astype(np.intp),
        events=int(events.size),
    )


def nested_scatter(
    residual: FloatArray, event: NDArray[np.intp], motion: NDArray[np.int64]
) -> dict[str, float] | None:
    """Split residuals by an analysis of variance of unbalanced nested classes.

    Mean squares are equated to their expectations (Searle, Casella and McCulloch 1992,
    section 3.6); a negative component is zero.

    Args:
        residual: ln y less its median, shape (n,).
        event: number of the earthquake, shape (n,).
        motion: number of the motion, each in one earthquake, shape (n,).

    Returns:
        Standard deviations of ln y about the median: in total, between earthquakes, between the
        motions of an earthquake, and within a motion (polarity and block size); None without two
        earthquakes, a second motion in one, and a second point in a motion.
    """
    n = residual.size
    motions, inverse = np.unique(motion, return_inverse=True)
    owner = np.zeros(motions.size, dtype=np.intp)
    owner[inverse] = event
    events, owner = np.unique(owner, return_inverse=True)
    per_motion = np.bincount(inverse).astype(np.float64)
    per_event = np.bincount(owner, per_motion)
    a, m = events.size, motions.size
    if a < 2 or m <= a or n <= m:
        return None
    sum_motion = np.bincount(inverse, residual)
    sum_event = np.bincount(owner, sum_motion)
    of_all = residual.sum() ** 2 / n
    of_events = (sum_event**2 / per_event).sum()
    of_motions = (sum_motion**2 / per_motion).sum()
    within = ((residual**2).sum() - of_motions) / (n - m)
    squares_by_event = np.bincount(owner, per_motion**2) / per_event
    k1 = (n - squares_by_event.sum()) / (m - a)
    k2 = (squares_by_event.sum() - (per_motion**2).sum() / n) / (a - 1)
    k3 = (n - (per_event**2).sum() / n) / (a - 1)
    of_motion = max(((of_motions - of_events) / (m - a) - within) / k1, 0.0)
    of_event = max(((of_events - of_all) / (a - 1) - within - k2 * of_motion) / k3, 0.0)
    return {
        "total": float(residual.std(ddof=1)),
        "between_events": math.sqrt(of_event),
        "between_motions": math.sqrt(of_motion),
        "within_motion": math.sqrt(max(within, 0.0)),
    }


def event_derivatives(rows: Likelihood, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the score and the information of each earthquake, shapes (G, k) and (G, k, k)."""
    parts = [rows.only(rows.event == e).derivatives(b) for e in np.unique(rows.event)]
    return np.array([score for score, _ in parts]), np.array([part for _, part in parts])


def jackknife_steps(rows: Likelihood, b: FloatArray) -> FloatArray:
    """Return the jackknife steps d_e = -(H - H_e)⁻¹ s_e of each earthquake, shape (G, k).

    One Newton step from the fit to all data to the one without earthquake e.
    """
    scores, parts = event_derivatives(rows, b)
    _, information = rows.derivatives(b)
    return np.array([
        -np.linalg.lstsq(information - part, score, rcond=None)[0]
        for score, part in zip(scores, parts, strict=True)
    ])  # fmt: skip


def cr3(steps: FloatArray) -> FloatArray:
    """Return the jackknife covariance (CR3), (G-1)/G · Σ d dᵀ for the G rows d of `steps`.

    With unequal earthquakes CR1 is too small; this is not (Bell and McCaffrey 2002, Survey
    Methodology 28(2), 169-181).
    """
    g = steps.shape[0]
    return np.asarray((g - 1.0) / g * (steps.T @ steps))


def sandwich(rows: Likelihood, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the covariance clustered by earthquake (CR1) and the inverse of the information.

    CR1 is H⁻¹ (Σ s_e s_eᵀ) H⁻¹ · G/(G-1) · (n-1)/(n-k).
    """
    scores, parts = event_derivatives(rows, b)
    bread = np.linalg.inv(parts.sum(axis=0))
    (g, k), n = scores.shape, rows.event.size
    factor = g / (g - 1.0) * (n - 1.0) / (n - k)
    return np.asarray(factor * bread @ (scores.T @ scores) @ bread), np.asarray(bread)


def bootstrap(
    event: NDArray[np.intp],
    fit: Callable[[FloatArray], FloatArray],
    *,
    replicates: int,
    seed: int,
    enough: Callable[[FloatArray], bool] | None = None,
) -> FloatArray:
    """Return parameters fitted to resampled earthquakes, shape (replicates, k).

    Whole earthquakes are drawn with replacement, because the points of one are not independent.

    Args:
        event: number of each row's earthquake, shape (n,).
        fit: returns the parameters from how many times each row counts, shape (n,).
        enough: whether a draw can be fitted; another is drawn if not.
    """
    random = np.random.default_rng(seed)
    events, number = np.unique(event, return_inverse=True)
    count = events.size
    samples: list[FloatArray] = []
    while len(samples) < replicates:
        drawn = np.bincount(random.integers(count, size=count), minlength=count)
        times = drawn[number].astype(np.float64)
        if enough is None or enough(times):
            samples.append(fit(times))
    return np.array(samples)


def left_out(
    event: NDArray[np.intp], fit: Callable[[NDArray[np.bool_]], FloatArray]
) -> dict[int, FloatArray]:
    """Return the parameters of the fit without each earthquake, by earthquake index.

    Args:
        event: number of each row's earthquake, shape (n,).
        fit: returns the parameters from the rows that stay, shape (n,).
    """
    return {int(e): fit(event != e) for e in np.unique(event)}


_OF_REAL_BLOCKS = ("log_loss_held_out", "brier_held_out", "calibration_slope_held_out")

CLUSTERED = "clustered by earthquake, CR3 (each earthquake left out in turn)"


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Result of a fitting method: parameters, scores and details.

    Args:
        coefficients: value of each parameter by name, in the order of the formula.
        steps: change of the parameters without each earthquake, shape (G, k).
        standard_errors: standard error of each parameter by name.
        scores: how well the model predicts, by name.
        details: everything else the report states, JSON-able.
        held_out: probability of each block of the grid by a fit without its earthquake,
            shape (n, m).
    """

    coefficients: dict[str, float]
    steps: FloatArray
    standard_errors: dict[str, float]
    scores: dict[str, float]
    details: dict[str, object]
    warnings: tuple[str, ...]
    held_out: FloatArray


@dataclass(frozen=True, eq=False)
class Estimates:
    """Parameters with their standard errors.

    Args:
        values: shape (k,).
        steps: change of the parameters without each earthquake, shape (G, k).
        samples: of a bootstrap by earthquake, shape (replicates, k); None without one.
        seed: seed of the bootstrap.
        other_errors: further standard errors by what the report calls them.
    """

    names: Sequence[str]
    values: FloatArray
    steps: FloatArray
    samples: FloatArray | None
    seed: int
    other_errors: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def errors(self) -> FloatArray:
        """Standard errors clustered by earthquake, shape (k,)."""
        return np.sqrt(np.diag(cr3(self.steps)))

    def named(self, values: FloatArray) -> dict[str, float]:
        """Return values by parameter name."""
        return dict(zip(self.names, values.tolist(), strict=True))


def method_result(
    data: FitData,
    estimates: Estimates,
    in_sample: FloatArray,
    held_out: FloatArray,
    *,
    ln_residual: FloatArray | None = None,
    scores: Mapping[str, float] | None = None,
    details: Mapping[str, object] | None = None,
    warnings: Sequence[str] = (),
) -> MethodResult:
    """Return the result of a method with leave-one-earthquake-out standard errors.

    Args:
        in_sample: probabilities of the blocks of the grid, shape (n, m).
        held_out: the same by fits without the earthquake concerned.
        ln_residual: ln y less its median where known, shape (n,), to be split by earthquakes.
        scores: further scores.
        details: what else the report states.
    """
    judged, samples = data.judged, estimates.samples
    scatter, few_events, events = None, [], len(estimates.steps)
    if ln_residual is not None:
        used = np.isfinite(ln_residual)
        scatter = nested_scatter(ln_residual[used], data.event[used], data.motion[used])
    if events < FEW_EVENTS:
        few_events = [
            f"only {events} earthquakes: standard errors clustered by earthquake are too small"
        ]
    scored = scores_of(judged, in_sample, held_out)
    real = data.judged_real
    if real is not None and real.is_known.any():
        real_scores = scores_of(real, in_sample, held_out)
        scored |= {
            f"{name}_kr05": real_scores[name] for name in _OF_REAL_BLOCKS if name in real_scores
        }
    return MethodResult(
        coefficients=estimates.named(estimates.values),
        steps=estimates.steps,
        standard_errors=estimates.named(estimates.errors),
        scores={**(scores or {}), **scored},
        details={
            "judged_on": judged.source,
            "judged_outcomes": int(judged.is_known.sum()),
            "score_intervals": score_intervals(judged, held_out, seed=estimates.seed),
            "standard_error_kinds": dict.fromkeys(estimates.names, CLUSTERED),
            **{name: estimates.named(values) for name, values in estimates.other_errors.items()},
            "bootstrap": None
            if samples is None
            else {
                "standard_errors": estimates.named(samples.std(axis=0, ddof=1)),
                "replicates": len(samples),
                "seed": estimates.seed,
            },
            "scatter_ln_y": scatter,
            **(details or {}),
        },
        warnings=(*few_events, *warnings),
        held_out=held_out,
    )
