"""Time against error: every method on the same cases, in turns, in one process."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rbfrag.bench.cases import BenchCase
from rbfrag.bench.methods import BenchMethod
from rbfrag.bench.peers import STABLE, PeerAnswer
from rbfrag.bench.reference import reference
from rbfrag.bench.timing import spread, timed_in_turns


@dataclass(frozen=True)
class WorkPrecision:
    """What one method did on all cases.

    Args:
        of_use: the setting that users of rbfrag get.
        wrong: cases whose outcome differs from the reference's.
        error_median: median relative error of the peak rotation, where the block stays.
        error_worst: greatest of these errors.
        time_s: median time of one run [s].
        time_low_s: its 10 % quantile over the cases [s].
        time_high_s: its 90 % quantile [s].
        slower: median over the cases of its time over that of rbfrag as used.
        slower_least: least of these ratios.
    """

    family: str
    setting: str
    of_use: bool
    cases: int
    wrong: int
    error_median: float | None
    error_worst: float | None
    time_s: float
    time_low_s: float
    time_high_s: float
    slower: float
    slower_least: float


def measure(
    cases: Sequence[BenchCase],
    methods: Sequence[BenchMethod],
    *,
    judge: Callable[[BenchCase], PeerAnswer] = reference,
    seed: int = 1,
    on_case: Callable[[int, int], None] | None = None,
) -> tuple[WorkPrecision, ...]:
    """Run every method on every case and compare with the extended-precision reference.

    Args:
        methods: with what; one of them `of_use`, to which times are compared.
        judge: returns what is right; for another kind than toppling.
        seed: of the order in which the methods take turns on each case.
        on_case: called after each case with (done, total).
    """
    rng = np.random.default_rng(seed)
    for method in methods:
        method.run(cases[0])  # compiles, imports
    truth: list[PeerAnswer] = []
    answers: list[list[PeerAnswer]] = [[] for _ in methods]
    seconds = np.empty((len(methods), len(cases)))
    for j, case in enumerate(cases):
        truth.append(judge(case))
        of_case, seconds[:, j] = timed_in_turns([method.run for method in methods], case, rng)
        for of_method, answer in zip(answers, of_case, strict=True):
            of_method.append(answer)
        if on_case is not None:
            on_case(j + 1, len(cases))
    base = next(i for i, method in enumerate(methods) if method.of_use)
    return tuple(
        _row(method, truth, answers[i], seconds[i], seconds[base])
        for i, method in enumerate(methods)
    )


def _row(
    method: BenchMethod,
    truth: Sequence[PeerAnswer],
    answers: Sequence[PeerAnswer],
    seconds: np.ndarray,
    base: np.ndarray,
) -> WorkPrecision:
    wrong = sum(a.outcome != t.outcome for a, t in zip(answers, truth, strict=True))
    errors = [
        abs(a.peak_rad - t.peak_rad) / t.peak_rad
        for a, t in zip(answers, truth, strict=True)
        if a.outcome == t.outcome == STABLE and t.peak_rad > 0.0 and math.isfinite(a.peak_rad)
    ]
    middle, low, high = spread(seconds)
    ratios = seconds / base
    return WorkPrecision(
        family=method.family,
        setting=method.setting,
        of_use=method.of_use,
        cases=len(truth),
        wrong=wrong,
        error_median=float(np.median(errors)) if errors else None,
        error_worst=max(errors, default=None),
        time_s=middle,
        time_low_s=low,
        time_high_s=high,
        slower=float(np.median(ratios)),
        slower_least=float(ratios.min()),
    )
