"""Published conversions of a spectral acceleration to PGV."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


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
