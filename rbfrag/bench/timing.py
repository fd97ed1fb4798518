"""How long something takes: processor time of this thread, repeated where it is short.

Processor time leaves out the turns that other programs get; on a quiet machine it is the
time that a user waits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

T = TypeVar("T")

SHORTEST_S = 4e-4
"""Least time measured in one piece: some thousand times the cost of reading the clock."""

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


def spread(values: ArrayLike) -> tuple[float, float, float]:
    """Return the median and the 10 % and 90 % quantiles."""
    low, middle, high = np.quantile(np.asarray(values, dtype=float), (0.1, 0.5, 0.9))
    return float(middle), float(low), float(high)
