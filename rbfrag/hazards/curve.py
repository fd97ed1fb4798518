"""Seismic hazard curves: annual rates of exceedance against the level of shaking."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.fragility.measures import ALONE
from rbfrag.question.shaking import doubts_about, doubts_about_rates
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.result import Tabular
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import QUANTITIES, SPECTRAL

MEASURES = ("pga_g", "pgv_m_s", "sa_g")
"""What the levels of a curve may be, with the unit."""

ANSWERED = "PGV, SA(1), PGA"
"""The measures whose curves are answered, each by a model of that very measure."""


class CurveKeywords(TypedDict, total=False):
    """Keywords that select a curve of a file and define its levels; see :func:`rbfrag.hazard`."""

    imt: str | None
    site: str | None
    convert: str | None
    convert_sigma: float | None
    component: str | None
    disaggregation: str | os.PathLike[str] | None


class _CurveSite(TypedDict, total=False):
    """Site, measure and logic-tree statistic of a curve; see :class:`HazardCurve`."""

    period_s: float | None
    site: str
    lon: float | None
    lat: float | None
    statistic: str
    component: str


@dataclass(frozen=True, eq=False, repr=False)
class HazardCurve(Tabular):
    """Annual rates of exceedance at increasing levels of one intensity measure.

    Args:
        measure: one of `MEASURES`.
        levels: levels of the measure in the unit it names, rising, shape (n,).
        annual_rate: mean number of exceedances a year [1/a], never rising, all above zero,
            shape (n,).
        end_level: the level from which on nothing is exceeded, if the curve states one.
        period_s: oscillator period of a spectral acceleration [s].
        site: name of the site, or empty.
        lon: longitude of the site [deg], or None.
        lat: latitude of the site [deg], or None.
        source: where the curve comes from, for messages.
        warnings: what was noticed on reading it.
        statistic: what of a logic tree the curve is, as OpenQuake names it: mean, quantile-0.84,
            rlz-001; empty where that is not stated.
        magnitudes_from_g: PGA [g] from which on its magnitudes are known, of a curve of PGV that
            was made of them; None of any other.
        component: horizontal component of the levels, as its file names it (rotd50, …); empty
            where it does not.
    """

    measure: str
    levels: FloatArray
    annual_rate: FloatArray
    end_level: float | None = None
    period_s: float | None = None
    site: str = ""
    lon: float | None = None
    lat: float | None = None
    source: str = "hazard curve"
    warnings: tuple[str, ...] = ()
    statistic: str = ""
    magnitudes_from_g: float | None = None
    component: str = ""

    @property
    def imt(self) -> str:
        """Intensity measure type as OpenQuake names it: PGA, PGV, SA(0.5)."""
        if self.measure == "sa_g":
            return f"SA({self.period_s:g})"
        return self.measure.split("_")[0].upper()

    @property
    def unit(self) -> str:
        """Unit of the levels."""
        return QUANTITIES[self.measure].unit

    def level_text(self, index: int) -> str:
        """Return a level with its measure and unit: "PGV = 0.2 m/s"."""
        return f"{self.imt} = {self.levels[index]:g} {self.unit}"

    @property
    def known_as(self) -> str | None:
        """Name of the measure in `predict`; None where no model uses it as its only measure."""
        name = self.measure
        if name == "sa_g":
            name = next(
                (measure for period, measure in SPECTRAL.items() if self.is_of(period)), name
            )
        return name if name in ALONE else None

    def is_of(self, period_s: float) -> bool:
        """Return whether the levels are spectral accelerations of a period [s]."""
        return self.period_s is not None and abs(self.period_s - period_s) < 1e-9

    @property
    def place(self) -> str:
        """Name or coordinates of the site, as text."""
        if self.site:
            return self.site
        if self.lon is None or self.lat is None:
            return ""
        return f"lon {self.lon:g}, lat {self.lat:g}"

    @cached_property
    def _log_rate(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(np.log(self.levels), np.log(self.annual_rate))

    def rate_at(self, level: ArrayLike) -> FloatArray:
        """Return annual rates of exceedance [1/a] between the levels of the curve.

        ln λ over ln x is the monotone cubic of Fritsch and Butland (1984), which keeps a power law.
        Straight chords lie below a curve that bends down. NaN outside the levels: nothing is
        invented there.
        """
        x = np.asarray(level, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.log(x)
        inside = (x >= self.levels[0]) & (x <= self.levels[-1])
        rate = np.exp(self._log_rate(np.where(inside, u, 0.0)))
        return np.where(inside, rate, np.nan)


def rates_from_probabilities(probability: FloatArray, years: float) -> FloatArray:
    """Return annual rates -ln(1 - P)/T of probabilities of exceedance in T years (Poisson)."""
    return -np.log1p(-probability) / years


_SELDOM = 1e-6


def hazard_curve(
    measure: str,
    levels: ArrayLike,
    annual_rate: ArrayLike,
    *,
    source: str = "hazard curve",
    **of: Unpack[_CurveSite],
) -> HazardCurve:
    """Return a checked hazard curve; levels without a usable rate are omitted with a warning.

    Levels whose rate is infinite (a probability of 1) are left out. From the first level of
    rate zero on nothing is exceeded: that level becomes `end_level`.

    Args:
        measure: ``pga_g``, ``pgv_m_s`` or ``sa_g`` (with `period_s`).
        levels: levels in that unit, above zero, rising, shape (n,).
        annual_rate: rates of exceedance [1/a], not below zero, never rising, shape (n,).
        source: file and place, for messages.
        of: period_s [s], site, lon and lat [deg], and statistic, as of :class:`HazardCurve`.

    Raises:
        InputError: levels or rates that make no hazard curve, with the offending value.
    """
    if measure not in MEASURES:
        raise InputError(f"{source}: measure {measure!r} is not one of {', '.join(MEASURES)}")
    period_s = of.get("period_s")
    if measure == "sa_g" and (period_s is None or not period_s > 0.0):
        raise InputError(f"{source}: a spectral acceleration requires a period above 0 s")
    x = np.asarray(levels, dtype=np.float64)
    rate = np.asarray(annual_rate, dtype=np.float64)
    if x.ndim != 1 or x.shape != rate.shape:
        raise InputError(
            f"{source}: {x.size} levels and {rate.size} rates: give one rate for each level"
        )
    _reject_disorder(x, rate, measure, source)
    warnings: list[Diagnostic] = []
    # A rate of exceedance never rises with the level. Levels of infinite rate carry no information,
    # and from the first zero on the curve has ended: its end enters the interval of the rate.
    endless = np.isinf(rate)
    if endless.any():
        warnings.append(
            Diagnostic(
                f"{source}: the {int(endless.sum())} lowest levels are omitted: exceeded with "
                "probability 1, they have no annual rate",
                "infinite_rates",
            )
        )
        x, rate = x[~endless], rate[~endless]
    end_level = None
    nothing = rate == 0.0
    if nothing.any():
        end_level = float(x[nothing][0])
        x, rate = x[~nothing], rate[~nothing]
    if x.size < 2:
        raise InputError(
            f"{source}: a curve must have at least two levels with positive finite rates, not "
            f"{x.size}"
        )
    # a curve may go on to levels that nothing reaches, at rates that say so
    reached = x[rate > _SELDOM]
    name = SPECTRAL.get(period_s or 0.0, measure) if measure == "sa_g" else measure
    doubts = (*doubts_about({name: reached}), *doubts_about_rates(rate))
    warnings += [doubt.replaced(text=f"{source}: {doubt}") for doubt in doubts]
    return HazardCurve(measure, x, rate, end_level, source=source, warnings=tuple(warnings), **of)


def _reject_disorder(x: FloatArray, rate: FloatArray, measure: str, source: str) -> None:
    for i, (level, value) in enumerate(zip(x.tolist(), rate.tolist(), strict=True), start=1):
        if not np.isfinite(level) or level <= 0.0:
            raise InputError(
                f"{source}: level {i} is {level:g}: {measure} levels are finite and above zero"
            )
        if np.isnan(value) or value < 0.0:
            raise InputError(
                f"{source}: the rate at level {i} ({measure} = {level:g}) is {value:g}: rates "
                "must be 0 or more"
            )
    for i in range(1, x.size):
        if x[i] <= x[i - 1]:
            verb = "repeats" if x[i] == x[i - 1] else "falls"
            raise InputError(
                f"{source}: level {i + 1} ({measure} = {x[i]:g}) {verb} after {x[i - 1]:g}: "
                "levels must increase"
            )
        if rate[i] > rate[i - 1]:
            raise InputError(
                f"{source}: the rate rises from {rate[i - 1]:g} to {rate[i]:g} 1/a at level "
                f"{i + 1} ({measure} = {x[i]:g}): a higher level cannot be exceeded more often"
            )
