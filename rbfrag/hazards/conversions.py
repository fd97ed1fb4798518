"""Published ratios: what a horizontal component means, and PGV out of a spectral acceleration.

The models are fitted on single components. Ratios of components are medians of Beyer, K. & Bommer,
J. J. (2006): Relationships between median values and between aleatory variabilities for different
definitions of the horizontal component of motion. Bulletin of the Seismological Society of
America 96(4A), 1512-1522, table 2 (PGA and PGV).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

T = TypeVar("T")


@dataclass(frozen=True)
class Component:
    """How a definition relates to a single component of unknown direction.

    Args:
        name: name in options.
        title: name for people.
        ratio: median of the definition over the median of a single component.
        scatter: standard deviation of ln(single component/definition).
    """

    name: str
    title: str
    ratio: float
    scatter: float

    def in_words(self, what: str) -> str:
        """Return what values mean: "the curve is", for example, of which component."""
        if self.name == "single":
            return f"{what} of a single component, as the models are"
        return f"{what} of {self.title}; Beyer and Bommer (2006) relate it to one component"


COMPONENTS: Mapping[str, Component] = {
    item.name: item
    for item in (
        Component("single", "a single component of any direction", 1.0, 0.0),
        # log10 scatters of a random component about the geometric mean, 0.07, and of the larger
        # one, 0.05, are taken as independent for the larger one
        Component("geometric_mean", "the geometric mean of two", 1.0, 0.07 * math.log(10.0)),
        Component("rotd50", "the median over all directions", 1.0, 0.07 * math.log(10.0)),
        Component("larger", "the larger of two", 1.1, math.hypot(0.07, 0.05) * math.log(10.0)),
    )
}
"""Definitions of the horizontal component by name."""


def component(name: str) -> Component:
    """Return the definition of that name."""
    return _named(COMPONENTS, name, "component")


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
    return _named(CONVERSIONS, name, "conversion")


def _named(known: Mapping[str, T], name: str, what: str) -> T:
    if name not in known:
        raise InputError(f"{what} {name!r} is not known: use one of {', '.join(known)}")
    return known[name]
