"""Text of a record file: its lines, single numbers and times."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from rbfrag.errors import MotionFileError
from rbfrag.files import NO_FILE, bounded_bytes, encoding_of, is_endless, packed_as
from rbfrag.motions.polarity import FloatArray

LARGEST_FILE_BYTES = 512 * 1024**2
MOST_DIGITS = 12
MOST_SHOWN = 40

_FORTRAN = re.compile(r"(?<!\d)(\d{1,3})[FE](\d{1,3})\.\d", re.IGNORECASE | re.ASCII)
_OF_INTEGERS = frozenset("0123456789- \t")
_BETWEEN_NUMBERS = re.compile(r"[\s,;]+")
_DECIMALS = re.compile(r"[+-]?\d*\.(\d+)([eEdD][+-]?\d+)?", re.ASCII)
_TAIL = 2000
_COMPARED, _DISTINCT, _FEWEST_DECIMALS = 30, 10, 3
"""So many numbers above the last, so many of them different, must agree in their decimals."""
_NUMBER = re.compile(r"([+-]?(?:\d+(?:\.\d*)?|\.\d+))(?:[eEdD]([+-]?\d+))?", re.ASCII)
"""With an exponent after E, or after D as Fortran prints double precision."""


def read_text(path: Path) -> str:
    """Return the text of a file: byte-order mark removed, newlines as ``\\n``."""
    return decoded(path, read_bytes(path))


def read_bytes(path: Path) -> bytes:
    """Return the content of a file of bounded size."""
    try:
        if path.is_dir():
            raise MotionFileError(path, "this is a folder: give a file")
        if is_endless(path):
            raise MotionFileError(path, f"this is {NO_FILE}: save the record to a file")
        raw = bounded_bytes(path, LARGEST_FILE_BYTES)
        if raw is None:
            largest = LARGEST_FILE_BYTES / 1024**2
            raise MotionFileError(
                path, f"more than {largest:.0f} MiB are too large for an accelerogram"
            )
        return raw
    except FileNotFoundError:
        raise MotionFileError(path, "there is no such file: check the path") from None
    except OSError as error:
        raise MotionFileError(path, f"the file cannot be read: {error.strerror}") from None
    except MotionFileError:
        raise
    except ValueError as error:
        # a name with a zero byte
        raise MotionFileError(path, f"the file cannot be read: {error}") from None


def decoded(path: Path, raw: bytes) -> str:
    """Return the text of a file's bytes: byte-order mark removed, newlines as ``\\n``."""
    if not raw.removeprefix(codecs.BOM_UTF8).strip():
        raise MotionFileError(path, "the file is empty: export the record again")
    packed = packed_as(raw[:6])
    if packed is not None:
        raise MotionFileError(path, f"it is a {packed} file: unpack it, and give a record")
    encoding = encoding_of(raw)
    if b"\0" in raw and encoding != "utf-16":
        raise MotionFileError(
            path,
            "the file is binary and not miniSEED: export the record in one of the text formats",
        )
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        # every byte has a meaning in Latin-1, which older networks write
        text = raw.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def cut_number(text: str) -> str:
    """Return the number at which a truncated file ends, or an empty text.

    A file that ends without a newline may have been cut. Its last number shows so if all those
    before it are printed with one number of decimals, and it has fewer.
    """
    if text.endswith("\n"):
        return ""
    words = _BETWEEN_NUMBERS.split(text[-_TAIL:])[1:]
    *earlier, last = words[-_COMPARED - 1 :] or [""]
    matches = {_DECIMALS.fullmatch(word) for word in set(earlier)}
    if len(earlier) < _COMPARED or len(matches) < _DISTINCT or None in matches:
        return ""
    shapes = {(len(word[1]), len(word[2] or "")) for word in matches if word}
    ((decimals, exponent),) = shapes if len(shapes) == 1 else {(0, 0)}
    if decimals < _FEWEST_DECIMALS:
        return ""
    end = _DECIMALS.match(last)
    is_complete = end is not None and len(end[1]) >= decimals and len(end[2] or "") >= exponent
    return "" if is_complete else last


def holds_integers(line: str) -> bool:
    """Return whether a line consists of integers."""
    return set(line) <= _OF_INTEGERS and any(character.isdigit() for character in line)


def without_blank_end(lines: Sequence[str]) -> Sequence[str]:
    """Return lines without trailing blank ones."""
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return lines[:end]


def field_layout(text: str) -> tuple[int, int] | None:
    """Return fields a line and characters a field of a Fortran format such as ``(8F10.6)``."""
    match = _FORTRAN.search(text)
    if not match:
        return None
    per_line, width = int(match[1]), int(match[2])
    return (per_line, width) if per_line and width else None


def finite_number(path: Path, text: str, line: int, description: str) -> float:
    """Return one number of a file, or reject it with its line, from 1."""
    if match := _NUMBER.fullmatch(text):
        value = float(f"{match[1]}e{match[2] or 0}")
        if math.isfinite(value):
            return value
        raise MotionFileError(path, f"{description} {shown(text)} is too large", line=line)
    raise MotionFileError(
        path,
        f"{description} {shown(text)} is not a finite number: repair the line or export the "
        "record again",
        line=line,
    )


def shown(text: str) -> str:
    """Return a text quoted for messages."""
    return repr(text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}…")


ROUNDING = 1e-9
"""Times added up in a program drift in their last digits; relative to the largest time."""

SINGLE_PRECISION = 2.0**-23
"""Many loggers count time in single precision and print more digits than it has; relative."""

LARGEST_NOISE = 0.01
"""No more than this part of a step is put down to single precision."""

FINE = 0.1
"""Times rounded by less than this part of a step show each row, wherever they start."""

RARE = 0.05
"""Steps other than the usual one come from rounding only if more than this part of them do."""

MOST_SIGNIFICANT = 17

_EXPONENT = re.compile(r"[eEdD]")


_CLOCK = r"(?P<hour>\d{1,2}):\s?(?P<minute>\d{1,2}):\s?(?P<second>\d{1,2})(?:\.(?P<fraction>\d+))?"
_FORMS = (
    re.compile(
        r"(?P<year>\d{4})[/-](?P<month>\d{1,2})[/-](?P<day>\d{1,2})[ T-]\s*" + _CLOCK, re.ASCII
    ),
    re.compile(
        r"(?<!\d)(?P<month>\d{1,2})/\s?(?P<day>\d{1,2})/(?P<year>\d{4}|\d{2}),?\s+" + _CLOCK,
        re.ASCII,
    ),
    re.compile(
        r"(?<!\d)(?P<year>\d{4})(?P<month>\d{2})(?P<day>\d{2})_"
        r"(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2})(?:\.(?P<fraction>\d+))?",
        re.ASCII,
    ),
)

CENTURY_TURNS_AT = 30
"""Two digits of a year below this are of the 21st century, others of the 20th."""

FIRST_YEAR = 1900

NEVER_SET = datetime(1980, 1, 1).date()
"""Where the clocks of recorders begin that were never set: the zero of GPS time."""


def first_sample_time(text: str) -> datetime | None:
    """Return the date and time in a header's text, without its zone; None where there is none.

    Args:
        text: such as ``2020/05/15 11:03:14.418 UTC``, ``8/24/14, 10:20:33.0 UTC`` (month
            first) or ``20230206_011729.868``. An impossible date, or that of a clock that was
            never set, is none.
    """
    match = next((match for form in _FORMS if (match := form.search(text))), None)
    if match is None:
        return None
    year = int(match["year"])
    if len(match["year"]) == 2:
        year += 2000 if year < CENTURY_TURNS_AT else 1900
    try:
        parts = match.group("month", "day", "hour", "minute", "second")
        month, day, hour, minute, second = map(int, parts)
        microsecond = int(f"{match['fraction'] or '':0<6.6}")
        time = datetime(year, month, day, hour, minute, second, microsecond)
    except ValueError:
        return None
    return None if time.year < FIRST_YEAR or time.date() == NEVER_SET else time


def sampling_interval(
    path: Path,
    tokens: Sequence[str],
    times_s: FloatArray,
    line_numbers: Sequence[int],
    stated_dt_s: float | None,
) -> float:
    """Return the shortest decimal dt [s] that reproduces every printed time.

    A time is reproduced when it is within half a unit of its last printed digit; zeros at
    the end that the writer left out count as printed. 0.008, 0.016, 0.023, … thus gives
    0.0078125, and not the rounded difference of two of them.

    Args:
        tokens: the times as printed, shape (n,).
        times_s: the same as numbers [s].
        line_numbers: their 1-based lines.
        stated_dt_s: interval that the caller states [s]: used if it reproduces the times, and
            rejected otherwise.
    """
    count = len(tokens)
    if count == 1:
        if stated_dt_s is None:
            raise MotionFileError(
                path,
                "a single row has no sampling interval: give it, as in  dt_s 0.005",
                line=line_numbers[0],
                fields=("dt_s",),
            )
        return stated_dt_s
    column = _Column(times_s, _tolerance(tokens, times_s))
    dt_s = column.shortest_decimal()
    if dt_s is None:
        column = column.allowing_single_precision()
        dt_s = column.shortest_decimal()
    if dt_s is None and column.is_fine():
        column.start_is_exact = False
        dt_s = column.shortest_decimal()
    if dt_s is None:
        raise _unequal(path, tokens, times_s, column.tolerance_s, line_numbers)
    if stated_dt_s is None:
        return dt_s
    if not column.reproduced_by(stated_dt_s):
        raise MotionFileError(
            path,
            f"the time column has dt = {dt_s:g} s, not {stated_dt_s:g}: omit dt_s",
            line=line_numbers[1],
            fields=("dt_s",),
        )
    return stated_dt_s


@dataclass
class _Column:
    times_s: FloatArray
    tolerance_s: FloatArray
    start_is_exact: bool = True

    @property
    def usual_step_s(self) -> float:
        return float(np.median(np.diff(self.times_s)))

    def allowing_single_precision(self) -> _Column:
        noise = SINGLE_PRECISION * float(np.max(np.abs(self.times_s)))
        allowed = min(noise, LARGEST_NOISE * abs(self.usual_step_s))
        return _Column(self.times_s, np.maximum(self.tolerance_s, allowed))

    def is_fine(self) -> bool:
        """Return whether the start may vary by its rounding without hiding a missing row."""
        return float(np.max(self.tolerance_s)) <= FINE * self.usual_step_s

    def may_hide_a_gap(self, mean_s: float) -> bool:
        """Return whether a missing row could be mistaken for rounding of coarsely printed times."""
        steps = np.diff(self.times_s)
        finest = float(np.min(self.tolerance_s))
        if np.min(steps) < 0.0 or (np.min(steps) == 0.0 and finest > FINE * mean_s):
            return True
        off = np.abs(steps - self.usual_step_s) > 1.98 * self.tolerance_s[1:]
        return bool(0.0 < np.mean(off) < RARE)

    def shortest_decimal(self) -> float | None:
        mean = float(self.times_s[-1] - self.times_s[0]) / (self.times_s.size - 1)
        if not mean > 0.0 or self.may_hide_a_gap(mean):
            return None
        lowest, highest = self.bounds_s()
        for digits in range(MOST_SIGNIFICANT):
            for near in (mean, 0.5 * (lowest + highest)):
                candidate = float(f"{near:.{digits}e}")
                if 0.0 < candidate < np.inf and self.reproduced_by(candidate):
                    return candidate
        return None

    def bounds_s(self) -> tuple[float, float]:
        """Intervals outside these do not reproduce the times."""
        slack = self.tolerance_s[1:]
        if not self.start_is_exact:
            slack = slack + self.tolerance_s[0]
        since, number = self.times_s[1:] - self.times_s[0], np.arange(1, self.times_s.size)
        return float(np.max((since - slack) / number)), float(np.min((since + slack) / number))

    def reproduced_by(self, dt_s: float) -> bool:
        with np.errstate(
            over="ignore"
        ):  # times near the largest number: infinite is not reproduced
            start = self.times_s - dt_s * np.arange(self.times_s.size)
        if self.start_is_exact:
            return bool(np.all(np.abs(start - self.times_s[0]) <= self.tolerance_s))
        return bool(np.max(start - self.tolerance_s) <= np.min(start + self.tolerance_s))


def _tolerance(tokens: Sequence[str], times_s: FloatArray) -> FloatArray:
    unit = np.array([last_digit(token) for token in tokens])
    if times_s[0] >= 0.0:
        # a later, larger time is not printed finer than an earlier one: "0.01" between 0.005
        # and 0.015 is 0.010
        unit = np.minimum.accumulate(unit[::-1])[::-1]
    largest = float(np.max(np.abs(times_s)))
    return np.asarray(np.maximum(0.5 * unit * (1.0 + 1e-6), ROUNDING * largest))


def last_digit(token: str) -> float:
    """Return the unit of the last digit of a printed number."""
    mantissa, *exponent = _EXPONENT.split(token)
    _, _, decimals = mantissa.partition(".")
    # float, as int() rejects exponents of thousands of digits
    power = (float(exponent[0]) if exponent else 0.0) - len(decimals)
    return float(f"1e{max(min(power, 300.0), -300.0):.0f}")


def _unequal(
    path: Path,
    tokens: Sequence[str],
    times_s: FloatArray,
    tolerance: FloatArray,
    line_numbers: Sequence[int],
) -> MotionFileError:
    steps = np.diff(times_s)
    usual = float(np.median(steps))
    slack = tolerance[1:] + tolerance[:-1]
    off = np.flatnonzero((steps < 0.0) | (np.abs(steps - usual) > slack))
    if usual <= 0.0:
        off = np.flatnonzero(steps <= 0.0)
    if not off.size:
        drift = times_s - times_s[0] - usual * np.arange(times_s.size)
        off = np.flatnonzero(np.abs(drift[1:]) > tolerance[1:])
    at = int(off[0]) + 1 if off.size else 1
    step = float(steps[at - 1])
    if step <= 0.0:
        reason = f"time {tokens[at]} s follows {tokens[at - 1]} s: times must rise from row to row"
    else:
        reason = (
            f"time {tokens[at]} s follows {tokens[at - 1]} s, a step of {step:g} s where "
            f"{usual:g} s is usual: times must be equally spaced"
        )
    return MotionFileError(
        path, f"{reason}; repair the line or resample the record", line=line_numbers[at]
    )
