"""Scaling with record length, combinations and workers:  python -m benchmarks.scaling"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from benchmarks.page import find_records, markdown, parser, report, write_csv
from rbfrag.bench.cases import BenchCase
from rbfrag.bench.timing import seconds, timed
from rbfrag.bench.work_precision import taylor_run
from rbfrag.campaign.executors.local import prepare
from rbfrag.campaign.kinds.toppling import CAMPAIGN
from rbfrag.campaign.worker import MotionWork, PlannedCase, Task, run_work
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import DEFAULT_P2, POLARITIES
from rbfrag.solver.toppling_run import simulate


@dataclass(frozen=True)
class LengthRow:
    """One run under a lengthened record.

    Args:
        lengthened: ``rest`` (zeros before it) or ``shaking`` (the record repeated).
        moved: sample intervals in which the block moves.
        run_s: time of one run with the excitation at hand [s].
        excitation_s: time to make the excitation from the record [s].
    """

    lengthened: str
    samples: int
    moved: int
    run_s: float
    excitation_s: float


@dataclass(frozen=True)
class WorkersRow:
    """Wall time of a set of critical searches by local worker processes.

    Args:
        seconds: wall time, with the workers started and warm [s].
        per_s: combinations per second.
    """

    workers: int
    combinations: int
    seconds: float
    per_s: float


def record_length(motion: GroundMotion, *, times: Sequence[int]) -> tuple[LengthRow, ...]:
    """Time one run of a stable block under a record preceded by zeros, or repeated."""
    p2, kr = 3.0, 0.5 * motion.pga_g
    samples = motion.acceleration_g
    taylor_run(BenchCase(motion, "forward", excitation(motion), p2, kr))  # compiles
    rows = []
    for lengthened in ("rest", "shaking"):
        for n in times:
            longer = (
                np.concatenate([np.zeros((n - 1) * samples.size), samples])
                if lengthened == "rest"
                else np.tile(samples, n)
            )
            record = GroundMotion(longer, motion.dt_s)
            excited, excitation_s = timed(lambda record=record: excitation(record))  # type: ignore[misc]
            case = BenchCase(record, "forward", excited, p2, kr)
            _, run_s = timed(lambda case=case: taylor_run(case))  # type: ignore[misc]
            moved = simulate(case.excitation, p2=case.p2, kr=case.kr).samples_moved
            rows.append(LengthRow(lengthened, longer.size, moved, run_s, excitation_s))
    return tuple(rows)


def workers(
    motions: Sequence[GroundMotion],
    *,
    processes: Sequence[int],
    combinations: Sequence[int],
) -> tuple[WorkersRow, ...]:
    """Time sets of critical searches, distributed to workers as in a campaign.

    Every motion brings both polarities and six p²; the database is left out.
    """
    per_motion = len(POLARITIES) * len(DEFAULT_P2)
    rows = []
    for number in processes:
        context = get_context("spawn")
        with ProcessPoolExecutor(number, mp_context=context, initializer=prepare) as pool:
            warm = [_work(motions[i % len(motions)], i, 1) for i in range(4 * number)]
            list(pool.map(run_work, warm))
            for count in combinations:
                chosen = range(max(1, count // per_motion))
                work = [_work(motions[i % len(motions)], i, per_motion) for i in chosen]
                started = time.perf_counter()
                searches = sum(len(answer.results) for answer in pool.map(run_work, work))
                seconds = time.perf_counter() - started
                rows.append(WorkersRow(number, searches, seconds, searches / seconds))
    return tuple(rows)


def _work(motion: GroundMotion, number: int, cases: int) -> MotionWork:
    planned = [
        PlannedCase(
            natural_key=f"{polarity} {case.p2}", polarity=polarity, vertical_id=None, case=case
        )
        for case in CAMPAIGN.cases()
        for polarity in POLARITIES
    ]
    tasks = tuple(Task(case) for case in planned[:cases])
    return MotionWork(motion_id=number, motion=motion, vertical=None, tasks=tasks, spectrum={})


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--times", type=int, nargs="+", default=[1, 2, 4, 8, 16])
    options.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    options.add_argument("--combinations", type=int, nargs="+", default=[24, 48, 96, 192])
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    lengths = record_length(records.motions[0], times=chosen.times)
    by_workers = workers(
        records.motions, processes=chosen.workers, combinations=chosen.combinations
    )
    if chosen.out is not None:
        write_csv(lengths, chosen.out / "record-length.csv")
        write_csv(by_workers, chosen.out / "workers.csv")
    by_length = (
        ["made longer by", "samples", "moved", "one run", "excitation"],
        [
            [
                row.lengthened,
                str(row.samples),
                str(row.moved),
                *map(seconds, (row.run_s, row.excitation_s)),
            ]
            for row in lengths
        ],
    )
    report("record-length", markdown(by_length), write=chosen.write)
    by_number = (
        ["workers", "combinations", "wall time", "combinations per second"],
        [
            [str(row.workers), str(row.combinations), seconds(row.seconds), f"{row.per_s:.0f}"]
            for row in by_workers
        ],
    )
    report("workers", markdown(by_number), write=chosen.write)


if __name__ == "__main__":
    main()
