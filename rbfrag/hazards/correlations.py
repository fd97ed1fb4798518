"""How the residuals of the logarithms of measures of one site go together."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.measures import SPECTRAL

PGV_PGA = 0.733
"""Correlation of the residuals of ln PGA and ln PGV (Bradley 2012)."""

_PGV_SA = (
    (0.75, 0.54, 0.81, 0.28, 1.5),
    (2.5, 0.80, 0.76, 1.1, 3.0),
    (10.0, 0.76, 0.70, 5.0, 3.2),
)
"""Of PGV and spectral accelerations: end of a range of periods, from 0.1 s on, a, b, c, d."""

_PERIODS_S = {"pga_g": 0.01, **{name: period for period, name in SPECTRAL.items()}}


def correlation(one: str, other: str) -> float:
    """Return the correlation of the residuals of two measures' logarithms.

    Of PGV with others after Bradley, B. A. (2012): Empirical correlations between peak ground
    velocity and spectrum-based intensity measures. Earthquake Spectra 28(1), 17-35; spectral
    accelerations, PGA as that at 0.01 s, after Baker, J. W. & Jayaram, N. (2008): Correlation of
    spectral acceleration values from NGA ground motion models. Earthquake Spectra 24(1), 299-317,
    equation 9.
    """
    if one == other:
        return 1.0
    if {one, other} == {"pgv_m_s", "pga_g"}:
        return PGV_PGA
    if "pgv_m_s" in (one, other):
        period_s = _PERIODS_S[one if other == "pgv_m_s" else other]
        a, b, c, d = next(of for end_s, *of in _PGV_SA if period_s < end_s)
        return 0.5 * (a + b - (a - b) * math.tanh(d * math.log(period_s / c)))
    short, long = sorted((_PERIODS_S[one], _PERIODS_S[other]))
    c1 = 1.0 - math.cos(0.5 * math.pi - 0.366 * math.log(long / max(short, 0.109)))
    if short > 0.109:
        return c1
    # the other branches of the equation are for two periods below 0.2 s, of which there are none
    return c1 + 0.5 * (math.sqrt(c1) - c1) * (1.0 + math.cos(math.pi * short / 0.109))


def correlations(names: tuple[str, ...]) -> NDArray[np.float64]:
    """Return the matrix of correlations of some measures, shape (k, k)."""
    return np.array([[correlation(one, other) for other in names] for one in names])
