"""BHRC V1 (Iran): blocks that begin with ``* VOL1DS FILE``, uncorrected, in g/10.

Each block: header lines with component, station, azimuths of the axes, number of points and
duration; 7 lines of integers and 7 of reals; then 10 samples of width 13 a line, and ``/&``.
There is no sampling interval: it is duration / number of points.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile, number_or_none

FORMAT = "BHRC V1"

COMPONENTS = 3

LAYOUT = (10, 13)
"""Fields a line and characters a field."""

_BLOCK = re.compile(r"\s*\*\s*VOL1DS FILE", re.IGNORECASE)
_RECORD = re.compile(r"VOL1DS FILE:\s*(\S+)", re.IGNORECASE)
_COMPONENT = re.compile(r"^\s*COMP\s+(\S+)")
_STATION = re.compile(r"^(.*\S)\s+Station\s.*\bAltitude\b")
_ORIGIN = re.compile(r"^\s*Origin Time\s*:\s*(\S.*)")
_POINTS = re.compile(r"NO\.\s*OF POINTS\s*=\s*(\S+)", re.IGNORECASE)
_DURATION = re.compile(r"DURATION\s*=\s*(\S+)", re.IGNORECASE)
_UNIT = re.compile(r"UNITS ARE SECONDS AND\s+(g\s*/\s*10\b|\S+)", re.IGNORECASE)

recognises = _BLOCK.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the components of a BHRC file in their order, with one recording id."""
    for index, span in enumerate(file.blocks(_BLOCK)):
        yield _component(file, span, f"component {index}")


def _component(file: RecordFile, span: range, name: str) -> ParsedTrace:
    points = file.find(span, _POINTS, "number of points")
    count = file.count(points, "number of points", name)
    duration = file.find(span, _DURATION, "duration")
    unit = file.find(span, _UNIT, "unit of acceleration")
    dt = file.dt_of_duration(duration, count.number)
    first, rows = file.volume_1_data(span, unit.line)
    values = file.fixed_width(rows, first + 1, LAYOUT, "acceleration")
    # the third of the real numbers, 13 wide, is the duration again, or zero
    again = HeaderField(file.lines[first - 7][26:39].strip(), first - 6)
    component = file.find(span, _COMPONENT, "line 'COMP'").text
    # L1, V2, T3: the letter is the axis, the number counts the channels
    axis = component.rstrip("0123456789")
    azimuth = file.label(
        span, re.compile(rf"\bAzimuth\b.*\b{re.escape(axis)}\s+(\d+(?:\.\d+)?)", re.ASCII)
    )
    orientation = azimuth_deg(f"{azimuth}°")
    return ParsedTrace(
        values,
        dt,
        unit,
        count,
        component,
        station=file.label(span, _STATION),
        event=" ".join(file.label(span, _ORIGIN).split()),
        recording=file.find(span, _RECORD, "name of the record").text,
        is_corrected=False,
        durations=(duration, again) if number_or_none(again.text) else (duration,),
        remark_if_partial=f"dt = {dt:g} s is the duration over the number of points of the header",
        labels={"orientation_deg": orientation, "is_vertical": is_vertical_name(axis)},
    )
