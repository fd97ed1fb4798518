"""AFAD NSMN text (Turkey): ``KEY : value`` lines, then the columns ``N-S E-W U-D`` in gal."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import NamedFields, ParsedTrace, PeakField, RecordFile

FORMAT = "AFAD NSMN text"

COMPONENTS = 3

HEADER_LINES = 60
"""How far down the line with the columns' names is looked for."""

_HEAD = re.compile(
    r"STRONG GROUND MOTION RECORDS?\b(?s:.)*^SAMPLING INTERVAL", re.MULTILINE | re.IGNORECASE
)
_COLUMNS = re.compile(r"^\s*((?:(?:N-S|E-W|U-D)\s*)+)$")
_UNIT = re.compile(r"PGA VALUES\s*\(([^)]*)\)", re.IGNORECASE)
_PEAK = re.compile(r"\((N-S|E-W|U-D)\)\s*(\S+)")

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the components of a file in the order of its columns, with one recording id."""
    header = range(min(HEADER_LINES, len(file.lines)))
    columns = file.find(header, _COLUMNS, "line 'N-S E-W U-D'")
    components = columns.text.split()
    if len(set(components)) != len(components):
        raise file.error(f"the columns {' '.join(components)} name one twice", columns.line)
    header = range(columns.line - 1)
    fields = NamedFields(file, header)
    dt = file.dt(fields["SAMPLING INTERVAL (sec)"])
    unit = file.find(header, _UNIT, "unit of the PGA values")
    count = file.count(fields["NUMBER OF DATA"], "number of data")
    peaks = {name: PeakField(text, unit.text, unit.line) for name, text in
             _PEAK.findall(file.lines[unit.line - 1])}  # fmt: skip
    rows = file.data(columns.line)
    table = file.table(rows, columns.line + 1, len(components), "acceleration")
    for component, values in zip(components, table.T, strict=True):
        yield ParsedTrace(
            values,
            dt,
            unit,
            count,
            component,
            station=fields["STATION ID"].text,
            event=fields.text("EARTHQUAKE DATE"),
            is_corrected=False,
            peak=peaks.get(component),
        )
