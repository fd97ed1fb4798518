"""The exact sampling interval behind a printed column of times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MotionFileError

ROUNDING = 1e-9
"""Times added up in a program drift in their last digits; relative to the largest time."""

SINGLE_PRECISION = 2.0**-23
"""Many loggers count time in single precision and print more digits than it has; relative."""

LARGEST_NOISE = 0.01
"""No more than this share of a step is put down to single precision."""

MOST_DIGITS = 17

_EXPONENT = re.compile(r"[eE]")


def sampling_interval(
    path: Path,
    tokens: Sequence[str],
    times_s: NDArray[np.float64],
    line_numbers: Sequence[int],
    stated_dt_s: float | None,
) -> float:
    """Return the shortest decimal dt [s] that reproduces every printed time.

    A time is reproduced when it is within half a unit of its last printed digit; zeros at
    the end that the writer left out count as printed. 0.008, 0.016, 0.023, … thus gives
    0.0078125, and not the rounded difference of two of them.

    Args:
        path: for messages.
        tokens: the times as printed, shape (n,).
        times_s: the same as numbers [s].
        line_numbers: their 1-based lines, shape (n,).
        stated_dt_s: interval that the caller states [s], or None. It is used if it reproduces
            the times, and refused otherwise.

    Raises:
        MotionFileError: times are not equally spaced, do not rise, or contradict the caller.
    """
    count = len(tokens)
    if count == 1:
        if stated_dt_s is None:
            raise MotionFileError(
                path,
                "a single row does not tell the sampling interval: give it, as in  --dt 0.005",
                line=line_numbers[0],
            )
        return stated_dt_s
    tolerance = _tolerance(tokens, times_s)
    found = _shortest_decimal(times_s, tolerance)
    if found is None:
        noise = SINGLE_PRECISION * float(np.max(np.abs(times_s)))
        usual = abs(float(np.median(np.diff(times_s))))
        tolerance = np.maximum(tolerance, min(noise, LARGEST_NOISE * usual))
        found = _shortest_decimal(times_s, tolerance)
    if found is None:
        raise _unequal(path, tokens, times_s, tolerance, line_numbers)
    if stated_dt_s is None:
        return found
    if not _reproduces(stated_dt_s, times_s, tolerance):
        raise MotionFileError(
            path,
            f"the time column has dt = {found:g} s, not {stated_dt_s:g}: leave --dt out",
            line=line_numbers[1],
        )
    return stated_dt_s


def _shortest_decimal(times_s: NDArray[np.float64], tolerance: NDArray[np.float64]) -> float | None:
    mean = float(times_s[-1] - times_s[0]) / (times_s.size - 1)
    if not mean > 0.0:
        return None
    for digits in range(MOST_DIGITS):
        candidate = float(f"{mean:.{digits}e}")
        if _reproduces(candidate, times_s, tolerance):
            return candidate
    return None


def _reproduces(dt_s: float, times_s: NDArray[np.float64], tolerance: NDArray[np.float64]) -> bool:
    # the first time is rounded too, so the start is any that suits all times
    start = times_s - dt_s * np.arange(times_s.size)
    return bool(np.max(start - tolerance) <= np.min(start + tolerance))


def _tolerance(tokens: Sequence[str], times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    unit = np.array([_last_digit(token) for token in tokens])
    if times_s[0] >= 0.0:
        # a later, larger time is not printed finer than an earlier one: "0.01" between 0.005
        # and 0.015 is 0.010
        unit = np.minimum.accumulate(unit[::-1])[::-1]
    largest = float(np.max(np.abs(times_s)))
    return np.asarray(np.maximum(0.5 * unit * (1.0 + 1e-6), ROUNDING * largest))


def _last_digit(token: str) -> float:
    mantissa, *exponent = _EXPONENT.split(token)
    _, _, decimals = mantissa.partition(".")
    power = (int(exponent[0]) if exponent else 0) - len(decimals)
    return float(f"1e{max(min(power, 300), -300)}")


def _unequal(
    path: Path,
    tokens: Sequence[str],
    times_s: NDArray[np.float64],
    tolerance: NDArray[np.float64],
    line_numbers: Sequence[int],
) -> MotionFileError:
    steps = np.diff(times_s)
    usual = float(np.median(steps))
    slack = tolerance[1:] + tolerance[:-1]
    odd = np.flatnonzero((steps < 0.0) | (np.abs(steps - usual) > slack))
    if usual <= 0.0:
        odd = np.flatnonzero(steps <= 0.0)
    if not odd.size:
        drift = times_s - times_s[0] - usual * np.arange(times_s.size)
        odd = np.flatnonzero(np.abs(drift[1:]) > tolerance[1:])
    at = int(odd[0]) + 1 if odd.size else 1
    step = float(steps[at - 1])
    if step <= 0.0:
        reason = f"time {tokens[at]} s follows {tokens[at - 1]} s: times must rise"
    else:
        reason = (
            f"time {tokens[at]} s follows {tokens[at - 1]} s, a step of {step:g} s where "
            f"{usual:g} s is usual: times must be equally spaced"
        )
    return MotionFileError(
        path, f"{reason}; repair the line or resample the record", line=line_numbers[at]
    )
