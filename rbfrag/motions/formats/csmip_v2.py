"""CSMIP/CDMG V2: channel blocks with corrected acceleration, velocity and displacement.

Each block: 25 text lines, numeric headers, then a line such as ::

    7500 points of accel data equally spaced at  .010 sec, in cm/sec2. (8f10.6)
    3251 POINTS OF ACCEL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM/SEC/SEC)

and the accelerations, 8 of width 10 a line, which may touch; then velocity and displacement
likewise. Older files are upper case and may wrap a header line, so that lines are found by what
they say. Channels of one file may differ in length. A block ends with ``/&``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.clock import first_sample_time
from rbfrag.motions.text.file import (
    field_layout,
    fixed_width_numbers,
    sample_count,
    without_blank_end,
)
from rbfrag.motions.text.header import (
    Field,
    agreed_dt,
    agreed_unit_in_g,
    blocks,
    find_field,
    missing_channels,
    optional_field,
    other_count,
    positive_number,
)

FORMAT = "CSMIP/CDMG V2"

END = "/&"

LAYOUT = (8, 10)
"""Fields a line and characters a field, where the file does not say."""

_BLOCK = re.compile(r"corrected accelerogram\s+\S", re.IGNORECASE)
_KIND = re.compile(r"^(?:\s*chan\s*\d|\s*\S+\s+points of instrument)", re.IGNORECASE | re.MULTILINE)
_RECORD = re.compile(r"^corrected accelerogram\s+(\S+)", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*chan\s*\d+\s*:\s*(\S.*)", re.IGNORECASE)
_STATION = re.compile(r"^station\s+(?:no|id)\.?\s*(\S+)", re.IGNORECASE)
_START = re.compile(r"\b(?:start|trigger) time\s*:\s*(\S.*)", re.IGNORECASE)
_POINTS = re.compile(r"^\s*(\S+)\s+points of accel\w*\s+data", re.IGNORECASE)
_INTERVAL = re.compile(r"equally spaced at\s*(\S+)\s*sec", re.IGNORECASE)
_UNIT = re.compile(r"sec[.,\s]+(?:in\s+|\(\s*units:\s*)([a-z/0-9^*]+)", re.IGNORECASE)
_SERIES_END = re.compile(r"\s*(?:/&|\S+\s+points of )", re.IGNORECASE)
_WIDE_GAP = re.compile(r"\s{2,}")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a CSMIP or CDMG V2 file."""
    return bool(_BLOCK.match(head)) and bool(_KIND.search(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the channels of a V2 file in their order, with one recording id.

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
    spans = blocks(path, lines, _BLOCK)
    remarks = missing_channels(lines, spans[0], len(spans))
    channels = [
        _channel(path, lines, span, index, units, dt_s, allow_partial)
        for index, span in enumerate(spans)
    ]
    return [replace(channel, remarks=(*remarks, *channel.remarks)) for channel in channels]


def _channel(
    path: Path,
    lines: list[str],
    span: range,
    index: int,
    units: str | None,
    dt_s: float | None,
    allow_partial: bool,
) -> GroundMotion:
    points = find_field(
        path, lines, span, _POINTS, f"line 'points of accel data' in channel {index}"
    )
    npts = sample_count(path, points.text, points.line, "number of points")
    here = range(points.line - 1, points.line)
    interval = find_field(path, lines, here, _INTERVAL, "sampling interval")
    dt = agreed_dt(path, positive_number(path, interval, "dt"), points.line, dt_s)
    factor = agreed_unit_in_g(
        path, find_field(path, lines, here, _UNIT, "unit of acceleration"), units
    )
    per_line, width = field_layout(lines[points.line - 1], LAYOUT) or LAYOUT
    if not allow_partial and not any(lines[at].startswith(END) for at in span):
        raise MotionFileError(
            path,
            f"channel {index} does not end with a line {END}: the file is truncated; export the "
            "record again",
            line=span.stop,
        )
    end = next((at for at in span if at >= points.line and _SERIES_END.match(lines[at])), span.stop)
    data = without_blank_end(lines[points.line : end])
    values = fixed_width_numbers(path, data, points.line + 1, width, per_line, "acceleration")
    remarks = other_count(
        path, npts, values.size, points.line, f"channel {index}", allow_partial=allow_partial
    )

    header = range(span.start, points.line - 1)
    channel = find_field(path, lines, header, _CHANNEL, f"line 'Chan' in channel {index}")
    station = optional_field(lines, header, _STATION)
    start = optional_field(lines, header, _START)
    return GroundMotion(
        values * factor,
        dt,
        station=_station(lines, station),
        event=_event(lines, channel, header.stop),
        component=channel.text,
        orientation_deg=azimuth_deg(channel.text),
        is_vertical=is_vertical_name(channel.text),
        recording=find_field(path, lines, header, _RECORD, "name of the record").text,
        source_file=path.name,
        trace_index=index,
        file_format=FORMAT,
        remarks=remarks,
        is_partial=bool(remarks),
        is_corrected=True,
        start_time=first_sample_time(start.text) if start else None,
    )


def _station(lines: Sequence[str], number: Field | None) -> str:
    """Number and name; the name stands at the left of the line after the number."""
    if number is None:
        return ""
    name = _WIDE_GAP.split(lines[number.line].strip())[0] if number.line < len(lines) else ""
    return f"{number.text} {name}".strip() if not _CHANNEL.match(name) else number.text


def _event(lines: Sequence[str], channel: Field, stop: int) -> str:
    """The line after the channel, unless it gives no more than the time of the record."""
    line = lines[channel.line].strip() if channel.line < stop else ""
    return "" if line.lower().startswith("rcrd of") else " ".join(line.split())
