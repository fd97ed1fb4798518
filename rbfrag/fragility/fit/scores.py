"""Scores of predicted against observed outcomes, on a grid that does not depend on the outcome.

Where outcomes are stored, they are what it is judged on. Otherwise the outcome is "the critical
value is at least the block's", which does not see the safe islands below the critical value; a
censored combination then counts where its limit decides.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.results import FloatArray

Mask = NDArray[np.bool_]

CLIP = 1e-4
"""Probabilities are clipped to this distance from 0 and 1 before the logarithm."""

RESAMPLES = 1000


@dataclass(frozen=True, eq=False)
class ScoredBlocks:
    """The blocks on which a fit is scored.

    Args:
        failed: 0 or 1, shape (n, m).
        is_known: where the outcome is known.
        event: number of each row's earthquake, shape (n,).
        source: where the outcomes come from.
    """

    failed: FloatArray
    is_known: Mask
    event: NDArray[np.intp]
    source: str


def critical_outcomes(
    critical: FloatArray, observed: Mask, strength: FloatArray
) -> tuple[FloatArray, Mask]:
    """Return the outcomes that follow from critical values, 0 or 1, and where they are known.

    Args:
        critical: critical strength, for censored points the value it lies below, shape (n,).
        observed: False for censored points, shape (n,).
        strength: of the blocks, shape (n, m).
    """
    reached = critical[:, None] >= strength
    is_known = (observed[:, None] | ~reached) & (strength > 0.0)
    return (reached & observed[:, None]).astype(np.float64), is_known


def log_loss(probability: FloatArray, outcome: FloatArray, is_known: Mask) -> float:
    """Return the mean log loss of the known outcomes."""
    p = np.clip(probability[is_known], CLIP, 1.0 - CLIP)
    return float(-np.log(np.where(outcome[is_known] > 0.0, p, 1.0 - p)).mean())


def brier(probability: FloatArray, outcome: FloatArray, is_known: Mask) -> float:
    """Return the Brier score, the mean squared error of the probability."""
    return float(((probability[is_known] - outcome[is_known]) ** 2).mean())


def sharpness(probability: FloatArray, is_known: Mask) -> float:
    """Return the mean of P (1 - P), the Brier score of a perfectly calibrated model."""
    return float((probability[is_known] * (1.0 - probability[is_known])).mean())


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
    line = calibration(held_out, *outcomes)
    result = {
        "log_loss_in_sample": log_loss(in_sample, *outcomes),
        "log_loss_held_out": log_loss(held_out, *outcomes),
        "brier_in_sample": brier(in_sample, *outcomes),
        "brier_held_out": brier(held_out, *outcomes),
        "calibration_slope_held_out": line.slope,
        "calibration_intercept_held_out": line.intercept,
        "sharpness_held_out": sharpness(held_out, judged.is_known),
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


@dataclass(frozen=True)
class NestedScatter:
    """Standard deviations of ln y about a model's median.

    Args:
        total: of all residuals.
        between_events: of the part that an earthquake's points share.
        between_motions: of the part that a motion's points share, beyond the earthquake.
        within_motion: of the rest: polarity and block size.
    """

    total: float
    between_events: float
    between_motions: float
    within_motion: float


def nested_scatter(
    residual: FloatArray, event: NDArray[np.intp], motion: NDArray[np.int64]
) -> NestedScatter | None:
    """Split residuals by an analysis of variance of unbalanced nested classes.

    Mean squares are equated to their expectations (Searle, Casella and McCulloch 1992,
    section 3.6); a negative component is zero.

    Args:
        residual: ln y less its median, shape (n,).
        event: number of the earthquake, shape (n,).
        motion: number of the motion, each in one earthquake, shape (n,).

    Returns:
        None without two earthquakes, a second motion in one, and a second point in a motion.
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
    return NestedScatter(
        total=float(residual.std(ddof=1)),
        between_events=math.sqrt(of_event),
        between_motions=math.sqrt(of_motion),
        within_motion=math.sqrt(max(within, 0.0)),
    )
