"""How well a model predicts the outcomes of blocks on a fixed grid of y0/PGV.

Where the certified maps of outcomes are stored, the outcome is what the block at y0 does.
Otherwise it is "the critical velocity is at least y0", which does not see the safe islands
below the critical value; a censored combination then counts where its limit decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GRID_OF_Y0_OVER_PGV = np.geomspace(0.1, 4.0, 25)
"""Blocks that a prediction is judged on, as y0/PGV."""

CLIP = 1e-4
"""Probabilities are clipped to this distance from 0 and 1 before the logarithm."""


def critical_outcomes(
    y: FloatArray, found: NDArray[np.bool_], pgv_m_s: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return the grid of y0 [m/s], the outcomes 0 or 1, and where they are known.

    Args:
        y: critical velocity [m/s], for censored points the value it lies below, shape (n,).
        found: False for censored points, shape (n,).
        pgv_m_s: peak ground velocity [m/s], shape (n,).

    Returns:
        Three arrays of shape (n, 25).
    """
    y0 = pgv_m_s[:, None] * GRID_OF_Y0_OVER_PGV
    reached = y[:, None] >= y0
    known = (found[:, None] | ~reached) & (y0 > 0.0)
    return y0, (reached & found[:, None]).astype(np.float64), known


def log_loss(probability: FloatArray, outcome: FloatArray, known: NDArray[np.bool_]) -> float:
    """Return the mean log loss of the known outcomes."""
    p = np.clip(probability[known], CLIP, 1.0 - CLIP)
    hit = outcome[known] > 0.0
    return float(-np.mean(np.log(np.where(hit, p, 1.0 - p))))


def brier(probability: FloatArray, outcome: FloatArray, known: NDArray[np.bool_]) -> float:
    """Return the Brier score, the mean squared error of the probability."""
    return float(np.mean((probability[known] - outcome[known]) ** 2))


@dataclass(frozen=True)
class Calibration:
    """A logistic regression of outcomes on the logit of the probability: 0 and 1 are perfect.

    Args:
        intercept: above 0 where too few failures are predicted.
        slope: below 1 where the model is over-confident.
    """

    intercept: float
    slope: float


def calibration(
    probability: FloatArray,
    outcome: FloatArray,
    known: NDArray[np.bool_],
    weights: FloatArray | None = None,
) -> Calibration:
    """Return intercept and slope of the outcomes on the clipped logit of the probability.

    Args:
        probability: predicted, shape (n, m).
        outcome: 0 or 1, same shape.
        known: where the outcome is known.
        weights: weight of each element, same shape; None for equal ones.
    """
    p = np.clip(probability[known], CLIP, 1.0 - CLIP)
    x, t = np.log(p / (1.0 - p)), outcome[known]
    w = np.ones(x.size) if weights is None else weights[known]
    if not 0.0 < w @ t < w.sum() or np.ptp(x) == 0.0:
        return Calibration(np.nan, np.nan)
    b = np.array([0.0, 1.0])
    loss = _logistic_loss(b, x, t, w)
    for _ in range(50):
        fitted = 0.5 * (1.0 + np.tanh(0.5 * (b[0] + b[1] * x)))
        v = w * fitted * (1.0 - fitted)
        r = w * (t - fitted)
        information = np.array([[v.sum(), v @ x], [v @ x, v @ (x * x)]])
        step = np.linalg.lstsq(information, np.array([r.sum(), r @ x]), rcond=None)[0]
        # where most probabilities are clipped a whole step may go too far and never come back
        for _ in range(30):
            reached = _logistic_loss(b + step, x, t, w)
            if reached <= loss * (1.0 + 1e-14):
                break
            step = 0.5 * step
        b, loss = b + step, reached
        if np.abs(step).max() < 1e-12:
            break
    return Calibration(float(b[0]), float(b[1]))


def _logistic_loss(b: FloatArray, x: FloatArray, t: FloatArray, w: FloatArray) -> float:
    eta = b[0] + b[1] * x
    return float(w @ (np.logaddexp(0.0, eta) - t * eta))


def sharpness(probability: FloatArray, known: NDArray[np.bool_]) -> float:
    """Return the mean of P (1 - P): what the Brier score would be of a calibrated model."""
    return float(np.mean(probability[known] * (1.0 - probability[known])))


def calibration_curve(
    probability: FloatArray, outcome: FloatArray, known: NDArray[np.bool_]
) -> list[tuple[float, float, int]]:
    """Return mean probability, share that toppled and count in ten classes of probability."""
    p, t = probability[known], outcome[known]
    number = np.minimum((p * 10.0).astype(np.intp), 9)
    return [
        (float(p[number == i].mean()), float(t[number == i].mean()), int((number == i).sum()))
        for i in range(10)
        if (number == i).any()
    ]


def normal_log_density(y: FloatArray, mean: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the logarithm of the normal density of each y."""
    return np.asarray(
        -0.5 * (np.log(2.0 * np.pi * variance) + (y - mean) ** 2 / variance), dtype=np.float64
    )
