"""BHRC V1 (Iran): blocks that begin with ``* VOL1DS FILE``, uncorrected, in g/10.

Each block: header lines with component, station, azimuths of the axes, number of points and
duration; 7 lines of integers and 7 of reals; then 10 samples of width 13 a line, and ``/&``.
There is no sampling interval: it is duration / number of points.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.formats.volume_1 import data_lines
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import fixed_width_numbers, sample_count
from rbfrag.motions.text.header import (
    agreed_dt,
    agreed_unit_in_g,
    blocks,
    find_field,
    interval_of_duration,
    optional_field,
    other_count,
)

FORMAT = "BHRC V1"

WIDTH = 13
PER_LINE = 10

_BLOCK = re.compile(r"\s*\*\s*VOL1DS FILE", re.IGNORECASE)
_RECORD = re.compile(r"VOL1DS FILE:\s*(\S+)", re.IGNORECASE)
_COMPONENT = re.compile(r"^\s*COMP\s+(\S+)")
_STATION = re.compile(r"^(.*\S)\s+Station\s.*\bAltitude\b")
_ORIGIN = re.compile(r"^\s*Origin Time\s*:\s*(\S.*)")
_POINTS = re.compile(r"NO\.\s*OF POINTS\s*=\s*(\S+)", re.IGNORECASE)
_DURATION = re.compile(r"DURATION\s*=\s*(\S+)", re.IGNORECASE)
_UNIT = re.compile(r"UNITS ARE SECONDS AND\s+(g\s*/\s*10|\S+)", re.IGNORECASE)


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a BHRC V1 file."""
    return bool(_BLOCK.match(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the components of a BHRC file in their order, with one recording id.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused, as the file's own is g/10.
        dt_s: sampling interval that the caller states [s]; refused when the file has another.
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
    points = find_field(path, lines, span, _POINTS, "number of points")
    npts = sample_count(path, points.text, points.line, "number of points")
    duration = find_field(path, lines, span, _DURATION, "duration")
    unit = find_field(path, lines, span, _UNIT, "unit of acceleration")
    factor = agreed_unit_in_g(path, unit, units)
    dt = agreed_dt(path, interval_of_duration(path, duration, npts), duration.line, dt_s)
    first, rows = data_lines(path, lines, span, unit.line)
    values = fixed_width_numbers(path, rows, first + 1, WIDTH, PER_LINE, "acceleration")
    remarks = other_count(
        path, npts, values.size, points.line, f"component {index}", allow_partial=allow_partial
    )
    if remarks:
        remarks += (f"dt = {dt:g} s is the duration over the number of points of the header",)

    component = find_field(path, lines, span, _COMPONENT, "line 'COMP'").text
    station = optional_field(lines, span, _STATION)
    origin = optional_field(lines, span, _ORIGIN)
    # L1, V2, T3: the letter is the axis, the number counts the channels
    axis = component.rstrip("0123456789")
    azimuth = optional_field(
        lines, span, re.compile(rf"\bAzimuth\b.*\b{re.escape(axis)}\s+(\d+(?:\.\d+)?)", re.ASCII)
    )
    return GroundMotion(
        values * factor,
        dt,
        station=station.text if station else "",
        event=" ".join(origin.text.split()) if origin else "",
        component=component,
        orientation_deg=azimuth_deg(azimuth.text) if azimuth else None,
        is_vertical=is_vertical_name(axis),
        recording=find_field(path, lines, span, _RECORD, "name of the record").text,
        source_file=path.name,
        trace_index=index,
        file_format=FORMAT,
        remarks=remarks,
        is_partial=bool(remarks),
        is_corrected=False,
    )
