"""CSMIP/CDMG V2: channel blocks with corrected acceleration, velocity and displacement.

Each block: 25 text lines, numeric headers, then a line such as ::

    7500 points of accel data equally spaced at  .010 sec, in cm/sec2. (8f10.6)
    3251 POINTS OF ACCEL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM/SEC/SEC)

and the accelerations, 8 of width 10 a line, which may touch; then velocity and displacement in the
same way. Older files are upper case and may wrap a header line, so that lines are found by what
they say. Channels of one file may differ in length. A block ends with ``/&``.

V3 files hold spectra of such a record, which are rejected in words of their own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile, peak_of
from rbfrag.motions.text import field_layout

FORMAT = "CSMIP/CDMG V2"

END = "/&"

LAYOUT = (8, 10)
"""Fields a line and characters a field, where the file does not say."""

_BLOCK = re.compile(r"corrected accelerogram\s+\S", re.IGNORECASE)
_HEAD = re.compile(
    _BLOCK.pattern + r"(?s:.)*^\s*(?:chan\s*\d|\S+\s+points of instrument)",
    re.IGNORECASE | re.MULTILINE,
)
_RECORD = re.compile(r"^corrected accelerogram\s+(\S+)", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*chan\s*\d+\s*:\s*(\S.*?)(?:\s{2,}location:.*)?$", re.IGNORECASE)
_STATION = re.compile(r"^station\s+(?:no|id)\.?\s*(\S+)", re.IGNORECASE)
_START = re.compile(r"\b(?:start|trigger) time\s*:\s*(\S.*)", re.IGNORECASE)
_POINTS = re.compile(r"^\s*(\S+)\s+points of accel\w*\s+data", re.IGNORECASE)
_INTERVAL = re.compile(r"equally spaced at\s*(\S+)\s*sec", re.IGNORECASE)
_UNIT = re.compile(r"sec[.,\s]+(?:in\s+|\(\s*units:\s*)([a-z/0-9^*]+)", re.IGNORECASE)
_DURATION = re.compile(r"\brecord length\s*=\s*(\S+)\s*sec", re.IGNORECASE)
_PEAK = re.compile(r"^peak acceleration\s*=\s*(\S+\s+\S+)", re.IGNORECASE)
_SERIES_END = re.compile(r"\s*(?:/&|\S+\s+points of )", re.IGNORECASE)
_WIDE_GAP = re.compile(r"\s{2,}")

_SPECTRA = re.compile(r"\s*response .*\bspectra\b", re.IGNORECASE)


def recognises(head: str) -> bool:
    """Return whether a text is of V2, or contains the spectra of V3."""
    return bool(_HEAD.match(head) or _SPECTRA.match(head))


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the channels of a V2 file in their order, with one recording id."""
    if _SPECTRA.match(file.lines[0]):
        raise file.error("this is V3, with spectra: use the .v2 of the same channel", 1)
    spans = file.blocks(_BLOCK)
    remarks = file.missing_channels(spans[0], len(spans))
    for index, span in enumerate(spans):
        yield _channel(file, span, f"channel {index}", remarks)


def _channel(file: RecordFile, span: range, name: str, remarks: tuple[str, ...]) -> ParsedTrace:
    points = file.find(span, _POINTS, f"line 'points of accel data' in {name}")
    count = file.count(points, "number of points", name)
    lines = range(points.line - 1, points.line)
    dt = file.dt(file.find(lines, _INTERVAL, "sampling interval"))
    unit = file.find(lines, _UNIT, "unit of acceleration")
    layout = field_layout(file.lines[points.line - 1]) or LAYOUT
    if not file.allow_partial and not any(file.lines[at].startswith(END) for at in span):
        raise file.error(
            f"{name} does not end with a line {END}: the file is truncated; export the "
            "record again",
            span.stop,
        )
    ends = (at for at in span if at >= points.line and _SERIES_END.match(file.lines[at]))
    data = file.data(points.line, next(ends, span.stop))
    values = file.fixed_width(data, points.line + 1, layout, "acceleration")

    header = range(span.start, points.line - 1)
    channel = file.find(header, _CHANNEL, f"line 'Chan' in {name}")
    # the line after it names the event, unless it gives no more than the time of the record
    event = file.lines[channel.line].strip() if channel.line < header.stop else ""
    return ParsedTrace(
        values,
        dt,
        unit,
        count,
        component=channel.text,
        station=_station(file, file.optional(header, _STATION)),
        event="" if event.lower().startswith("rcrd of") else " ".join(event.split()),
        recording=file.find(header, _RECORD, "name of the record").text,
        start=file.label(header, _START),
        is_corrected=True,
        remarks=(*remarks, *file.location(header)),
        durations=(file.optional(header, _DURATION),),
        peak=peak_of(file.optional(header, _PEAK)),
    )


def _station(file: RecordFile, number: HeaderField | None) -> str:
    """Number and name; the name stands at the left of the line after the number."""
    if number is None:
        return ""
    name = (
        _WIDE_GAP.split(file.lines[number.line].strip())[0] if number.line < len(file.lines) else ""
    )
    return f"{number.text} {name}".strip() if not _CHANNEL.match(name) else number.text
