"""How time grows: with the length of a record, the number of combinations, the workers."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from rbfrag.bench.cases import BenchCase
from rbfrag.bench.methods import taylor_run
from rbfrag.bench.timing import timed
from rbfrag.campaign.executors.local import prepare
from rbfrag.campaign.kinds.toppling import CAMPAIGN
from rbfrag.campaign.worker import MotionWork, PlannedCase, Task, run_work
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import DEFAULT_P2, POLARITIES
from rbfrag.solver.toppling_run import simulate


@dataclass(frozen=True)
class LengthRow:
    """One run under a record made longer.

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
    """One set of critical searches by local worker processes, wall time.

    Args:
        seconds: wall time, with the workers started and warm [s].
        per_s: combinations per second.
    """

    workers: int
    combinations: int
    seconds: float
    per_s: float


def record_length(
    motion: GroundMotion, *, times: Sequence[int] = (1, 2, 4, 8, 16)
) -> tuple[LengthRow, ...]:
    """Time one run, of a block that stays, under a record with zeros before it, or repeated."""
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
    processes: Sequence[int] = (1, 2),
    combinations: Sequence[int] = (12, 24, 48, 96),
) -> tuple[WorkersRow, ...]:
    """Time sets of critical searches, as a campaign hands them to its workers.

    Every motion brings both polarities and six p²; the database is left out.
    """
    each = len(POLARITIES) * len(DEFAULT_P2)
    rows = []
    for number in processes:
        context = get_context("spawn")
        with ProcessPoolExecutor(number, mp_context=context, initializer=prepare) as pool:
            warm = [_work(motions[i % len(motions)], i, 1) for i in range(4 * number)]
            list(pool.map(run_work, warm))
            for count in combinations:
                chosen = range(max(1, count // each))
                work = [_work(motions[i % len(motions)], i, each) for i in chosen]
                started = time.perf_counter()
                done = sum(len(answer.results) for answer in pool.map(run_work, work))
                seconds = time.perf_counter() - started
                rows.append(WorkersRow(number, done, seconds, done / seconds))
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
