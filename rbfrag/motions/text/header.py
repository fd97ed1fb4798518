"""A field of a record's header: found by what it says, and agreed with what the caller states."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.text.file import finite_number
from rbfrag.motions.units import acceleration_unit, unit_in_g

TENTH_OF_G = re.compile(r"g\s*/\s*10", re.IGNORECASE)
"""The unit of the uncorrected (volume 1) formats of the 1970s."""

SAME_DT = 1e-9
"""Intervals that differ by less were computed from different fields of one header; relative."""

ROUNDING = 1e-9
"""A computed number of samples is off by no more than this share."""

MOST_DIGITS = 17

_CHANNELS = re.compile(r"\(\s*(\d{1,3})\s+chns\s+of", re.IGNORECASE | re.ASCII)

LONGEST_LINE = 1000
"""Characters of a header line that are looked at."""


@dataclass(frozen=True)
class Field:
    """A header field.

    Args:
        text: its value as the file has it.
        line: 1-based line of the file.
    """

    text: str
    line: int


def find_field(
    path: Path, lines: Sequence[str], span: range, pattern: re.Pattern[str], what: str
) -> Field:
    """Return the first match's group 1 among some lines.

    Args:
        path: for messages.
        lines: the lines of the file.
        span: indices of the lines to look at.
        pattern: searched for in each line; its group 1 is the value.
        what: the field's name, for messages.

    Raises:
        MotionFileError: no line has it.
    """
    found = optional_field(lines, span, pattern)
    if found is None:
        raise MotionFileError(
            path,
            f"the header has no {what}: the file is truncated or its header damaged; export the "
            "record again",
            line=span.start + 1,
        )
    return found


def optional_field(lines: Sequence[str], span: range, pattern: re.Pattern[str]) -> Field | None:
    """Return the first match's group 1 among some lines, or None.

    Args:
        lines: the lines of the file.
        span: indices of the lines to look at.
        pattern: searched for in each line; its group 1 is the value.
    """
    for at in span:
        if found := pattern.search(lines[at][:LONGEST_LINE]):
            return Field(found[1].strip(), at + 1)
    return None


def positive_number(path: Path, field: Field, what: str) -> float:
    """Return a field's number, which must be above zero.

    Args:
        path: for messages.
        field: the field.
        what: its name, for messages.
    """
    value = finite_number(path, field.text, field.line, what)
    if value <= 0.0:
        raise MotionFileError(path, f"{what} {field.text} must be positive", line=field.line)
    return value


def agreed_unit_in_g(path: Path, field: Field, units: str | None) -> float:
    """Return how many g the header's unit is; refused where the caller states another.

    Args:
        path: for messages.
        field: the unit as the file spells it; g/10 is known here besides the usual units.
        units: unit that the caller states, or None.
    """
    unit: str | None = None
    if not TENTH_OF_G.fullmatch(field.text):
        try:
            unit = acceleration_unit(field.text)
        except InputError as error:
            raise MotionFileError(path, str(error), line=field.line) from None
    if units is not None and acceleration_unit(units) != unit:
        raise MotionFileError(
            path, f"the header says {field.text}, not {units}: leave --units out", line=field.line
        )
    return 0.1 if unit is None else unit_in_g(unit)


def stated_unit_in_g(path: Path, units: str | None) -> float:
    """Return how many g the caller's unit is, for formats that state none.

    Args:
        path: for messages.
        units: unit that the caller states, or None.

    Raises:
        MotionFileError: the caller states none either.
    """
    if units is None:
        raise MotionFileError(
            path,
            "files of this format state no unit of acceleration, and it is never guessed: give "
            "it with --units g, m/s2, cm/s2 or mm/s2",
        )
    return unit_in_g(units)


def agreed_dt(path: Path, dt: float, line: int | None, dt_s: float | None) -> float:
    """Return the header's sampling interval [s]; refused where the caller states another.

    Args:
        path: for messages.
        dt: interval by the header [s].
        line: 1-based line that states it, if there is one.
        dt_s: interval that the caller states [s], or None.
    """
    if not 0.0 < dt < math.inf:
        raise MotionFileError(
            path, f"the sampling interval of {dt:g} s must be positive and finite", line=line
        )
    if dt_s is not None and not math.isclose(dt, dt_s, rel_tol=SAME_DT, abs_tol=0.0):
        raise MotionFileError(
            path, f"the header says dt = {dt:g} s, not {dt_s:g}: leave --dt out", line=line
        )
    return dt


def interval_of_duration(path: Path, duration: Field, npts: int) -> float:
    """Return the shortest decimal dt [s] with which npts samples last the printed duration.

    Args:
        path: for messages.
        duration: length of the record [s], as printed.
        npts: number of samples.
    """
    seconds = positive_number(path, duration, "record length")
    _, _, decimals = duration.text.partition(".")
    half_digit = 0.5 * 10.0 ** -len(decimals.rstrip())
    for digits in range(MOST_DIGITS):
        dt = float(f"{seconds / npts:.{digits}e}")
        if dt > 0.0 and abs(dt * npts - seconds) <= half_digit:
            return dt
    return seconds / npts


def other_count(
    path: Path, stated: float, found: int, line: int, what: str = "", *, allow_partial: bool
) -> tuple[str, ...]:
    """Refuse a file whose header states another number of samples than follow, or remark on it.

    Args:
        path: for messages.
        stated: samples by the header; a product of duration and frequency may be rounded.
        found: samples that follow.
        line: 1-based line that states the number.
        what: whose samples, when the file holds several traces.
        allow_partial: True to return a remark instead; a file without any sample is refused
            all the same.

    Returns:
        Nothing where both agree, else one remark.
    """
    if found and abs(stated - found) <= ROUNDING * found:
        return ()
    says = f"the header{f' of {what}' if what else ''} says {stated:.12g} samples, but {found} "
    if found and allow_partial:
        return (f"{says}follow: the record is partial, and which samples are missing is not told",)
    raise MotionFileError(
        path,
        f"{says}follow: the file is truncated or its header is wrong; export the record again, or "
        "read what there is with --allow-partial",
        line=line,
    )


def blocks(path: Path, lines: Sequence[str], first: re.Pattern[str]) -> list[range]:
    """Return the spans of a file's blocks: each begins with a line of its own and ends at the next.

    Args:
        path: for messages.
        lines: the lines of the file.
        first: matches the first line of each block at its beginning.

    Raises:
        MotionFileError: no line begins a block.
    """
    starts = [at for at, line in enumerate(lines) if first.match(line)]
    if not starts:
        raise MotionFileError(
            path, "the first line of the header is damaged: export the record again", line=1
        )
    ends = [*starts[1:], len(lines)]
    return [range(start, end) for start, end in zip(starts, ends, strict=True)]


def missing_channels(lines: Sequence[str], span: range, found: int) -> tuple[str, ...]:
    """Return a remark if a file holds fewer channels than its header says; else nothing.

    Some agencies split a recording into one file a channel, so that this is no error.

    Args:
        lines: the lines of the file.
        span: indices of the lines of its first block.
        found: channels in the file.
    """
    stated = optional_field(lines, span, _CHANNELS)
    if stated is None or int(stated.text) <= found:
        return ()
    return (f"the header says {stated.text} channels, but the file holds {found}",)


class NamedFields:
    """Header lines ``name: value``, looked up by name.

    Args:
        path: for messages.
        lines: the lines of the file.
        span: indices of the header's lines; those without a colon are passed over.
    """

    def __init__(self, path: Path, lines: Sequence[str], span: range) -> None:
        self.path = path
        self._fields: dict[str, Field] = {}
        for at in span:
            name, colon, value = lines[at][:LONGEST_LINE].partition(":")
            if colon and name.strip():
                self._fields.setdefault(name.strip(), Field(value.strip(), at + 1))

    def __getitem__(self, name: str) -> Field:
        """Return the field of this name, or else the first whose name begins so.

        Raises:
            MotionFileError: there is none, or its value is empty.
        """
        found = self._find(name)
        if found is None:
            raise MotionFileError(
                self.path, f"the header has no {name!r}: export the record again", line=1
            )
        if not found.text:
            raise MotionFileError(self.path, f"the header's {name!r} is empty", line=found.line)
        return found

    def text(self, name: str) -> str:
        """Return a field's text; empty where the header has none."""
        found = self._find(name)
        return found.text if found else ""

    def _find(self, name: str) -> Field | None:
        if name in self._fields:
            return self._fields[name]
        return next((field for key, field in self._fields.items() if key.startswith(name)), None)
