"""Joint range of the fitted data: ratios of intensity measures, and the distance from the fitted
points.

A range of each variable by itself says nothing of values that do not go together. The ratios here
do not change when a motion is scaled and name what contradicts what; the distance of Mahalanobis
(1936) in the logarithms of block and measures says the rest. No library is loaded here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from rbfrag.errors import ModelError
from rbfrag.fragility.confidence import packed
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import ArrayNamespace
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.numbers import exact_percent
from rbfrag.vocabulary.quantities import MEASURES, QUANTITIES

INSIDE = 0.995
"""Share of the fitted points that lie within the fitted distance."""

MARGIN = 2.0
"""Factor by which a ratio may lie beyond those of the shipped motions before it is doubted."""


def _name_of(value: str) -> str:
    """Return the name of a quantity in a ratio: a measure, a spectral velocity, p of the block."""
    if value not in MEASURES:
        return TERMS["sa"].title if value == "velocity_m_s" else "block's p"
    return MEASURES[value].imt or MEASURES[value].title or QUANTITIES[value].symbol


@dataclass(frozen=True)
class Ratio:
    """Ratio of intensity measures that does not change when the motion is scaled.

    Args:
        name: its name in the stored domain.
        symbol: its formula for people.
        unit: its unit, empty for none.
        of: names of the values of the ratio; the first is inconsistent with the others.
        shipped: its range over the motions of the shipped reference, which judges where a model
            says nothing of it; None where models say it all.
    """

    name: str
    symbol: str
    unit: str
    of: tuple[str, ...]
    formula: Callable[[Mapping[str, Any]], Any]
    shipped: tuple[float, float] | None = None

    def limits(self, domain: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
        """Return the range within which no warning is given.

        Args:
            domain: fitted ranges of a model by name.
        """
        if self.name in domain or self.shipped is None:
            return domain.get(self.name, (0.0, math.inf))
        return self.shipped[0] / MARGIN, self.shipped[1] * MARGIN

    def contradiction(
        self,
        values: Mapping[str, float],
        fitted: tuple[float, float] | None,
        ratio: float | None = None,
    ) -> str:
        """Return the sentence for values whose ratio is outside its range.

        Args:
            fitted: range of the fitted motions; None where the shipped ones judge.
            ratio: the ratio of these values; None for many values, which are not given.
        """
        names = {value: _name_of(value) for value in self.of}
        is_ratio = "is"
        if ratio is not None:
            is_ratio = f"is {ratio:.2g}{self.unit},"
            units = {"p": "1/s", "velocity_m_s": "m/s"}
            names = {
                value: f"a {name} of {values[value]:.3g} "
                f"{units.get(value) or QUANTITIES[value].unit}"
                for value, name in names.items()
            }
        if fitted is None and self.shipped is not None:
            where = (
                f"more than a factor of {MARGIN:g} outside the {self.shipped[0]:.3g} to "
                f"{self.shipped[1]:.3g}{self.unit} of the motions of the shipped reference: check "
                "the values"
            )
        else:
            low, high = fitted or (0.0, math.inf)
            where = (
                f"outside the fitted {low:.2g} to {high:.2g}{self.unit}: the answer is an "
                "extrapolation"
            )
        first, *rest = names.values()
        return (
            f"{first} is inconsistent with {' and '.join(rest)}: {self.symbol} {is_ratio} {where}"
        )


RATIOS: tuple[Ratio, ...] = (
    Ratio(
        "pgv_over_pga_s", "PGV/(PGA·g)", " s", ("pgv_m_s", "pga_g"),
        lambda v: v["pgv_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2),
    ),
    Ratio(
        "pgv_over_pga_tm", "PGV/(PGA·g·Tm/2π)", "", ("pgv_m_s", "pga_g", "tm_s"),
        lambda v: v["pgv_m_s"] * (2.0 * math.pi / STANDARD_GRAVITY_M_S2) / (v["pga_g"] * v["tm_s"]),
    ),
    Ratio(
        "z", "z = p·PGV/(PGA·g)", "", ("p", "pgv_m_s", "pga_g"),
        lambda v: v["p"] * v["pgv_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2),
    ),
    Ratio(
        "pgd_pga_over_pgv2", "PGD·PGA·g/PGV²", "", ("pgd_m", "pgv_m_s", "pga_g"),
        lambda v: v["pgd_m"] / v["pgv_m_s"] * (v["pga_g"] * STANDARD_GRAVITY_M_S2 / v["pgv_m_s"]),
    ),
    Ratio(
        "pgd_over_pgv_tm", "2π·PGD/(PGV·Tm)", "", ("pgd_m", "pgv_m_s", "tm_s"),
        lambda v: v["pgd_m"] * 2.0 * math.pi / (v["pgv_m_s"] * v["tm_s"]),
        (1.18, 110.0),
    ),
    Ratio(
        "velocity_over_pgv", "V(p)/PGV", "", ("velocity_m_s", "pgv_m_s"),
        lambda v: v["velocity_m_s"] / v["pgv_m_s"],
    ),
    Ratio(
        "velocity_over_pga_s", "V(p)/(PGA·g)", " s", ("velocity_m_s", "pga_g"),
        lambda v: v["velocity_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2),
    ),
)  # fmt: skip
"""The ratios that are fitted and judged; PGD·PGA/PGV² after Newmark and Rosenblueth (1971).

Of a harmonic motion 2π·PGD/(PGV·Tm) is 1, and of any other more, because displacements have longer
periods than accelerations, which Tm is the mean of.
"""


def ratios_of(names: Collection[str]) -> tuple[Ratio, ...]:
    """Return the ratios that can be computed from the named values."""
    return tuple(ratio for ratio in RATIOS if all(name in names for name in ratio.of))


class Spread(NamedTuple):
    """Scatter of the fitted points: an ellipsoid in the logarithms of block parameters and
    intensity measures.

    Args:
        names: the values that the model reads.
        centre: mean logarithms.
        packed: inverse covariance of the logarithms on and below its diagonal, row by row, those
            off it doubled.
        radius2: squared distance within which the share `INSIDE` of the points lies.
    """

    names: tuple[str, ...]
    centre: tuple[float, ...]
    packed: tuple[float, ...]
    radius2: float

    def holds(self, values: Mapping[str, Any], ns: ArrayNamespace) -> Any:
        """Return whether (where) values above zero lie within the fitted distance."""
        return self.distance2(values, ns) <= self.radius2

    def distance2(self, values: Mapping[str, Any], ns: ArrayNamespace) -> Any:
        """Return the squared Mahalanobis distance from the centre of the fitted points."""
        log, factors = ns.log, self.packed
        before: list[Any] = []
        total, k = 0.0, 0
        for name, middle in zip(self.names, self.centre):  # noqa: B905  (strict takes longer)
            deviation = log(values[name]) - middle
            before.append(deviation)
            inner = 0.0
            for previous in before:
                inner = inner + factors[k] * previous
                k += 1
            total = total + inner * deviation
        return total

    @property
    def sentence(self) -> str:
        """Warning for points outside the ellipsoid."""
        words = {"velocity_m_s": "the spectral velocity"}
        *leading, last = (words.get(name, name) for name in self.names)
        return (
            f"the combination of {', '.join(leading)} and {last} is farther from the centre of the "
            f"fitted data than {exact_percent(INSIDE)} of them: the answer is an extrapolation"
        )


def stored_spread(name: str, diagnostics: Mapping[str, Any]) -> Spread | None:
    """Return the scatter of the fitted points of a stored model; None if not stored.

    Args:
        name: the model's name.

    Raises:
        ModelError: it is not whole.
    """
    stored = diagnostics.get("mahalanobis")
    if stored is None:
        return None
    try:
        names, centre = tuple(stored["names"]), tuple(float(v) for v in stored["centre"])
        inverse = stored["inverse_covariance"]
        radius = float(stored["radius"])
        if any(len(part) != len(names) for part in (centre, inverse, *inverse)):
            raise ValueError
        factors = packed(inverse)
    except (KeyError, TypeError, ValueError, IndexError):
        raise ModelError(
            f"model {name!r} has no complete dispersion of its data: fit it again"
        ) from None
    return Spread(names, centre, factors, radius * radius)
