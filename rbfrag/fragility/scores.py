"""How well a model predicts, judged on the critical values.

The outcome is "the critical velocity is at least y0" on a fixed grid of y0/PGV, each
combination weighing the same; a censored combination counts where its limit decides.
This is not the simulated outcome of a block at y0: safe islands below the critical value
are not seen.
"""

from __future__ import annotations

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


def normal_log_density(y: FloatArray, mean: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the logarithm of the normal density of each y."""
    return np.asarray(
        -0.5 * (np.log(2.0 * np.pi * variance) + (y - mean) ** 2 / variance), dtype=np.float64
    )
