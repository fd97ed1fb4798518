"""Running a campaign: workers compute, one writer stores, resumed by its natural keys."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Literal

from sqlalchemy import Engine

from rbfrag.campaign.executors.choice import CLUSTER, check_workers, executor
from rbfrag.campaign.grid import checked_ratios, grid_of
from rbfrag.campaign.made_on import made_on
from rbfrag.campaign.plan import CampaignPlan, plan_campaign
from rbfrag.campaign.progress import CampaignProgress
from rbfrag.campaign.todo import MotionTasks, Todo, Wanted, still_to_do
from rbfrag.campaign.worker import MotionResults, MotionWork, run_work
from rbfrag.db.campaigns import (
    CombinationRecord,
    KnownCombination,
    finish_campaign,
    insert_combinations,
    insert_points,
    start_campaign,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.db.queries import Vertical
from rbfrag.db.responses import insert_responses
from rbfrag.db.spectra import store_spectrum
from rbfrag.errors import WorkFailedError
from rbfrag.solver.results import DEFAULT_P2, MAP_DEPTH, NUMERICS_VERSION


@dataclass(frozen=True)
class CampaignSummary:
    """What a finished campaign reports.

    Args:
        combinations: critical searches asked for (motions x vertical x polarity x p²).
        found: of these, with a critical value above the limit.
        below_limit: nothing topples down to the search limit (censored).
        no_motion: no block down to the limit ever lifts.
        outside_model: the motion is outside the model.
        certified: with a proven answer.
        reentrant: with a safe island below the critical value.
        runs: simulations made by this run.
        grid_runs: of these, runs of the requested grid.
        responses: histories that this run stored.
        without_vertical: horizontal motions that vertical shaking was asked for and have none.
        seconds: wall time of this run.
        resumed: combinations of which everything that is asked for was stored before.
        warnings: what a reader of the results should know.
    """

    combinations: int
    found: int
    below_limit: int
    no_motion: int
    outside_model: int
    certified: int
    reentrant: int
    runs: int
    grid_runs: int
    responses: int
    without_vertical: int
    seconds: float
    resumed: int
    warnings: tuple[str, ...] = field(default=())

    def as_dict(self) -> dict[str, object]:
        """Return the keys of the JSON contract."""
        return {**asdict(self), "warnings": list(self.warnings)}


def simulate(
    db: str | os.PathLike[str] | None = None,
    *,
    suite: str | None = None,
    p2: Sequence[float] = DEFAULT_P2,
    vertical: Vertical = "without",
    grid: int | Sequence[float] = (),
    store_responses: Sequence[float | Literal["critical"]] = (),
    jobs: int | None = None,
    scheduler: str | None = None,
    map_depth: float = MAP_DEPTH,
    on_progress: Callable[[CampaignProgress], None] | None = None,
) -> CampaignSummary:
    """Find the critical block of every motion x vertical x polarity x p² and store it.

    The toppling spectrum of each motion at these p² is stored with it.

    The toppling spectrum of every motion at these p² is stored with them. What is stored already
    is not computed again, and each combination is stored with all that belongs to it in one
    transaction: a run that was interrupted or killed is resumed by the
    same call. The database is the same whatever does the work.

    Args:
        db: the database (path, URL, or None for the default).
        suite: only the motions of this suite.
        p2: frequency parameters [1/s²].
        vertical: ``without`` vertical motion, ``with`` that of the same recording, or ``both``.
        grid: run blocks for themselves too, and store their peak rotation: at these k_r/PGA, or
            at that many from 0.99 down to 0.01, equally spaced in the logarithm.
        store_responses: keep the motion in time of blocks of these k_r/PGA; ``critical`` stands
            for the critical block of each combination.
        jobs: worker processes; None for one per processor, 1 for none (in this process).
        scheduler: address of a Dask scheduler whose workers take the place of local ones.
        map_depth: width of k_r/PGA that the maps may leave undecided at a border; the critical
            value does not depend on it. Another depth makes other combinations.
        on_progress: called after each motion.

    Raises:
        InputError: nothing to run, a value that cannot be used, no scheduler at that address.
        DatabaseError: the database cannot be used.
        WorkFailedError: a worker died; what was finished is stored.
    """
    check_workers(jobs, scheduler)
    wanted = _wanted(grid, store_responses)
    started = time.perf_counter()
    with opened_database(db) as engine:
        with engine.connect() as connection:
            plan = plan_campaign(
                connection, suite=suite, p2=p2, vertical=vertical, map_depth=map_depth
            )
            todo = still_to_do(connection, plan, wanted)
        with executor(run_work, jobs, scheduler if todo.motions else None) as execute:
            settings = {
                "suite": suite,
                "p2": list(map(float, p2)),
                "vertical": vertical,
                "grid": list(wanted.grid),
                "store_responses": list(map(str, store_responses)),
                "made_on": made_on() if scheduler is None else CLUSTER,
                **plan.settings,
            }
            with engine.begin() as connection:
                campaign_id = start_campaign(connection, settings)
            run = _Run(engine, campaign_id, plan, todo, started, on_progress)
            run.tell()
            for done in execute(_work(engine, todo, map_depth), len(todo.motions)):
                run.take(done)
            with engine.begin() as connection:
                finish_campaign(connection, campaign_id)
    return run.summary()


class _Run:
    """The writer of one run, and its counts."""

    def __init__(
        self,
        engine: Engine,
        campaign_id: int,
        plan: CampaignPlan,
        todo: Todo,
        started: float,
        on_progress: Callable[[CampaignProgress], None] | None,
    ) -> None:
        self._engine = engine
        self._campaign_id = campaign_id
        self._plan = plan
        self._started = started
        self._on_progress = on_progress
        self._known = dict(todo.known)
        self._total = len(plan.cases)
        self._resumed = self._done = self._total - todo.tasks
        self._runs = self._grid_runs = self._responses = 0

    def take(self, done: MotionResults) -> None:
        """Store the answers of one motion and count them."""
        if done.numerics_version != NUMERICS_VERSION:
            raise WorkFailedError(
                f"a worker computes with numerics version {done.numerics_version}, this rbfrag "
                f"with {NUMERICS_VERSION}: install the same version on all machines"
            )
        _store(self._engine, self._campaign_id, self._plan.settings, done)
        for result in done.results:
            self._done += 1
            self._runs += result.runs
            self._grid_runs += result.grid_runs
            self._responses += len(result.responses)
            if result.search is not None:
                found = result.search
                self._known[result.case.natural_key] = KnownCombination(
                    0, found.status, found.kr_over_pga, found.certified, bool(found.reentrant)
                )
        self.tell()

    def tell(self) -> None:
        """Report progress."""
        if self._on_progress is not None:
            self._on_progress(
                CampaignProgress(self._done, self._total, self._resumed, self._seconds())
            )

    def summary(self) -> CampaignSummary:
        """Return what the campaign reports."""
        known = self._known.values()
        status = [each.status for each in known]
        return CampaignSummary(
            combinations=self._total,
            found=status.count("found"),
            below_limit=status.count("below_limit"),
            no_motion=status.count("no_motion"),
            outside_model=status.count("outside_model"),
            certified=sum(each.certified for each in known),
            reentrant=sum(bool(each.reentrant) for each in known),
            runs=self._runs,
            grid_runs=self._grid_runs,
            responses=self._responses,
            without_vertical=self._plan.without_vertical,
            seconds=self._seconds(),
            resumed=self._resumed,
            warnings=self._plan.warnings,
        )

    def _seconds(self) -> float:
        return time.perf_counter() - self._started


def _wanted(
    grid: int | Sequence[float], store_responses: Sequence[float | Literal["critical"]]
) -> Wanted:
    histories = [value for value in store_responses if value != "critical"]
    return Wanted(
        grid=grid_of(grid) if isinstance(grid, int) else checked_ratios(grid, "--grid"),
        histories=checked_ratios(histories, "--store-responses"),
        critical_history="critical" in store_responses,
    )


def _work(engine: Engine, todo: Todo, map_depth: float) -> Iterator[MotionWork]:
    for each in todo.motions:
        yield _with_samples(engine, each, map_depth)


def _with_samples(engine: Engine, each: MotionTasks, map_depth: float) -> MotionWork:
    up = next((t.case.vertical_id for t in each.tasks if t.case.vertical_id is not None), None)
    with engine.connect() as connection:
        return MotionWork(
            motion_id=each.plan.motion.id,
            motion=load_motion(connection, each.plan.motion.id),
            vertical=None if up is None else load_motion(connection, up),
            tasks=each.tasks,
            spectrum=each.spectrum,
            map_depth=map_depth,
        )


def _store(
    engine: Engine, campaign_id: int, settings: Mapping[str, object], done: MotionResults
) -> None:
    records = [
        CombinationRecord(
            natural_key=each.case.natural_key,
            motion_id=done.motion_id,
            vertical_motion_id=each.case.vertical_id,
            result=each.search,
            settings=settings,
            numerics_version=done.numerics_version,
        )
        for each in done.results
        if each.search is not None
    ]
    points = {
        each.case.natural_key: each.blocks for each in done.results if each.blocks is not None
    }
    responses = [record for each in done.results for record in each.responses]
    with engine.begin() as connection:
        insert_combinations(connection, campaign_id, records)
        insert_points(connection, points)
        insert_responses(connection, responses)
        for part in done.spectrum:
            store_spectrum(
                connection,
                done.motion_id,
                polarity=part.polarity,
                p2=part.p2,
                x_m_s=part.x_m_s,
                numerics_version=done.numerics_version,
            )
