"""CWB/CWA dat (Taiwan): ``#Name: value`` lines, then time and three components in fixed columns.

The columns are named by ``#DataSequence: Time U(+); N(+); E(+)`` and laid out by
``#Data: 4F10.3``; dt is 1 / ``SampleRate(Hz)``.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import field_layout, fixed_width_numbers, without_blank_end
from rbfrag.motions.text.header import (
    Field,
    NamedFields,
    agreed_dt,
    agreed_unit_in_g,
    other_count,
    positive_number,
)
from rbfrag.motions.text.times import refuse_other_times

FORMAT = "CWB dat"

COMMENT = "#"

_HEAD = re.compile(r"#(?s:.)*^#SampleRate\(Hz\)(?s:.)*^#DataSequence:", re.MULTILINE)
_SEQUENCE = re.compile(r"Time((?:[ \t;]+[A-Z]\(\+\))+)[ \t;]*")
_COLUMN = re.compile(r"([A-Z])\(\+\)")
_DECIMALS = re.compile(r"F\d+\.(\d)", re.ASCII)
_WORD = re.compile(r"[^\s.]+")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a CWB file."""
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
    # one line within the header is blank
    first = max(at for at, line in enumerate(lines) if line.startswith(COMMENT)) + 1
    lines[:first] = [line.removeprefix(COMMENT) for line in lines[:first]]
    fields = NamedFields(path, lines, range(first))

    rate = fields["SampleRate(Hz)"]
    frequency_hz = positive_number(path, rate, "sample rate")
    dt = agreed_dt(path, 1.0 / frequency_hz, rate.line, dt_s)
    unit = fields["AmplitudeUnit"]
    word = _WORD.match(unit.text)
    factor = agreed_unit_in_g(path, Field(word[0] if word else unit.text, unit.line), units)
    components = _components(path, fields["DataSequence"])
    per_line, width, decimals = _layout(path, fields["Data"], 1 + len(components))
    rows = without_blank_end(lines[first:])
    numbers = fixed_width_numbers(path, rows, first + 1, width, per_line, "value")
    if numbers.size % per_line:
        raise MotionFileError(
            path,
            f"the last row has not {per_line} columns: the file is truncated",
            line=first + len(rows),
        )
    table = numbers.reshape(-1, per_line)
    length = fields["RecordLength(sec)"]
    stated = positive_number(path, length, "record length") * frequency_hz
    remarks = other_count(path, stated, table.shape[0], length.line, allow_partial=allow_partial)
    refuse_other_times(path, table[:, 0], dt, decimals, first + 1, 1)
    station = fields["StationCode"].text
    event = fields.text("Origin Time")
    return [
        GroundMotion(
            table[:, 1 + index] * factor,
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


def _components(path: Path, sequence: Field) -> list[str]:
    found = _SEQUENCE.fullmatch(sequence.text)
    if not found:
        raise MotionFileError(
            path,
            f"the columns {sequence.text!r} are not of the form Time U(+); N(+); E(+)",
            line=sequence.line,
        )
    return _COLUMN.findall(found[1])


def _layout(path: Path, field: Field, columns: int) -> tuple[int, int, int]:
    """Columns, characters a column and decimals of the printed format."""
    layout, decimals = field_layout(field.text), _DECIMALS.search(field.text)
    if layout is None or decimals is None or layout[0] != columns:
        raise MotionFileError(
            path,
            f"the format {field.text!r} does not fit the {columns} columns of the data sequence, "
            f"as {columns}F10.3 would",
            line=field.line,
        )
    return (*layout, int(decimals[1]))
