"""Correlation of the total log residuals of two intensity measures, in closed form for any period.

Baker, J. W. & Jayaram, N. (2008): Correlation of spectral acceleration values from NGA ground
motion models. Earthquake Spectra 24(1), 299-317.

Bradley, B. A. (2011): Empirical correlation of PGA, spectral accelerations and spectrum intensities
from active shallow crustal earthquakes. Earthquake Engineering & Structural Dynamics 40(15),
1707-1721.

Bradley, B. A. (2012): Empirical correlations between peak ground velocity and spectrum-based
intensity measures. Earthquake Spectra 28(1), 17-35.

The three are fitted separately: a matrix of many measures need not be positive definite.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rbfrag.vocabulary.spectral import LONGEST_S

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_PGV_PGA = 0.733

# (longest period [s], a, b, c, d) of ρ = (a + b)/2 − (a − b)/2 tanh[d ln(T/c)]
_WITH_PEAK = {
    "pga_g": ((0.2, 1.0, 0.895, 0.06, 1.6), (LONGEST_S, 0.97, 0.25, 0.8, 0.8)),
    "pgv_m_s": (
        (0.1, 0.73, 0.54, 0.045, 1.8), (0.75, 0.54, 0.81, 0.28, 1.5), (2.5, 0.80, 0.76, 1.1, 3.0),
        (LONGEST_S, 0.76, 0.70, 5.0, 3.2),
    ),
}  # fmt: skip


def correlation(measure: str, other: str) -> float:
    """Return the correlation of the total log residuals of two intensity measures.

    Args:
        measure: ``pgv_m_s``, ``pga_g`` or ``sa(T)``, T from 0.01 to 10 s.
        other: the second measure likewise.
    """
    peaks = [name for name in (measure, other) if name in _WITH_PEAK]
    periods = sorted(_period_s(name) for name in (measure, other) if name not in _WITH_PEAK)
    if not periods:
        return 1.0 if measure == other else _PGV_PGA
    if not peaks:
        return _of_ordinates(*periods)
    (period_s,) = periods
    segments = _WITH_PEAK[peaks[0]]
    a, b, c, d = next(row[1:] for row in segments if period_s <= row[0])
    return 0.5 * (a + b) - 0.5 * (a - b) * math.tanh(d * math.log(period_s / c))


def nearest_correlation(matrices: ArrayLike, least: float = 0.01) -> Any:
    """Return positive definite correlation matrices near matrices that need not be so.

    Eigenvalues below `least` are raised to it, and the result is scaled to a unit diagonal, which
    lowers the smallest one again by a few per cent at most. Other matrices are unchanged.

    Args:
        matrices: symmetric with a unit diagonal, shape (..., k, k).
        least: smallest eigenvalue that is left as it is.
    """
    import numpy as np

    matrices = np.asarray(matrices, dtype=np.float64)
    values, vectors = np.linalg.eigh(matrices)
    raised = (vectors * np.maximum(values, least)[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    scale = 1.0 / np.sqrt(np.diagonal(raised, axis1=-2, axis2=-1))
    result = raised * scale[..., :, None] * scale[..., None, :]
    return np.where((values[..., 0] < least)[..., None, None], result, matrices)


def _period_s(measure: str) -> float:
    """Return T [s] of ``sa(T)`` within the range of the correlations."""
    return float(measure[3:-1])


def _of_ordinates(short_s: float, long_s: float) -> float:
    """Return the correlation of spectral accelerations at two periods [s], the shorter first.

    C1 to C4 and the cases are those of Baker and Jayaram (2008); beyond .109 s C3 is C1.
    """
    corner_s = 0.109
    c2 = 1.0
    if long_s < 0.2:
        fall = 1.0 - 1.0 / (1.0 + math.exp(100.0 * long_s - 5.0))
        c2 -= 0.105 * fall * (long_s - short_s) / (long_s - 0.0099)
    if long_s <= corner_s:
        return c2
    c1 = 1.0 - math.sin(0.366 * math.log(long_s / max(short_s, corner_s)))
    if short_s > corner_s:
        return c1
    c4 = c1 + 0.5 * (math.sqrt(c1) - c1) * (1.0 + math.cos(math.pi * short_s / corner_s))
    return min(c2, c4)
