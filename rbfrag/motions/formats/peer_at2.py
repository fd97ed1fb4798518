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
from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile

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
# a station and the direction of the component: MUL009, A-ELC180, 14403090, 25C00EW, NCADBHNE
_AFTER_STATION = re.compile(
    r"[\w.-]{2,}?((?:[0-2]\d|3[0-5])\d|360|NS|EW|H[NL][ENZ]|UP|DWN|VER)", re.ASCII | re.IGNORECASE
)
_REMARK = re.compile(r"\([^()]*\)\s*$")


def recognises(head: str) -> bool:
    """Return whether one of the first lines is that of an AT2 file with NPTS and DT."""
    return _sampling(head.split("\n")) is not None


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the only trace of an AT2 file."""
    sampling = _sampling(file.lines)
    assert sampling is not None, "parse() is called for recognised text only"
    at, match = sampling
    count = file.count(HeaderField(match[1], at + 1), "NPTS")
    dt = file.dt(HeaderField(match[2], at + 1), "DT")
    unit = _unit(file, file.lines[:at])
    event, station, component = _names(file.lines[1] if at >= 2 else "")
    direction = _AFTER_STATION.fullmatch(component)
    yield ParsedTrace(
        file.free_numbers(file.lines[at + 1 :], at + 2, "acceleration"),
        dt,
        unit,
        count,
        component,
        station=station,
        event=event,
        axis=direction and direction[1],
        # an event alone would join records of all its stations
        recording=f"{event} {station}" if event and station else "",
    )


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


def _sampling(lines: list[str]) -> tuple[int, re.Match[str]] | None:
    for at, line in enumerate(lines[:HEADER_LINES]):
        if match := _NAMED.search(line) or _TRAILING.match(line):
            return at, match
    return None


def _unit(file: RecordFile, header: list[str]) -> HeaderField | None:
    for number, line in enumerate(header, 1):
        quantity = _QUANTITY.search(line)
        if quantity and quantity[1].upper() != "ACCELERATION":
            raise file.error(
                f"this is a {quantity[1].lower()} record: the acceleration (.AT2) is required",
                number,
            )
        if match := _UNIT.search(line):
            return HeaderField(match[1], number)
    return None


def _names(line: str) -> tuple[str, str, str]:
    """Event, station and component; commas also stand between name, date and time."""
    fields = [field.strip() for field in _REMARK.sub("", line.strip()).split(",")]
    fields = [field for field in fields if field]
    if len(fields) < 3:
        return " ".join(fields), "", ""
    return " ".join(fields[:-2]), fields[-2], fields[-1]
