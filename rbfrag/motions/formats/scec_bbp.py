"""SCEC broadband platform (``.acc.bbp``): ``#`` lines, then time, N-S, E-W and U-D.

The unit stands in the names of the columns or in a line of its own, or nowhere::

    #    time(sec)      N-S(cm/s/s)      E-W(cm/s/s)      U-D(cm/s/s)
    # Column 2: North-south acceleration (cm/s/s) (+ is northward)
    #   units= cm/s/s

Velocities are written in the same way. Observed records may begin with an offset.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import takewhile

from rbfrag.errors import InputError
from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile
from rbfrag.motions.text import sampling_interval
from rbfrag.motions.units import stated_in_g

FORMAT = "SCEC broadband platform"

COMPONENTS = 3

_NAMES = ("N-S", "E-W", "U-D")
_SENSES = {"northward": "N", "eastward": "E", "upward": "UP"}

_MARK = re.compile(r"time\s*\(sec\)\s+N-S|Column 2:|units\s*=|\bstat\s*=", re.IGNORECASE)
_ROW = re.compile(r"\s*[-+.\d]\S*(?:\s+[-+.\d]\S*){3}\s*")
_COLUMNS = re.compile(r"time\s*\(sec\)|Column [2-4]:|units\s*=", re.IGNORECASE)
_UNIT = re.compile(r"\(\s*([^()+]*?)\s*\)|units\s*=\s*(\S+)", re.IGNORECASE)
_OTHER = re.compile(r"velocity|displacement", re.IGNORECASE)
_SENSE = re.compile(r"Column ([2-4]):.*\(\+ is (\w+)\)", re.IGNORECASE)
_STATION = re.compile(r"\bstat(?:ion)?\s*[=:]\s*(\S+)", re.IGNORECASE)


def recognises(head: str) -> bool:
    """Return whether comments that name such columns stand above rows of four numbers."""
    lines = head.split("\n")
    comments = list(takewhile(lambda line: line.startswith("#"), lines))
    row = lines[len(comments)] if len(comments) < len(lines) else ""
    return any(map(_MARK.search, comments)) and bool(_ROW.fullmatch(row))


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the three components of a file, with one recording id."""
    first = next(at for at, line in enumerate(file.lines) if not line.startswith("#"))
    header = range(first)
    unit = _unit(file, header)
    rows = file.data(first)
    table = file.table(rows, first + 1, 1 + COMPONENTS, "acceleration")
    lines = range(first + 1, first + 1 + len(rows))
    tokens = [row.split()[0] for row in rows]
    dt = sampling_interval(file.path, tokens, table[:, 0], lines, file.dt_s)
    names = list(_NAMES)
    for match in map(_SENSE.search, file.lines[:first]):
        if match:
            names[int(match[1]) - 2] = _SENSES.get(match[2].lower(), match[2])
    station = file.label(header, _STATION)
    for name, values in zip(names, table.T[1:], strict=True):
        yield ParsedTrace(
            values, dt, unit, None, name, station=station, recording=file.path.name.split(".")[0]
        )


def _unit(file: RecordFile, header: range) -> HeaderField | None:
    """Return the unit of all three columns, or None if there is none."""
    fields = []
    for at in header:
        line = file.lines[at]
        if not _COLUMNS.search(line):
            continue
        if other := _OTHER.search(line):
            raise _no_acceleration(file, other[0], at + 1)
        words = [bracketed or bare for bracketed, bare in _UNIT.findall(line)]
        fields += [HeaderField(word, at + 1) for word in words if word not in {"", "s", "sec"}]
    for field in fields:
        try:
            alike = stated_in_g(field.text) == stated_in_g(fields[0].text)
        except InputError:
            raise _no_acceleration(file, field.text, field.line) from None
        if not alike:
            raise file.error(
                f"a column is in {field.text}, another in {fields[0].text}", field.line
            )
    if not fields:
        file.require_units()
    return next(iter(fields), None)


def _no_acceleration(file: RecordFile, quantity: str, line: int) -> Exception:
    return file.error(
        f"the columns hold {quantity}, no acceleration: take the .acc.bbp file of the same "
        "station, or correct the header",
        line,
    )
