"""CDMG V1: channel blocks of uncorrected samples as pairs of time and acceleration.

Each block: 13 text lines, 7 lines of integers, 7 of reals, then pairs (time in s, acceleration
in g/10), 5 a line in fields of 7 characters, which may touch, and a line ``/& ... END OF DATA``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from rbfrag.motions.text.record_file import PrintedTimes, RecordFile, Trace

FORMAT = "CDMG V1"

LAYOUT = (10, 7)
"""Fields a line and characters a field."""

LAST_DIGIT_S = 1.000001e-3
"""Half of it is what rounding moves a time, and the first, which others are counted from."""

_BLOCK = re.compile(r"uncorrected accelerogram data", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*chan\s*\d+\s*:\s*(\S+)", re.IGNORECASE)
_STATION = re.compile(r"^(station\s+no\..*)", re.IGNORECASE)
_POINTS = re.compile(r"no\.\s*of points\s*=\s*(\S+)", re.IGNORECASE)
_DURATION = re.compile(r"record length\s*=\s*(\S+)\s*sec", re.IGNORECASE)
_TRIGGER = re.compile(r"trigger time\s*:\s*(\S.*)", re.IGNORECASE)
_UNIT = re.compile(r"units of uncor accel are sec and\s+(g\s*/\s*10|\S*\w)", re.IGNORECASE)
_HEAD = re.compile(_BLOCK.pattern + r"(?s:.)*" + _POINTS.pattern, re.IGNORECASE)

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[Trace]:
    """Yield the channels of a V1 file in their order, with one recording id.

    A channel of zeros alone belongs to no sensor (the fourth channel of three-axis recorders);
    it is left out, and a remark of the others says so.
    """
    spans = file.blocks(_BLOCK)
    channels = [_channel(file, span) for span in spans]
    silent = [channel for channel in channels if not channel.values.any()]
    if len(silent) == len(channels):
        raise file.error("every sample of every channel is zero: this is no record")
    remarks = file.missing_channels(spans[0], len(spans))
    if silent:
        names = ", ".join(channel.component for channel in silent)
        remarks += (f"the channel {names} holds zeros only and is left out",)
    for channel in channels:
        if channel.values.any():
            yield replace(channel, remarks=remarks)


def _channel(file: RecordFile, span: range) -> Trace:
    points = file.find(span, _POINTS, "number of points")
    count = file.count(points, "number of points")
    duration = file.find(span, _DURATION, "record length")
    unit = file.find(span, _UNIT, "unit of acceleration")
    dt = file.dt_of_duration(duration, count.number)
    first, rows = file.volume_1_data(span, unit.line)
    numbers = file.fixed_width(rows, first + 1, LAYOUT, "time or acceleration")
    values = numbers[1::2]
    if not values.any():
        file.missing_samples(count, values.size)
    station = file.optional(span, _STATION)
    return Trace(
        values,
        dt,
        unit,
        count,
        component=file.find(span, _CHANNEL, "line 'CHAN'").text,
        times=PrintedTimes(numbers[0::2], LAST_DIGIT_S, first + 1, LAYOUT[0] // 2),
        station=" ".join(file.lines[station.line].split()) if station else "",
        event=file.lines[span.start + 1].strip() if len(span) > 1 else "",
        start=file.label(span, _TRIGGER),
        is_corrected=False,
    )
