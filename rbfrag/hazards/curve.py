"""Seismic hazard curves, and the intensity measures of their levels by OpenQuake names."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.question.shaking import doubts_about
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import NEVER, annual_rate, percent
from rbfrag.results.result import Tabular
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import MEASURES, QUANTITIES
from rbfrag.vocabulary.spectral import spectral_name

CURVE_MEASURES = ("pga_g", "pgv_m_s", "sa_g")
"""What the levels of a curve may be, with the unit."""

ANSWERED = "PGV, SA(T) with T from 0.01 to 10 s, PGA"
"""The measures whose curves are answered, each by a model of that very measure."""


class CurveKeywords(TypedDict, total=False):
    """Keywords that select a curve of a file and define its levels; see :func:`rbfrag.hazard`."""

    imt: str | None
    site: str | None
    convert: str | None
    convert_sigma: float | None
    component: str | None
    disaggregation: str | os.PathLike[str] | None


@dataclass(frozen=True, eq=False, repr=False)
class HazardCurve(Tabular):
    """Annual rates of exceedance at increasing levels of one intensity measure.

    Args:
        measure: one of `CURVE_MEASURES`.
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
        name = self.measure if self.period_s is None else spectral_name(self.period_s)
        return name if name in MEASURES else None

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


def probability_in(years: float, annual_rate: FloatArray) -> FloatArray:
    """Return the probability of at least one failure in T years, 1 - exp(-λT) (Poisson)."""
    return np.asarray(-np.expm1(-annual_rate * checked_years(years)))


def checked_years(years: float) -> float:
    """Return a period [a] after checking that it is positive and finite."""
    if not np.isfinite(years) or years <= 0.0:
        raise InputError(f"years = {years:g}: give a period above 0 years")
    return years


_SELDOM = 1e-6

_MOST_A_YEAR = 100.0
"""Rates of exceedance above this are of another unit, or of no earthquakes [1/a]."""


def hazard_curve(
    measure: str,
    levels: ArrayLike,
    annual_rate: ArrayLike,
    *,
    source: str = "hazard curve",
    **of: Any,
) -> HazardCurve:
    """Return a checked hazard curve; levels without a usable rate are omitted with a warning.

    Levels whose rate is infinite (a probability of 1) are left out. From the first level of
    rate zero on nothing is exceeded: that level becomes `end_level`.

    Args:
        measure: ``pga_g``, ``pgv_m_s`` or ``sa_g`` (with `period_s`).
        levels: levels in that unit, above zero, rising, shape (n,).
        annual_rate: rates of exceedance [1/a], not below zero, never rising, shape (n,).
        source: file and place, for messages.
        of: period_s [s], site, lon and lat [deg], statistic and component, as of
            :class:`HazardCurve`.

    Raises:
        InputError: levels or rates that make no hazard curve, with the offending value.
    """
    if measure not in CURVE_MEASURES:
        raise InputError(f"{source}: measure {measure!r} is not one of {', '.join(CURVE_MEASURES)}")
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
    name = measure if period_s is None else spectral_name(period_s)
    doubts = [*doubts_about({name: reached})]
    if (largest := rate[0]) > _MOST_A_YEAR:
        text = f"the curve has a rate of {largest:.4g} /yr: are these annual rates of exceedance?"
        doubts.append(Diagnostic(text, "suspicious_value"))
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


NOTABLE = 0.01
"""Part of a rate, or probability, from which on a warning tells of it."""

NOTABLE_FACTOR = 2.0
"""Factor on a rate by shaking above the last level from which on the answer is a range."""


def rate_bounds(
    rate: FloatArray, above: FloatArray, above_at_most: FloatArray, below: FloatArray
) -> FloatArray:
    """Return upper bounds of rates [1/yr], shape (m,), of which `rate` are the lower ones.

    Shaking above the last level of a curve fails a block each time at most. NaN where a block
    fails below the first level, too: a curve gives no rate of weaker shaking.

    Args:
        rate: rates of failure [1/yr], shape (m,).
        above: part from beyond the last level, at least [1/yr], shape (m,).
        above_at_most: the same at most.
        below: probability of failure at the first level, shape (m,).
    """
    return np.where(below > NOTABLE, np.nan, rate + above_at_most - above)


def is_truncated(rate: FloatArray, bound: FloatArray) -> NDArray[np.bool_]:
    """Return where a rate is a range because the curve ends or begins too early, shape (m,).

    Args:
        rate: rates of failure [1/yr], shape (m,); NaN for a block that cannot be used.
        bound: their upper bounds, from :func:`rate_bounds`.
    """
    return (rate >= 0.0) & ~(bound <= np.maximum(NOTABLE_FACTOR * rate, NEVER))


def describe_ends(
    curves: Sequence[HazardCurve],
    site: NDArray[np.intp],
    rate: FloatArray,
    above: FloatArray,
    above_at_most: FloatArray,
    below: FloatArray,
) -> Iterator[str]:
    """Yield warnings where shaking beyond the ends of curves may matter; the worst case is named.

    Args:
        curves: the curve of each site.
        site: index of each block's site, shape (m,).
        rate: rates of failure [1/a], shape (m,); NaN of blocks that cannot be used.
        above: part from beyond the last level, at least [1/a], shape (m,).
        above_at_most: the same at most.
        below: probability of failure at the first level, shape (m,).
    """
    more = above_at_most - above
    of_block = " of a block" if rate.size > 1 else ""
    for doubtful, size in ((more > NOTABLE * rate, more), (below > NOTABLE, below)):
        if not doubtful.any():
            continue
        worst = int(np.argmax(np.where(doubtful, size, -1.0)))
        curve, sites = curves[site[worst]], np.unique(site[doubtful]).size
        of_site = f" of {curve.place}" if len(curves) > 1 and curve.place else ""
        more_sites = f" (and {sites - 1:,} more of {len(curves):,} sites)" if sites > 1 else ""
        if size is more:
            yield Diagnostic(
                f"the hazard curve{of_site} ends at {curve.level_text(-1)}: stronger shaking may "
                f"add up to {annual_rate(float(more[worst]))} /yr to the rate{of_block}"
                f"{more_sites}",
                "curve_ends",
            )
        else:
            yield Diagnostic(
                f"the hazard curve{of_site} begins at {curve.level_text(0)}, where "
                f"P(failure){of_block} is already {percent(float(below[worst]))}: weaker shaking "
                f"is neglected (unconservative){more_sites}",
                "curve_ends",
            )


_SA = re.compile(r"SA\s*\(\s*([0-9.]+)\s*\)", re.IGNORECASE)


@dataclass(frozen=True)
class IntensityType:
    """Intensity measure of the levels of a file.

    Args:
        measure: ``pga_g``, ``pgv_m_s`` or ``sa_g``.
        factor: what a level of the file is multiplied by to be in that unit.
        period_s: oscillator period of a spectral acceleration [s].
    """

    measure: str
    factor: float
    period_s: float | None = None

    @classmethod
    def of(cls, measure: str) -> IntensityType:
        """Return the type of a measure, by its name in `predict`."""
        period_s, factor = MEASURES[measure].period_s, MEASURES[measure].imt_factor
        return cls(measure if period_s is None else "sa_g", factor, period_s)

    @property
    def imt(self) -> str:
        """Name in OpenQuake."""
        return f"SA({self.period_s})" if self.measure == "sa_g" else MEASURES[self.measure].imt


def openquake_type(imt: str, where: str) -> IntensityType:
    """Return the type of an OpenQuake intensity measure: PGA [g], PGV [cm/s], SA(T) [g]."""
    name = imt.strip()
    for measure, about in MEASURES.items():
        if about.imt and about.imt == name.upper() and about.period_s is None:
            return IntensityType.of(measure)
    match = _SA.fullmatch(name)
    if match:
        try:
            period = float(match.group(1))
        except ValueError:
            period = 0.0
        if period > 0.0:
            return IntensityType("sa_g", 1.0, period)
    raise InputError(
        f"{where}: intensity measure {imt!r} is unknown; use PGA [g], PGV [cm/s] or SA(period) [g]",
        fields=("imt",),
    )


def requested_measure(imt: str) -> tuple[str, IntensityType]:
    """Return the requested measure, by its name in `predict`, and its type."""
    kind = openquake_type(imt, "imt")
    name = kind.measure if kind.period_s is None else spectral_name(kind.period_s)
    if name not in MEASURES:
        text = f"imt = {imt}: no model uses it: use one of {ANSWERED}"
        raise InputError(text, fields=("imt",))
    return name, kind


def is_read(imt: str) -> bool:
    """Return whether a model uses a measure, given by its OpenQuake name."""
    try:
        requested_measure(imt)
    except InputError:
        return False
    return True
