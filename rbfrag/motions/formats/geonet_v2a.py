"""GeoNet V2A: three component blocks of text, numbers and three series in fixed columns.

Each block: 16 text lines, 10 numeric lines, then acceleration, velocity and displacement,
10 values of width 8 a line in mm/s², mm/s and mm. Values may touch. Header fields are found
by what they say, not by their line.
"""

from __future__ import annotations

import re
from dataclasses import replace

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.record_file import Field, RecordFile

FORMAT = "GeoNet V2A"

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
_PEAK = re.compile(r"^Acceleration:\s+peak\s+\S+\s+(\S+)")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a GeoNet V2A file."""
    return bool(_BLOCK.match(head)) and "Number of points" in head


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the components of a V2A file in their order, with one recording id."""
    return [_component(file, span, index) for index, span in enumerate(file.blocks(_BLOCK))]


def _component(file: RecordFile, span: range, index: int) -> GroundMotion:
    header = range(span.start, min(span.start + TEXT_LINES, span.stop))

    def field(pattern: re.Pattern[str], what: str) -> Field:
        return file.find(header, pattern, f"{what} of component {index}")

    recording = field(_BLOCK, "accelerogram name").text
    station = field(_SITE, "site").text
    component = field(_COMPONENT, "component").text
    points = field(_NPTS, "number of points")
    npts = file.count(points, "number of points")
    dt = file.dt(field(_DT, "sampling interval"))
    factor = file.unit_in_g(field(_PEAK, "peak acceleration with its unit"))

    first = span.start + TEXT_LINES + NUMERIC_LINES
    data = file.data(first, span.stop)
    rows = -(-npts // LAYOUT[0])
    # cut so short that no line lost among the accelerations can be the reason
    is_cut = file.allow_partial and span.stop == len(file.lines) and len(data) < 2 * rows
    cut_remark: tuple[str, ...] = ()
    if is_cut:
        _refuse_other_duration(file, header, points, npts, dt)
        cut_remark = (f"the file ends before component {index} does",)
    elif len(data) != SERIES * rows:
        raise file.error(
            f"the header of component {index} says {npts} points, which are {SERIES} x {rows} "
            f"lines of data, but {len(data)} follow: the file is truncated or its header wrong",
            points.line,
        )
    values = file.fixed_width(data[:rows], first + 1, LAYOUT, "acceleration")
    whole = file if is_cut else replace(file, allow_partial=False)
    remarks = whole.remarks(npts, values.size, points.line, f"component {index}")
    return file.motion(
        values * factor,
        dt,
        station=station,
        # the file names its own trigger, not the earthquake
        event="",
        component=component,
        recording=recording,
        trace_index=index,
        remarks=(*remarks, *cut_remark),
        is_partial=is_cut,
        is_corrected=True,
    )


def _refuse_other_duration(
    file: RecordFile, header: range, points: Field, npts: int, dt: float
) -> None:
    """Where lines are missing, a wrong count would take velocities for accelerations."""
    duration = file.find(header, _DURATION, "duration")
    seconds = file.positive(duration, "duration")
    if abs(seconds - npts * dt) > 2.0 * dt:
        raise file.error(
            f"{npts} points at dt = {dt:g} s last {npts * dt:g} s, but the header says "
            f"{duration.text} s: the number of points is wrong, and where the accelerations end "
            "is not known",
            points.line,
        )
