"""Hazard curve files: OpenQuake CSV, USGS JSON, two columns, or one row per site."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Unpack

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, is_number, json_document, number_at, source_text
from rbfrag.hazards.curve import (
    ANSWERED,
    CurveKeywords,
    HazardCurve,
    IntensityType,
    hazard_curve,
    openquake_type,
    rates_from_probabilities,
)
from rbfrag.hazards.shaking import by_preference, velocity_conversion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.components import COMPONENTS
from rbfrag.results.diagnostic import Diagnostic

CurveLike = HazardCurve | str | os.PathLike[str]
"""A curve, or the file that holds it."""


def as_curves(
    sources: CurveLike | Sequence[CurveLike], **meaning: Unpack[CurveKeywords]
) -> list[HazardCurve]:
    """Return the hazard curves of an argument, reading the selected curve of each file.

    Raises:
        InputError: something else, or a file that holds curves of several sites.
    """
    if isinstance(sources, str | os.PathLike):
        curves = select_curves(sources, **meaning)
        if len(curves) > 1:
            raise InputError(
                f"{sources} has {len(curves)} sites, and the blocks are at one site: choose it by "
                "number or name"
            )
        return curves
    if isinstance(sources, HazardCurve):
        return _by_magnitude([sources], meaning)
    if not isinstance(sources, Sequence):
        raise InputError(
            f"curve is of type {type(sources).__name__}: give a HazardCurve, the path of its file, "
            "or a list of them"
        )
    return [curve for source in sources for curve in as_curves(source, **meaning)]


def select_curves(
    path: str | os.PathLike[str], **meaning: Unpack[CurveKeywords]
) -> list[HazardCurve]:
    """Return the curves of a file that a model can use, one per site; see :func:`as_curves`."""
    convert = meaning.get("convert")
    period = None if convert is None else velocity_conversion(convert).period_s
    imt = meaning.get("imt")
    if imt is None and meaning.get("disaggregation") is not None:
        imt = "PGA"
    curves = read_hazard_curves(path, imt=imt, site=meaning.get("site"))
    return _by_magnitude(suited_curves(curves, converted_period_s=period), meaning)


def _by_magnitude(curves: list[HazardCurve], meaning: CurveKeywords) -> list[HazardCurve]:
    """Return the curves, with PGA converted to PGV where a disaggregation is given."""
    path = meaning.get("disaggregation")
    if path is None or all(curve.magnitudes_from_g is not None for curve in curves):
        return curves
    from rbfrag.hazards.disaggregation import Disaggregation

    disaggregation = Disaggregation.read(path)
    return [disaggregation.velocity_curve(curve, **meaning) for curve in curves]


def read_hazard_curves(
    path: str | os.PathLike[str], *, imt: str | None = None, site: str | None = None
) -> list[HazardCurve]:
    """Return the hazard curves of a file: OpenQuake CSV, USGS NSHM JSON, or two columns.

    Args:
        path: the file.
        imt: only curves of this intensity measure: PGA, PGV, SA(0.5).
        site: only the curve of this site: its number in the file from 1 on, or its name.

    Raises:
        InputError: the file cannot be used, or holds no such curve; the message names the
            line or the element.
    """
    if str(path).lower().endswith(".npz"):
        raise InputError(
            f"{path} has numpy arrays, which are not supported: export the curves of the job as "
            "text:  oq export hcurves CALC_ID -e csv"
        )
    return hazard_curves_in(source_text(path, "a hazard curve"), str(path), imt=imt, site=site)


def hazard_curves_in(
    text: str, source: str, *, imt: str | None = None, site: str | None = None
) -> list[HazardCurve]:
    """Return the hazard curves of a file's text."""
    first = text.lstrip().split("\n", 1)[0]
    if first.startswith("#") and "investigation_time" in first:
        curves = openquake_curves(text, source)
    elif first.startswith("{"):
        curves = nshm_curves(text, source)
    else:
        curves = table_curves(text, source, imt)
    if imt is not None:
        kind, have = openquake_type(imt, "imt"), ", ".join(dict.fromkeys(c.imt for c in curves))
        curves = [
            curve
            for curve in curves
            if curve.measure == kind.measure
            and (kind.period_s is None or curve.is_of(kind.period_s))
        ]
        if not curves:
            raise InputError(f"{source}: there is no curve of {imt}; there are {have}")
    if site is None or (named := [curve for curve in curves if curve.site == site]):
        return curves if site is None else named
    sites = list(dict.fromkeys((curve.site, curve.lon, curve.lat) for curve in curves))
    if not (site.isdigit() and 1 <= int(site) <= len(sites)):
        raise InputError(
            f"{source}: there is no site {site!r}; give a number from 1 to {len(sites)}, or a name"
        )
    place = sites[int(site) - 1]
    return [curve for curve in curves if (curve.site, curve.lon, curve.lat) == place]


def suited_curves(
    curves: list[HazardCurve], *, converted_period_s: float | None = None
) -> list[HazardCurve]:
    """Return the curves of one measure, the best single predictor among those of the models.

    Args:
        converted_period_s: period of the spectral acceleration that a conversion to PGV has been
            asked for, or None.

    Raises:
        InputError: curves of several measures, none of which a model reads.
    """
    names = list(dict.fromkeys(curve.imt for curve in curves))
    if len(names) == 1:
        return curves
    if converted_period_s is not None:
        chosen = [curve for curve in curves if curve.is_of(converted_period_s)]
        if chosen:
            return chosen
    elif measures := by_preference({curve.known_as or "" for curve in curves}):
        chosen = [curve for curve in curves if curve.known_as == measures[0]]
        note = Diagnostic(
            f"the file has hazard curves of {', '.join(names)}: that of {chosen[0].imt} is used, "
            "the best single predictor of toppling; imt selects another",
            "curve_selected",
            fields=("imt",),
        )
        return [replace(curve, warnings=(*curve.warnings, note)) for curve in chosen]
    required = ANSWERED if converted_period_s is None else f"SA({converted_period_s:g})"
    raise InputError(f"the file has curves of {', '.join(names)}; wanted is one of {required}")


_DECIMAL = r"([0-9]+(?:\.[0-9]*)?|\.[0-9]+)"
_SPECTRAL = re.compile(rf"{_DECIMAL} Second Spectral Acceleration", re.IGNORECASE)


def nshm_curves(text: str, source: str) -> list[HazardCurve]:
    """Return one curve for each intensity measure of the file.

    Each measure holds ``xs``, the natural logarithms of acceleration in g (or of velocity in
    cm/s for the peak ground velocity), and ``ys``, annual rates of exceedance.
    """
    try:
        document = json_document(text)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    if not isinstance(document, dict) or not document:
        raise InputError(
            f"{source}: a JSON object with one member per intensity measure is required"
        )
    if "response" in document:
        try:
            return list(_service_curves(document, source))
        except (AttributeError, KeyError, TypeError):
            raise InputError(
                f"{source}: no hazard curves as the USGS services answer; download the curve again"
            ) from None
    curves = []
    for name, member in document.items():
        where = f"{source}, {name!r}"
        kind = _usgs_type(name, where)
        if not isinstance(member, dict):
            raise InputError(f"{where}: an object with xs and ys is required")
        x, y = (_numbers(member.get(key), key, where) for key in ("xs", "ys"))
        with np.errstate(over="ignore"):
            levels = kind.factor * np.exp(x)
        curves.append(hazard_curve(kind.measure, levels, y, source=where, period_s=kind.period_s))
    return curves


def _service_curves(document: dict[str, Any], source: str) -> Iterator[HazardCurve]:
    """Yield the total curves of a response of the Unified Hazard Tool or of nshmp-ws.

    The former has ``metadata`` with ``imt`` and ``xvals`` (or ``xvalues``) and ``yvals`` for each
    site or kind of source, the latter ``xs`` and ``ys``; levels in g (PGV: cm/s), annual rates.
    """
    response = document["response"]
    for member in response["hazardCurves"] if isinstance(response, dict) else response:
        about = {**document.get("request", {}), **member, **member.get("metadata", {})}
        name = about["imt"]["value"]
        where = f"{source}, {name}"
        kind = _usgs_type(name, where)
        for data in member["data"] if isinstance(member["data"], list) else [member["data"]]:
            if data.get("component", "Total") != "Total":
                continue  # of one kind of source
            fields = {**about, **data, **data.get("values", {})}
            x, y = (
                _numbers(next((fields[key] for key in keys if key in fields), None), keys[0], where)
                for keys in (("xs", "xvalues", "xvals"), ("ys", "yvalues", "yvals"))
            )
            yield hazard_curve(
                kind.measure, kind.factor * x, y, source=where, period_s=kind.period_s,
                lon=fields.get("longitude"), lat=fields.get("latitude"),
            )  # fmt: skip


def _usgs_type(name: str, where: str) -> IntensityType:
    """Return the type of a USGS measure such as 1.00 Second Spectral Acceleration or SA1P0."""
    peaks = {"peak ground acceleration": "PGA", "peak ground velocity": "PGV"}
    name = peaks.get(name.lower(), name)
    name = re.sub(r"SA(\d+)P(\d+)", r"SA(\1.\2)", _SPECTRAL.sub(r"SA(\1)", name))
    return openquake_type(name, where)


def _numbers(value: Any, key: str, where: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: {key} is not a list of numbers")
    for i, item in enumerate(value):
        if not is_number(item):
            raise InputError(f"{where}: {key}[{i}] = {item!r} is not a number")
    return np.array(value, dtype=np.float64)


_LEVEL = re.compile(r"poe-(.+)")
_NO_CURVES = {
    r"[0-9.e-]+~.+": "uniform hazard spectra",
    r"[A-Z].*-[0-9.]+(e-[0-9]+)?": "a hazard map",
}
"""Columns of what the engine exports in addition to curves: PROBABILITY~IMT and IMT-PROBABILITY."""

_SITE_COLUMNS = ("lon", "lat", "depth", "custom_site_id", "site_id")


def openquake_curves(text: str, source: str) -> list[HazardCurve]:
    """Return one curve for each site of the file.

    The first line holds kind, investigation_time [years] and imt; the columns are lon, lat,
    depth and ``poe-LEVEL``, levels in g (PGA, SA) or cm/s (PGV), values probabilities of
    exceedance in the investigation time: λ = -ln(1 - poe)/time.

    Raises:
        InputError: a header or a row that does not say what it should, with its line.
    """
    # The engine gives probabilities of exceedance in the investigation time; for a Poisson process
    # λ = -ln(1 - poe)/time.
    rows = [cells for _, cells in csv_rows(text, source)]
    head = ",".join(rows[0])
    names = [name.strip() for name in rows[1]] if len(rows) > 1 else []
    for name in () if any(map(_LEVEL.fullmatch, names)) else names:
        for pattern, data in _NO_CURVES.items():
            if re.fullmatch(pattern, name):
                raise InputError(
                    f"{source}, line 2: {name!r} is a column of {data}: single levels make no "
                    "rate; export the curves of that job instead:  oq export hcurves CALC_ID -e csv"
                )
    years = number_at(_header_value("investigation_time", head, source), f"{source}, line 1")
    if not years > 0.0:
        raise InputError(f"{source}, line 1: investigation_time = {years:g}: give years above zero")
    kind = openquake_type(_header_value("imt", head, source), f"{source}, line 1")
    statistic, component = _header_value("kind", head, source, ""), _component_in(text)
    if len(rows) < 2:
        raise InputError(f"{source}: ends after line 1, before the names of the columns")
    levels, columns = [], []
    for column, name in enumerate(names):
        match = _LEVEL.fullmatch(name)
        if match:
            levels.append(kind.factor * number_at(match.group(1), f"{source}, line 2"))
            columns.append(column)
        elif name not in _SITE_COLUMNS:
            raise InputError(
                f"{source}, line 2: column {name!r} is not one of {', '.join(_SITE_COLUMNS)} and "
                "poe-LEVEL"
            )
    if not columns:
        raise InputError(f"{source}, line 2: there is no column poe-LEVEL")
    curves = []
    for line, row in enumerate(rows[2:], start=3):
        if not row:
            continue
        where = f"{source}, line {line}"
        if len(row) != len(names):
            raise InputError(f"{where}: {len(row)} cells under {len(names)} columns")
        poe = np.array([number_at(row[column], where) for column in columns])
        wrong = ~((poe >= 0.0) & (poe <= 1.0))
        if wrong.any():
            raise InputError(
                f"{where}: {poe[wrong][0]:g} is not a probability: poe must be between 0 and 1"
            )
        cell_of = {name: row[i].strip() for i, name in enumerate(names)}
        with np.errstate(divide="ignore", over="ignore"):
            rates = rates_from_probabilities(poe, years)
        curve = hazard_curve(
            kind.measure, levels, rates, source=where, period_s=kind.period_s, statistic=statistic,
            component=component, **_site_of(cell_of, where),
        )  # fmt: skip
        curves.append(curve)
    if not curves:
        raise InputError(f"{source}: there is no site below line 2")
    return curves


def _header_value(name: str, head: str, source: str, default: str | None = None) -> str:
    match = re.search(rf"\b{name}\s*=\s*(?:'([^']*)'|\"+([^\"]*)\"+|([^,\s]+))", head)
    if match is None:
        if default is not None:
            return default
        raise InputError(f"{source}, line 1: {name} is missing")
    return next(group for group in match.groups() if group is not None)


def _site_of(cells: dict[str, str], where: str) -> dict[str, Any]:
    """Return the name and coordinates of the site of a row."""
    named = (cells[name] for name in ("custom_site_id", "site_id", "name", "site") if name in cells)
    place: dict[str, float | None] = {}
    for name, limit in (("lon", 180.0), ("lat", 90.0)):
        value = place[name] = number_at(cells[name], where) if name in cells else None
        if value is not None and not abs(value) <= limit:
            raise InputError(
                f"{where}: {name} = {value:g} must be between -{limit:g} and {limit:g}"
            )
    return {"site": next(named, ""), **place}


_LEVELS = {
    "pga_g": ("pga_g", 1.0),
    "pga_m_s2": ("pga_g", 1.0 / STANDARD_GRAVITY_M_S2),
    "pgv_m_s": ("pgv_m_s", 1.0),
    "pgv_cm_s": ("pgv_m_s", 0.01),
}
_SPECTRAL_COLUMN = re.compile(rf"sa\({_DECIMAL}\)_g")
_POE = re.compile(rf"poe_{_DECIMAL}_years?")

_UNIT = re.compile(r"\s*[(\[]([^()\[\]]+)[)\]]$")
"""A unit in brackets at the end of a column's name, as people write it: PGV [m/s]."""

HEADER_HELP = (
    "name the columns pga_g, pga_m_s2, pgv_m_s, pgv_cm_s or sa(1.0)_g, and annual_rate, "
    "return_period_years or poe_50_years"
)


def table_curves(text: str, source: str, imt: str | None = None) -> list[HazardCurve]:
    """Return the curve of a two-column CSV file, or the curves of a table with one row per site.

    The header says what the numbers are: levels ``pga_g``, ``pga_m_s2``, ``pgv_m_s``,
    ``pgv_cm_s`` or ``sa(0.5)_g``, also with the unit in brackets; and ``annual_rate`` [1/a],
    ``return_period_years`` or ``poe_50_years``, the probability of exceedance in 50 years. Between
    semicolons numbers may have decimal commas. Levels may fall from row to row, as those of return
    periods that do. Of ``Ground Motion (g), Annual Frequency of Exceedance`` `imt` states the
    measure, as of a table with a row of annual rates for each site, ``name,lon,lat`` and below the
    levels (in g, of PGV in cm/s) as nshmp-haz writes it.

    Args:
        imt: intensity measure of levels whose header does not name it.
    """
    rows = [
        (number, [cell.strip() for cell in row])
        for number, row in csv_rows(text, source)
        if row and not row[0].lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(f"{source}: there is no curve: {HEADER_HELP}")
    # Semicolons separate cells where commas are decimal signs.
    if ";" in rows[0][1][0]:
        rows = [
            (number, [cell.strip().replace(",", ".") for cell in ",".join(row).split(";")])
            for number, row in rows
        ]
    line, header = rows[0]
    if len(header) > 2 and sum(map(_is_level, header)) > 1:
        return list(_site_rows(rows, source, imt))
    if len(header) != 2:
        raise InputError(f"{source}, line {line}: {len(header)} columns, not two: {HEADER_HELP}")
    where, (level, rate) = f"{source}, line {line}", map(_with_unit, header)
    period = None
    if level == "ground_motion_g":
        kind = _type_from_option(imt, f"{where}: ground motion")
        measure, factor, period = kind.measure, 1.0, kind.period_s
    elif match := _SPECTRAL_COLUMN.fullmatch(level):
        measure, factor, period = "sa_g", 1.0, float(match[1])
    elif level in _LEVELS:
        measure, factor = _LEVELS[level]
    else:
        raise InputError(f"{where}: column {level!r} is unknown: {HEADER_HELP}")
    match, of_periods = _POE.fullmatch(rate), rate in _RETURN_PERIODS
    years = float(match[1]) if match else None
    is_rate = of_periods or re.fullmatch("annual_rate|annual_frequency_of_exceed[ae]nce", rate)
    if not (is_rate or (years is not None and years > 0.0)):
        raise InputError(f"{where}: column {rate!r} must be a rate or a probability: {HEADER_HELP}")
    levels, values = [], []
    for number, row in rows[1:]:
        if len(row) != 2:
            raise InputError(f"{source}, line {number}: {len(row)} cells, not two")
        try:
            levels.append(factor * float(row[0]))
            values.append(float(row[1]))
        except ValueError:
            raise InputError(
                f"{source}, line {number}: {','.join(row)!r} are not two numbers"
            ) from None
        if years is not None and not 0.0 <= values[-1] <= 1.0:
            raise InputError(
                f"{source}, line {number}: {values[-1]:g} is not a probability: {header[1]} must "
                "be between 0 and 1"
            )
        if of_periods:
            if not values[-1] > 0.0:
                raise InputError(
                    f"{source}, line {number}: the return period {values[-1]:g} years must be "
                    "above zero"
                )
            values[-1] = 1.0 / values[-1]
    # A table by rising return period has falling rates, one by rising rate is reversed.
    if len(levels) > 1 and all(high > low for high, low in pairwise(levels)):
        levels, values = levels[::-1], values[::-1]
    rates = np.array(values)
    if years is not None:
        with np.errstate(divide="ignore", over="ignore"):
            rates = rates_from_probabilities(rates, years)
    return [
        hazard_curve(
            measure, levels, rates, source=source, period_s=period, component=_component_in(text)
        )
    ]


_COMPONENT = re.compile(
    r"^#.*?\bcomponent\s*[:=]\s*['\"]*([\w -]*\w)", re.IGNORECASE | re.MULTILINE
)


def _component_in(text: str) -> str:
    """Return the horizontal component that a comment names, such as `component='RotD50'`."""
    match = _COMPONENT.search(text)
    name = "" if match is None else re.sub(r"[\s-]+", "_", match[1].lower())
    return name if name in COMPONENTS else ""


def _is_level(name: str) -> bool:
    return re.fullmatch(rf"{_DECIMAL}(?:[eE][+-]?\d+)?", name) is not None


def _site_rows(
    rows: Sequence[tuple[int, list[str]]], source: str, imt: str | None
) -> Iterator[HazardCurve]:
    """Yield the curve of each row below a header of site columns and levels."""
    line, header = rows[0]
    kind = _type_from_option(imt, f"{source}, line {line}: levels of shaking")
    levels = [kind.factor * float(name) for name in header if _is_level(name)]
    for number, row in rows[1:]:
        where = f"{source}, line {number}"
        if len(row) != len(header):
            raise InputError(f"{where}: {len(row)} cells under {len(header)} columns")
        cells = dict(zip(header, row, strict=True))
        rates = [number_at(cells[name], where) for name in header if _is_level(name)]
        yield hazard_curve(
            kind.measure, levels, rates, source=where, period_s=kind.period_s,
            **_site_of(cells, where),
        )  # fmt: skip


def _type_from_option(imt: str | None, subject: str) -> IntensityType:
    if imt is None:
        text = f"{subject} in g: the header does not say whether of PGA or SA; state it as imt PGA"
        raise InputError(f"{text} or SA(0.5)", fields=("imt",))
    return openquake_type(imt, "imt")


_RETURN_PERIODS = frozenset(
    {"return_period", "return_period_years", "return_period_a", "return_period_yr"}
)


def _with_unit(name: str) -> str:
    """Return a column name in lower case with its bracketed unit written as in pgv_m_s."""
    text = name.strip().lower()
    unit = _UNIT.search(text)
    if unit is None or not unit[1].strip(" 0123456789."):
        return text.replace(" ", "_")
    spelled = unit[1].strip().replace("/", "_").replace("²", "2").replace("^", "")
    return f"{text[: unit.start()].strip()}_{spelled}".replace(" ", "_")
