"""CDMG V1: channel blocks of uncorrected samples as pairs of time and acceleration.

Each block: 13 text lines, 7 lines of integers, 7 of reals, then pairs (time in s, acceleration
in g/10), 5 a line in fields of 7 characters, which may touch, and a line ``/& ... END OF DATA``.
"""

from __future__ import annotations

import re
from dataclasses import replace

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.record_file import RecordFile

FORMAT = "CDMG V1"

LAYOUT = (10, 7)
"""Fields a line and characters a field."""

TIME_DECIMALS = 3

_BLOCK = re.compile(r"uncorrected accelerogram data", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*chan\s*\d+\s*:\s*(\S+)", re.IGNORECASE)
_STATION = re.compile(r"^(station\s+no\..*)", re.IGNORECASE)
_POINTS = re.compile(r"no\.\s*of points\s*=\s*(\S+)", re.IGNORECASE)
_DURATION = re.compile(r"record length\s*=\s*(\S+)\s*sec", re.IGNORECASE)
_TRIGGER = re.compile(r"trigger time\s*:\s*(\S.*)", re.IGNORECASE)
_UNIT = re.compile(r"units of uncor accel are sec and\s+(g\s*/\s*10|\S*\w)", re.IGNORECASE)


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a CDMG V1 file."""
    return bool(_BLOCK.match(head)) and bool(_POINTS.search(head))


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the channels of a V1 file in their order, with one recording id.

    A channel of zeros alone belongs to no sensor (the fourth channel of three-axis recorders);
    it is left out, and a remark of the others says so.
    """
    spans = file.blocks(_BLOCK)
    channels = [_channel(file, span) for span in spans]
    moving = [channel for channel in channels if channel.acceleration_g.any()]
    silent = [channel.component for channel in channels if not channel.acceleration_g.any()]
    if not moving:
        raise file.error("every sample of every channel is zero: this is no record")
    remarks = file.missing_channels(spans[0], len(spans))
    if silent:
        remarks += (f"the channel {', '.join(silent)} holds zeros only and is left out",)
    return [
        replace(channel, trace_index=index, remarks=(*remarks, *channel.remarks))
        for index, channel in enumerate(moving)
    ]


def _channel(file: RecordFile, span: range) -> GroundMotion:
    points = file.find(span, _POINTS, "number of points")
    npts = file.count(points, "number of points")
    duration = file.find(span, _DURATION, "record length")
    unit = file.find(span, _UNIT, "unit of acceleration")
    factor = file.unit_in_g(unit)
    dt = file.dt_of_duration(duration, npts)
    first, rows = file.volume_1_data(span, unit.line)
    numbers = file.fixed_width(rows, first + 1, LAYOUT, "time or acceleration")
    times, values = numbers[0::2], numbers[1::2]
    remarks = file.remarks(npts, values.size, points.line)
    if times.size != values.size:
        raise file.error(
            "the last time has no acceleration: the file is truncated", first + len(rows)
        )
    file.refuse_other_times(times, dt, TIME_DECIMALS, first + 1, LAYOUT[0] // 2)
    station = file.optional(span, _STATION)
    return file.motion(
        values * factor,
        dt,
        station=" ".join(file.lines[station.line].split()) if station else "",
        event=file.lines[span.start + 1].strip() if len(span) > 1 else "",
        component=file.find(span, _CHANNEL, "line 'CHAN'").text,
        remarks=remarks,
        is_corrected=False,
        start=file.words(span, _TRIGGER),
    )
