"""Ratios of rates between intensity measures, and PGV predicted from PGA and magnitude.

A model of PGA averages over the PGV that goes with a PGA in the reference, whose earthquakes are
stronger than those that most often make such a PGA. PGV and SA(1.0) need no magnitude.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.components import Component
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

TAU = {"pgv_m_s": 0.15, "sa10_g": 0.15}
"""Standard deviation of ln rate between the measures that may be asked for."""

LAW_TAU = 0.25
"""The same where PGV is taken from PGA and magnitude."""

PREFERRED = ("pgv_m_s", "sa10_g")
"""The measures that answer by themselves, the better first."""

PGA_ALONE = Diagnostic(
    "a rate from PGA alone is biased: the model averages over the PGV of the strong earthquakes "
    "that it is fitted to, and smaller earthquakes have less PGV at the same PGA",
    "pga_alone",
)

_CONSTANT, _SLOPE, _BY_MAGNITUDE, _SCATTER, _SATURATION = -0.623, 0.873, 0.472, 0.434, 7.6


def velocity_of(pga_g: FloatArray, magnitude: FloatArray) -> FloatArray:
    """Return the median PGV [m/s] of a single component at a PGA [g] and magnitude.

    ln PGV = -.623 + .873 ln PGA + .472 (min(M, 7.6) - 6), of the motions of the shipped reference.
    """
    with np.errstate(divide="ignore"):
        log = _CONSTANT + _SLOPE * np.log(pga_g)
    return np.asarray(np.exp(log + _BY_MAGNITUDE * (np.minimum(magnitude, _SATURATION) - 6.0)))


def component_of_velocity(component: Component) -> Component:
    """Return the component of PGV by :func:`velocity_of`, where PGA is of a given component."""
    return replace(
        component,
        amplitude=component.ratio("pga_g") ** _SLOPE,
        sigma=math.hypot(_SCATTER, _SLOPE * component.sigma),
    )


def factors_between(tau: float) -> tuple[float, float]:
    """Return the 95 % range of the ratio to rates by other intensity measures: exp(±1.96 tau)."""
    return math.exp(-1.96 * tau), math.exp(1.96 * tau)


def as_dict(tau: float | None) -> dict[str, float] | None:
    """Return the spread between measures under the keys of the JSON contract."""
    if tau is None:
        return None
    low, high = factors_between(tau)
    return {"tau": tau, "factor_low": low, "factor_high": high}


def in_words(tau: float) -> str:
    """Return the text on the factors by which another intensity measure may change a rate."""
    low, high = factors_between(tau)
    return f"Not included in the interval: choice of intensity measure, rate × {low:.2f}–{high:.2f}"


@dataclass(frozen=True)
class VelocityConversion:
    """PGV [m/s] = `factor` · SA(`period_s`) [g] in the median.

    Args:
        name: name in options.
        period_s: oscillator period [s].
        factor: PGV over spectral acceleration [m/s per g].
        scatter: standard deviation of ln(PGV/converted) that is taken where none is given: that
            of the 749 horizontal motions of the shipped reference. The publications give a
            factor for the median, and no scatter that goes with these motions.
        source: where it is published.
    """

    name: str
    period_s: float
    factor: float
    scatter: float
    source: str


CONVERSIONS: Mapping[str, VelocityConversion] = {
    item.name: item
    for item in (
        VelocityConversion(
            "newmark_hall_1982",
            1.0,
            STANDARD_GRAVITY_M_S2 / (2.0 * math.pi * 1.65),
            0.48,
            "Newmark and Hall (1982), SA(1 s)/PGV = 2π·1.65/g at 5 % damping",
        ),
        VelocityConversion(
            "bommer_alarcon_2006",
            0.5,
            STANDARD_GRAVITY_M_S2 / 20.0,
            0.47,
            "Bommer and Alarcón (2006), PGV [cm/s] = SA(0.5 s) [cm/s²]/20",
        ),
    )
}
"""The conversions by name."""


def velocity_conversion(name: str) -> VelocityConversion:
    """Return the conversion of that name."""
    if name not in CONVERSIONS:
        raise InputError(f"unknown conversion {name!r}: it must be {' or '.join(CONVERSIONS)}")
    return CONVERSIONS[name]
