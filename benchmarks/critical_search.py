"""The critical search against 23 runs of the same blocks:  python -m benchmarks.critical_search

The 23 runs are those of the dissertation's search; all are paired in one process.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.cvode import cvode_is_installed, cvode_run
from benchmarks.page import find_records, markdown, parser, report, write_csv
from rbfrag.bench.peers import BenchCase, Records
from rbfrag.bench.work_precision import ratio, seconds, spread, taylor_run, timed_in_turns
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.results import DEFAULT_P2, POLARITIES, SEARCH_LIMIT, Polarity
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import OUTCOMES

SCAN = 11
"""Runs of the descending scan, evenly in ln k_r between PGA and the search limit ..."""

BISECTIONS = 12
"""... and of the bisection below the first that topples: 23 runs in all."""


@dataclass(frozen=True)
class SearchTimes:
    """Computing times of one search method over all combinations.

    Args:
        name: what was run.
        combinations: how many combinations.
        time_s: median time per combination [s].
        time_low_s: its 10 % quantile [s].
        time_high_s: its 90 % quantile [s].
        over_runs: median of its time over that of the same 23 runs by rbfrag, side by side.
        over_runs_least: least of these ratios.
        over_search: median of its time over that of the whole critical search.
        over_search_least: least of these ratios.
        wrong: outcomes that differ from those of rbfrag's kernel; None for the search.
    """

    name: str
    combinations: int
    time_s: float
    time_low_s: float
    time_high_s: float
    over_runs: float
    over_runs_least: float
    over_search: float
    over_search_least: float
    wrong: int | None


def choose_combinations(
    records: Records, number: int, *, seed: int = 1
) -> tuple[tuple[GroundMotion, Polarity, float], ...]:
    """Draw (motion, polarity, p²) for critical searches; p² in turn, no motion twice in a row."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(records.motions))
    return tuple(
        (
            records.motions[order[i % order.size]],
            POLARITIES[int(rng.integers(2))],
            float(DEFAULT_P2[i % len(DEFAULT_P2)]),
        )
        for i in range(number)
    )


def compare_searches(
    combinations: Sequence[tuple[GroundMotion, Polarity, float]],
    *,
    tolerances: Sequence[float] = (1e-6, 1e-8),
    seed: int = 1,
    on_combination: Callable[[int, int], None] | None = None,
) -> tuple[SearchTimes, ...]:
    """Time the critical search, and the same 23 runs with rbfrag's kernel and with CVODE.

    The 23 values of k_r are those of a descending scan and a bisection, made beforehand:
    every method runs the same values, whatever it would have found itself.

    Args:
        combinations: motions with polarity and p² [1/s²].
        tolerances: relative tolerances of CVODE; not run where it is not installed.
        seed: of the order in which the methods take turns on each combination.
        on_combination: called after each combination with (done, total).
    """
    rng = np.random.default_rng(seed)
    names = ["critical search", "23 runs, rbfrag, side by side", "23 runs, rbfrag, one by one"]
    works: list[Callable[[tuple[BenchCase, ...]], object]] = [
        lambda cases: critical(cases[0].motion, p2=cases[0].p2, polarity=cases[0].polarity),
        _runs_in_batch,
        lambda cases: tuple(taylor_run(case).outcome for case in cases),
    ]
    if cvode_is_installed():
        for rtol in tolerances:
            names.append(f"23 runs, CVODE in Python, rtol {rtol:.0e}")
            works.append(_runs_by_cvode(rtol))
    times_s = np.empty((len(works), len(combinations)))
    wrong = [0] * len(works)
    for j, (motion, polarity, p2) in enumerate(combinations):
        cases = search_runs(motion, polarity, p2)
        if j == 0:
            for work in works[:3]:
                work(cases)  # compiles
        answers, times_s[:, j] = timed_in_turns(works, cases, rng)
        ours = answers[1]
        assert isinstance(ours, tuple)
        for i in range(2, len(works)):
            theirs = answers[i]
            assert isinstance(theirs, tuple)
            wrong[i] += sum(a != b for a, b in zip(ours, theirs, strict=True))
        if on_combination is not None:
            on_combination(j + 1, len(combinations))
    rows = []
    for i, name in enumerate(names):
        middle, low, high = spread(times_s[i])
        over_search, over_runs = times_s[i] / times_s[0], times_s[i] / times_s[1]
        rows.append(
            SearchTimes(
                name=name,
                combinations=len(combinations),
                time_s=middle,
                time_low_s=low,
                time_high_s=high,
                over_runs=float(np.median(over_runs)),
                over_runs_least=float(over_runs.min()),
                over_search=float(np.median(over_search)),
                over_search_least=float(over_search.min()),
                wrong=None if i == 0 else wrong[i],
            )
        )
    return tuple(rows)


def search_runs(motion: GroundMotion, polarity: Polarity, p2: float) -> tuple[BenchCase, ...]:
    """Return the 23 runs of one search: a descending scan, then a bisection."""
    excited = excitation(motion, None, polarity)

    def case(ratio: float) -> BenchCase:
        return BenchCase(motion, polarity, excited, p2, ratio * excited.pga_g)

    ratios = np.geomspace(1.0, SEARCH_LIMIT, SCAN)
    runs = [case(float(ratio)) for ratio in ratios]
    topples = [taylor_run(run).outcome == "toppled" for run in runs]
    first = topples.index(True) if True in topples else SCAN - 1
    low, high = float(ratios[first]), float(ratios[max(first - 1, 0)])
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        runs.append(case(middle))
        if taylor_run(runs[-1]).outcome == "toppled":
            low = middle
        else:
            high = middle
    return tuple(runs)


def _runs_in_batch(cases: tuple[BenchCase, ...]) -> tuple[str, ...]:
    runs = simulate_many(
        cases[0].excitation, p2=cases[0].p2, kr=np.array([case.kr for case in cases])
    )
    return tuple(OUTCOMES[code].value for code in runs.outcome.tolist())


def _runs_by_cvode(rtol: float) -> Callable[[tuple[BenchCase, ...]], object]:
    return lambda cases: tuple(cvode_run(case, rtol).outcome for case in cases)


def table(rows: Sequence[SearchTimes]) -> tuple[list[str], list[list[str]]]:
    """Return the times of searches, and of the same runs with other methods."""
    headers = [
        "work for one combination", "time", "10–90 %", "over rbfrag's 23 runs, median", "least",
        "over the search, median", "least", "other outcomes",
    ]  # fmt: skip
    return headers, [
        [
            row.name,
            seconds(row.time_s),
            f"{seconds(row.time_low_s)} – {seconds(row.time_high_s)}",
            *map(ratio, (row.over_runs, row.over_runs_least)),
            *map(ratio, (row.over_search, row.over_search_least)),
            "" if row.wrong is None else f"{row.wrong} of {23 * row.combinations}",
        ]
        for row in rows
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--combinations", type=int, default=12)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--rtol", type=float, nargs="+", default=[1e-6, 1e-8])
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    combinations = choose_combinations(records, chosen.combinations, seed=chosen.seed)
    rows = compare_searches(
        combinations,
        tolerances=chosen.rtol,
        seed=chosen.seed,
        on_combination=lambda number, total: print(f"{number}/{total}", file=sys.stderr),
    )
    if chosen.out is not None:
        write_csv(rows, chosen.out / "critical-search.csv")
    about = f"{len(combinations)} combinations of {records.source}, seed {chosen.seed}."
    report(
        "critical-search",
        f"{markdown(table(rows))}\n\n{about}",
        write=chosen.write,
    )


if __name__ == "__main__":
    main()
