"""ShakeMap grids: the shaking of one earthquake over a region (grid.xml, uncertainty.xml)."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from rbfrag.errors import InputError
from rbfrag.exchange.xml_source import xml_events
from rbfrag.files import is_numeral
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.quantities import MEASURES

FloatArray = NDArray[np.float64]

MOST_NODES = 20_000_000
"""Larger grids are rejected."""

_G = {"pctg": 0.01, "%g": 0.01, "g": 1.0}
_V = {"cms": 0.01, "cm/s": 0.01, "m/s": 1.0}

_MEASURES: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "PGV": ("pgv_m_s", _V),
    "PGA": ("pga_g", _G),
}
"""Measures that are read of a grid: our name, and its units with their factors; a blank unit is the
first of them."""

_SPECTRAL = re.compile(r"PSA(\d)(\d)|SA\(([\d.]+)\)")
"""Spectral accelerations of a grid, by the period in tenths of a second or in seconds."""

_MOST_STD = 5.0


@dataclass(frozen=True, eq=False)
class ShakeMapGrid:
    """Nodes of a ShakeMap, rows from west to east, north to south.

    Args:
        event: event_id, event (description), magnitude and time under the keys of the JSON
            contract; None where the file has no value.
        epicentre: longitude and latitude [deg]; None where the file has none.
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).
        measures: what the map holds of PGV [m/s], PGA and spectral accelerations [g] by their
            names in `predict`, each of shape (n,); NaN where the file has it.
        std_ln: standard deviations of their logarithms by the same names, as far as they are there.
        columns: declared number of nodes in a row.
        rows: declared number of rows.
        warnings: what was noticed on reading.
    """

    event: Mapping[str, Any]
    epicentre: tuple[float, float] | None
    lon: FloatArray
    lat: FloatArray
    measures: dict[str, FloatArray]
    std_ln: dict[str, FloatArray]
    columns: int
    rows: int
    warnings: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        """True if the number of nodes is the declared one."""
        return self.lon.size == self.columns * self.rows

    @property
    def is_complete(self) -> NDArray[np.bool_]:
        """Mask of the nodes with a number in every field that is read, shape (n,)."""
        return has_all_fields(self.measures, self.std_ln)


def _measure_of(title: str, prefix: str = "") -> tuple[str, Mapping[str, float]] | None:
    """Return name and units of the measure of a field; None where it is not read."""
    if not title.startswith(prefix):
        return None
    title = title.removeprefix(prefix)
    if (match := _SPECTRAL.fullmatch(title)) is None:
        return _MEASURES.get(title)
    period = match[3] or f"{match[1]}.{match[2]}"
    name = f"sa({float(period):g})" if is_numeral(period) else ""
    return (name, _G) if name in MEASURES else None


Place = tuple[int, str, int]
"""Column of a field, its unit, and the line that states them."""


def _read_grid(
    path: str | os.PathLike[str], prefix: str = "", *, allow_partial: bool
) -> ShakeMapGrid:
    """Return a grid or its uncertainty.

    Args:
        prefix: beginning of the names of the fields of which one is required in addition to LON
            and LAT.
    """
    source = str(path)
    tags, positions, table = _parse_grid(source, prefix)
    specification = tags.get("grid_specification", {})
    size = {}
    for name in ("nlon", "nlat"):
        text = specification.get(name, "")
        if not text.strip().isdigit() or int(text) < 1:
            raise InputError(f"{source}: grid_specification {name} = {text!r} is not a number")
        size[name] = int(text)
    columns, rows = size.values()
    warnings: list[str] = []
    if len(table) != columns * rows:
        message = (
            f"{source}: grid_data has {len(table)} nodes, grid_specification says "
            f"{columns} x {rows} = {columns * rows}"
        )
        if not allow_partial:
            text = f"{message}: with allow_partial it is read as it is"
            raise InputError(text, fields=("allow_partial",))
        warnings.append(Diagnostic(f"{message}: read as it is", "incomplete_map"))
    coordinates = []
    for title, limit in (("LON", 180.0), ("LAT", 90.0)):
        values = table[:, positions[title][0]].copy()
        off = np.flatnonzero(~(np.abs(values) <= limit))
        if off.size:
            raise InputError(
                f"{source}, node {off[0] + 1} of grid_data: {title} = {values[off[0]]:g} must be "
                f"between -{limit:g} and {limit:g}"
            )
        coordinates.append(values)
    measures: dict[str, FloatArray] = {}
    std_ln: dict[str, FloatArray] = {}
    for prefix, group in (("", measures), ("STD", std_ln)):
        titles = dict.fromkeys((*(prefix + title for title in _MEASURES), *positions))
        for title in titles:
            if title in positions and (measure := _measure_of(title, prefix)) is not None:
                name, units = measure
                largest = None if prefix else MEASURES[name].largest
                # the standard deviation of a logarithm does not depend on the unit inside
                of_logs = {f"ln({unit})": 1.0 for unit in units}
                group[name] = _field(
                    source, table, title, positions[title], of_logs if prefix else units,
                    largest or _MOST_STD, warnings,
                )  # fmt: skip
    fields = (*coordinates, *measures.values(), *std_ln.values())
    unknown = int(np.isnan(np.sum(fields, axis=0)).sum())
    if unknown:
        text = (
            f"{source}: {unknown:,} of {len(table):,} nodes of grid_data have no "
            "number (NaN) in a field that is read: they are left out"
        )
        warnings.append(Diagnostic(text, "incomplete_map"))
    root, about = tags["shakemap_grid"], tags.get("event", {})

    def number(name: str) -> float | None:
        try:
            value = float(about.get(name, ""))
        except ValueError:
            return None
        return value if np.isfinite(value) else None

    event = {
        "event_id": about.get("event_id", root.get("event_id", "")),
        "event": about.get("event_description", ""),
        "magnitude": number("magnitude"),
        "time": about.get("event_timestamp", ""),
    }
    x, y = number("lon"), number("lat")
    lon, lat = coordinates
    return ShakeMapGrid(
        event, None if x is None or y is None else (x, y), lon, lat, measures, std_ln, columns,
        rows, tuple(warnings),
    )  # fmt: skip


def _parse_grid(
    source: str, prefix: str
) -> tuple[dict[str, Mapping[str, str]], dict[str, Place], FloatArray]:
    """Return the attributes by tag, the positions of the fields, and grid_data by node."""
    tags: dict[str, Mapping[str, str]] = {}
    positions: dict[str, Place] = {}
    blocks: list[FloatArray] = []
    in_data, rest, data_line, count = False, "", 0, 0
    for kind, text, attributes, line in xml_events(source, "a ShakeMap grid"):
        if kind == "start":
            tags[text] = attributes
        if kind == "start" and text == "grid_field":
            where = f"{source}, line {line}"
            index, title = attributes.get("index", ""), attributes.get("name", "").strip()
            if not index.isdigit() or int(index) < 1:
                raise InputError(f"{where}: grid_field index {index!r} is not a number from 1 on")
            if title in positions:
                raise InputError(f"{where}: field {title} occurs twice")
            positions[title] = int(index) - 1, attributes.get("units", "").strip(), line
        elif kind == "start" and text == "grid_data":
            in_data, data_line = True, line
            measures = [title for title in positions if _measure_of(title, prefix)]
            needed = " or ".join(prefix + title for title in (*_MEASURES, "PSA10"))
            for title in ("LON", "LAT", needed):
                if not measures if title == needed else title not in positions:
                    have = ", ".join(positions) or "none"
                    raise InputError(
                        f"{source}, line {line}: there is no field {title}; the fields are {have}"
                    )
        elif in_data and (kind == "text" or (kind, text) == ("end", "grid_data")):
            in_data = kind == "text"
            # a number may be cut where the parser's buffer ends
            data = rest + text if in_data else f"{rest} "
            words = data.split()
            rest = "" if data[-1].isspace() else words.pop()
            try:
                blocks.append(np.array(words, dtype=np.float64))
            except ValueError:
                bad = next(i for i, word in enumerate(words) if not is_numeral(word))
                raise InputError(
                    f"{source}, node {(count + bad) // max(len(positions), 1) + 1} of grid_data: "
                    f"{words[bad][:40]!r} is not a number"
                ) from None
            count += len(words)
            if count > MOST_NODES * max(len(positions), 1):
                raise InputError(f"{source}: the grid has more than {MOST_NODES} nodes")
    if "shakemap_grid" not in tags:
        raise InputError(f"{source}: not a ShakeMap grid: there is no shakemap_grid")
    if not count:
        raise InputError(f"{source}: there is no grid_data")
    width, highest = len(positions), max(place for place, _, _ in positions.values()) + 1
    if highest != width:
        raise InputError(f"{source}: the fields have indices up to {highest} but there are {width}")
    if count % width:
        raise InputError(
            f"{source}, line {data_line}: grid_data has {count} numbers, not "
            f"a multiple of the {width} fields: a row is truncated or a field is missing"
        )
    return tags, positions, np.concatenate(blocks).reshape(-1, width)


def _field(
    source: str,
    table: FloatArray,
    title: str,
    place: Place,
    units: Mapping[str, float],
    largest: float,
    warnings: list[str],
) -> FloatArray:
    """Return a field in our unit, after a check of its unit and its numbers."""
    column, unit, line = place
    if not unit:
        unit = next(iter(units))
        text = f"{source}, line {line}: {title} has no unit: assumed to be {unit}"
        warnings.append(Diagnostic(text, "unit_assumed"))
    if unit not in units:
        raise InputError(
            f"{source}, line {line}: {title} in {unit!r} is unknown: use one of {', '.join(units)}"
        )
    values = units[unit] * table[:, column]
    bad = np.flatnonzero((values < 0.0) | np.isinf(values))
    if bad.size:
        raise InputError(
            f"{source}, node {bad[0] + 1} of grid_data: {title} = {table[bad[0], column]:g}: "
            "a finite number, not below zero, is wanted"
        )
    if (values > largest).any():
        text = f"{source}: {title} reaches {np.nanmax(table[:, column]):g} {unit}"
        warnings.append(Diagnostic(f"{text}: is that its unit?", "suspicious_value"))
    return values


def read_shakemap(
    path: str | os.PathLike[str],
    *,
    uncertainty: str | os.PathLike[str] | None = None,
    allow_partial: bool = False,
) -> ShakeMapGrid:
    """Return the grid of a ShakeMap, version 3 or 4.

    Columns are found by their names. Units are those stated; where a unit is blank it is that of
    the ShakeMap manual (percent of g, cm/s), with a warning.

    Args:
        path: grid.xml.
        uncertainty: uncertainty.xml of the same map: standard deviations of the measures'
            logarithms.
        allow_partial: read a grid with fewer or more nodes than it declares, with a warning.

    Raises:
        InputError: not such a file, or numbers that cannot be used; the message names the line.
    """
    if os.fspath(path).lower().endswith((".hdf", ".hdf5", ".h5")):
        raise InputError(
            f"{path} is HDF5 (shake_result.hdf), which is not supported: use grid.xml and "
            "uncertainty.xml of the same ShakeMap"
        )
    grid = _read_grid(path, allow_partial=allow_partial)
    if uncertainty is None:
        return grid
    other = _read_grid(uncertainty, "STD", allow_partial=allow_partial)
    ids = [shaken.event["event_id"] for shaken in (other, grid)]
    if all(ids) and ids[0] != ids[1]:
        raise InputError(
            f"{uncertainty}: is of event {ids[0]!r}, the grid of {ids[1]!r}: name the uncertainty "
            "of the same map"
        )
    if other.lon.size != grid.lon.size or not all(
        np.allclose(ours, theirs, rtol=0.0, atol=1e-4)
        for ours, theirs in ((other.lon, grid.lon), (other.lat, grid.lat))
    ):
        raise InputError(
            f"{uncertainty}: has {other.lon.size} nodes that are not those of the grid "
            f"({grid.lon.size}): name the uncertainty of the same map"
        )
    return replace(
        grid,
        std_ln={**grid.std_ln, **other.std_ln},
        warnings=(*grid.warnings, *other.warnings),
    )


def has_all_fields(*fields: Mapping[str, FloatArray]) -> NDArray[np.bool_]:
    """Return the mask of the locations with a number in every field, shape (n,)."""
    is_complete: NDArray[np.bool_] = np.isfinite(
        np.sum([values for group in fields for values in group.values()], axis=0)
    )
    return is_complete


def at_places(
    grid: ShakeMapGrid, lon: FloatArray, lat: FloatArray
) -> tuple[dict[str, FloatArray], dict[str, FloatArray], NDArray[np.bool_]]:
    """Return measures and deviations of a grid at locations, and the mask of locations on the map.

    Bilinear between the four nodes around a place, in the logarithm of the measures; off the map
    NaN.

    Args:
        grid: a whole grid.
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).
    """
    if not grid.is_whole:
        raise InputError(
            "blocks between nodes need a whole grid: this one has not as many nodes as it declares"
        )
    shape = (grid.rows, grid.columns)
    x, y = grid.lon.reshape(shape)[0], grid.lat.reshape(shape)[:, 0]
    regular = np.allclose(grid.lon.reshape(shape), x, atol=1e-4)
    regular = regular and np.allclose(grid.lat.reshape(shape), y[:, None], atol=1e-4)
    if (
        not regular
        or x.size < 2
        or y.size < 2
        or not (np.diff(x) > 0).all()
        or not (np.diff(y) < 0).all()
    ):
        raise InputError("the nodes of the grid do not run west to east and north to south")
    on_map = (lon >= x[0]) & (lon <= x[-1]) & (lat <= y[0]) & (lat >= y[-1])

    def between(values: FloatArray) -> FloatArray:
        bilinear = RegularGridInterpolator((y, x), values.reshape(shape), bounds_error=False)
        there: FloatArray = bilinear(np.column_stack([lat, lon]))
        return there

    measures = {
        name: np.exp(between(np.log(np.maximum(values, 1e-300))))
        for name, values in grid.measures.items()
    }
    return measures, {name: between(values) for name, values in grid.std_ln.items()}, on_map
