"""The variance of the residuals as a function of intensity, from bins.

    s_j² = Σ w r² / Σ w  over bin j,    v(x) = v0 + v1 x (+ v2 x²),    all v_i >= 0

v0 has a floor, so that v(x) > 0 for every x >= 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FLOOR_SHARE = 1e-4
"""Floor of v0 as a share of the smallest non-zero bin variance (1 % in standard deviation)."""

POINTS_PER_BIN = 20
MOST_BINS = 20
FEWEST_BINS = 4


@dataclass(frozen=True, eq=False)
class Bins:
    """Bins of equal count over sorted intensities.

    Args:
        x: intensities [m/s], rising, shape (n,).
        starts: first index of each bin.
    """

    x: FloatArray
    starts: NDArray[np.intp]

    @classmethod
    def equal_count(cls, x: FloatArray) -> Bins:
        """Cut rising intensities into bins of equal count, about 20 points each."""
        count = max(FEWEST_BINS, min(MOST_BINS, x.size // POINTS_PER_BIN))
        count = min(count, x.size)
        return cls(x, np.arange(count, dtype=np.intp) * x.size // count)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum of the values in each bin."""
        result: FloatArray = np.add.reduceat(values, self.starts)
        return result


def powers(x: FloatArray, degree: int) -> FloatArray:
    """Return the columns 1, x, …, x^degree, shape (n, degree + 1)."""
    return np.vander(x, degree + 1, increasing=True)


def fit_variance(
    bins: Bins,
    squared_residuals: FloatArray,
    multiplicity: FloatArray,
    degree: int,
    previous: FloatArray | None,
) -> FloatArray:
    """Return v0, v1[, v2] [m²/s²] from the bin variances of the residuals.

    Non-negative least squares with weights n_j/v(x_j)², the inverse variance of a bin
    variance of normal residuals, so that bins of weak motions count as much as strong ones.

    Args:
        bins: the bins.
        squared_residuals: r² [m²/s²] of each point, in the order of ``bins.x``.
        multiplicity: how many times each point counts (a resampled earthquake counts
            several times or not at all).
        degree: degree of v(x).
        previous: v0, v1[, v2] of the iteration before; None for equal relative weights.
    """
    from scipy.optimize import nnls

    counts = bins.sums(multiplicity)
    used = counts > 0.0
    counts = counts[used]
    centres = bins.sums(multiplicity * bins.x)[used] / counts
    spread = bins.sums(multiplicity * squared_residuals)[used] / counts
    # Least squares takes two parameters from the residuals.
    spread = spread * (counts.sum() / max(counts.sum() - 2.0, 1.0))
    columns = powers(centres, degree)
    floor = FLOOR_SHARE * spread[spread > 0.0].min()
    scale = spread if previous is None else columns @ previous
    scale = np.maximum(scale, floor) / np.sqrt(counts)
    # Columns of like size keep the active set free of rounding.
    size = np.abs(columns).max(axis=0)
    solution, _ = nnls(columns / (scale[:, None] * size), (spread - floor) / scale)
    coefficients: FloatArray = solution / size
    coefficients[0] += floor
    return coefficients
