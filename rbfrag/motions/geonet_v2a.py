"""GeoNet V2A: three component blocks of text, numbers and three series in fixed columns.

Each block: 16 text lines, 10 numeric lines, then acceleration, velocity and displacement,
10 values of width 8 a line in mm/s², mm/s and mm. Values may touch. Header fields are found
by what they say, not by their line.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text_file import finite_number, fixed_width_numbers, sample_count
from rbfrag.motions.units import acceleration_unit, unit_in_g

FORMAT = "GeoNet V2A"

TEXT_LINES = 16
NUMERIC_LINES = 10
PER_LINE = 10
WIDTH = 8
SERIES = 3

_BLOCK = re.compile(r"^Corrected accelerogram\s+(\S+)")
_SITE = re.compile(r"^Site\s+(\S+)")
_NPTS = re.compile(r"^Number of points\s+(\S+)")
_DT = re.compile(r"data at\s+(\S+)\s+sec intervals")
_COMPONENT = re.compile(r"^Component\s+(\S+)")
_PEAK = re.compile(r"^Acceleration:\s+peak\s+\S+\s+(\S+)")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a GeoNet V2A file."""
    return bool(_BLOCK.match(head)) and "Number of points" in head


def read(path: Path, text: str, *, units: str | None, dt_s: float | None) -> list[GroundMotion]:
    """Return the components of a V2A file in their order, with one recording id.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused when the file states another.
        dt_s: sampling interval that the caller states [s]; likewise.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    starts = [i for i, line in enumerate(lines) if _BLOCK.match(line)]
    ends = [*starts[1:], len(lines)]
    return [
        _component(path, lines, start, end, index, units, dt_s)
        for index, (start, end) in enumerate(zip(starts, ends, strict=True))
    ]


def _component(
    path: Path,
    lines: list[str],
    start: int,
    end: int,
    index: int,
    units: str | None,
    dt_s: float | None,
) -> GroundMotion:
    def field(pattern: re.Pattern[str], what: str) -> tuple[str, int]:
        for at in range(start, min(start + TEXT_LINES, end)):
            if found := pattern.search(lines[at]):
                return found[1], at + 1
        raise MotionFileError(
            path, f"component {index} has no line with its {what}", line=start + 1
        )

    recording, _ = field(_BLOCK, "accelerogram name")
    station, _ = field(_SITE, "site")
    component, _ = field(_COMPONENT, "component")
    npts_text, npts_line = field(_NPTS, "number of points")
    npts = sample_count(path, npts_text, npts_line, "number of points")
    dt_text, dt_line = field(_DT, "sampling interval")
    dt = finite_number(path, dt_text, dt_line, "sampling interval")
    if dt <= 0.0:
        raise MotionFileError(path, f"sampling interval {dt_text} s must be positive", line=dt_line)
    if dt_s is not None and dt_s != dt:
        raise MotionFileError(
            path, f"the header says {dt_text} s, not {dt_s:g}: leave --dt out", line=dt_line
        )
    unit_text, unit_line = field(_PEAK, "peak acceleration with its unit")
    try:
        unit = acceleration_unit(unit_text)
    except InputError as error:
        raise MotionFileError(path, str(error), line=unit_line) from None
    if units is not None and acceleration_unit(units) != unit:
        raise MotionFileError(
            path, f"the header says {unit_text}, not {units}: leave --units out", line=unit_line
        )

    first = start + TEXT_LINES + NUMERIC_LINES
    data = lines[first:end]
    while data and not data[-1].strip():
        data.pop()
    rows = -(-npts // PER_LINE)
    if len(data) != SERIES * rows:
        raise MotionFileError(
            path,
            f"the header of component {index} says {npts} points, which are {SERIES} x {rows} "
            f"lines of data, but {len(data)} follow: the file is truncated or its header wrong",
            line=npts_line,
        )
    values = fixed_width_numbers(path, data[:rows], first + 1, WIDTH, "acceleration")
    if values.size != npts:
        raise MotionFileError(
            path,
            f"the header of component {index} says {npts} points, but {values.size} "
            "accelerations follow",
            line=npts_line,
        )
    return GroundMotion(
        values * unit_in_g(unit),
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
    )
