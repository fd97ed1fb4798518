"""AFAD NSMN text (Turkey): ``KEY : value`` lines, then the columns ``N-S E-W U-D`` in gal."""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import sample_count, table_numbers, without_blank_end
from rbfrag.motions.text.header import (
    Field,
    NamedFields,
    agreed_dt,
    agreed_unit_in_g,
    find_field,
    other_count,
    positive_number,
)

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


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the components of a file in the order of its columns, with one recording id.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused when the file states another.
        dt_s: sampling interval that the caller states [s]; likewise.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    header = range(min(HEADER_LINES, len(lines)))
    columns = find_field(path, lines, header, _COLUMNS, "line 'N-S E-W U-D'")
    components = columns.text.split()
    if len(set(components)) != len(components):
        raise MotionFileError(
            path, f"the columns {' '.join(components)} name one twice", line=columns.line
        )
    header = range(columns.line - 1)
    fields = NamedFields(path, lines, header)
    interval = fields["SAMPLING INTERVAL (sec)"]
    dt = agreed_dt(path, positive_number(path, interval, "dt"), interval.line, dt_s)
    unit: Field = find_field(path, lines, header, _UNIT, "unit of the PGA values")
    factor = agreed_unit_in_g(path, unit, units)
    stated = fields["NUMBER OF DATA"]
    npts = sample_count(path, stated.text, stated.line, "number of data")
    rows = without_blank_end(lines[columns.line :])
    table = table_numbers(path, rows, columns.line + 1, len(components), "acceleration")
    remarks = other_count(path, npts, table.shape[0], stated.line, allow_partial=allow_partial)
    station = fields["STATION ID"].text
    event = fields.text("EARTHQUAKE DATE")
    return [
        GroundMotion(
            table[:, index] * factor,
            dt,
            station=station,
            event=event,
            component=component,
            orientation_deg=azimuth_deg(component),
            is_vertical=is_vertical_name(component),
            recording=f"{event} {station}".strip(),
            source_file=path.name,
            trace_index=index,
            file_format=FORMAT,
            remarks=remarks,
            is_partial=bool(remarks),
            is_corrected=False,
        )
        for index, component in enumerate(components)
    ]
