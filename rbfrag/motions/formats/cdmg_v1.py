"""CDMG V1: channel blocks of uncorrected samples as pairs of time and acceleration.

Each block: 13 text lines, 7 lines of integers, 7 of reals, then pairs (time in s, acceleration
in g/10), 5 a line in fields of 7 characters, which may touch, and a line ``/& ... END OF DATA``.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.formats.volume_1 import data_lines
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.clock import first_sample_time
from rbfrag.motions.text.file import fixed_width_numbers, sample_count
from rbfrag.motions.text.header import (
    agreed_dt,
    agreed_unit_in_g,
    blocks,
    find_field,
    interval_of_duration,
    missing_channels,
    optional_field,
    other_count,
)
from rbfrag.motions.text.times import refuse_other_times

FORMAT = "CDMG V1"

WIDTH = 7
PER_LINE = 10
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


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the channels of a V1 file in their order, with one recording id.

    A channel of zeros alone belongs to no sensor (the fourth channel of three-axis recorders);
    it is left out, and a remark of the others says so.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused, as the file's own is g/10.
        dt_s: sampling interval that the caller states [s]; refused when the file states another.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    spans = blocks(path, lines, _BLOCK)
    channels = [_channel(path, lines, span, units, dt_s, allow_partial) for span in spans]
    moving = [channel for channel in channels if channel.acceleration_g.any()]
    still = [channel.component for channel in channels if not channel.acceleration_g.any()]
    if not moving:
        raise MotionFileError(path, "every sample of every channel is zero: this is no record")
    remarks = missing_channels(lines, spans[0], len(spans))
    if still:
        remarks += (f"the channel {', '.join(still)} holds zeros only and is left out",)
    return [
        replace(channel, trace_index=index, remarks=(*remarks, *channel.remarks))
        for index, channel in enumerate(moving)
    ]


def _channel(
    path: Path,
    lines: list[str],
    span: range,
    units: str | None,
    dt_s: float | None,
    allow_partial: bool,
) -> GroundMotion:
    points = find_field(path, lines, span, _POINTS, "number of points")
    npts = sample_count(path, points.text, points.line, "number of points")
    duration = find_field(path, lines, span, _DURATION, "record length")
    unit = find_field(path, lines, span, _UNIT, "unit of acceleration")
    factor = agreed_unit_in_g(path, unit, units)
    dt = agreed_dt(path, interval_of_duration(path, duration, npts), duration.line, dt_s)
    first, rows = data_lines(path, lines, span, unit.line)
    numbers = fixed_width_numbers(path, rows, first + 1, WIDTH, PER_LINE, "time or acceleration")
    times, values = numbers[0::2], numbers[1::2]
    remarks = other_count(path, npts, values.size, points.line, allow_partial=allow_partial)
    if times.size != values.size:
        raise MotionFileError(
            path, "the last time has no acceleration: the file is truncated", line=first + len(rows)
        )
    refuse_other_times(path, times, dt, TIME_DECIMALS, first + 1, PER_LINE // 2)
    channel = find_field(path, lines, span, _CHANNEL, "line 'CHAN'")
    station = optional_field(lines, span, _STATION)
    trigger = optional_field(lines, span, _TRIGGER)
    event = lines[span.start + 1].strip() if len(span) > 1 else ""
    name = " ".join(lines[station.line].split()) if station else ""
    return GroundMotion(
        values * factor,
        dt,
        station=name,
        event=event,
        component=channel.text,
        orientation_deg=azimuth_deg(channel.text),
        is_vertical=is_vertical_name(channel.text),
        recording=f"{event} {name}".strip(),
        source_file=path.name,
        file_format=FORMAT,
        remarks=remarks,
        is_partial=bool(remarks),
        is_corrected=False,
        start_time=first_sample_time(trigger.text) if trigger else None,
    )
