"""CDMG and CSMIP V1: channel blocks of uncorrected samples.

Each block: 13 text lines, 7 lines of integers, 7 of reals, the samples, and a line ``/& ... END OF
DATA``. The samples are pairs (time in s, acceleration in g/10), 5 a line in fields of 7 characters,
which may touch; or, since the 1990s, accelerations alone below a line such as ::

    13400 Accelerogram points at 200 pts/sec in units of g.       Format: (8f9.6)
    12001 POINTS OF ACCEL DATA EQUALLY SPACED AT .005 SEC.  (UNITS: G)
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from rbfrag.motions.record_file import (
    Count,
    HeaderField,
    ParsedTrace,
    PrintedTimes,
    RecordFile,
    peak_of,
)
from rbfrag.motions.text import field_layout

FORMAT = "CDMG V1"

LAYOUT = (10, 7)
"""Fields a line and characters a field, of pairs."""

SERIES_LAYOUT = (8, 9)
"""The same of accelerations alone, where the file does not say."""

LAST_DIGIT_S = 1.000001e-3
"""Half of it is what rounding moves a time, and the first, which others are counted from."""

_BLOCK = re.compile(r"uncorrected accelerogram data", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*chan\s*\d+\s*:\s*(\S+)", re.IGNORECASE)
_STATION = re.compile(r"^(station\s+no\..*)", re.IGNORECASE)
_POINTS = re.compile(r"no\.\s*of points\s*=\s*(\S+)", re.IGNORECASE)
_DURATION = re.compile(r"record length\s*=\s*(\S+)\s*sec", re.IGNORECASE)
_TRIGGER = re.compile(r"trigger time\s*:\s*(\S.*)", re.IGNORECASE)
_UNIT = re.compile(
    r"units of uncor \w+ (?:are sec and|is|are)\s+(g\s*/\s*10\b|\S*\w)", re.IGNORECASE
)
_SERIES = re.compile(
    r"^\s*(\d+)\s+(?:accelerogram points|points of accel\w*\s+data)\b", re.IGNORECASE
)
_SERIES_UNIT = re.compile(r"(?:\bin units of\s+|\bunits:\s*)(g\s*/\s*10\b|\S*\w)", re.IGNORECASE)
_RATE = re.compile(r"\bat\s+(\S+)\s*pts\s*/\s*sec", re.IGNORECASE)
_INTERVAL = re.compile(r"equally spaced at\s*(\S+)\s*sec", re.IGNORECASE)
_PEAK = re.compile(r"\bmax\s*=\s*(\S+\s+g)\b", re.IGNORECASE)
_HEAD = re.compile(_BLOCK.pattern + r"(?s:.)*" + _POINTS.pattern, re.IGNORECASE)

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the channels of a V1 file in their order, with one recording id.

    A channel of zeros alone belongs to no sensor (the fourth channel of three-axis recorders);
    it is left out, and a remark of the others says so.
    """
    spans = file.blocks(_BLOCK)
    channels = [_channel(file, span) for span in spans]
    silent = [channel for channel in channels if not channel.values.any()]
    if len(silent) == len(channels):
        raise file.error("every sample of every channel is zero: not a record")
    remarks = file.missing_channels(spans[0], len(spans))
    if silent:
        names = ", ".join(channel.component for channel in silent)
        remarks += (f"the channel {names} holds zeros only and is left out",)
    for channel in channels:
        if channel.values.any():
            yield replace(channel, remarks=(*remarks, *channel.remarks))


def _channel(file: RecordFile, span: range) -> ParsedTrace:
    points = file.find(span, _POINTS, "number of points")
    count = file.count(points, "number of points")
    duration = file.find(span, _DURATION, "record length")
    unit = file.optional(span, _UNIT)
    first, rows = file.volume_1_data(span, unit.line if unit else duration.line)
    times = None
    if _SERIES.match(file.lines[first]):
        dt, unit = _series(file, first, count, unit)
        layout = field_layout(file.lines[first]) or SERIES_LAYOUT
        values = file.fixed_width(rows[1:], first + 2, layout, "acceleration")
    else:
        unit = unit or file.find(span, _UNIT, "unit of acceleration")
        dt = file.dt_of_duration(duration, count.number)
        numbers = file.fixed_width(rows, first + 1, LAYOUT, "time or acceleration")
        values = numbers[1::2]
        times = PrintedTimes(numbers[0::2], LAST_DIGIT_S, first + 1, LAYOUT[0] // 2)
    if not values.any():
        file.missing_samples(count, values.size)
    station = file.optional(span, _STATION)
    return ParsedTrace(
        values,
        dt,
        unit,
        count,
        component=file.find(span, _CHANNEL, "line 'CHAN'").text,
        times=times,
        station=" ".join(file.lines[station.line].split()) if station else "",
        event=file.lines[span.start + 1].strip() if len(span) > 1 else "",
        start=file.label(span, _TRIGGER),
        is_corrected=False,
        remarks=file.location(span),
        durations=(duration,),
        peak=peak_of(file.optional(span, _PEAK)),
    )


def _series(
    file: RecordFile, at: int, count: Count, above: HeaderField | None
) -> tuple[float, HeaderField]:
    """Return interval [s] and unit of accelerations alone, by the line of an index above them.

    The unit must agree with what the text lines say, where they say it.
    """
    lines = range(at, at + 1)
    points = file.find(lines, _SERIES, "number of points")
    if file.count(points, "number of points").number != count.number:
        raise file.error(
            f"{points.text} points follow by this line, but {count.number:.12g} by line "
            f"{count.line}: export the record again",
            points.line,
        )
    rate = file.optional(lines, _RATE)
    if rate is None:
        dt = file.dt(file.find(lines, _INTERVAL, "sampling interval"))
    else:
        dt = file.possible_dt(1.0 / file.positive(rate, "number of points a second"), rate.line)
    unit = file.optional(lines, _SERIES_UNIT) or above
    if unit is None:
        unit = file.find(lines, _SERIES_UNIT, "unit of acceleration")
    if above is not None and _spelling(above) != _spelling(unit):
        raise file.error(
            f"the samples are in {unit.text} by this line, but in {above.text} by line "
            f"{above.line}: correct one of them",
            unit.line,
        )
    return dt, unit


def _spelling(unit: HeaderField) -> str:
    return unit.text.replace(" ", "").lower()
