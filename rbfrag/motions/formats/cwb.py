"""CWB/CWA dat (Taiwan): ``#Name: value`` lines, then time and three components in fixed columns.

The columns are named by ``#DataSequence: Time U(+); N(+); E(+)`` and laid out by
``#Data: 4F10.3``; dt is 1 / ``SampleRate(Hz)``.
"""

from __future__ import annotations

import re

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import field_layout
from rbfrag.motions.text.record_file import Field, NamedFields, RecordFile

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


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the components of a file in the order of its columns, with one recording id."""
    lines = file.lines
    # one line within the header is blank
    first = max(at for at, line in enumerate(lines) if line.startswith(COMMENT)) + 1
    lines[:first] = [line.removeprefix(COMMENT) for line in lines[:first]]
    fields = NamedFields(file, range(first))

    rate = fields["SampleRate(Hz)"]
    frequency_hz = file.positive(rate, "sample rate")
    dt = file.agreed_dt(1.0 / frequency_hz, rate.line)
    unit = fields["AmplitudeUnit"]
    word = _WORD.match(unit.text)
    factor = file.unit_in_g(Field(word[0] if word else unit.text, unit.line))
    components = _components(file, fields["DataSequence"])
    layout, decimals = _layout(file, fields["Data"], 1 + len(components))
    table = file.fixed_table(file.data(first), first + 1, layout, "value")
    length = fields["RecordLength(sec)"]
    stated = file.positive(length, "record length") * frequency_hz
    remarks = file.remarks(stated, table.shape[0], length.line)
    file.refuse_other_times(table[:, 0], dt, decimals, first + 1, 1)
    station = fields["StationCode"].text
    return [
        file.motion(
            table[:, 1 + index] * factor,
            dt,
            station=station,
            event=fields.text("Origin Time"),
            component=component,
            trace_index=index,
            remarks=remarks,
            is_corrected=False,
        )
        for index, component in enumerate(components)
    ]


def _components(file: RecordFile, sequence: Field) -> list[str]:
    found = _SEQUENCE.fullmatch(sequence.text)
    if not found:
        raise file.error(
            f"the columns {sequence.text!r} are not of the form Time U(+); N(+); E(+)",
            sequence.line,
        )
    return _COLUMN.findall(found[1])


def _layout(file: RecordFile, field: Field, columns: int) -> tuple[tuple[int, int], int]:
    """Columns and characters a column of the printed format, and its decimals."""
    layout, decimals = field_layout(field.text), _DECIMALS.search(field.text)
    if layout is None or decimals is None or layout[0] != columns:
        raise file.error(
            f"the format {field.text!r} does not fit the {columns} columns of the data sequence, "
            f"as {columns}F10.3 would",
            field.line,
        )
    return layout, int(decimals[1])
