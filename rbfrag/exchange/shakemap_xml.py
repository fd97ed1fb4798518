"""The XML of ShakeMap grids: event, declared size, fields found by their names, numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.xml_source import parse_xml

FloatArray = NDArray[np.float64]

MOST_NODES = 20_000_000
"""Larger grids are refused."""

_FIELDS: Mapping[str, tuple[str, Mapping[str, float], str]] = {
    "PGA": ("pga_g", {"pctg": 0.01, "%g": 0.01, "g": 1.0}, "pctg"),
    "PGV": ("pgv_m_s", {"cms": 0.01, "cm/s": 0.01, "m/s": 1.0}, "cms"),
    "STDPGA": ("std_ln_pga", {"ln(pctg)": 1.0, "ln(%g)": 1.0, "ln(g)": 1.0}, "ln(pctg)"),
    "STDPGV": ("std_ln_pgv", {"ln(cms)": 1.0, "ln(cm/s)": 1.0, "ln(m/s)": 1.0}, "ln(cms)"),
}
"""What is read of a grid: our name, units with their factors, and the unit of a blank one."""

_MOST = {"pga_g": 10.0, "pgv_m_s": 20.0, "std_ln_pga": 5.0, "std_ln_pgv": 5.0}


@dataclass(frozen=True)
class ShakeMapEvent:
    """The earthquake of a ShakeMap.

    Args:
        event_id: identifier.
        magnitude: magnitude, or None.
        depth_km: depth [km], or None.
        lat: latitude of the epicentre [deg], or None.
        lon: longitude of the epicentre [deg], or None.
        time: time of origin as written.
        description: name for people.
        version: version of the ShakeMap code.
    """

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
    """A ShakeMap grid while its XML is read.

    Args:
        source: path of the file.
        needed: fields that must be there beside LON and LAT.
    """

    source: str
    needed: tuple[str, ...]
    root: Mapping[str, str] = field(default_factory=dict)
    event: Mapping[str, str] = field(default_factory=dict)
    size: Mapping[str, str] = field(default_factory=dict)
    places: dict[str, tuple[int, str, int]] = field(default_factory=dict)
    blocks: list[FloatArray] = field(default_factory=list)
    rest: str = ""
    in_data: bool = False
    is_grid: bool = False
    data_line: int = 0
    values: int = 0

    def start(self, name: str, attributes: Mapping[str, str], line: int) -> None:
        """Take a start tag."""
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
            if title in self.places:
                raise InputError(f"{where}: field {title} is there twice")
            self.places[title] = (int(index) - 1, attributes.get("units", "").strip(), line)
        elif name == "grid_data":
            self.in_data, self.data_line = True, line
            for wanted in ("LON", "LAT", *self.needed):
                if wanted not in self.places:
                    have = ", ".join(self.places) or "none"
                    raise InputError(
                        f"{self.source}, line {line}: there is no field {wanted}; the fields are "
                        f"{have}"
                    )

    def text(self, piece: str) -> None:
        """Take a piece of text."""
        if not self.in_data:
            return
        # a number may be cut where the parser's buffer ends
        whole = self.rest + piece
        cut = max(whole.rfind(" "), whole.rfind("\n"), whole.rfind("\t"), whole.rfind("\r"))
        self.rest = whole[cut + 1 :]
        self._take(whole[: cut + 1])

    def end(self, name: str, _line: int) -> None:
        """Take an end tag."""
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
        if self.values > MOST_NODES * max(len(self.places), 1):
            raise InputError(f"{self.source}: the grid has more than {MOST_NODES} nodes")
        self.blocks.append(block)

    def _bad_word(self, words: list[str]) -> str:
        for i, word in enumerate(words):
            try:
                float(word)
            except ValueError:
                row = (self.values + i) // max(len(self.places), 1) + 1
                return f"{self.source}, node {row} of grid_data: {word[:40]!r} is not a number"
        raise AssertionError("every word is a number")

    def read(
        self, allow_partial: bool
    ) -> tuple[ShakeMapEvent, dict[str, FloatArray], int, int, list[str]]:
        """Return event, fields by name, columns, rows and warnings.

        Args:
            allow_partial: go on where the number of nodes is not the declared one.

        Raises:
            InputError: not such a file, or numbers that cannot be used.
        """
        parse_xml(self.source, "a ShakeMap grid", start=self.start, end=self.end, text=self.text)
        if not self.is_grid:
            raise InputError(f"{self.source}: not a ShakeMap grid: there is no shakemap_grid")
        if not self.blocks:
            raise InputError(f"{self.source}: there is no grid_data")
        warnings: list[str] = []
        width = len(self.places)
        highest = max(place for place, _, _ in self.places.values()) + 1
        if highest != width:
            raise InputError(
                f"{self.source}: the fields have indices up to {highest} but there are {width}"
            )
        values = np.concatenate(self.blocks)
        if values.size % width:
            raise InputError(
                f"{self.source}, line {self.data_line}: grid_data has {values.size} numbers, which "
                f"is no multiple of the {width} fields: a row is cut or a field missing"
            )
        table = values.reshape(-1, width)
        columns, rows = (self._count(name) for name in ("nlon", "nlat"))
        if table.shape[0] != columns * rows:
            message = (
                f"{self.source}: grid_data has {table.shape[0]} nodes, grid_specification says "
                f"{columns} x {rows} = {columns * rows}"
            )
            if not allow_partial:
                raise InputError(f"{message}: with --allow-partial it is read as it is")
            warnings.append(f"{message}: read as it is")
        fields = {
            "lon": self._degrees(table, "LON", 180.0),
            "lat": self._degrees(table, "LAT", 90.0),
        }
        for title in _FIELDS:
            if title in self.places:
                fields[_FIELDS[title][0]] = self._field(table, title, warnings)
        return self._event(), fields, columns, rows, warnings

    def _count(self, name: str) -> int:
        text = self.size.get(name, "")
        if not text.strip().isdigit() or int(text) < 1:
            raise InputError(f"{self.source}: grid_specification {name} = {text!r} is no number")
        return int(text)

    def _degrees(self, table: FloatArray, title: str, limit: float) -> FloatArray:
        values = table[:, self.places[title][0]].copy()
        off = ~(np.abs(values) <= limit)
        if off.any():
            node = int(np.flatnonzero(off)[0])
            raise InputError(
                f"{self.source}, node {node + 1} of grid_data: {title} = {values[node]:g} lies off "
                f"the map (-{limit:g} to {limit:g})"
            )
        return values

    def _field(self, table: FloatArray, title: str, warnings: list[str]) -> FloatArray:
        place, unit, line = self.places[title]
        name, units, usual = _FIELDS[title]
        if not unit:
            warnings.append(f"{self.source}, line {line}: {title} has no unit: taken as {usual}")
            unit = usual
        if unit not in units:
            raise InputError(
                f"{self.source}, line {line}: {title} in {unit!r} is not known: use one of "
                f"{', '.join(units)}"
            )
        values = units[unit] * table[:, place]
        bad = ~(values >= 0.0) | np.isinf(values)
        if bad.any():
            node = int(np.flatnonzero(bad)[0])
            raise InputError(
                f"{self.source}, node {node + 1} of grid_data: {title} = {table[node, place]:g}: "
                "a finite number, not below zero, is wanted"
            )
        if values.max() > _MOST[name]:
            warnings.append(
                f"{self.source}: {title} reaches {table[:, place].max():g} {unit}: is that its "
                "unit?"
            )
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
