"""The scores of a fit: on the data it was fitted to, and on earthquakes left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit import scores
from rbfrag.fragility.fit.data import FitData

FloatArray = NDArray[np.float64]

RESAMPLES = 1000


@dataclass(frozen=True, eq=False)
class Outcomes:
    """The blocks that a fit is judged on.

    Args:
        y0_m_s: their toppling velocities [m/s], shape (n, 25).
        toppled: 0 or 1, same shape.
        known: where the outcome is known.
        kind: where the outcomes come from, in words.
    """

    y0_m_s: FloatArray
    toppled: FloatArray
    known: NDArray[np.bool_]
    kind: str


def outcomes_of(data: FitData) -> Outcomes:
    """Return the stored outcomes, or, where there are none, those that critical values give."""
    if data.has_outcomes:
        known = np.isfinite(data.topples) & (data.y0_m_s > 0.0)
        toppled = np.where(known, data.topples, 0.0)
        return Outcomes(data.y0_m_s, toppled, known, "simulated outcomes")
    return Outcomes(
        *scores.critical_outcomes(data.y, data.found, data.pgv_m_s),
        "critical values (safe islands are not seen)",
    )


def scores_of(seen: Outcomes, in_sample: FloatArray, held_out: FloatArray) -> dict[str, float]:
    """Return the scores of a report.

    Args:
        seen: the outcomes.
        in_sample: probabilities by the fit to all data, shape (n, 25).
        held_out: probabilities by fits without the earthquake concerned.
    """
    line = scores.calibration(held_out, seen.toppled, seen.known)
    result = {
        "log_loss_in_sample": scores.log_loss(in_sample, seen.toppled, seen.known),
        "log_loss_held_out": scores.log_loss(held_out, seen.toppled, seen.known),
        "brier_in_sample": scores.brier(in_sample, seen.toppled, seen.known),
        "brier_held_out": scores.brier(held_out, seen.toppled, seen.known),
        "calibration_slope_held_out": line.slope,
        "calibration_intercept_held_out": line.intercept,
        "sharpness_held_out": scores.sharpness(held_out, seen.known),
    }
    return {name: value for name, value in result.items() if np.isfinite(value)}


def score_intervals(
    data: FitData, seen: Outcomes, held_out: FloatArray, *, seed: int
) -> dict[str, list[float]]:
    """Return 95 % intervals of the mean held-out scores, by resampling whole earthquakes."""
    random = np.random.default_rng(seed)
    g = int(data.event.max()) + 1
    drawn = random.multinomial(g, np.full(g, 1.0 / g), size=RESAMPLES).astype(np.float64)
    count = np.bincount(data.event, seen.known.sum(axis=1), minlength=g)
    p = np.clip(held_out, scores.CLIP, 1.0 - scores.CLIP)
    losses = {
        "log_loss_held_out": -np.where(seen.toppled > 0.5, np.log(p), np.log1p(-p)),
        "brier_held_out": (held_out - seen.toppled) ** 2,
    }
    result = {}
    for name, loss in losses.items():
        total = np.bincount(data.event, np.where(seen.known, loss, 0.0).sum(axis=1), minlength=g)
        means = (drawn @ total) / np.maximum(drawn @ count, 1.0)
        result[name] = [float(v) for v in np.quantile(means, [0.025, 0.975])]
    return result
