"""What the header of a two-column text says: the unit, and whose record it is."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.units import acceleration_unit

_ACCELERATION = re.compile(r"(?<![A-Za-z])(?:acc|a(?![A-Za-z]))", re.IGNORECASE)
_OTHER_QUANTITY = re.compile(r"(?<![A-Za-z])(vel|displ?)[a-z]*", re.IGNORECASE)
_TIME = re.compile(r"(?<![A-Za-z])(?:time|t)(?![A-Za-z])", re.IGNORECASE)

_ACCELERATION_UNIT = re.compile(
    r"(?<![A-Za-z])(?:acc[^,;\t()\[\]]*|a\s*)[(\[]\s*([^)\]]+?)\s*[)\]]", re.IGNORECASE
)
_ACCELERATION_SUFFIX = re.compile(
    r"(?<![A-Za-z])acc[a-z]*(?:_|\s+in\s+)(g|gal|[cm]?m[_/]s(?:ec)?(?:\^|\*\*)?2)(?![A-Za-z0-9])",
    re.IGNORECASE,
)
_UNITS_WORD = re.compile(
    r"(?<![A-Za-z])units?\s*(?:of\s+acc[a-z]*\s*)?(?:[:=]|\bof\b|\bare\b|\bin\b)\s*([^\s,;()\[\]]+)",
    re.IGNORECASE,
)
_TIME_UNIT = re.compile(
    r"(?<![A-Za-z])(?:time[^,;\t()\[\]]*|t\s*)[(\[]\s*([^)\]]+?)\s*[)\]]", re.IGNORECASE
)
_SECONDS = frozenset({"s", "sec", "sec.", "secs", "second", "seconds"})

_TITLE = re.compile(
    r"#\s*(?:Time Series:\s*)?(?P<event>\S.*?\b(?:18|19|20)\d\d)\s+-\s+"
    r"(?P<station>\S+)-(?P<component>[A-Za-z0-9]+)[\s,;]*",
    re.IGNORECASE,
)

Header = Sequence[tuple[int, str]]
"""Lines above the data with their 1-based numbers."""


def stated_unit(path: Path, header: Header, units: str | None) -> str:
    """Return the standard name of the unit of acceleration; it is never guessed.

    Args:
        path: for messages.
        header: the lines above the data.
        units: unit that the caller states, or None.

    Raises:
        MotionFileError: nobody states the unit, or header and caller disagree, or the columns
            are not time in seconds and acceleration.
    """
    _check_columns(path, header)
    found: tuple[int, str, str] | None = None
    unknown: tuple[int, str] | None = None
    for number, spelling in _spellings(header):
        try:
            unit = acceleration_unit(spelling)
        except InputError:
            unknown = unknown or (number, spelling)
            continue
        if found is not None and found[2] != unit:
            raise MotionFileError(
                path,
                f"the header says {spelling}, but {found[1]} on line {found[0]}: correct it",
                line=number,
            )
        found = found or (number, spelling, unit)
    if found is None and unknown is not None:
        number, spelling = unknown
        raise MotionFileError(
            path,
            f"the header gives the acceleration in {spelling!r}, which is no known unit: convert "
            "the record to g, m/s2, cm/s2 or mm/s2",
            line=number,
        )
    if found is None and units is None:
        raise MotionFileError(
            path,
            "the file states no unit of acceleration, and it is never guessed: give it with "
            "--units g, m/s2, cm/s2 or mm/s2",
        )
    if found is None:
        assert units is not None
        return acceleration_unit(units)
    if units is not None and acceleration_unit(units) != found[2]:
        raise MotionFileError(
            path,
            f"the header says {found[1]}, not {units}: leave --units out, or correct the header",
            line=found[0],
        )
    return found[2]


def event_station_component(header: Header) -> tuple[str, str, str]:
    """Return what a title ``# Northridge 1994 - VSP-360`` says; empty texts for other titles.

    Args:
        header: the lines above the data; only the first is a title.
    """
    match = _TITLE.fullmatch(header[0][1].rstrip()) if header else None
    return (match["event"], match["station"], match["component"]) if match else ("", "", "")


def _spellings(header: Header) -> Iterator[tuple[int, str]]:
    for number, line in header:
        names_columns = bool(_TIME.search(line))
        for match in _ACCELERATION_UNIT.finditer(line):
            # a title may well have brackets: "Accelerogram (corrected)"
            if names_columns or _is_unit(match[1]):
                yield number, match[1]
        for match in _ACCELERATION_SUFFIX.finditer(line):
            yield number, match[1].replace("_", "/")
        for match in _UNITS_WORD.finditer(line):
            yield number, match[1]


def _is_unit(text: str) -> bool:
    try:
        acceleration_unit(text)
    except InputError:
        return False
    return True


def _check_columns(path: Path, header: Header) -> None:
    for number, line in header:
        time = _TIME.search(line)
        if not time:
            continue
        if (unit := _TIME_UNIT.search(line)) and unit[1].lower() not in _SECONDS:
            raise MotionFileError(
                path,
                f"the times are in {unit[1]!r}: convert them to seconds",
                line=number,
            )
        acceleration = _ACCELERATION.search(line)
        other = _OTHER_QUANTITY.search(line)
        if other and not acceleration:
            raise MotionFileError(
                path, f"the header names {other[0]!r}: an acceleration is needed", line=number
            )
        # a title such as "Accelerations, time series" is no list of columns
        if acceleration and acceleration.start() < time.start() and _TIME_UNIT.search(line):
            raise MotionFileError(
                path, "the acceleration stands before the time: swap the columns", line=number
            )
