"""PEER AT2: four header lines, then free-format values in g.

Line 2 is "earthquake and date, station, component", line 3 names quantity and unit, line 4
has NPTS and DT in one of several spellings::

    NPTS=  7996, DT= .00500 SEC
    NPTS=   1991, DT=   .0100 SEC,   0 POLE @    30.00000 HZ,  -5 POLE @      .05000
    NPTS=   1451, dt=  .02000
    4096    0.0100    NPTS, DT
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import finite_number
from rbfrag.motions.text.record_file import Field, RecordFile
from rbfrag.motions.units import unit_in_g

FORMAT = "PEER AT2"

PER_LINE = 5

HEADER_LINES = 8
"""How far down the NPTS line is looked for."""

_NAMED = re.compile(r"NPTS\s*=\s*([^\s,]+)\s*,?\s*DT\s*=\s*([^\s,]+)", re.IGNORECASE)
_TRAILING = re.compile(r"^\s*(\S+)\s+(\S+)\s+NPTS\s*,\s*DT", re.IGNORECASE)
_QUANTITY = re.compile(
    r"(ACCELERATION|VELOCITY|DISPLACEMENT)\s+TIME\s+(?:HISTORY|SERIES)", re.IGNORECASE
)
_UNIT = re.compile(r"UNITS\s+OF\s+([A-Za-z/0-9^*']+)", re.IGNORECASE)
_NOT_IN_LABELS = re.compile(r"[^!-~]|[,=]")
_REMARK = re.compile(r"\([^()]*\)\s*$")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of an AT2 file."""
    lines = head.split("\n")[:HEADER_LINES]
    return any(_NAMED.search(line) or _TRAILING.match(line) for line in lines)


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the one motion of an AT2 file."""
    lines = file.lines
    at, npts_text, dt_text = _sampling(lines)
    number = at + 1
    npts = file.count(Field(npts_text, number), "NPTS")
    dt = finite_number(file.path, dt_text, number, "DT")
    if dt <= 0.0:
        raise file.error(f"DT = {dt_text} s must be positive", number)
    if file.dt_s is not None and file.dt_s != dt:
        raise file.error(
            f"the header says DT = {dt_text} s, not {file.dt_s:g}: leave --dt out", number
        )
    factor = _unit_in_g(file, lines[:at])
    values = file.free_numbers(lines[at + 1 :], at + 2, "acceleration")
    event, station, component = _names(lines[1] if at >= 2 else "")
    return [
        file.motion(
            values * factor if factor != 1.0 else values,
            dt,
            station=station,
            event=event,
            component=component,
            # an event alone would join records of all its stations
            recording=f"{event} {station}" if event and station else "",
            remarks=file.remarks(npts, values.size, number),
        )
    ]


def write(motion: GroundMotion) -> Iterator[str]:
    """Yield the lines of an AT2 file, without newlines; its samples read back bit for bit.

    Args:
        motion: equally spaced samples. The labels that AT2 has are kept: event, station and
            component, without commas and other than printable ASCII characters.
    """
    if motion.dt_s is None:
        raise InputError(f"{motion.label}: only equally spaced samples can be written")
    labels = (_NOT_IN_LABELS.sub(" ", text).split() for text in
              (motion.event, motion.station, motion.component))  # fmt: skip
    yield "PEER STRONG MOTION DATABASE RECORD. WRITTEN BY RBFRAG."
    yield ", ".join(" ".join(words) or "UNKNOWN" for words in labels)
    yield "ACCELERATION TIME HISTORY IN UNITS OF G"
    yield f"NPTS= {motion.npts:6d}, DT= {motion.dt_s!r} SEC"
    samples = motion.acceleration_g.tolist()
    for at in range(0, len(samples), PER_LINE):
        yield "".join(f"{value:25.16E}" for value in samples[at : at + PER_LINE])


def _sampling(lines: list[str]) -> tuple[int, str, str]:
    for at, line in enumerate(lines[:HEADER_LINES]):
        if found := _NAMED.search(line) or _TRAILING.match(line):
            return at, found[1], found[2]
    raise AssertionError("read() is called for recognised text only")


def _unit_in_g(file: RecordFile, header: list[str]) -> float:
    for number, line in enumerate(header, 1):
        quantity = _QUANTITY.search(line)
        if quantity and quantity[1].upper() != "ACCELERATION":
            raise file.error(
                f"this is a {quantity[1].lower()} record: the acceleration (.AT2) is needed", number
            )
        if found := _UNIT.search(line):
            return file.unit_in_g(Field(found[1], number))
    if file.units is None:
        raise file.error("the header states no unit of acceleration: give it with --units g")
    return unit_in_g(file.units)


def _names(line: str) -> tuple[str, str, str]:
    """Event, station and component; commas also stand between name, date and time."""
    fields = [field.strip() for field in _REMARK.sub("", line.strip()).split(",")]
    fields = [field for field in fields if field]
    if len(fields) < 3:
        return " ".join(fields), "", ""
    return " ".join(fields[:-2]), fields[-2], fields[-1]
