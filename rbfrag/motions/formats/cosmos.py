"""COSMOS strong-motion data format, volumes 1 and 2 in physical units (V1c, V2c).

Text lines, an integer and a real header of 100 values each, comment lines, then a line such as ::

    19200 acceleration pts, approx  192 secs, units=cm/sec2(04),Format=(1E15.6)

the samples, and ``End-of-data``. The sampling interval is the 62nd value of the real header, in
milliseconds (COSMOS Strong Motion Data Format v1.20, 2001); the 34th is the raw record's and may
differ. A file may hold several channels, and velocities and displacements, which are passed over.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.clock import first_sample_time
from rbfrag.motions.text.file import (
    field_layout,
    finite_number,
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
    optional_field,
    other_count,
)

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


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the accelerations of a COSMOS file in their order.

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
    motions: list[GroundMotion] = []
    others: list[str] = []
    for span in blocks(path, lines, _BLOCK):
        series = find_field(path, lines, span, _SERIES, "line '... acceleration pts, ...'")
        quantity = _POINTS.search(series.text)
        if quantity and not quantity[2].lower().startswith("accel"):
            others.append(quantity[2])
            continue
        motions.append(_trace(path, lines, span, series, len(motions), units, dt_s, allow_partial))
    if not motions:
        raise MotionFileError(
            path, f"the file holds {', '.join(others)}: the acceleration is needed"
        )
    return motions


def _trace(
    path: Path,
    lines: list[str],
    span: range,
    series: Field,
    index: int,
    units: str | None,
    dt_s: float | None,
    allow_partial: bool,
) -> GroundMotion:
    here = range(series.line - 1, series.line)
    points = find_field(path, lines, here, _POINTS, "number of points")
    npts = sample_count(path, points.text, points.line, "number of points")
    factor = agreed_unit_in_g(
        path, find_field(path, lines, here, _UNIT, "unit of acceleration"), units
    )
    header = range(span.start, series.line - 1)
    dt = agreed_dt(path, *_interval(path, lines, header), dt_s)
    _check_duration(path, lines, here, npts, dt)
    per_line, width = _layout(path, series)
    end = next((at for at in span if at >= series.line and _END.match(lines[at])), span.stop)
    data = without_blank_end(lines[series.line : end])
    values = fixed_width_numbers(path, data, series.line + 1, width, per_line, "acceleration")
    remarks = other_count(path, npts, values.size, series.line, allow_partial=allow_partial)

    channel = optional_field(lines, header, _CHANNEL)
    direction = channel.text if channel else ""
    seed = optional_field(lines, header, _SCNL)
    component = seed.text if seed else direction
    station = optional_field(lines, header, _STATION)
    start = optional_field(lines, header, _START)
    event = optional_field(lines, header, _EVENT)
    name = station.text if station else ""
    azimuth, vertical = azimuth_deg(direction), is_vertical_name(direction)
    record = optional_field(lines, header, _RECORD)
    return GroundMotion(
        values * factor,
        dt,
        station=name,
        event=event.text if event else "",
        component=component,
        orientation_deg=azimuth if direction else azimuth_deg(component),
        is_vertical=vertical if vertical is not None else is_vertical_name(component),
        recording=_without(record.text, component)
        if record
        else f"{event.text if event else ''} {name}".strip(),
        source_file=path.name,
        trace_index=index,
        file_format=FORMAT,
        remarks=remarks,
        is_partial=bool(remarks),
        is_corrected=not lines[span.start].strip().lower().startswith("uncorrected"),
        start_time=first_sample_time(start.text) if start else None,
    )


def _interval(path: Path, lines: list[str], header: range) -> tuple[float, int]:
    """Sampling interval [s] and its line."""
    reals = find_field(path, lines, header, _REALS, "line 'Real-header values follow'")
    per_line, width = _layout(path, reals)
    row, place = divmod(DT_MS_VALUE - 1, per_line)
    at = reals.line + row
    what = f"real-header value {DT_MS_VALUE}, the sampling interval in ms"
    if at >= header.stop:
        raise MotionFileError(
            path, f"the header ends before {what}: export the record again", line=reals.line
        )
    shown = lines[at][place * width : (place + 1) * width].strip()
    milliseconds = finite_number(path, shown, at + 1, what)
    if milliseconds <= 0.0:
        raise MotionFileError(
            path, f"{what} is {shown}, which means unknown: the record cannot be used", line=at + 1
        )
    return milliseconds / 1000.0, at + 1


def _check_duration(path: Path, lines: list[str], here: range, npts: int, dt: float) -> None:
    field = optional_field(lines, here, _SECONDS)
    if field is None:
        return
    seconds = finite_number(path, field.text, field.line, "approximate duration")
    if abs(seconds - npts * dt) > DURATION_S + DURATION_SHARE * seconds:
        raise MotionFileError(
            path,
            f"{npts} points at dt = {dt:g} s last {npts * dt:g} s, but the header says approx "
            f"{field.text} s: correct the header",
            line=field.line,
        )


def _layout(path: Path, field: Field) -> tuple[int, int]:
    layout = field_layout(field.text)
    if layout is None:
        raise MotionFileError(path, "the line names no format such as (8F10.3)", line=field.line)
    return layout


def _without(record: str, component: str) -> str:
    """Record id without its channel: NN.00725272.CI.MLAC.HNE.-- names one of three."""
    return ".".join(part for part in record.split(".") if part not in (component, "--"))
