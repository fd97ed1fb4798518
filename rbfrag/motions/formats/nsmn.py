"""AFAD NSMN text (Turkey): ``KEY : value`` lines, then the columns ``N-S E-W U-D`` in gal."""

from __future__ import annotations

import re

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.record_file import NamedFields, RecordFile

FORMAT = "AFAD NSMN text"

HEADER_LINES = 60
"""How far down the line with the columns' names is looked for."""

_HEAD = re.compile(
    r"STRONG GROUND MOTION RECORDS?\b(?s:.)*^SAMPLING INTERVAL", re.MULTILINE | re.IGNORECASE
)
_COLUMNS = re.compile(r"^\s*((?:(?:N-S|E-W|U-D)\s*)+)$")
_UNIT = re.compile(r"PGA VALUES\s*\(([^)]*)\)", re.IGNORECASE)


def recognises(head: str) -> bool:
    """Return whether the first lines are those of an NSMN file."""
    return bool(_HEAD.match(head))


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the components of a file in the order of its columns, with one recording id."""
    header = range(min(HEADER_LINES, len(file.lines)))
    columns = file.find(header, _COLUMNS, "line 'N-S E-W U-D'")
    components = columns.text.split()
    if len(set(components)) != len(components):
        raise file.error(f"the columns {' '.join(components)} name one twice", columns.line)
    header = range(columns.line - 1)
    fields = NamedFields(file, header)
    dt = file.dt(fields["SAMPLING INTERVAL (sec)"])
    factor = file.unit_in_g(file.find(header, _UNIT, "unit of the PGA values"))
    stated = fields["NUMBER OF DATA"]
    npts = file.count(stated, "number of data")
    rows = file.data(columns.line)
    table = file.table(rows, columns.line + 1, len(components), "acceleration")
    remarks = file.remarks(npts, table.shape[0], stated.line)
    station = fields["STATION ID"].text
    return [
        file.motion(
            table[:, index] * factor,
            dt,
            station=station,
            event=fields.text("EARTHQUAKE DATE"),
            component=component,
            trace_index=index,
            remarks=remarks,
            is_corrected=False,
        )
        for index, component in enumerate(components)
    ]
