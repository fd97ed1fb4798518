"""BHRC V1 (Iran): blocks that begin with ``* VOL1DS FILE``, uncorrected, in g/10.

Each block: header lines with component, station, azimuths of the axes, number of points and
duration; 7 lines of integers and 7 of reals; then 10 samples of width 13 a line, and ``/&``.
There is no sampling interval: it is duration / number of points.
"""

from __future__ import annotations

import re

from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.record_file import RecordFile

FORMAT = "BHRC V1"

LAYOUT = (10, 13)
"""Fields a line and characters a field."""

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


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the components of a BHRC file in their order, with one recording id."""
    return [_component(file, span, index) for index, span in enumerate(file.blocks(_BLOCK))]


def _component(file: RecordFile, span: range, index: int) -> GroundMotion:
    points = file.find(span, _POINTS, "number of points")
    npts = file.count(points, "number of points")
    duration = file.find(span, _DURATION, "duration")
    unit = file.find(span, _UNIT, "unit of acceleration")
    factor = file.unit_in_g(unit)
    dt = file.dt_of_duration(duration, npts)
    first, rows = file.volume_1_data(span, unit.line)
    values = file.fixed_width(rows, first + 1, LAYOUT, "acceleration")
    remarks = file.remarks(npts, values.size, points.line, f"component {index}")
    if remarks:
        remarks += (f"dt = {dt:g} s is the duration over the number of points of the header",)

    component = file.find(span, _COMPONENT, "line 'COMP'").text
    # L1, V2, T3: the letter is the axis, the number counts the channels
    axis = component.rstrip("0123456789")
    azimuth = file.words(
        span, re.compile(rf"\bAzimuth\b.*\b{re.escape(axis)}\s+(\d+(?:\.\d+)?)", re.ASCII)
    )
    return file.motion(
        values * factor,
        dt,
        station=file.words(span, _STATION),
        event=" ".join(file.words(span, _ORIGIN).split()),
        component=component,
        orientation_deg=azimuth_deg(azimuth),
        is_vertical=is_vertical_name(axis),
        recording=file.find(span, _RECORD, "name of the record").text,
        trace_index=index,
        remarks=remarks,
        is_corrected=False,
    )
