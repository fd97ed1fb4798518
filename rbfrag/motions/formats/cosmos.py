"""COSMOS strong-motion data format, volumes 1 and 2 in physical units (V1c, V2c).

Text lines, an integer and a real header of 100 values each, comment lines, then a line such as ::

    19200 acceleration pts, approx  192 secs, units=cm/sec2(04),Format=(1E15.6)

the samples, and ``End-of-data``. The sampling interval is the 62nd value of the real header, in
milliseconds (COSMOS Strong Motion Data Format v1.20, 2001); the 34th is the raw record's and may
differ. A file may hold several channels, and velocities and displacements, which are passed over.
"""

from __future__ import annotations

import re

from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import field_layout, finite_number
from rbfrag.motions.text.record_file import Field, RecordFile

FORMAT = "COSMOS V1c/V2c"

DT_MS_VALUE = 62
"""Place of the sampling interval in the real header, from 1."""

DURATION_SHARE = 0.02
DURATION_S = 2.0
"""How far the "approx" seconds may be from npts * dt; a wrong unit of dt is far beyond."""

_BLOCK = re.compile(r"\s*[A-Za-z].*\(Format v\S* with\s*\d+ text lines\)", re.IGNORECASE)
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
_RECORD = re.compile(r"^\|.*\bRcrdId:\s*(\S+)", re.IGNORECASE)


def recognises(head: str) -> bool:
    """Return whether the first line is that of a COSMOS file."""
    return bool(_BLOCK.match(head.split("\n", 1)[0]))


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the accelerations of a COSMOS file in their order."""
    motions: list[GroundMotion] = []
    others: list[str] = []
    for span in file.blocks(_BLOCK):
        series = file.find(span, _SERIES, "line '... acceleration pts, ...'")
        quantity = _POINTS.search(series.text)
        if quantity and not quantity[2].lower().startswith("accel"):
            others.append(quantity[2])
            continue
        motions.append(_trace(file, span, series, len(motions)))
    if not motions:
        raise file.error(f"the file holds {', '.join(others)}: the acceleration is needed")
    return motions


def _trace(file: RecordFile, span: range, series: Field, index: int) -> GroundMotion:
    here = range(series.line - 1, series.line)
    npts = file.count(file.find(here, _POINTS, "number of points"), "number of points")
    factor = file.unit_in_g(file.find(here, _UNIT, "unit of acceleration"))
    header = range(span.start, series.line - 1)
    dt = file.agreed_dt(*_interval(file, header))
    _check_duration(file, here, npts, dt)
    ends = (at for at in span if at >= series.line and _END.match(file.lines[at]))
    data = file.data(series.line, next(ends, span.stop))
    values = file.fixed_width(data, series.line + 1, _layout(file, series), "acceleration")
    remarks = file.remarks(npts, values.size, series.line)

    direction = file.words(header, _CHANNEL)
    component = file.words(header, _SCNL) or direction
    vertical = is_vertical_name(direction)
    record = file.words(header, _RECORD)
    return file.motion(
        values * factor,
        dt,
        station=file.words(header, _STATION),
        event=file.words(header, _EVENT),
        component=component,
        orientation_deg=azimuth_deg(direction or component),
        is_vertical=vertical if vertical is not None else is_vertical_name(component),
        recording=_without(record, component) if record else None,
        trace_index=index,
        remarks=remarks,
        is_corrected=not file.lines[span.start].strip().lower().startswith("uncorrected"),
        start=file.words(header, _START),
    )


def _interval(file: RecordFile, header: range) -> tuple[float, int]:
    """Sampling interval [s] and its line."""
    reals = file.find(header, _REALS, "line 'Real-header values follow'")
    per_line, width = _layout(file, reals)
    row, place = divmod(DT_MS_VALUE - 1, per_line)
    at = reals.line + row
    what = f"real-header value {DT_MS_VALUE}, the sampling interval in ms"
    if at >= header.stop:
        raise file.error(f"the header ends before {what}: export the record again", reals.line)
    shown = file.lines[at][place * width : (place + 1) * width].strip()
    milliseconds = finite_number(file.path, shown, at + 1, what)
    if milliseconds <= 0.0:
        raise file.error(
            f"{what} is {shown}, which means unknown: the record cannot be used", at + 1
        )
    return milliseconds / 1000.0, at + 1


def _check_duration(file: RecordFile, here: range, npts: int, dt: float) -> None:
    field = file.optional(here, _SECONDS)
    if field is None:
        return
    seconds = finite_number(file.path, field.text, field.line, "approximate duration")
    if abs(seconds - npts * dt) > DURATION_S + DURATION_SHARE * seconds:
        raise file.error(
            f"{npts} points at dt = {dt:g} s last {npts * dt:g} s, but the header says approx "
            f"{field.text} s: correct the header",
            field.line,
        )


def _layout(file: RecordFile, field: Field) -> tuple[int, int]:
    layout = field_layout(field.text)
    if layout is None:
        raise file.error("the line names no format such as (8F10.3)", field.line)
    return layout


def _without(record: str, component: str) -> str:
    """Record id without its channel: NN.00725272.CI.MLAC.HNE.-- names one of three."""
    return ".".join(part for part in record.split(".") if part not in (component, "--"))
