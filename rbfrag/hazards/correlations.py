"""How the residuals of the logarithms of measures of one site go together."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.measures import SPECTRAL

PGV_PGA = 0.733
"""Correlation of the residuals of ln PGA and ln PGV (Bradley 2012)."""

_PERIODS_S = {"pga_g": 0.01, **{name: period for period, name in SPECTRAL.items()}}


def correlation(one: str, other: str) -> float:
    """Return the correlation of the residuals of two measures' logarithms.

    PGV and PGA after Bradley, B. A. (2012), Bulletin of the Seismological Society of America
    102(1); spectral accelerations, PGA as that at 0.01 s, after Baker, J. W. & Jayaram, N. (2008):
    Correlation of spectral acceleration values from NGA ground motion models. Earthquake Spectra
    24(1), 299-317, equation 9.

    Raises:
        KeyError: PGV beside a spectral acceleration, which no model reads together.
    """
    if one == other:
        return 1.0
    if {one, other} == {"pgv_m_s", "pga_g"}:
        return PGV_PGA
    short, long = sorted((_PERIODS_S[one], _PERIODS_S[other]))
    c1 = 1.0 - math.cos(0.5 * math.pi - 0.366 * math.log(long / max(short, 0.109)))
    if short > 0.109:
        return c1
    # the other branches of the equation are for two periods below 0.2 s, of which there are none
    return c1 + 0.5 * (math.sqrt(c1) - c1) * (1.0 + math.cos(math.pi * short / 0.109))


def correlations(names: tuple[str, ...]) -> NDArray[np.float64]:
    """Return the matrix of correlations of some measures, shape (k, k)."""
    return np.array([[correlation(one, other) for other in names] for one in names])
