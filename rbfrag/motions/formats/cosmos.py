"""COSMOS strong-motion data format, volumes 1 and 2 in physical units (V1c, V2c).

Text lines, an integer and a real header of 100 values each, comment lines, then a line such as ::

    19200 acceleration pts, approx  192 secs, units=cm/sec2(04),Format=(1E15.6)

the samples, and ``End-of-data``. The sampling interval is the 62nd value of the real header, in
milliseconds (COSMOS Strong Motion Data Format v1.20, 2001); the 34th is the raw record's and may
differ. A file may hold several channels, and velocities and displacements, which are passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.direction import is_vertical_name
from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile, peak_of
from rbfrag.motions.text import field_layout, finite_number

FORMAT = "COSMOS V1c/V2c"

DT_MS_VALUE = 62
"""Place of the sampling interval in the real header, from 1."""

_BLOCK = re.compile(r"[^\S\n]*[A-Za-z].*\(Format v\S* with[^\S\n]*\d+ text lines\)", re.IGNORECASE)
_REALS = re.compile(r"^(\s*\d+\s+Real-header values follow on.*)", re.IGNORECASE)
_SERIES = re.compile(r"^(\s*\S+\s+\w+\s+pts,\s*approx.*)", re.IGNORECASE)
_POINTS = re.compile(r"^\s*(\S+)\s+(\w+)\s+pts", re.IGNORECASE)
_SECONDS = re.compile(r"approx\s+(\S+)\s+secs?", re.IGNORECASE)
_UNIT = re.compile(r"units\s*=\s*([^\s,(]+)", re.IGNORECASE)
_END = re.compile(r"\s*End-of-data", re.IGNORECASE)
_EVENT = re.compile(r"^\s*Record of\s+(\S.*)", re.IGNORECASE)
_START = re.compile(r"^\s*Rcrd start time:\s*(\S.*)", re.IGNORECASE)
_STATION = re.compile(r"^\s*Statn No:.*\bCode:\s*(\S+)", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*Sta Chan\s+[^:]*:\s*([^(]*)", re.IGNORECASE)
_SCNL = re.compile(r"<SCNL>\s*[^.\s]+\.([^.\s]+)\.")
_PEAK = re.compile(r"^Processed:.*\bMax\s*=\s*(\S+\s+[^\s,]+)", re.IGNORECASE)
_RECORD = re.compile(r"^\|.*\bRcrdId:\s*(\S+)", re.IGNORECASE)

recognises = _BLOCK.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the accelerations of a COSMOS file in their order."""
    quantities: list[str] = []
    spans = file.blocks(_BLOCK)
    for span in spans:
        series = file.find(span, _SERIES, "line '... acceleration pts, ...'")
        quantity = _POINTS.search(series.text)
        if quantity and not quantity[2].lower().startswith("accel"):
            quantities.append(quantity[2])
        else:
            yield _trace(file, span, series)
    if len(quantities) == len(spans):
        raise file.error(f"the file has {', '.join(quantities)}: the acceleration is required")


def _trace(file: RecordFile, span: range, series: HeaderField) -> ParsedTrace:
    lines = range(series.line - 1, series.line)
    count = file.count(file.find(lines, _POINTS, "number of points"), "number of points")
    unit = file.find(lines, _UNIT, "unit of acceleration")
    header = range(span.start, series.line - 1)
    dt = file.possible_dt(*_interval(file, header))
    ends = (at for at in span if at >= series.line and _END.match(file.lines[at]))
    data = file.data(series.line, next(ends, span.stop))
    values = file.fixed_width(data, series.line + 1, _layout(file, series), "acceleration")
    direction = file.label(header, _CHANNEL)
    component = file.label(header, _SCNL) or direction
    record = file.label(header, _RECORD)
    return ParsedTrace(
        values,
        dt,
        unit,
        count,
        component,
        axis=component if is_vertical_name(direction) is None else direction,
        station=file.label(header, _STATION),
        event=file.label(header, _EVENT),
        # NN.00725272.CI.MLAC.HNE.-- names one of three channels
        recording=".".join(part for part in record.split(".") if part not in (component, "--"))
        if record
        else None,
        start=file.label(header, _START),
        is_corrected=not file.lines[span.start].strip().lower().startswith("uncorrected"),
        remarks=file.location(header),
        durations=(file.optional(lines, _SECONDS),),
        peak=peak_of(file.optional(header, _PEAK)),
    )


def _interval(file: RecordFile, header: range) -> tuple[float, int]:
    """Sampling interval [s] and its line."""
    reals = file.find(header, _REALS, "line 'Real-header values follow'")
    per_line, width = _layout(file, reals)
    row, place = divmod(DT_MS_VALUE - 1, per_line)
    at = reals.line + row
    description = f"real-header value {DT_MS_VALUE}, the sampling interval in ms"
    if at >= header.stop:
        raise file.error(
            f"the header ends before {description}: export the record again", reals.line
        )
    shown = file.lines[at][place * width : (place + 1) * width].strip()
    milliseconds = finite_number(file.path, shown, at + 1, description)
    if milliseconds <= 0.0:
        raise file.error(
            f"{description} is {shown}, that is, unknown: the record is not usable", at + 1
        )
    return milliseconds / 1000.0, at + 1


def _layout(file: RecordFile, field: HeaderField) -> tuple[int, int]:
    layout = field_layout(field.text)
    if layout is None:
        raise file.error("the line has no format such as (8F10.3)", field.line)
    return layout
