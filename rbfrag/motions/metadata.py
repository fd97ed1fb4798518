"""Metadata table of record files, for facts that their headers lack."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError, checked_name
from rbfrag.motions.archive import archive_of
from rbfrag.motions.processing import says_corrected
from rbfrag.motions.text import read_text
from rbfrag.motions.units import acceleration_unit
from rbfrag.vocabulary.quantities import MECHANISMS, QUANTITIES
from rbfrag.vocabulary.quantity import Limits

COLUMNS = (
    "file", "trace_index", "event_id", "units", "file_units", "is_vertical", "companion_group",
    "magnitude", "processing", "earthquake", "year", "station", "component", "dt_s", "gain",
    "mechanism", "depth_km", "network", "lat", "lon", "rjb_km", "rrup_km", "repi_km", "vs30_m_s",
)  # fmt: skip
"""The columns with a meaning; only ``file`` must be there. Others become attributes."""

OF_EARTHQUAKE = ("mechanism", "depth_km")
OF_RECORDING = ("network", "lat", "lon", "rjb_km", "rrup_km", "repi_km", "vs30_m_s")
"""Columns that have one value for an earthquake, and one for a recording."""

RANGES = {
    **{name: QUANTITIES[name].range for name in ("depth_km", *OF_RECORDING[3:])},
    "lat": Limits(least=-90.0, most=90.0),
    "lon": Limits(least=-180.0, most=360.0),
}

OTHER_NAMES = {
    "unit": "units", "vs30": "vs30_m_s", "rjb": "rjb_km", "rrup": "rrup_km", "repi": "repi_km",
    "depth": "depth_km", "latitude": "lat", "longitude": "lon",
}  # fmt: skip
"""Other names of columns."""

_FEWEST_LETTERS, _MOST_EDITS = 6, 2

NAMES = ("event_id", "companion_group", "earthquake", "station", "component", "network")
"""Columns of names, whose length is bounded."""

_TRUTH = {
    "1": True, "yes": True, "true": True,
    "0": False, "no": False, "false": False,
    "": None,
}  # fmt: skip

LARGEST_MAGNITUDE = 10.0


@dataclass(frozen=True)
class TraceMetadata:
    """Metadata of one trace; empty or None for missing cells.

    Args:
        line: line of the table, from 1.
        trace_index: position of the trace in its file, from 0; None for all traces of the file.
        event_id: key of the earthquake.
        units: unit of acceleration; from the column ``file_units`` it may be any words.
        is_vertical: whether the trace is the vertical component.
        companion_group: a name that all components of one recording share.
        magnitude: magnitude of the earthquake.
        processing: what was done to the record.
        earthquake: name of the earthquake for people.
        year: year or time of the earthquake, as text.
        dt_s: sampling interval [s].
        gain: counts/(m/s²) of a file in counts.
        mechanism: fault mechanism.
        depth_km: depth of the hypocentre [km].
        site: columns of :data:`OF_RECORDING` that have a value.
        attributes: texts of the further columns by name.
    """

    file: str
    line: int
    trace_index: int | None = None
    event_id: str = ""
    units: str | None = None
    is_vertical: bool | None = None
    companion_group: str = ""
    magnitude: float | None = None
    processing: str = ""
    earthquake: str = ""
    year: str | None = None
    station: str = ""
    component: str = ""
    dt_s: float | None = None
    gain: float | None = None
    mechanism: str | None = None
    depth_km: float | None = None
    site: Mapping[str, object] = field(default_factory=dict)
    attributes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class MotionMetadata:
    """The rows of a metadata table, found by file and trace.

    Args:
        rows: every row, in the table's order.
        not_read: further columns that differ between the components of a recording, which are no
            attributes of it.
    """

    path: str
    rows: tuple[TraceMetadata, ...]
    not_read: tuple[str, ...]
    _by_file: Mapping[Path, tuple[TraceMetadata, ...]] = field(repr=False, compare=False)

    def file(self, path: str | os.PathLike[str]) -> list[TraceMetadata]:
        """Return the rows of a file by trace index; empty if the table lacks it.

        A zip's rows are those of each of its members that has none of its own.
        """
        for named in (Path(path), archive_of(Path(path))):
            if named is not None and (rows := self._by_file.get(_place(named))):
                return list(rows)
        return []

    def trace(self, path: str | os.PathLike[str], trace_index: int) -> TraceMetadata | None:
        """Return the row of one trace, or None if the table lacks it."""
        for row in self.file(path):
            if row.trace_index in (None, trace_index):
                return row
        return None


def read_metadata(path: str | os.PathLike[str]) -> MotionMetadata:
    """Return the metadata of record files from a CSV.

    Args:
        path: CSV with the columns of :data:`COLUMNS` (``file`` at least). Files are named
            relative to the folder of the CSV. A row without ``trace_index``
            is about all traces of its file. Columns without a meaning are attributes of the
            recording, unless its components differ in them.

    Raises:
        MotionFileError: a value out of its range, or several of one earthquake or recording.
    """
    table = Path(path)
    rows: list[TraceMetadata] = []
    seen: dict[tuple[Path, int | None], int] = {}
    by_file: dict[Path, list[TraceMetadata]] = {}
    header: list[str] | None = None
    folder = table.absolute().parent
    for line, cells in _numbered_rows(table):
        if header is None:
            header = _header(table, cells, line)
            continue
        if len(cells) != len(header):
            raise MotionFileError(
                table,
                f"{len(cells)} cells, but the header has {len(header)} columns: repair the row "
                "(a comma in a text needs quotes around the text)",
                line=line,
            )
        fields = dict(zip(header, (cell.strip() for cell in cells), strict=True))
        row = _row(table, fields, line)
        place = _place(folder / row.file)
        first = seen.setdefault((place, row.trace_index), line)
        if first != line:
            raise MotionFileError(
                table, f"{_named(row)} was given in line {first}: keep one row", line=line
            )
        entries = by_file.get(place, [])
        if entries and None in (row.trace_index, entries[0].trace_index):
            raise MotionFileError(
                table,
                f"{_named(row)} and {_named(entries[0])} (line {entries[0].line}) are both given: "
                "use one row without trace_index for the file, or one row with trace_index for "
                "each trace, from 0",
                line=line,
            )
        rows.append(row)
        by_file.setdefault(place, []).append(row)
    if header is None:
        raise MotionFileError(table, "the table is empty: give a header")
    _reject_conflicts(table, rows)
    not_read = _of_components(rows)
    by_place = {
        place: tuple(
            replace(
                row,
                attributes={
                    name: text for name, text in row.attributes.items() if name not in not_read
                },
            )
            for row in sorted(traces, key=lambda row: row.trace_index or 0)
        )
        for place, traces in by_file.items()
    }
    return MotionMetadata(os.fspath(path), tuple(rows), not_read, by_place)


def _reject_conflicts(table: Path, rows: list[TraceMetadata]) -> None:
    """Reject several values of one earthquake, or of the components of one recording."""
    first: dict[tuple[str, ...], tuple[object, int]] = {}
    for row in rows:
        event = {name: getattr(row, name) for name in OF_EARTHQUAKE}
        facts: list[tuple[str, tuple[str, ...], dict[str, object]]]
        facts = [(f"earthquake {row.event_id!r}", (row.event_id,), event)]
        if group := row.companion_group:
            facts.append((f"recording {group!r}", (row.event_id, group, row.station), {**row.site}))
        for subject, key, values in facts:
            for name, value in values.items():
                if value is None:
                    continue
                before, line = first.setdefault((subject, *key, name), (value, row.line))
                if before != value:
                    raise MotionFileError(
                        table,
                        f"{name} of the {subject} is {value}, but {before} in line {line}: correct "
                        "one of them",
                        line=row.line,
                    )


def _of_components(rows: list[TraceMetadata]) -> tuple[str, ...]:
    """Return the further columns in which components of one recording differ."""
    seen: dict[tuple[str, ...], str] = {}
    differing: dict[str, None] = {}
    for row in rows:
        for name, text in row.attributes.items():
            key = (row.event_id, row.companion_group, row.station, name)
            if row.companion_group and seen.setdefault(key, text) != text:
                differing[name] = None
    return tuple(differing)


def _numbered_rows(table: Path) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(read_text(table)), strict=True)
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise MotionFileError(
            table, f"not CSV: {error}; repair the quotes", line=reader.line_num
        ) from None


def _header(table: Path, cells: list[str], line: int) -> list[str]:
    header = [cell.strip().lower() for cell in cells]
    header = [OTHER_NAMES.get(name, name) for name in header]
    if "file" not in header:
        shown = ", ".join(header[:8])
        raise MotionFileError(
            table,
            f"no column 'file' among {shown}: a metadata table is a CSV, separated by commas, "
            "with the columns file, trace_index, event_id, units, ...",
            line=line,
        )
    for name in COLUMNS:
        if header.count(name) > 1:
            raise MotionFileError(table, f"the column {name!r} occurs twice", line=line)
    for text in header:
        if text in COLUMNS:
            continue
        is_long = sum(map(str.isalpha, text)) >= _FEWEST_LETTERS
        for name in COLUMNS:
            differs_in_marks = _letters(text) == _letters(name)
            if differs_in_marks or (is_long and _edits(text, name) <= _MOST_EDITS):
                raise MotionFileError(
                    table,
                    f"{text[:60]}: did you mean {name}? Rename the column",
                    line=line,
                )
    return header


def _letters(text: str) -> str:
    """Return the letters and digits of a text, in small letters."""
    return "".join(filter(str.isalnum, text.lower()))


def _edits(first: str, second: str) -> int:
    """Return the edit distance of two texts: letters inserted, deleted or replaced."""
    before = list(range(len(second) + 1))
    for i, a in enumerate(first, 1):
        row = [i]
        for j, b in enumerate(second):
            row.append(min(row[j] + 1, before[j + 1] + 1, before[j] + (a != b)))
        before = row
    return before[-1]


def _row(table: Path, fields: Mapping[str, str], line: int) -> TraceMetadata:
    def text(name: str) -> str:
        return fields.get(name, "")

    for name in NAMES:
        try:
            checked_name(text(name), f"the {name}")
        except InputError as error:
            raise MotionFileError(table, str(error), line=line) from None

    def number(name: str, ok: Callable[[float], bool], rule: str) -> float | None:
        if not text(name):
            return None
        try:
            value = float(text(name))
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and ok(value)):
            raise MotionFileError(table, f"{name} {text(name)!r} must be {rule}", line=line)
        return value

    if not text("file"):
        raise MotionFileError(
            table, "the cell 'file' is empty: give the file of the record", line=line
        )
    index = text("trace_index")
    if index and not (index.isascii() and index.isdigit() and len(index) < 10):
        raise MotionFileError(
            table, f"trace_index {index!r} must be a whole number from 0", line=line
        )
    vertical = text("is_vertical")
    if vertical.lower() not in _TRUTH:
        raise MotionFileError(table, f"is_vertical {vertical!r} must be 0 or 1", line=line)
    try:
        says_corrected(text("processing"))
        if text("units"):
            acceleration_unit(text("units"))
    except InputError as error:
        raise MotionFileError(table, str(error), line=line) from None
    for name in OF_EARTHQUAKE:
        if text(name) and not text("event_id"):
            raise MotionFileError(
                table, f"{name} requires the event_id of the earthquake", line=line
            )
    mechanism = text("mechanism").lower().replace("_", "-").replace(" ", "-")
    if mechanism and mechanism not in MECHANISMS:
        names = " or ".join(MECHANISMS)
        raise MotionFileError(table, f"mechanism {text('mechanism')!r} must be {names}", line=line)
    ranged = {name: number(name, limits.holds, limits.words) for name, limits in RANGES.items()}
    site = {"network": text("network"), **{name: ranged[name] for name in OF_RECORDING[1:]}}
    most = LARGEST_MAGNITUDE
    return TraceMetadata(
        line=line,
        trace_index=int(index) if index else None,
        units=text("units") or text("file_units") or None,
        is_vertical=_TRUTH[vertical.lower()],
        magnitude=number("magnitude", lambda m: abs(m) <= most, f"a number up to {most:g}"),
        year=text("year") or None,
        dt_s=number("dt_s", lambda value: value > 0.0, "a positive number of seconds"),
        gain=number("gain", lambda value: value > 0.0, "a positive number of counts/(m/s2)"),
        mechanism=mechanism or None,
        depth_km=ranged["depth_km"],
        site={name: value for name, value in site.items() if value not in (None, "")},
        attributes={
            name: value for name, value in fields.items() if name and value and name not in COLUMNS
        },
        **{name: text(name) for name in ("file", "processing", *NAMES[:-1])},
    )


def _named(row: TraceMetadata) -> str:
    return row.file if row.trace_index is None else f"trace {row.trace_index} of {row.file}"


def _place(path: Path) -> Path:
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError):
        # a loop of links or a name that no file can have: it matches itself only
        return path.absolute()
