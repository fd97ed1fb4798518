"""Uncertain values: lognormal about a median, or between 0 and 1."""

from __future__ import annotations

from typing import Any

import numpy as np

from rbfrag.solver.results import FloatArray

_LEAST_FRACTION = 1e-12


def lognormal(z: FloatArray, median: Any, sigma: Any) -> FloatArray:
    """Return values at standard normal points.

    Args:
        z: the points.
        sigma: standard deviation of the logarithm.
    """
    return np.asarray(median * np.exp(sigma * z))


def fraction(z: FloatArray, mean: Any, sigma: Any) -> FloatArray:
    """Return values between 0 and 1 at standard normal points: normal, cut off at both.

    Args:
        z: the points.
        mean: mean before it is cut.
        sigma: standard deviation before it is cut; where it is 0 the value is the mean.
    """
    from scipy.special import ndtr, ndtri

    with np.errstate(all="ignore"):
        low, high = ndtr(-mean / sigma), ndtr((1.0 - mean) / sigma)
        drawn = mean + sigma * ndtri(low + (high - low) * ndtr(z))
    return np.asarray(np.where(sigma > 0.0, np.clip(drawn, _LEAST_FRACTION, 1.0), mean))
