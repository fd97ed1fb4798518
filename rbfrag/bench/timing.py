"""How long something takes: processor time of this thread, repeated where it is short.

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
    """Return what `work` returns, and the seconds of one call.

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
    """Return answers and seconds of several works on one case, run in an order drawn at random."""
    timings: dict[int, tuple[T, float]] = {}
    for i in rng.permutation(len(works)).tolist():
        timings[i] = timed(partial(works[i], case))
    answers, seconds = zip(*(timings[i] for i in range(len(works))), strict=True)
    return list(answers), list(seconds)


def spread(values: ArrayLike) -> tuple[float, float, float]:
    """Return the median and the 10 % and 90 % quantiles."""
    low, middle, high = np.quantile(np.asarray(values, dtype=float), (0.1, 0.5, 0.9))
    return float(middle), float(low), float(high)
