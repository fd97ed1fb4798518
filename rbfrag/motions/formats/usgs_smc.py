"""USGS SMC: 11 text lines, integer and real headers, comment lines, then samples in cm/s².

The integer header is 6 lines of 8 (the 16th value is the number of comment lines, the 17th npts),
the real one 10 lines of 5 (the 2nd value is samples per second). Samples stand 8 a line in
fields of 10 characters with one-digit exponents, and touch: ``-1.9234E+0-3.1562E+0``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile, peak_of
from rbfrag.motions.text import MOST_DIGITS, holds_integers

FORMAT = "USGS SMC"

UNIT = "cm/s2"
"""The unit of the format."""

INTEGER_LINES, INTEGERS, INTEGER_WIDTH = 6, 8, 10
REAL_LINES, REALS, REAL_WIDTH = 10, 5, 15
LAYOUT = (8, 10)
"""Samples a line, and characters a sample."""
COMMENTS_VALUE, NPTS_VALUE, RATE_VALUE = 16, 17, 2
"""Places in the headers, from 1."""

TEXT_LINES = 20
"""How far down the integer header is looked for."""

_HEAD = re.compile(r"\s*\d\s+(?:\w+ )*(ACCELEROGRAM|VELOCITY|DISPLACEMENT|RESPONSE)\b[^\n]*\n\*")
_STATION = re.compile(r"^\s*station\s*=\s*(.*?)\s*component\s*=", re.IGNORECASE)
_COMPONENT = re.compile(r"component\s*=\s*(\S.*)", re.IGNORECASE)
_PEAK = re.compile(r"\bpk\s*=\s*(\S+)")
_EVENT = re.compile(r"^\s*(\d{4}\s+\d{1,2}\s+\d{1,2}\s+\d{4}\s.*)", re.ASCII)

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the only trace of a file."""
    lines = file.lines
    kind = _HEAD.match(file.text)
    if kind and kind[1] != "ACCELEROGRAM":
        raise file.error(f"this is a record of {kind[1].lower()}: the acceleration is required", 1)
    top = next(
        (
            at
            for at, line in enumerate(lines[:TEXT_LINES])
            if holds_integers(line) and len(line.rstrip()) == INTEGERS * INTEGER_WIDTH
        ),
        None,
    )
    if top is None:
        raise file.error("the file has no integer header: export it again", 1)
    comments = _integer(file, top, COMMENTS_VALUE)
    npts = _value(file, top, NPTS_VALUE, INTEGERS, INTEGER_WIDTH)
    count = file.count(npts, "number of samples")
    rate = _value(file, top + INTEGER_LINES, RATE_VALUE, REALS, REAL_WIDTH)
    dt = file.possible_dt(1.0 / file.positive(rate, "samples per second"), rate.line)
    above = top + INTEGER_LINES + REAL_LINES
    first = above + comments
    for at in range(above, min(first, len(lines))):
        if not lines[at].startswith("|"):
            raise file.error(
                f"the header declares {comments} comment lines, but this line does not begin with "
                "|",
                at + 1,
            )
    values = file.fixed_width(file.data(first), first + 1, LAYOUT, "acceleration")
    header = range(top)
    yield ParsedTrace(
        values,
        dt,
        HeaderField(UNIT, 1),
        count,
        component=file.find(header, _COMPONENT, "line 'component ='").text,
        station=" ".join(file.label(header, _STATION).split()),
        event=" ".join(file.label(header, _EVENT).split()),
        is_corrected="UNCORRECTED" not in lines[0] if "CORRECTED" in lines[0] else None,
        peak=peak_of(file.optional(header, _PEAK), UNIT),
    )


def _value(file: RecordFile, top: int, place: int, per_line: int, width: int) -> HeaderField:
    row, column = divmod(place - 1, per_line)
    at = top + row
    if at >= len(file.lines):
        raise file.error(
            "the file ends within its header: export the record again", len(file.lines)
        )
    return HeaderField(file.lines[at][column * width : (column + 1) * width].strip(), at + 1)


def _integer(file: RecordFile, top: int, place: int) -> int:
    field = _value(file, top, place, INTEGERS, INTEGER_WIDTH)
    if field.text.isascii() and field.text.isdigit() and len(field.text) < MOST_DIGITS:
        return int(field.text)
    raise file.error(f"the number of comment lines {field.text!r} is invalid", field.line)
