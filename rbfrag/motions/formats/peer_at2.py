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
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import finite_number, free_numbers, sample_count
from rbfrag.motions.text.header import other_count
from rbfrag.motions.units import acceleration_unit, unit_in_g

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


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the one motion of an AT2 file.

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
    at, npts_text, dt_text = _sampling(lines)
    number = at + 1
    npts = sample_count(path, npts_text, number, "NPTS")
    dt = finite_number(path, dt_text, number, "DT")
    if dt <= 0.0:
        raise MotionFileError(path, f"DT = {dt_text} s must be positive", line=number)
    if dt_s is not None and dt_s != dt:
        raise MotionFileError(
            path, f"the header says DT = {dt_text} s, not {dt_s:g}: leave --dt out", line=number
        )
    factor = unit_in_g(_unit(path, lines[:at], units))
    values = free_numbers(path, lines[at + 1 :], at + 2, "acceleration")
    remarks = other_count(path, npts, values.size, number, allow_partial=allow_partial)
    event, station, component = _names(lines[1] if at >= 2 else "")
    return [
        GroundMotion(
            values * factor if factor != 1.0 else values,
            dt,
            station=station,
            event=event,
            component=component,
            orientation_deg=azimuth_deg(component),
            is_vertical=is_vertical_name(component),
            # an event alone would join records of all its stations
            recording=f"{event} {station}" if event and station else "",
            source_file=path.name,
            file_format=FORMAT,
            remarks=remarks,
            is_partial=bool(remarks),
        )
    ]


def write(motion: GroundMotion) -> Iterator[str]:
    """Yield the lines of an AT2 file, without newlines; its samples read back bit for bit.

    Args:
        motion: equally spaced samples. The labels that AT2 has are kept: event, station and
            component, without commas and other than printable ASCII characters.

    Raises:
        InputError: a motion from nodes.
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


def _unit(path: Path, header: list[str], stated: str | None) -> str:
    for number, line in enumerate(header, 1):
        quantity = _QUANTITY.search(line)
        if quantity and quantity[1].upper() != "ACCELERATION":
            raise MotionFileError(
                path,
                f"this is a {quantity[1].lower()} record: the acceleration (.AT2) is needed",
                line=number,
            )
        found = _UNIT.search(line)
        if not found:
            continue
        try:
            unit = acceleration_unit(found[1])
        except InputError as error:
            raise MotionFileError(path, str(error), line=number) from None
        if stated is not None and acceleration_unit(stated) != unit:
            raise MotionFileError(
                path, f"the header says {found[1]}, not {stated}: leave --units out", line=number
            )
        return unit
    if stated is None:
        raise MotionFileError(
            path, "the header states no unit of acceleration: give it with --units g"
        )
    return acceleration_unit(stated)


def _names(line: str) -> tuple[str, str, str]:
    """Event, station and component; commas also stand between name, date and time."""
    fields = [field.strip() for field in _REMARK.sub("", line.strip()).split(",")]
    fields = [field for field in fields if field]
    if len(fields) < 3:
        return " ".join(fields), "", ""
    return " ".join(fields[:-2]), fields[-2], fields[-1]
