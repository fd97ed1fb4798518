"""Delimited text: time and acceleration in two columns, or accelerations in one.

Columns are separated by comma, semicolon, tab or blanks. Lines beginning with ``#`` are
comments; a last comment line, or a first line of words, may name the columns with their
units, as in ``# Time (s),Acceleration (g's)``. A unit is never guessed.
"""

from __future__ import annotations

import re
from decimal import Decimal
from pathlib import Path

import numpy as np

from rbfrag.errors import InputError, MotionFileError, UnknownFormatError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text_file import finite_number
from rbfrag.motions.units import acceleration_unit, unit_in_g

FORMAT = "delimited text"

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_DATA_LINE = re.compile(rf"\s*{_NUMBER}(?:\s*[,;\s]\s*{_NUMBER})?\s*[,;]?\s*")
_SEPARATOR = re.compile(r"\s*[,;]\s*|\s+")
_ACCELERATION = re.compile(r"\bacc(?:el(?:eration)?)?\b|\ba\b", re.IGNORECASE)
_UNIT = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]")
_SUFFIX_UNIT = re.compile(r"\bacc(?:eleration)?_(g|m_s2|cm_s2|mm_s2)\b", re.IGNORECASE)
_TITLE = re.compile(r"#\s*Time Series:\s*(.+?)\s+-\s+(\S+)-([^\s,]+)[\s,]*$")


def recognises(head: str) -> bool:
    """Return whether the first lines after comments and one header line are numbers."""
    return _first_data_line(head.split("\n")[:-1] or head.split("\n")) is not None


def read(path: Path, text: str, *, units: str | None, dt_s: float | None) -> list[GroundMotion]:
    """Return the one motion of a text file.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit of acceleration, if the file does not state it.
        dt_s: sampling interval [s], if the file has no column of times.

    Raises:
        MotionFileError: a line that cannot be used, an unknown unit or sampling interval.
    """
    lines = text.split("\n")
    first = _first_data_line(lines)
    if first is None:
        raise UnknownFormatError(path, "no line of numbers was found")
    numbered = [
        (number, line.strip())
        for number, line in enumerate(lines[first:], first + 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    columns = len(_SEPARATOR.split(numbered[0][1].rstrip(",; ")))
    rows = [_fields(path, line, number, columns) for number, line in numbered]
    unit = _unit(path, lines[:first], units)
    values = np.array(
        [_number(path, row[-1], n) for row, (n, _) in zip(rows, numbered, strict=True)]
    )
    if columns == 2:
        dt = _interval(path, [row[0] for row in rows], [number for number, _ in numbered])
        if dt_s is not None and dt_s != dt:
            raise MotionFileError(
                path, f"the column of times says dt = {dt:g} s, not {dt_s:g}: leave --dt out"
            )
    elif dt_s is None:
        raise MotionFileError(
            path,
            "the file holds one column of accelerations and no times: give the sampling "
            "interval with --dt",
        )
    else:
        dt = dt_s
    event, station, component = _names(lines[:first])
    factor = unit_in_g(unit)
    return [
        GroundMotion(
            values * factor if factor != 1.0 else values,
            dt,
            station=station,
            event=event,
            component=component,
            orientation_deg=azimuth_deg(component),
            is_vertical=is_vertical_name(component),
            recording=f"{event} {station}".strip(),
            source_file=path.name,
            file_format=FORMAT,
        )
    ]


def _first_data_line(lines: list[str]) -> int | None:
    """Index of the first line of numbers: after comments, blanks and one line of words."""
    words = 0
    for index, line in enumerate(lines):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if _DATA_LINE.fullmatch(line):
            return index
        words += 1
        if words > 1:
            return None
    return None


def _fields(path: Path, line: str, number: int, columns: int) -> list[str]:
    fields = _SEPARATOR.split(line.rstrip(",; "))
    if len(fields) != columns:
        raise MotionFileError(
            path, f"{len(fields)} columns where the first line has {columns}", line=number
        )
    return fields


def _number(path: Path, text: str, line: int) -> float:
    return finite_number(path, text, line, "acceleration")


def _unit(path: Path, header: list[str], stated: str | None) -> str:
    found = _header_unit(path, header)
    if found is None:
        if stated is None:
            raise MotionFileError(
                path,
                "the file states no unit of acceleration: give it with --units g, m/s2, cm/s2 "
                "or mm/s2",
            )
        return acceleration_unit(stated)
    if stated is not None and acceleration_unit(stated) != found:
        raise MotionFileError(path, f"the header says {found}, not {stated}: leave --units out")
    return found


def _header_unit(path: Path, header: list[str]) -> str | None:
    for number, line in reversed(list(enumerate(header, 1))):
        if suffix := _SUFFIX_UNIT.search(line):
            return acceleration_unit(suffix[1].replace("_", "/"))
        named = _ACCELERATION.search(line)
        unit = _UNIT.search(line, named.end()) if named else None
        if unit:
            try:
                return acceleration_unit(unit[1])
            except InputError as error:
                raise MotionFileError(path, str(error), line=number) from None
    return None


def _interval(path: Path, times: list[str], lines: list[int]) -> float:
    """Sampling interval: the shortest decimal that gives every time as printed."""
    if len(times) < 2:
        raise MotionFileError(path, "one line of data has no sampling interval", line=lines[0])
    value = np.array(
        [finite_number(path, text, n, "time") for text, n in zip(times, lines, strict=True)]
    )
    # half a unit of the last digit of each printed time
    half = np.array([0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent) for text in times])
    slack = half + half[0] + 1e-12 * np.abs(value)
    count = np.arange(len(times))
    mean = float((value[-1] - value[0]) / count[-1])
    if not mean > 0.0:
        raise MotionFileError(path, "times do not rise", line=lines[-1])
    for digits in range(1, 17):
        dt = float(f"{mean:.{digits}g}")
        if (np.abs(value - value[0] - count * dt) <= slack).all():
            return dt
    wrong = int(np.argmax(np.abs(np.diff(value) - mean))) + 1
    raise MotionFileError(
        path,
        f"times are not equally spaced: {times[wrong - 1]} s is followed by {times[wrong]} s, "
        f"elsewhere the step is about {mean:g} s",
        line=lines[wrong],
    )


def _names(header: list[str]) -> tuple[str, str, str]:
    for line in header:
        if title := _TITLE.match(line):
            return title[1], title[2], title[3]
    return "", "", ""
