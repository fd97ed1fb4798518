"""USGS SMC: 11 text lines, integer and real headers, comment lines, then samples in cm/s².

The integer header is 6 lines of 8 (the 16th value is the number of comment lines, the 17th npts),
the real one 10 lines of 5 (the 2nd value is samples per second). Samples stand 8 a line in
fields of 10 characters with one-digit exponents, and touch: ``-1.9234E+0-3.1562E+0``.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import (
    MOST_DIGITS,
    fixed_width_numbers,
    holds_integers,
    sample_count,
    without_blank_end,
)
from rbfrag.motions.text.header import (
    Field,
    agreed_dt,
    agreed_unit_in_g,
    find_field,
    optional_field,
    other_count,
    positive_number,
)

FORMAT = "USGS SMC"

UNIT = "cm/s2"
"""The unit of the format."""

INTEGER_LINES, INTEGERS, INTEGER_WIDTH = 6, 8, 10
REAL_LINES, REALS, REAL_WIDTH = 10, 5, 15
PER_LINE, WIDTH = 8, 10
COMMENTS_VALUE, NPTS_VALUE, RATE_VALUE = 16, 17, 2
"""Places in the headers, from 1."""

TEXT_LINES = 20
"""How far down the integer header is looked for."""

_HEAD = re.compile(r"\s*\d\s+(?:\w+ )*(ACCELEROGRAM|VELOCITY|DISPLACEMENT|RESPONSE)\b[^\n]*\n\*")
_STATION = re.compile(r"^\s*station\s*=\s*(.*?)\s*component\s*=", re.IGNORECASE)
_COMPONENT = re.compile(r"component\s*=\s*(\S.*)", re.IGNORECASE)
_EVENT = re.compile(r"^\s*(\d{4}\s+\d{1,2}\s+\d{1,2}\s+\d{4}\s.*)", re.ASCII)


def recognises(head: str) -> bool:
    """Return whether the first lines are those of an SMC file."""
    return bool(_HEAD.match(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the one motion of a file.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused unless it is cm/s2.
        dt_s: sampling interval that the caller states [s]; refused when the file has another.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    kind = _HEAD.match(text)
    if kind and kind[1] != "ACCELEROGRAM":
        raise MotionFileError(
            path, f"this is a record of {kind[1].lower()}: the acceleration is needed", line=1
        )
    factor = agreed_unit_in_g(path, Field(UNIT, 1), units)
    top = next(
        (
            at
            for at, line in enumerate(lines[:TEXT_LINES])
            if holds_integers(line) and len(line.rstrip()) == INTEGERS * INTEGER_WIDTH
        ),
        None,
    )
    if top is None:
        raise MotionFileError(path, "the file has no integer header: export it again", line=1)
    comments = _integer(path, lines, top, COMMENTS_VALUE)
    stated = _value(path, lines, top, NPTS_VALUE, INTEGERS, INTEGER_WIDTH)
    npts = sample_count(path, stated.text, stated.line, "number of samples")
    rate = _value(path, lines, top + INTEGER_LINES, RATE_VALUE, REALS, REAL_WIDTH)
    dt = agreed_dt(path, 1.0 / positive_number(path, rate, "samples per second"), rate.line, dt_s)
    above = top + INTEGER_LINES + REAL_LINES
    first = above + comments
    for at in range(above, min(first, len(lines))):
        if not lines[at].startswith("|"):
            raise MotionFileError(
                path,
                f"the header says {comments} comment lines, but this is none: they begin with |",
                line=at + 1,
            )
    data = without_blank_end(lines[first:])
    values = fixed_width_numbers(path, data, first + 1, WIDTH, PER_LINE, "acceleration")
    remarks = other_count(path, npts, values.size, stated.line, allow_partial=allow_partial)

    header = range(top)
    component = find_field(path, lines, header, _COMPONENT, "line 'component ='").text
    station = optional_field(lines, header, _STATION)
    event = optional_field(lines, header, _EVENT)
    name = " ".join(station.text.split()) if station else ""
    earthquake = " ".join(event.text.split()) if event else ""
    return [
        GroundMotion(
            values * factor,
            dt,
            station=name,
            event=earthquake,
            component=component,
            orientation_deg=azimuth_deg(component),
            is_vertical=is_vertical_name(component),
            recording=f"{earthquake} {name}".strip(),
            source_file=path.name,
            file_format=FORMAT,
            remarks=remarks,
            is_partial=bool(remarks),
            is_corrected=_is_corrected(lines[0]),
        )
    ]


def _is_corrected(kind: str) -> bool | None:
    if "UNCORRECTED" in kind:
        return False
    return True if "CORRECTED" in kind else None


def _value(path: Path, lines: list[str], top: int, place: int, per_line: int, width: int) -> Field:
    row, column = divmod(place - 1, per_line)
    at = top + row
    if at >= len(lines):
        raise MotionFileError(
            path, "the file ends within its header: export the record again", line=len(lines)
        )
    return Field(lines[at][column * width : (column + 1) * width].strip(), at + 1)


def _integer(path: Path, lines: list[str], top: int, place: int) -> int:
    field = _value(path, lines, top, place, INTEGERS, INTEGER_WIDTH)
    if field.text.isascii() and field.text.isdigit() and len(field.text) < MOST_DIGITS:
        return int(field.text)
    raise MotionFileError(
        path, f"the number of comment lines {field.text!r} is no count", line=field.line
    )
