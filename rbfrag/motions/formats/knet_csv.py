"""K-NET CSV (NIED, Japan): all components of a station in columns, in gal, below ``#`` lines.

The header names its fields on one line and gives their values on the next, by section; the last
``#`` line names the columns::

    #SamplingFrequency(Hz)
    #100
    #Offset
    #N-S(gal),E-W(gal),U-D(gal)
    #0.10,1.70,16.50
    #Time,RelativeTime(s),N-S(gal),E-W(gal),U-D(gal)
    2024/01/01 00:00:15.00,0.00,0.10,0.24,16.66

As in the ASCII format of the same networks, the mean of a component is the instrument's offset.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from rbfrag.motions.record_file import (
    Count,
    HeaderField,
    ParsedTrace,
    PrintedTimes,
    RecordFile,
)
from rbfrag.motions.text import last_digit

FORMAT = "K-NET CSV"

TIME_COLUMNS = ("Time", "RelativeTime(s)")

_HEAD = re.compile(r"#K(?:-|ik-)NET CSV", re.IGNORECASE)
_COLUMN = re.compile(r"([^()]+)\(([^()]+)\)")
_BOREHOLE = re.compile(r"\D+1")

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the components in the order of their columns, with one recording id."""
    lines = file.lines
    start = next((at for at, line in enumerate(lines) if not line.startswith("#")), len(lines))
    names = lines[start - 1].removeprefix("#").split(",")
    columns = [_COLUMN.fullmatch(name.strip()) for name in names[len(TIME_COLUMNS) :]]
    if tuple(names[: len(TIME_COLUMNS)]) != TIME_COLUMNS or not columns or None in columns:
        raise file.error(
            f"the line above the samples does not name the columns {', '.join(TIME_COLUMNS)} and "
            "components with their units: download the record again",
            start,
        )
    fields = _fields(lines[: start - 1])

    def field(name: str) -> HeaderField:
        if name not in fields:
            raise file.error(f"the header has no {name!r}: download the record again", 1)
        return fields[name]

    frequency = field("SamplingFrequency(Hz)")
    frequency_hz = file.positive(frequency, "sampling frequency")
    dt = file.possible_dt(1.0 / frequency_hz, frequency.line)
    duration = field("DurationTime(s)")
    seconds = file.positive(duration, "duration")
    rows = [row.split(",") for row in file.data(start)]
    for number, row in enumerate(rows, start + 1):
        if len(row) != len(names):
            raise file.error(
                f"the line has {len(row)} values, not {len(names)} as the columns named above: "
                "repair the line or download the record again",
                number,
            )
    numbers = range(start + 1, start + 1 + len(rows))
    relative = [row[1] for row in rows]
    times_s = file.numbers(relative, lambda: numbers, "time")
    tolerance_s = 0.5 * max(map(last_digit, relative), default=0.0) * (1.0 + 1e-6)
    station, origin = field("Code").text, field("OriginTime").text
    first = rows[0][0] if rows else ""
    for at, column in enumerate(columns, len(TIME_COLUMNS)):
        assert column is not None
        values = file.numbers([row[at] for row in rows], lambda: numbers, "acceleration")
        # a file without samples is rejected by their number
        offset = float(values.mean()) if values.size else 0.0
        component, borehole = column[1].strip(), bool(_BOREHOLE.fullmatch(column[1].strip()))
        remarks = [
            f"the mean of {offset:.6g} {column[2]}, the offset of the instrument, was subtracted; "
            "this is no baseline correction"
        ]
        if borehole:
            remarks.append("this is the borehole sensor, below the surface")
        yield ParsedTrace(
            values - offset,
            dt,
            HeaderField(column[2], start),
            Count(seconds * frequency_hz, duration.line, seconds=seconds),
            component,
            times=PrintedTimes(times_s, tolerance_s, start + 1),
            station=station,
            event=f"{origin} JST",
            recording=f"{station} {first}{' borehole' if borehole else ''}",
            start=first,
            is_corrected=False,
            remarks=tuple(remarks),
        )


def _fields(lines: list[str]) -> dict[str, HeaderField]:
    """Return the header's values by name: each line of names is followed by one of values."""
    fields: dict[str, HeaderField] = {}
    for at, (names, values) in enumerate(pairwise(lines), 2):
        pairs = zip(names.removeprefix("#").split(","), values.removeprefix("#").split(","),
                    strict=False)  # fmt: skip
        for name, value in pairs:
            fields.setdefault(name.strip(), HeaderField(value.strip(), at))
    return fields
