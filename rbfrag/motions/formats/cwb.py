"""CWB/CWA dat (Taiwan): ``#Name: value`` lines, then time and three components in fixed columns.

The columns are named by ``#DataSequence: Time U(+); N(+); E(+)`` and laid out by
``#Data: 4F10.3``; dt is 1 / ``SampleRate(Hz)``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import (
    Count,
    HeaderField,
    NamedFields,
    ParsedTrace,
    PeakField,
    PrintedTimes,
    RecordFile,
    number_or_none,
)
from rbfrag.motions.text import field_layout

FORMAT = "CWB dat"

COMPONENTS = 3

COMMENT = "#"

_HEAD = re.compile(r"#(?s:.)*^#SampleRate\(Hz\)(?s:.)*^#DataSequence:", re.MULTILINE)
_SEQUENCE = re.compile(r"Time((?:[ \t;]+[A-Z]\(\+\))+)[ \t;]*")
_COLUMN = re.compile(r"([A-Z])\(\+\)")
_DECIMALS = re.compile(r"F\d+\.(\d)", re.ASCII)
_WORD = re.compile(r"[^\s.]+")

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the components of a file in the order of its columns, with one recording id."""
    lines = file.lines
    # one line within the header is blank
    first = max(at for at, line in enumerate(lines) if line.startswith(COMMENT)) + 1
    lines[:first] = [line.removeprefix(COMMENT) for line in lines[:first]]
    fields = NamedFields(file, range(first))

    rate = fields["SampleRate(Hz)"]
    frequency_hz = file.positive(rate, "sample rate")
    dt = file.possible_dt(1.0 / frequency_hz, rate.line)
    unit = fields["AmplitudeUnit"]
    word = _WORD.match(unit.text)
    components = _components(file, fields["DataSequence"])
    layout, last_digit_s = _layout(file, fields["Data"], 1 + len(components))
    table = file.fixed_table(file.data(first), first + 1, layout, "value")
    length = fields["RecordLength(sec)"]
    seconds = file.positive(length, "record length")
    for component, values in zip(components, table.T[1:], strict=True):
        yield ParsedTrace(
            values,
            dt,
            HeaderField(word[0] if word else unit.text, unit.line),
            Count(seconds * frequency_hz, length.line, seconds=seconds),
            component,
            times=PrintedTimes(table[:, 0], 1.000001 * last_digit_s, first + 1),
            station=fields["StationCode"].text,
            event=fields.text("Origin Time"),
            is_corrected=False,
            peak=_peak(fields.optional(f"AmplitudeMAX. {component}")),
        )


def _peak(field: HeaderField | None) -> PeakField | None:
    """The larger of two values such as ``10.287~  -11.410``."""
    if field is None:
        return None
    values = ["", *field.text.replace("~", " ").split()]
    return PeakField(
        max(values, key=lambda text: abs(number_or_none(text) or 0.0)), "gal", field.line
    )


def _components(file: RecordFile, sequence: HeaderField) -> list[str]:
    match = _SEQUENCE.fullmatch(sequence.text)
    if not match:
        raise file.error(
            f"the columns {sequence.text!r} are not of the form Time U(+); N(+); E(+)",
            sequence.line,
        )
    return _COLUMN.findall(match[1])


def _layout(file: RecordFile, field: HeaderField, columns: int) -> tuple[tuple[int, int], float]:
    """Columns and characters a column of the printed format, and its last digit."""
    layout, decimals = field_layout(field.text), _DECIMALS.search(field.text)
    if layout is None or decimals is None or layout[0] != columns:
        raise file.error(
            f"the format {field.text!r} does not fit the {columns} columns of the data sequence, "
            f"as {columns}F10.3 would",
            field.line,
        )
    return layout, 10.0 ** -int(decimals[1])
