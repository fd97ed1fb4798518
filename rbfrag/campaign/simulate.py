"""Running a campaign: local worker processes, one writer, resumed by its natural keys."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass

from sqlalchemy import Engine

from rbfrag.campaign.made_on import made_on
from rbfrag.campaign.plan import DEFAULT_P2, SETTINGS, MotionPlan, plan_campaign
from rbfrag.campaign.worker import MotionResults, MotionWork, prepare_worker, run_work
from rbfrag.db.campaign_store import (
    CombinationRecord,
    finish_campaign,
    insert_combinations,
    known_statuses,
    start_campaign,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.motion_store import load_motion
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.solver.results import NUMERICS_VERSION

QUEUED_PER_WORKER = 2
"""Motions handed out ahead of each worker: enough to keep it busy, little enough for memory."""


@dataclass(frozen=True)
class CampaignProgress:
    """How far a campaign is, in combinations."""

    done: int
    total: int
    resumed: int
    seconds: float

    @property
    def rate_per_s(self) -> float:
        """Combinations finished per second by this run."""
        made = self.done - self.resumed
        return made / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Estimated time left [s]; None before anything is finished."""
        return (self.total - self.done) / self.rate_per_s if self.rate_per_s else None


@dataclass(frozen=True)
class CampaignSummary:
    """What a finished campaign reports.

    Args:
        combinations: critical searches asked for (motions x polarity x p²).
        found: of these, with a critical value above the limit.
        below_limit: nothing topples down to the search limit (censored).
        no_motion: no block down to the limit ever lifts.
        outside_model: the motion is outside the model.
        runs: simulations made by this run.
        seconds: wall time of this run.
        resumed: combinations that were stored before.
    """

    combinations: int
    found: int
    below_limit: int
    no_motion: int
    outside_model: int
    runs: int
    seconds: float
    resumed: int

    def as_dict(self) -> dict[str, float | int]:
        """Return the keys of the JSON contract."""
        return asdict(self)


def simulate(
    db: str | os.PathLike[str] | None = None,
    *,
    suite: str | None = None,
    p2: Sequence[float] = DEFAULT_P2,
    jobs: int | None = None,
    on_progress: Callable[[CampaignProgress], None] | None = None,
) -> CampaignSummary:
    """Find the critical block of every motion x polarity x p² and store it.

    What is stored already is not computed again, and each combination is stored in a
    transaction of its own: a run that was interrupted or killed is resumed by the same call.

    Args:
        db: the database (path, URL, or None for the default).
        suite: only the motions of this suite.
        p2: frequency parameters [1/s²].
        jobs: worker processes; None for one per processor, 1 for none (in this process).
        on_progress: called after each motion.

    Raises:
        InputError: nothing to run, or a value that cannot be used.
        DatabaseError: the database cannot be used.
        WorkFailedError: a worker died; what was finished is stored.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs must be at least 1, not {jobs}")
    started = time.perf_counter()
    with opened_database(db) as engine:
        with engine.begin() as connection:
            plans = plan_campaign(connection, suite=suite, p2=p2)
            keys = [case.natural_key for plan in plans for case in plan.cases]
            statuses = known_statuses(connection, keys)
            asked = {"suite": suite, "p2": list(map(float, p2)), **SETTINGS}
            campaign_id = start_campaign(connection, {**asked, "made_on": made_on()})
        resumed, runs = len(statuses), 0
        todo = [_without_known(plan, statuses) for plan in plans]
        todo = [plan for plan in todo if plan.cases]
        workers = min(jobs or os.cpu_count() or 1, len(todo))

        def report() -> None:
            if on_progress is not None:
                seconds = time.perf_counter() - started
                on_progress(CampaignProgress(len(statuses), len(keys), resumed, seconds))

        report()
        for done in _answers(_work(engine, todo), workers):
            runs += sum(result.n_runs for result in done.results)
            _store(engine, campaign_id, done)
            statuses.update(
                (case.natural_key, result.status)
                for case, result in zip(done.cases, done.results, strict=True)
            )
            report()
        with engine.begin() as connection:
            finish_campaign(connection, campaign_id)
    count = Counter(statuses.values())
    return CampaignSummary(
        combinations=len(keys),
        found=count["found"],
        below_limit=count["below_limit"],
        no_motion=count["no_motion"],
        outside_model=count["outside_model"],
        runs=runs,
        seconds=time.perf_counter() - started,
        resumed=resumed,
    )


def _without_known(plan: MotionPlan, known: dict[str, str]) -> MotionPlan:
    cases = tuple(case for case in plan.cases if case.natural_key not in known)
    return MotionPlan(motion_id=plan.motion_id, name=plan.name, cases=cases)


def _work(engine: Engine, plans: Sequence[MotionPlan]) -> Iterator[MotionWork]:
    for plan in plans:
        with engine.connect() as connection:
            motion = load_motion(connection, plan.motion_id)
        yield MotionWork(motion_id=plan.motion_id, motion=motion, cases=plan.cases)


def _answers(work: Iterator[MotionWork], workers: int) -> Iterator[MotionResults]:
    if workers <= 1:
        yield from map(run_work, work)
        return
    # spawn: the same on every system, and no lock or connection is inherited half-way
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=prepare_worker)
    running: set[Future[MotionResults]] = set()
    try:
        for item in work:
            running.add(pool.submit(run_work, item))
            if len(running) >= workers * (1 + QUEUED_PER_WORKER):
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in finished)
        while running:
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in finished)
    except BrokenProcessPool:
        raise WorkFailedError(
            "a worker process died (killed, or out of memory); what was finished is stored: "
            "run the same command again to go on, with fewer --jobs if memory is short"
        ) from None
    finally:
        for future in running:
            future.cancel()
        pool.shutdown(wait=True, cancel_futures=True)


def _store(engine: Engine, campaign_id: int, done: MotionResults) -> None:
    records = [
        CombinationRecord(
            natural_key=case.natural_key,
            motion_id=done.motion_id,
            vertical_motion_id=None,
            result=result,
            settings=SETTINGS,
            numerics_version=NUMERICS_VERSION,
        )
        for case, result in zip(done.cases, done.results, strict=True)
    ]
    with engine.begin() as connection:
        insert_combinations(connection, campaign_id, records)
