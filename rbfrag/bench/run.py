"""All measurements of `rbfrag bench`, one after the other."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rbfrag.bench import methods
from rbfrag.bench.cases import choose_cases, choose_combinations, find_records
from rbfrag.bench.critical_search import SearchTimes, compare_searches
from rbfrag.bench.scaling import LengthRow, WorkersRow, record_length, workers
from rbfrag.bench.tables import Row
from rbfrag.bench.work_precision import WorkPrecision, measure
from rbfrag.campaign.machine import machine


@dataclass(frozen=True)
class Size:
    """How much is measured."""

    cases: int
    combinations: int
    times_longer: tuple[int, ...]
    workers: tuple[int, ...]
    searches: tuple[int, ...]


QUICK = Size(10, 3, (1, 4), (1, 2), (24,))
FULL = Size(24, 12, (1, 2, 4, 8, 16), (1, 2), (24, 48, 96))


@dataclass(frozen=True)
class BenchResult:
    """Everything that was measured.

    Args:
        machine: processor, cores, load, versions.
        records: a sentence about the motions.
        not_installed: packages of peers that were left out.
        seconds: wall time of all measurements [s].
        work_precision: time against error of each method.
        rocking: the same of free-standing blocks.
        critical_search: searches, and the same runs by others.
        record_length: scaling with the length of the record.
        workers: scaling with combinations and worker processes.
    """

    machine: dict[str, str | int | float | None]
    records: str
    not_installed: tuple[str, ...]
    seconds: float
    work_precision: tuple[WorkPrecision, ...]
    rocking: tuple[WorkPrecision, ...]
    critical_search: tuple[SearchTimes, ...]
    record_length: tuple[LengthRow, ...]
    workers: tuple[WorkersRow, ...]

    def tables(self) -> dict[str, Sequence[Row]]:
        """Return the measured rows by the name of their table."""
        return {
            "work-precision": self.work_precision,
            "work-precision-rocking": self.rocking,
            "critical-search": self.critical_search,
            "record-length": self.record_length,
            "workers": self.workers,
        }


def run_bench(
    records: str | os.PathLike[str] | None = None,
    *,
    quick: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> BenchResult:
    """Measure everything.

    Args:
        records: file or folder of accelerograms; None as for :func:`cases.find_records`.
        quick: few cases, under a minute.
        say: told what comes next.
    """
    size = QUICK if quick else FULL
    started = time.perf_counter()
    about = machine()
    chosen = find_records(records)
    say(f"{size.cases} runs under {chosen.source}, each by every method ...")
    cases = choose_cases(chosen, size.cases)
    work_precision = measure(cases, methods.methods(quick=quick))
    say("the same blocks free-standing ...")
    rocking = measure(
        cases, methods.rocking_methods(quick=quick), judge=methods.rocking_reference_run
    )
    say(f"{size.combinations} critical searches ...")
    searches = compare_searches(choose_combinations(chosen, size.combinations))
    say("scaling ...")
    length = record_length(chosen.motions[0], times=size.times_longer)
    by_workers = workers(chosen.motions, processes=size.workers, combinations=size.searches)
    return BenchResult(
        machine=about,
        records=chosen.source,
        not_installed=methods.missing_peers(),
        seconds=time.perf_counter() - started,
        work_precision=work_precision,
        rocking=rocking,
        critical_search=searches,
        record_length=length,
        workers=by_workers,
    )
