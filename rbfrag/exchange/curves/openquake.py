"""Hazard-curve CSV files of the OpenQuake engine."""

from __future__ import annotations

import csv
import re

import numpy as np

from rbfrag.errors import InputError
from rbfrag.exchange.intensity_type import openquake_type
from rbfrag.hazards.curve import HazardCurve, hazard_curve, rates_from_probabilities

_LEVEL = re.compile(r"poe-(.+)")
_SITE_COLUMNS = ("lon", "lat", "depth", "custom_site_id", "site_id")


def is_openquake_curve(text: str) -> bool:
    """Whether the text is such a file: a first line with # that names investigation_time."""
    first = text.lstrip().split("\n", 1)[0]
    return first.startswith("#") and "investigation_time" in first


def openquake_curves(text: str, source: str) -> list[HazardCurve]:
    """Return one curve for each site of the file.

    The first line holds kind, investigation_time [years] and imt; the columns are lon, lat,
    depth and ``poe-LEVEL``, levels in g (PGA, SA) or cm/s (PGV), values probabilities of
    exceedance in the investigation time: λ = -ln(1 - poe)/time.

    Args:
        text: content of the file.
        source: its path, for messages.

    Raises:
        InputError: a header or a row that does not say what it should, with its line.
    """
    rows = list(csv.reader(text.splitlines()))
    head = ",".join(rows[0])
    years = _number(_stated("investigation_time", head, source), f"{source}, line 1")
    if not years > 0.0:
        raise InputError(f"{source}, line 1: investigation_time = {years:g}: give years above zero")
    kind = openquake_type(_stated("imt", head, source), f"{source}, line 1")
    if len(rows) < 2:
        raise InputError(f"{source}: ends after line 1, before the names of the columns")
    names = [name.strip() for name in rows[1]]
    levels, places = [], []
    for place, name in enumerate(names):
        match = _LEVEL.fullmatch(name)
        if match:
            levels.append(kind.factor * _number(match.group(1), f"{source}, line 2"))
            places.append(place)
        elif name not in _SITE_COLUMNS:
            raise InputError(
                f"{source}, line 2: column {name!r} is none of {', '.join(_SITE_COLUMNS)} and "
                "poe-LEVEL"
            )
    if not places:
        raise InputError(f"{source}, line 2: there is no column poe-LEVEL")
    curves = []
    for line, row in enumerate(rows[2:], start=3):
        if not row:
            continue
        where = f"{source}, line {line}"
        if len(row) != len(names):
            raise InputError(f"{where}: {len(row)} cells under {len(names)} columns")
        poe = np.array([_number(row[place], where) for place in places])
        wrong = ~((poe >= 0.0) & (poe <= 1.0))
        if wrong.any():
            raise InputError(
                f"{where}: {poe[wrong][0]:g} is no probability: poe lies between 0 and 1"
            )
        place_of = {name: row[i].strip() for i, name in enumerate(names)}
        with np.errstate(divide="ignore"):
            rates = rates_from_probabilities(poe, years)
        curves.append(
            hazard_curve(
                kind.measure,
                levels,
                rates,
                source=where,
                period_s=kind.period_s,
                site=place_of.get("custom_site_id", place_of.get("site_id", "")),
                lon=_coordinate(place_of, "lon", 180.0, where),
                lat=_coordinate(place_of, "lat", 90.0, where),
            )
        )
    if not curves:
        raise InputError(f"{source}: there is no site below line 2")
    return curves


def _stated(name: str, head: str, source: str) -> str:
    match = re.search(rf"\b{name}\s*=\s*(?:'([^']*)'|\"+([^\"]*)\"+|([^,\s]+))", head)
    if match is None:
        raise InputError(f"{source}, line 1: {name} is not stated")
    return next(group for group in match.groups() if group is not None)


def _number(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {text!r} is not a number") from None


def _coordinate(cells: dict[str, str], name: str, limit: float, where: str) -> float | None:
    if name not in cells:
        return None
    value = _number(cells[name], where)
    if not abs(value) <= limit:
        raise InputError(f"{where}: {name} = {value:g} lies off the map (-{limit:g} to {limit:g})")
    return value
