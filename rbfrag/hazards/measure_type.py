"""Intensity measure types by their OpenQuake names."""

from __future__ import annotations

import re
from dataclasses import dataclass

from rbfrag.errors import InputError
from rbfrag.fragility.measures import ALONE
from rbfrag.vocabulary.quantities import MEASURES, SPECTRAL

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


def requested_measure(imt: str, *, alone: bool = False) -> tuple[str, IntensityType]:
    """Return the requested measure, by its name in `predict`, and its type.

    Args:
        alone: accept only what a model reads alone.
    """
    kind = openquake_type(imt, "imt")
    name = kind.measure if kind.period_s is None else SPECTRAL.get(kind.period_s)
    if name is None or (alone and name not in ALONE):
        periods = (period for period in SPECTRAL if not alone or SPECTRAL[period] in ALONE)
        options = ", ".join(["PGV", "PGA", *(f"SA({period:g})" for period in periods)])
        text = f"imt = {imt}: no model reads it{' alone' if alone else ''}: use one of {options}"
        raise InputError(text, fields=("imt",))
    return name, kind


def is_read(imt: str) -> bool:
    """Return whether a model uses a measure, given by its OpenQuake name."""
    try:
        requested_measure(imt)
    except InputError:
        return False
    return True
