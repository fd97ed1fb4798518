"""GeoNet V2A: three component blocks of text, numbers and three series in fixed columns.

Each block: 16 text lines, 10 numeric lines, then acceleration, velocity and displacement,
10 values of width 8 a line in mm/s², mm/s and mm. Values may touch. Header fields are found
by what they say, not by their line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace

from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile, peak_of

FORMAT = "GeoNet V2A"

COMPONENTS = 3

TEXT_LINES = 16
NUMERIC_LINES = 10
LAYOUT = (10, 8)
"""Fields a line and characters a field."""

SERIES = 3

_BLOCK = re.compile(r"^Corrected accelerogram\s+(\S+)")
_SITE = re.compile(r"^Site\s+(\S+)")
_NPTS = re.compile(r"^Number of points\s+(\S+)")
_DURATION = re.compile(r"^Number of points\s.*\bDuration\s+(\S+)\s*sec", re.IGNORECASE)
_DT = re.compile(r"data at\s+(\S+)\s+sec intervals")
_COMPONENT = re.compile(r"^Component\s+(\S+)")
_UNIT = re.compile(r"^Acceleration:\s+peak\s+\S+\s+(\S+)")
_PEAK = re.compile(r"^Acceleration:\s+peak\s+(\S+\s+\S+)")

_HEAD = re.compile(_BLOCK.pattern + r"(?s:.)*Number of points")

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the components of a V2A file in their order, with one recording id."""
    for index, span in enumerate(file.blocks(_BLOCK)):
        yield _component(file, span, f"component {index}")


def _component(file: RecordFile, span: range, name: str) -> ParsedTrace:
    header = range(span.start, min(span.start + TEXT_LINES, span.stop))

    def field(pattern: re.Pattern[str], description: str) -> HeaderField:
        return file.find(header, pattern, f"{description} of {name}")

    recording = field(_BLOCK, "accelerogram name").text
    station = field(_SITE, "site").text
    component = field(_COMPONENT, "component").text
    points = field(_NPTS, "number of points")
    count = file.count(points, "number of points", name)
    dt = file.dt(field(_DT, "sampling interval"))
    unit = field(_UNIT, "peak acceleration with its unit")

    first = span.start + TEXT_LINES + NUMERIC_LINES
    data = file.data(first, span.stop)
    rows = math.ceil(count.number / LAYOUT[0])
    # cut so short that no line lost among the accelerations can be the reason
    is_cut = file.allow_partial and span.stop == len(file.lines) and len(data) < 2 * rows
    if is_cut:
        # where lines are missing, a wrong count would take velocities for accelerations
        duration = field(_DURATION, "duration")
        if abs(file.positive(duration, "duration") - count.number * dt) > 2.0 * dt:
            trouble = "do not last the duration: where the accelerations end is not known"
            raise file.error(f"{count.number:.12g} points at {dt:g} s {trouble}", count.line)
    elif len(data) != SERIES * rows:
        raise file.error(
            f"the header of {name} declares {count.number} points, which are {SERIES} x {rows} "
            f"lines of data, but {len(data)} follow: the file is truncated or its header wrong",
            count.line,
        )
    values = file.fixed_width(data[:rows], first + 1, LAYOUT, "acceleration")
    if not is_cut:
        replace(file, allow_partial=False).missing_samples(count, values.size)
    return ParsedTrace(
        values,
        dt,
        unit,
        count,
        component,
        # the file names its own trigger, not the earthquake
        event="",
        station=station,
        recording=recording,
        is_corrected=True,
        is_partial=is_cut,
        remark_if_partial=f"the file ends before {name} does",
        durations=(file.optional(header, _DURATION),),
        peak=peak_of(file.optional(header, _PEAK)),
    )
