"""ShakeMap grids: the shaking of one earthquake over a region (grid.xml, uncertainty.xml)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from rbfrag.errors import InputError
from rbfrag.exchange.xml_source import parse_xml
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
    "PSA03": ("sa03_g", _G),
    "PSA10": ("sa10_g", _G),
    "PSA30": ("sa30_g", _G),
}
"""Measures that are read of a grid: our name, and its units with their factors; a blank unit is the
first of them."""

_STD = "std_ln_"
_FIELDS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    **_MEASURES,
    # the standard deviation of a logarithm does not depend on the unit inside
    **{
        f"STD{title}": (_STD + name, {f"ln({unit})": 1.0 for unit in units})
        for title, (name, units) in _MEASURES.items()
    },
}

_MOST_STD = 5.0


@dataclass(frozen=True)
class ShakeMapEvent:
    """The earthquake of a ShakeMap, epicentre in degrees; None where the file has no value."""

    event_id: str
    magnitude: float | None
    depth_km: float | None
    lat: float | None
    lon: float | None
    time: str
    description: str
    version: str


@dataclass
class GridReading:
    """State of reading a ShakeMap grid from XML.

    Args:
        source: path of the file.
        needed: fields of which one must be there beside LON and LAT.
    """

    source: str
    needed: tuple[str, ...]
    root: Mapping[str, str] = field(default_factory=dict)
    event: Mapping[str, str] = field(default_factory=dict)
    size: Mapping[str, str] = field(default_factory=dict)
    grid_fields: dict[str, tuple[int, str, int]] = field(default_factory=dict)
    blocks: list[FloatArray] = field(default_factory=list)
    rest: str = ""
    in_data: bool = False
    is_grid: bool = False
    data_line: int = 0
    values: int = 0

    def start(self, name: str, attributes: Mapping[str, str], line: int) -> None:
        """Process a start tag."""
        if name == "shakemap_grid":
            self.is_grid, self.root = True, attributes
        elif name == "event":
            self.event = attributes
        elif name == "grid_specification":
            self.size = attributes
        elif name == "grid_field":
            where = f"{self.source}, line {line}"
            index, title = attributes.get("index", ""), attributes.get("name", "").strip()
            if not index.isdigit() or int(index) < 1:
                raise InputError(f"{where}: grid_field index {index!r} is not a number from 1 on")
            if title in self.grid_fields:
                raise InputError(f"{where}: field {title} occurs twice")
            self.grid_fields[title] = (int(index) - 1, attributes.get("units", "").strip(), line)
        elif name == "grid_data":
            self.in_data, self.data_line = True, line
            for titles in (("LON",), ("LAT",), self.needed):
                if not set(titles) & set(self.grid_fields):
                    have = ", ".join(self.grid_fields) or "none"
                    raise InputError(
                        f"{self.source}, line {line}: there is no field {' or '.join(titles)}; the "
                        f"fields are {have}"
                    )

    def text(self, part: str) -> None:
        """Process a piece of text."""
        if not self.in_data:
            return
        # a number may be cut where the parser's buffer ends
        buffer = self.rest + part
        cut = max(buffer.rfind(" "), buffer.rfind("\n"), buffer.rfind("\t"), buffer.rfind("\r"))
        self.rest = buffer[cut + 1 :]
        self._take(buffer[: cut + 1])

    def end(self, name: str, _line: int) -> None:
        """Process an end tag."""
        if name == "grid_data":
            self._take(self.rest)
            self.rest, self.in_data = "", False

    def _take(self, text: str) -> None:
        words = text.split()
        if not words:
            return
        try:
            block = np.array(words, dtype=np.float64)
        except ValueError:
            raise InputError(self._bad_word(words)) from None
        self.values += block.size
        if self.values > MOST_NODES * max(len(self.grid_fields), 1):
            raise InputError(f"{self.source}: the grid has more than {MOST_NODES} nodes")
        self.blocks.append(block)

    def _bad_word(self, words: list[str]) -> str:
        for i, word in enumerate(words):
            try:
                float(word)
            except ValueError:
                row = (self.values + i) // max(len(self.grid_fields), 1) + 1
                return f"{self.source}, node {row} of grid_data: {word[:40]!r} is not a number"
        raise AssertionError("every word is a number")

    def read(
        self, allow_partial: bool
    ) -> tuple[ShakeMapEvent, dict[str, FloatArray], int, int, list[str]]:
        """Return event, fields by name, columns, rows and warnings."""
        parse_xml(self.source, "a ShakeMap grid", start=self.start, end=self.end, text=self.text)
        if not self.is_grid:
            raise InputError(f"{self.source}: not a ShakeMap grid: there is no shakemap_grid")
        if not self.blocks:
            raise InputError(f"{self.source}: there is no grid_data")
        warnings: list[str] = []
        width = len(self.grid_fields)
        highest = max(place for place, _, _ in self.grid_fields.values()) + 1
        if highest != width:
            raise InputError(
                f"{self.source}: the fields have indices up to {highest} but there are {width}"
            )
        values = np.concatenate(self.blocks)
        if values.size % width:
            raise InputError(
                f"{self.source}, line {self.data_line}: grid_data has {values.size} numbers, not "
                f"a multiple of the {width} fields: a row is truncated or a field is missing"
            )
        table = values.reshape(-1, width)
        columns, rows = (self._count(name) for name in ("nlon", "nlat"))
        if table.shape[0] != columns * rows:
            message = (
                f"{self.source}: grid_data has {table.shape[0]} nodes, grid_specification says "
                f"{columns} x {rows} = {columns * rows}"
            )
            if not allow_partial:
                text = f"{message}: with allow_partial it is read as it is"
                raise InputError(text, fields=("allow_partial",))
            warnings.append(Diagnostic(f"{message}: read as it is", "incomplete_map"))
        fields = {
            "lon": self._degrees(table, "LON", 180.0),
            "lat": self._degrees(table, "LAT", 90.0),
        }
        for title in _FIELDS:
            if title in self.grid_fields:
                fields[_FIELDS[title][0]] = self._field(table, title, warnings)
        unknown = int(np.isnan(np.sum([*fields.values()], axis=0)).sum())
        if unknown:
            text = (
                f"{self.source}: {unknown:,} of {table.shape[0]:,} nodes of grid_data have no "
                "number (NaN) in a field that is read: they are left out"
            )
            warnings.append(Diagnostic(text, "incomplete_map"))
        return self._event(), fields, columns, rows, warnings

    def _count(self, name: str) -> int:
        text = self.size.get(name, "")
        if not text.strip().isdigit() or int(text) < 1:
            raise InputError(f"{self.source}: grid_specification {name} = {text!r} is not a number")
        return int(text)

    def _degrees(self, table: FloatArray, title: str, limit: float) -> FloatArray:
        values = table[:, self.grid_fields[title][0]].copy()
        off = ~(np.abs(values) <= limit)
        if off.any():
            node = int(np.flatnonzero(off)[0])
            raise InputError(
                f"{self.source}, node {node + 1} of grid_data: {title} = {values[node]:g} must be "
                f"between -{limit:g} and {limit:g}"
            )
        return values

    def _field(self, table: FloatArray, title: str, warnings: list[str]) -> FloatArray:
        place, unit, line = self.grid_fields[title]
        name, units = _FIELDS[title]
        if not unit:
            usual = next(iter(units))
            text = f"{self.source}, line {line}: {title} has no unit: assumed to be {usual}"
            warnings.append(Diagnostic(text, "unit_assumed"))
            unit = usual
        if unit not in units:
            raise InputError(
                f"{self.source}, line {line}: {title} in {unit!r} is unknown: use one of "
                f"{', '.join(units)}"
            )
        values = units[unit] * table[:, place]
        bad = (values < 0.0) | np.isinf(values)
        if bad.any():
            node = int(np.flatnonzero(bad)[0])
            raise InputError(
                f"{self.source}, node {node + 1} of grid_data: {title} = {table[node, place]:g}: "
                "a finite number, not below zero, is wanted"
            )
        largest = MEASURES[name].largest if name in MEASURES else None
        if (values > (largest or _MOST_STD)).any():
            text = f"{self.source}: {title} reaches {np.nanmax(table[:, place]):g} {unit}"
            warnings.append(Diagnostic(f"{text}: is that its unit?", "suspicious_value"))
        return values

    def _event(self) -> ShakeMapEvent:
        def number(name: str) -> float | None:
            try:
                value = float(self.event.get(name, ""))
            except ValueError:
                return None
            return value if np.isfinite(value) else None

        return ShakeMapEvent(
            event_id=self.event.get("event_id", self.root.get("event_id", "")),
            magnitude=number("magnitude"),
            depth_km=number("depth"),
            lat=number("lat"),
            lon=number("lon"),
            time=self.event.get("event_timestamp", ""),
            description=self.event.get("event_description", ""),
            version=self.root.get("code_version", ""),
        )


@dataclass(frozen=True, eq=False)
class ShakeMapGrid:
    """Nodes of a ShakeMap, rows from west to east, north to south.

    Args:
        event: the earthquake.
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).
        measures: what the map holds of PGV [m/s], PGA and spectral accelerations [g] by their
            names in `predict`, each of shape (n,); NaN where the file has it.
        std_ln: standard deviations of their logarithms by the same names, as far as they are there.
        columns: declared number of nodes in a row.
        rows: declared number of rows.
        warnings: what was noticed on reading.
    """

    event: ShakeMapEvent
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
    event, fields, columns, rows, warnings = GridReading(str(path), tuple(_MEASURES)).read(
        allow_partial
    )
    grid = ShakeMapGrid(
        event=event,
        lon=fields["lon"],
        lat=fields["lat"],
        measures={name: fields[name] for name, _ in _MEASURES.values() if name in fields},
        std_ln=_deviations(fields),
        columns=columns,
        rows=rows,
        warnings=tuple(warnings),
    )
    return grid if uncertainty is None else _with_uncertainty(grid, uncertainty, allow_partial)


def _deviations(fields: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    return {n.removeprefix(_STD): values for n, values in fields.items() if n.startswith(_STD)}


def _with_uncertainty(
    grid: ShakeMapGrid, path: str | os.PathLike[str], allow_partial: bool
) -> ShakeMapGrid:
    event, fields, _, _, warnings = GridReading(
        str(path), tuple(f"STD{title}" for title in _MEASURES)
    ).read(allow_partial)
    if event.event_id and grid.event.event_id and event.event_id != grid.event.event_id:
        raise InputError(
            f"{path}: is of event {event.event_id!r}, the grid of {grid.event.event_id!r}: name "
            "the uncertainty of the same map"
        )
    same = fields["lon"].size == grid.lon.size
    same = same and np.allclose(fields["lon"], grid.lon, rtol=0.0, atol=1e-4)
    if not (same and np.allclose(fields["lat"], grid.lat, rtol=0.0, atol=1e-4)):
        raise InputError(
            f"{path}: has {fields['lon'].size} nodes that are not those of the grid "
            f"({grid.lon.size}): name the uncertainty of the same map"
        )
    return replace(
        grid,
        std_ln={**grid.std_ln, **_deviations(fields)},
        warnings=(*grid.warnings, *warnings),
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
