"""Times in record files: that of the first sample, and the interval of a printed column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from rbfrag.errors import MotionFileError
from rbfrag.motions.polarity import FloatArray

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

MOST_DIGITS = 17

_EXPONENT = re.compile(r"[eE]")


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
        time = datetime(
            year,
            int(match["month"]),
            int(match["day"]),
            int(match["hour"]),
            int(match["minute"]),
            int(match["second"]),
            int(f"{match['fraction'] or '':0<6.6}"),
        )
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
        for digits in range(MOST_DIGITS):
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
