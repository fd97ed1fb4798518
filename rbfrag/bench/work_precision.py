"""Work-precision comparison: every method on the same cases, alternating, in one process.

Times are processor times of this thread, repeated for short work. They leave out the turns that
other programs get; on a quiet machine it is the time that a user waits.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.bench.peers import STABLE, BenchCase, PeerAnswer, Solver, euler, scipy_run
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.toppling_run import OUTCOMES, simulate

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


SOLVERS: tuple[Solver, ...] = ("RK45", "DOP853", "LSODA")


@dataclass(frozen=True)
class BenchMethod:
    """One method with one setting.

    Args:
        family: methods of one family are joined by a line in the figure.
        setting: what distinguishes it within the family.
        of_use: the setting that users of rbfrag get.
    """

    family: str
    setting: str
    run: Callable[[BenchCase], PeerAnswer]
    of_use: bool = False


@dataclass(frozen=True)
class WorkPrecision:
    """Results of one method on all cases.

    Args:
        of_use: the setting that users of rbfrag get.
        wrong: cases whose outcome differs from the reference's.
        error_median: median relative error of the peak rotation, where the block remains stable.
        error_worst: maximum of these errors.
        time_s: median time of one run [s].
        time_low_s: its 10 % quantile over the cases [s].
        time_high_s: its 90 % quantile [s].
        slower: median over the cases of the ratio of its time to that of rbfrag as used.
        slower_least: minimum of these ratios.
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


def taylor_run(case: BenchCase, order: int = ORDER, ph_max: float = PH_MAX) -> PeerAnswer:
    """Run one case with rbfrag's kernel."""
    run = simulate(case.excitation, p2=case.p2, kr=case.kr, order=order, ph_max=ph_max)
    return PeerAnswer(OUTCOMES[run.outcome].value, run.peak_rad)


def refined_run(case: BenchCase) -> PeerAnswer:
    """Run one case with rbfrag's kernel in steps a third as long."""
    return taylor_run(case, ph_max=PH_MAX / 3.0)


def general_methods() -> tuple[BenchMethod, ...]:
    """Return the compared methods whose packages are installed with rbfrag."""
    steps = [
        BenchMethod("forward Euler", step_setting(parts), partial(euler, parts=parts))
        for parts in (1, 8, 64)
    ]
    solvers = [
        BenchMethod(f"scipy {name}", f"rtol {rtol:.0e}", partial(scipy_run, solver=name, rtol=rtol))
        for name in SOLVERS
        for rtol in (1e-4, 1e-6)
    ]
    return (*steps, *solvers)


def step_setting(parts: int) -> str:
    """Return the setting of a method with `parts` steps per sampling interval."""
    return "dt" if parts == 1 else f"dt/{parts}"


def measure(
    cases: Sequence[BenchCase],
    methods: Sequence[BenchMethod],
    *,
    judge: Callable[[BenchCase], PeerAnswer] = refined_run,
    seed: int = 1,
    on_case: Callable[[int, int], None] | None = None,
) -> tuple[WorkPrecision, ...]:
    """Run every method on every case and compare with a reference.

    Args:
        cases: blocks under motions.
        methods: methods to run; one of them is `of_use`, to which times are compared.
        judge: returns the answer that errors are measured from.
        seed: of the order in which the methods take turns on each case.
        on_case: called after each case with its number and the number of cases.
    """
    rng = np.random.default_rng(seed)
    for method in methods:
        method.run(cases[0])  # compiles, imports
    truth: list[PeerAnswer] = []
    answers: list[list[PeerAnswer]] = [[] for _ in methods]
    times_s = np.empty((len(methods), len(cases)))
    for j, case in enumerate(cases):
        truth.append(judge(case))
        of_case, times_s[:, j] = timed_in_turns([method.run for method in methods], case, rng)
        for of_method, answer in zip(answers, of_case, strict=True):
            of_method.append(answer)
        if on_case is not None:
            on_case(j + 1, len(cases))
    base = next(i for i, method in enumerate(methods) if method.of_use)
    return tuple(
        _row(method, truth, answers[i], times_s[i], times_s[base])
        for i, method in enumerate(methods)
    )


def _row(
    method: BenchMethod,
    truth: Sequence[PeerAnswer],
    answers: Sequence[PeerAnswer],
    times_s: np.ndarray,
    base_s: np.ndarray,
) -> WorkPrecision:
    errors = [
        abs(answer.peak_rad - right.peak_rad) / right.peak_rad
        for answer, right in zip(answers, truth, strict=True)
        if answer.outcome == right.outcome == STABLE
        if right.peak_rad > 0.0 and math.isfinite(answer.peak_rad)
    ]
    middle, low, high = spread(times_s)
    slower = times_s / base_s
    return WorkPrecision(
        family=method.family,
        setting=method.setting,
        of_use=method.of_use,
        cases=len(truth),
        wrong=sum(a.outcome != t.outcome for a, t in zip(answers, truth, strict=True)),
        error_median=float(np.median(errors)) if errors else None,
        error_worst=max(errors, default=None),
        time_s=middle,
        time_low_s=low,
        time_high_s=high,
        slower=float(np.median(slower)),
        slower_least=float(slower.min()),
    )


def work_precision_table(rows: Sequence[WorkPrecision]) -> tuple[list[str], list[list[str]]]:
    """Return headers and cells: the time against error of each method."""
    headers = [
        "method", "setting", "wrong", "error, median", "error, worst", "time of a run", "10–90 %",
        "slower, median", "slower, least",
    ]  # fmt: skip
    return headers, [
        [
            row.family,
            row.setting,
            f"{row.wrong} of {row.cases}",
            *("–" if x is None else f"{x:.1e}" for x in (row.error_median, row.error_worst)),
            seconds(row.time_s),
            f"{seconds(row.time_low_s)} – {seconds(row.time_high_s)}",
            *map(ratio, (row.slower, row.slower_least)),
        ]
        for row in rows
    ]
