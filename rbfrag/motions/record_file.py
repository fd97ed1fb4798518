"""Record file as a format's parser uses it, and the traces that the parser returns.

Fields are found by what they say; counts, intervals and numbers are read or rejected with their
line. What all traces go through (unit, missing samples, labels) is done once, in
:mod:`rbfrag.motions.readers`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbfrag.errors import MotionFileError, UnitNotStatedError
from rbfrag.motions.ground_motion import LOCATION
from rbfrag.motions.polarity import FloatArray
from rbfrag.motions.text import (
    MOST_DIGITS,
    MOST_SIGNIFICANT,
    finite_number,
    holds_integers,
    shown,
    without_blank_end,
)

SAME_DT = 1e-9
"""Intervals that differ by less were computed from different fields of one header; relative."""

ROUNDING = 1e-9
"""A computed number of samples is off by no more than this ratio."""

VOLUME_1_NUMBERS = 14

LONGEST_LINE = 1000
"""Characters of a header line that are looked at."""

_LOCATION = re.compile(r"^\s*(?:sta\s+)?chan\b.*\blocation:\s*(\S.*)", re.IGNORECASE)
_CHANNELS = re.compile(r"\(\s*(\d{1,3})\s+chns\s+of", re.IGNORECASE | re.ASCII)


class HeaderField(NamedTuple):
    """A header field: its text in the file, and its line, from 1."""

    text: str
    line: int


class Count(NamedTuple):
    """Number of samples in a header, and its line.

    A product of duration and frequency may be rounded; `seconds` is that duration. `of` says whose
    samples, where a file holds several traces.
    """

    number: float
    line: int
    of: str = ""
    seconds: float | None = None

    def at(self, dt_s: float) -> Count:
        """Return the count by another sampling interval [s]."""
        return self if self.seconds is None else self._replace(number=self.seconds / dt_s)


class PeakField(NamedTuple):
    """Peak acceleration in a header, of either sign, its unit, and its line."""

    text: str
    unit: str
    line: int


class PrintedTimes(NamedTuple):
    """Times [s] printed with the samples, `per_line` per line, each within `tolerance_s`."""

    times_s: FloatArray
    tolerance_s: float
    first_line: int
    per_line: int = 1


@dataclass(frozen=True)
class ParsedTrace:
    """One trace as its format's parser returns it.

    Args:
        values: samples, in `unit` times `scale`.
        dt_s: sampling interval [s].
        unit: the unit as the header spells it; None where the caller must state it.
        count: number of samples by the header; None where it states none.
        times: printed times that `dt_s` must reproduce.
        component: its name; direction and sense are what it says, or else what `axis` says.
        axis: a name that says more of the direction.
        recording: id that the components of a recording share; None for event and station.
        start: text with the time of the first sample.
        remarks: what else a user should see.
        is_partial: True where more is missing than `count` tells.
        remark_if_partial: what a user should see besides where samples are missing.
        labels: labels of a motion that the file holds as such, before all that is derived.
        durations: what the header says the samples last [s], where it does.
        peak: what it says of the largest sample of these, not of the record before correction.
    """

    values: FloatArray
    dt_s: float
    unit: HeaderField | None
    count: Count | None
    component: str
    scale: float = 1.0
    times: PrintedTimes | None = None
    station: str = ""
    event: str = ""
    axis: str | None = None
    recording: str | None = None
    start: str = ""
    is_corrected: bool | None = None
    remarks: tuple[str, ...] = ()
    is_partial: bool = False
    remark_if_partial: str = ""
    labels: Mapping[str, object] = field(default_factory=dict)
    durations: tuple[HeaderField | None, ...] = ()
    peak: PeakField | None = None


@dataclass(frozen=True)
class RecordFile:
    """A file being read. Every rejection is a MotionFileError with the line.

    Args:
        text: the file's text.
        units: unit of acceleration that the caller states, or None.
        dt_s: sampling interval that the caller states [s], or None.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.
        gain: counts/(m/s²) of a file in counts, of all its traces or by index; or None.
        channel: patterns of the channels to read, separated by commas; None for all.
    """

    path: Path
    text: str
    units: str | None = None
    dt_s: float | None = None
    allow_partial: bool = False
    gain: float | Mapping[int, float] | None = None
    channel: str | None = None

    @cached_property
    def lines(self) -> list[str]:
        """The lines of the file."""
        return self.text.split("\n")

    def error(
        self, trouble: str, line: int | None = None, fields: tuple[str, ...] = ()
    ) -> MotionFileError:
        """Return an error that names this file, and the line from 1 where one is wrong."""
        return MotionFileError(self.path, trouble, line=line, fields=fields)

    # fields of the header

    def optional(self, span: range, pattern: re.Pattern[str]) -> HeaderField | None:
        """Return the first match's group 1 among the lines of a span of indices, or None."""
        for at in span:
            if match := pattern.search(self.lines[at][:LONGEST_LINE]):
                return HeaderField(match[1].strip(), at + 1)
        return None

    def label(self, span: range, pattern: re.Pattern[str]) -> str:
        """Return the first match's group 1 among the lines of a span; empty where there is none."""
        field = self.optional(span, pattern)
        return field.text if field else ""

    def location(self, span: range) -> tuple[str, ...]:
        """Return the remark on the location of a channel's sensor, if there is one."""
        location = self.label(span, _LOCATION)
        return (LOCATION + location,) if location else ()

    def find(self, span: range, pattern: re.Pattern[str], description: str) -> HeaderField:
        """Return the first match's group 1 among the lines of a span; raise an error without a
        match.
        """
        field = self.optional(span, pattern)
        if field is None:
            raise self.error(
                f"the header has no {description}: the file is truncated or its header damaged; "
                "export the record again",
                span.start + 1,
            )
        return field

    def blocks(self, first: re.Pattern[str]) -> list[range]:
        """Return the spans that begin with a line that `first` matches and end at the next."""
        starts = [at for at, line in enumerate(self.lines) if first.match(line)]
        if not starts:
            raise self.error(
                "the first line of the header is damaged: export the record again", line=1
            )
        ends = [*starts[1:], len(self.lines)]
        return [range(start, end) for start, end in zip(starts, ends, strict=True)]

    def missing_channels(self, span: range, channels: int) -> tuple[str, ...]:
        """Return a remark if the file contains fewer channels than its first block declares.

        Some agencies split a recording into one file a channel, so that this is no error.
        """
        declared = self.label(span, _CHANNELS)
        if not declared or int(declared) <= channels:
            return ()
        return (f"the header says {declared} channels, but the file holds {channels}",)

    # what header and caller must agree on

    def positive(self, field: HeaderField, description: str) -> float:
        """Return a field's number, which must be above zero."""
        return positive_number(self.path, field, description)

    def count(self, field: HeaderField, description: str, of: str = "") -> Count:
        """Return the number of samples in a field, an integer of at least 1."""
        digits = field.text.removesuffix(".")
        # int() rejects thousands of digits in words of its own
        if digits.isascii() and digits.isdigit() and len(digits) < MOST_DIGITS and int(digits) > 0:
            return Count(int(digits), field.line, of)
        raise self.error(f"{description} {shown(field.text)} is not a count of samples", field.line)

    def require_units(self, states: str = "the file has") -> None:
        """Reject a file without a unit of acceleration unless the caller gives it."""
        if self.units is None:
            raise UnitNotStatedError(
                self.path,
                f"{states} no unit of acceleration: give units g, m/s2, cm/s2 or mm/s2",
                fields=("units",),
            )

    def dt(self, field: HeaderField, description: str = "dt") -> float:
        """Return the sampling interval [s] in a field."""
        return self.possible_dt(self.positive(field, description), field.line)

    def possible_dt(self, dt: float, line: int | None) -> float:
        """Return the header's sampling interval [s], which must be positive and finite."""
        if not 0.0 < dt < math.inf:
            raise self.error(f"the sampling interval of {dt:g} s must be positive and finite", line)
        return dt

    def dt_of_duration(self, duration: HeaderField, npts: float) -> float:
        """Return the shortest decimal dt [s] for which npts samples last the printed duration."""
        seconds = self.positive(duration, "record length")
        _, _, decimals = duration.text.partition(".")
        half_digit = 0.5 * 10.0 ** -len(decimals.rstrip())
        for digits in range(MOST_SIGNIFICANT):
            dt = float(f"{seconds / npts:.{digits}e}")
            if dt > 0.0 and abs(dt * npts - seconds) <= half_digit:
                break
        else:
            dt = seconds / npts
        return self.possible_dt(dt, duration.line)

    def missing_samples(self, count: Count, npts: int) -> str:
        """Return a remark if the number of samples differs from the header's, or reject the file.

        A file without any is rejected in any case.
        """
        if npts and abs(count.number - npts) <= ROUNDING * npts:
            return ""
        whose = f"the header{f' of {count.of}' if count.of else ''}"
        says = f"{whose} declares {count.number:.12g} samples, but {npts} follow:"
        if npts and self.allow_partial:
            return f"{says} the record is partial, at an unknown place"
        interval = "" if count.seconds is None else "give the correct interval with dt_s, "
        raise self.error(
            f"{says} the file is truncated or its header is wrong; export the record again, "
            f"{interval}or use allow_partial",
            count.line,
            fields=("allow_partial", "dt_s"),
        )

    # samples

    def data(self, start: int, stop: int | None = None) -> Sequence[str]:
        """Return the lines of some indices without the blank ones at their end."""
        return without_blank_end(self.lines[start:stop])

    def volume_1_data(self, span: range, header_line: int) -> tuple[int, Sequence[str]]:
        """Return the index of the first line of samples of a volume 1 block, and all these lines.

        They stand below 7 lines of integers and 7 of reals, and end with a line ``/&``.

        Args:
            span: indices of the block's lines.
            header_line: 1-based line of the last header field, above the numbers.
        """
        lines = self.lines
        stop = next((at for at in span if lines[at].startswith("/&")), span.stop)
        first = next((at for at in range(header_line, stop) if holds_integers(lines[at])), stop)
        first += VOLUME_1_NUMBERS
        if first >= stop:
            raise self.error(
                f"no samples follow the header: {VOLUME_1_NUMBERS} lines of numbers and then the "
                "samples were expected; the file is truncated, export the record again",
                header_line,
            )
        return first, self.data(first, stop)

    def free_numbers(self, rows: Sequence[str], first_line: int, description: str) -> FloatArray:
        """Return blank-separated numbers of rows, of which the first is this line, from 1."""

        def lines() -> list[int]:
            return [line for line, row in enumerate(rows, first_line) for _ in row.split()]

        return self.numbers(" ".join(rows).split(), lines, description)

    def numbers(
        self, tokens: Sequence[str], lines: Callable[[], Sequence[int]], description: str
    ) -> FloatArray:
        """Return the numbers printed as tokens; `lines` gives the line of each, from 1."""
        try:
            numbers = np.array(tokens, dtype=np.float64)
        except ValueError:
            numbers = np.array([np.nan])
        # numpy also reads 'nan', 'inf', '1_000' and digits of other scripts
        printed = all(token.isascii() and "_" not in token for token in tokens)
        if printed and np.isfinite(numbers).all():
            return numbers
        return np.array(
            [
                finite_number(self.path, token.strip(), line, description)
                for token, line in zip(tokens, lines(), strict=True)
            ]
        )

    def table(
        self, rows: Sequence[str], first_line: int, columns: int, description: str
    ) -> FloatArray:
        """Return blank-separated columns of numbers, shape (rows, columns)."""
        for number, row in enumerate(rows, first_line):
            width = len(row.split())
            if width != columns:
                raise self.error(
                    f"the line has {width} values, not {columns} as in the header: repair the "
                    "line or export the record again",
                    number,
                )
        return self.free_numbers(rows, first_line, description).reshape(-1, columns)

    def fixed_width(
        self, rows: Sequence[str], first_line: int, layout: tuple[int, int], description: str
    ) -> FloatArray:
        """Return numbers in columns of a fixed width, which may touch.

        Args:
            rows: the lines that hold them; only the last may hold fewer than the others.
            first_line: 1-based line of the first.
            layout: fields a line, and characters a field, the number at its right end.
            description: what the numbers are, for messages.
        """
        per_line, width = layout
        rows = [row.rstrip() for row in rows]
        row_width = width * per_line
        for at, row in enumerate(rows):
            # a character too many or too few would shift every field after it
            if len(row) != row_width and (
                at < len(rows) - 1 or len(row) % width or len(row) > row_width
            ):
                raise self.error(
                    f"the line has {len(row)} characters, which are not {per_line} fields of "
                    f"{width}: repair the line or export the record again",
                    first_line + at,
                )
        text = "".join(rows)
        if not text:
            return np.empty(0)
        try:
            numbers = np.frombuffer(text.encode("ascii"), dtype=f"S{width}").astype(np.float64)
        except ValueError:
            numbers = np.array([np.nan])
        if not np.isfinite(numbers).all() or "_" in text:
            # numpy knows fewer blanks than Python does: a field may be sound all the same
            return np.array(
                [
                    finite_number(
                        self.path, row[start : start + width].strip(), first_line + at, description
                    )
                    for at, row in enumerate(rows)
                    for start in range(0, len(row), width)
                ]
            )
        return numbers

    def fixed_table(
        self, rows: Sequence[str], first_line: int, layout: tuple[int, int], description: str
    ) -> FloatArray:
        """Return columns of a fixed width, shape (rows, fields a line)."""
        numbers = self.fixed_width(rows, first_line, layout, description)
        if numbers.size % layout[0]:
            raise self.error(
                f"the last row does not have {layout[0]} columns: the file is truncated",
                first_line - 1 + len(rows),
            )
        return numbers.reshape(-1, layout[0])

    def reject_other_times(self, times: PrintedTimes, dt: float, samples: int) -> None:
        """Reject printed times that the sampling interval [s] does not reproduce.

        A missing or doubled row shows so.
        """
        printed, tolerance, first_line, per_line = times
        if printed.size != samples:
            raise self.error(
                "the last time has no acceleration: the file is truncated",
                first_line + samples // per_line,
            )
        with np.errstate(over="ignore"):
            expected = printed[0] + dt * np.arange(printed.size)
            off = np.flatnonzero(~(np.abs(printed - expected) <= tolerance))
        if off.size:
            at = int(off[0])
            raise self.error(
                f"time {printed[at]:g} s instead of {expected[at]:g} s for the header's dt of "
                f"{dt:g} s: repair the line or export the record again",
                first_line + at // per_line,
            )


def peak_of(field: HeaderField | None, unit: str | None = None) -> PeakField | None:
    """Return the peak acceleration of a field, in a unit that is its second word where none is."""
    if field is None:
        return None
    text, _, word = field.text.partition(" ")
    return PeakField(text, unit or word.strip(), field.line)


def number_or_none(text: str) -> float | None:
    """Return the finite number of a header field, None if it has none."""
    try:
        return finite_number(Path(), text, 1, "")
    except MotionFileError:
        return None


def positive_number(path: Path, field: HeaderField, description: str) -> float:
    """Return a field's number, which must be above zero."""
    value = finite_number(path, field.text, field.line, description)
    if value <= 0.0:
        raise MotionFileError(path, f"{description} {field.text} must be positive", line=field.line)
    return value


class NamedFields:
    """Header lines ``name: value`` of a span, looked up by name; lines without a colon are not."""

    def __init__(self, file: RecordFile, span: range) -> None:
        self._file = file
        self._fields: dict[str, HeaderField] = {}
        for at in span:
            name, colon, value = file.lines[at][:LONGEST_LINE].partition(":")
            if colon and name.strip():
                self._fields.setdefault(name.strip(), HeaderField(value.strip(), at + 1))

    def __getitem__(self, name: str) -> HeaderField:
        """Return the field of this name, or else the first whose name begins so."""
        field = self.optional(name)
        if field is None:
            raise self._file.error(f"the header has no {name!r}: export the record again", line=1)
        if not field.text:
            raise self._file.error(f"the header's {name!r} is empty", field.line)
        return field

    def text(self, name: str) -> str:
        """Return a field's text; empty where the header has none."""
        field = self.optional(name)
        return field.text if field else ""

    def optional(self, name: str) -> HeaderField | None:
        """Return the field of this name, or else the first whose name begins so, or None."""
        if name in self._fields:
            return self._fields[name]
        return next((field for key, field in self._fields.items() if key.startswith(name)), None)
