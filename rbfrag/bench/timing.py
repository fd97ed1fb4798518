"""Measurement of processor time of this thread, repeated for short work, and its text.

Processor time leaves out the turns that other programs get; on a quiet machine it is the
time that a user waits.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

C = TypeVar("C")
T = TypeVar("T")

SHORTEST_S = 4e-4
"""Least time measured at once: some thousand times the cost of reading the clock."""

LONG_S = 0.02
"""Work that takes longer is done once: its first call is no slower than the next."""


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Return the result of `work`, and the seconds of one call.

    Work under 20 ms is repeated: the least of three readings after a first call.
    """
    started = time.thread_time()
    answer = work()
    once = time.thread_time() - started
    if once >= LONG_S:
        return answer, once
    calls = int(SHORTEST_S / max(once, 1e-6)) + 1
    best = np.inf
    for _ in range(3):
        started = time.thread_time()
        for _ in range(calls):
            work()
        best = min(best, (time.thread_time() - started) / calls)
    return answer, float(best)


def timed_in_turns(
    works: Sequence[Callable[[C], T]], case: C, rng: np.random.Generator
) -> tuple[list[T], list[float]]:
    """Return results and seconds of several works on one case, run in random order."""
    timings: dict[int, tuple[T, float]] = {}
    for i in rng.permutation(len(works)).tolist():
        timings[i] = timed(partial(works[i], case))
    answers, seconds = zip(*(timings[i] for i in range(len(works))), strict=True)
    return list(answers), list(seconds)


def spread(values: ArrayLike) -> tuple[float, float, float]:
    """Return the median and the 10 % and 90 % quantiles."""
    low, middle, high = np.quantile(np.asarray(values, dtype=float), (0.1, 0.5, 0.9))
    return float(middle), float(low), float(high)


def seconds(value: float) -> str:
    """Format a time with two digits and a suitable unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= 0.9995 * size:
            return f"{_two_digits(value / size)} {unit}"
    return f"{_two_digits(value / 1e-9)} ns"


def ratio(value: float) -> str:
    """Format a ratio with two digits."""
    return f"{_two_digits(value)}×"


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):,.0f}" if value >= 9.95 else f"{value:.2g}"
