"""Published regressions of the displacement of a block that slides, each as its authors give it.

Saygili & Rathje (2008), J. Geotech. Geoenviron. Eng. 134(6), 790-803; Rathje & Saygili (2009),
Bull. New Zealand Soc. Earthquake Eng. 42(1), 18-27; Jibson (2007), Engineering Geology 91(2-4),
209-218. The coefficients were compared in two programs of others: SLAMMER of the U.S. Geological
Survey, whose panels print equations and standard deviations, and OpenSRA. They agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Values = Mapping[str, FloatArray]

_LN_CM, _LN_10 = math.log(0.01), math.log(10.0)

KY_G = (0.05, 0.30)
"""Yield accelerations that Saygili & Rathje simulated [g]; Jibson's are like them."""


@dataclass(frozen=True)
class Published:
    """One regression.

    Args:
        name: authors, year and equation.
        predictors: what it reads beside the yield acceleration, of `pga_g`, `pgv_m_s`,
            `arias_m_s`, `magnitude`.
        median: ln of the median displacement [ln m].
        sigma: standard deviation of ln D.
    """

    name: str
    predictors: tuple[str, ...]
    median: Callable[[Values], FloatArray]
    sigma: Callable[[Values], FloatArray]


def _ratio(v: Values) -> FloatArray:
    return v["ky"] / v["pga_g"]


def _quartic(v: Values, *a: float) -> FloatArray:
    return _LN_CM + np.polynomial.polynomial.polyval(_ratio(v), a)


def _power(v: Values, constant: float, rising: float, falling: float) -> FloatArray:
    """Return ln D of log10 D [cm] = constant + log10((1 - r)^rising r^falling)."""
    r = _ratio(v)
    return _LN_CM + _LN_10 * constant + rising * np.log(1.0 - r) + falling * np.log(r)


def _log10(value: float) -> Callable[[Values], FloatArray]:
    return lambda v: np.full_like(v["ky"], value * _LN_10)


PUBLISHED = (
    Published(
        "Jibson (2007), eq. 6", ("pga_g",),
        lambda v: _power(v, 0.215, 2.341, -1.438), _log10(0.510),
    ),
    Published(
        "Saygili & Rathje (2008)", ("pga_g",),
        lambda v: _quartic(v, 5.52, -4.43, -20.39, 42.61, -28.74) + 0.72 * np.log(v["pga_g"]),
        lambda v: np.full_like(v["ky"], 1.13),
    ),
    Published(
        "Jibson (2007), eq. 7", ("pga_g", "magnitude"),
        lambda v: _power(v, -2.710, 2.335, -1.478) + _LN_10 * 0.424 * v["magnitude"],
        _log10(0.454),
    ),
    Published(
        "Rathje & Saygili (2009)", ("pga_g", "magnitude"),
        lambda v: _quartic(v, 4.89, -4.85, -19.64, 42.49, -29.06)
        + 0.72 * np.log(v["pga_g"]) + 0.89 * (v["magnitude"] - 6.0),
        lambda v: 0.73 + 0.789 * _ratio(v) - 0.539 * _ratio(v) ** 2,
    ),
    Published(
        "Jibson (2007), eq. 9", ("arias_m_s",),
        lambda v: _LN_CM + 2.401 * np.log(v["arias_m_s"]) - 3.481 * np.log(v["ky"])
        - 3.230 * _LN_10,
        _log10(0.656),
    ),
    Published(
        "Jibson (2007), eq. 10", ("pga_g", "arias_m_s"),
        lambda v: _LN_CM + 0.561 * np.log(v["arias_m_s"]) - 3.833 * np.log(_ratio(v))
        - 1.474 * _LN_10,
        _log10(0.616),
    ),
    Published(
        "Saygili & Rathje (2008)", ("pga_g", "pgv_m_s"),
        lambda v: _quartic(v, -1.56, -4.58, -20.84, 44.75, -30.50)
        - 0.64 * np.log(v["pga_g"]) + 1.55 * np.log(100.0 * v["pgv_m_s"]),
        lambda v: 0.405 + 0.524 * _ratio(v),
    ),
    Published(
        "Saygili & Rathje (2008)", ("pga_g", "pgv_m_s", "arias_m_s"),
        lambda v: _quartic(v, -0.74, -4.93, -19.91, 43.75, -30.12)
        - 1.30 * np.log(v["pga_g"]) + 1.04 * np.log(100.0 * v["pgv_m_s"])
        + 0.67 * np.log(v["arias_m_s"]),
        lambda v: 0.20 + 0.79 * _ratio(v),
    ),
)  # fmt: skip
"""The regressions by what they read."""
