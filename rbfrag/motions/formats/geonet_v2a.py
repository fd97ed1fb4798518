"""GeoNet V2A: three component blocks of text, numbers and three series in fixed columns.

Each block: 16 text lines, 10 numeric lines, then acceleration, velocity and displacement,
10 values of width 8 a line in mm/s², mm/s and mm. Values may touch. Header fields are found
by what they say, not by their line.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import fixed_width_numbers, sample_count, without_blank_end
from rbfrag.motions.text.header import (
    Field,
    agreed_dt,
    agreed_unit_in_g,
    blocks,
    find_field,
    other_count,
    positive_number,
)

FORMAT = "GeoNet V2A"

TEXT_LINES = 16
NUMERIC_LINES = 10
PER_LINE = 10
WIDTH = 8
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


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the components of a V2A file in their order, with one recording id.

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
    return [
        _component(path, lines, span, index, units, dt_s, allow_partial)
        for index, span in enumerate(blocks(path, lines, _BLOCK))
    ]


def _component(
    path: Path,
    lines: list[str],
    span: range,
    index: int,
    units: str | None,
    dt_s: float | None,
    allow_partial: bool,
) -> GroundMotion:
    header = range(span.start, min(span.start + TEXT_LINES, span.stop))

    def field(pattern: re.Pattern[str], what: str) -> Field:
        return find_field(path, lines, header, pattern, f"{what} of component {index}")

    recording = field(_BLOCK, "accelerogram name").text
    station = field(_SITE, "site").text
    component = field(_COMPONENT, "component").text
    points = field(_NPTS, "number of points")
    npts = sample_count(path, points.text, points.line, "number of points")
    interval = field(_DT, "sampling interval")
    dt = agreed_dt(path, positive_number(path, interval, "dt"), interval.line, dt_s)
    factor = agreed_unit_in_g(path, field(_PEAK, "peak acceleration with its unit"), units)

    first = span.start + TEXT_LINES + NUMERIC_LINES
    data = without_blank_end(lines[first : span.stop])
    rows = -(-npts // PER_LINE)
    # cut so short that no line lost among the accelerations can be the reason
    is_cut = allow_partial and span.stop == len(lines) and len(data) < 2 * rows
    cut_remark: tuple[str, ...] = ()
    if is_cut:
        _refuse_other_duration(path, lines, header, points, npts, dt)
        cut_remark = (f"the file ends before component {index} does",)
    elif len(data) != SERIES * rows:
        raise MotionFileError(
            path,
            f"the header of component {index} says {npts} points, which are {SERIES} x {rows} "
            f"lines of data, but {len(data)} follow: the file is truncated or its header wrong",
            line=points.line,
        )
    values = fixed_width_numbers(path, data[:rows], first + 1, WIDTH, PER_LINE, "acceleration")
    what = f"component {index}"
    remarks = other_count(path, npts, values.size, points.line, what, allow_partial=is_cut)
    return GroundMotion(
        values * factor,
        dt,
        station=station,
        # the file names its own trigger, not the earthquake
        event="",
        component=component,
        orientation_deg=azimuth_deg(component),
        is_vertical=is_vertical_name(component),
        recording=recording,
        source_file=path.name,
        trace_index=index,
        file_format=FORMAT,
        remarks=(*remarks, *cut_remark),
        is_partial=is_cut,
        is_corrected=True,
    )


def _refuse_other_duration(
    path: Path, lines: list[str], header: range, points: Field, npts: int, dt: float
) -> None:
    """Where lines are missing, a wrong count would take velocities for accelerations."""
    duration = find_field(path, lines, header, _DURATION, "duration")
    seconds = positive_number(path, duration, "duration")
    if abs(seconds - npts * dt) > 2.0 * dt:
        raise MotionFileError(
            path,
            f"{npts} points at dt = {dt:g} s last {npts * dt:g} s, but the header says "
            f"{duration.text} s: the number of points is wrong, and where the accelerations end "
            "is not known",
            line=points.line,
        )
