"""Simulation campaign: workers compute, one writer stores; resumable by natural keys."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypedDict, Unpack

from sqlalchemy import Engine

from rbfrag.campaign.executors import Stopped, check_workers, never
from rbfrag.campaign.kind import Case
from rbfrag.campaign.kinds import campaign_kinds, campaign_of_kind
from rbfrag.campaign.plan import (
    CampaignPlan,
    ExtraResults,
    MotionChoice,
    checked_ratios,
    plan_campaign,
    remaining_work,
    strengths_of,
)
from rbfrag.campaign.runner import Workforce
from rbfrag.campaign.sequences import sequences_of_kind, simulate_sequences
from rbfrag.campaign.summary import CampaignProgress as CampaignProgress
from rbfrag.campaign.summary import CampaignSummary as CampaignSummary
from rbfrag.campaign.worker import MotionResults, MotionWork, Task, TaskResult, run_work
from rbfrag.db.campaigns import (
    CombinationRecord,
    KnownCombination,
    add_grids,
    add_maps,
    insert_combinations,
    insert_points,
    insert_responses,
    store_spectrum,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.db.rows import Vertical
from rbfrag.errors import InputError, UnknownFieldError, WorkFailedError
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import MAP_DEPTH, Polarity

SAME_VALUE = 1e-9
"""Relative difference up to which a search that is repeated on another processor is the same."""

DESCRIBED = ("p2", "rotations_deg", "displacements_m", "family", "restitution_factors")
OPTIONS = (*DESCRIBED, "grid", "store_responses", "full_map")
"""What may be asked of a kind; the former describe its blocks."""


class CampaignOptions(TypedDict, total=False):
    """Options of a campaign."""

    suite: str | None
    p2: Sequence[float] | None
    rotations_deg: Sequence[float | None] | None
    displacements_m: Sequence[float] | None
    family: Sequence[Any] | None
    restitution_factors: Sequence[float] | None
    vertical: Vertical
    include_structures: bool
    where: str | None
    grid: int | Sequence[float] | None
    store_responses: Sequence[float | Literal["critical"]] | None
    full_map: bool
    map_depth: float


def simulate(
    db: str | os.PathLike[str] | None = None,
    *,
    kind: str = "toppling",
    sequence: bool = False,
    seed: int = 1,
    draws: int = 1,
    jobs: int | None = None,
    scheduler: str | None = None,
    on_progress: Callable[[CampaignProgress], None] | None = None,
    stopped: Stopped = never,
    **request: Unpack[CampaignOptions],
) -> CampaignSummary:
    """Store critical values and outcomes of every motion x vertical x polarity x block.

    Of each combination the critical value with its certificate is stored, and the outcomes of
    the blocks of a grid that does not depend on them: what fits read. For blocks described by
    p² the toppling spectrum of each motion goes with them. What is stored already is not computed
    again, and each motion is stored in one transaction: a run that was interrupted or killed is
    resumed by the same call. The database is the same whatever does the work.

    Args:
        db: the database (path, URL, or None for the default).
        kind: what the blocks do; an option of another kind is rejected.
        suite: only the motions of this suite.
        p2: toppling and rocking: frequency parameters p² [1/s²]; None for 30, 10, 3, 1, 0.3 and
            0.1.
        rotations_deg: slumping: rotations that count as failure [deg], None among them for
            failure past recovery; None for 2 and past recovery.
        displacements_m: sliding: displacements on a level plane [m]; None for 0.01, 0.05, 0.15
            and 0.3.
        family: slumping and confined_toppling: the blocks, as
            `rbfrag.campaign.kinds.slumping.FAMILY` has them.
        restitution_factors: rocking: factors on the restitution of the rectangle, 1 - 1.5 sin² α
            (Housner 1963); None for 1, 0.95, 0.9 and 0.8.
        vertical: ``without`` vertical motion (if left out), ``with`` that of the same recording,
            or ``both``.
        include_structures: use motions of sensors on structures, which are excluded by default.
        where: only motions that meet this condition over their metadata and measures, such as
            ``"vs30_m_s > 600 and magnitude >= 6"``.
        grid: toppling: run more blocks for themselves: at these k_r/PGA, or at that many from
            0.99 down to 0.01, equally spaced in the logarithm.
        store_responses: toppling: keep the motion in time of blocks of these k_r/PGA;
            ``critical`` stands for the critical block of each combination.
        full_map: map the intervals of k_r/PGA that fail and that do not, down to the limit.
        map_depth: width of k_r/PGA that the maps may leave undecided at a border; a map that is
            stored stays as it is.
        sequence: sliding, slumping and confined_toppling: run blocks under two motions, one after
            the other, and return the conditional fragility; two shocks of one station where
            metadata state them, and each other motion after a drawn one of another earthquake.
        seed: of the draws of a sequence.
        draws: how many first motions are drawn for each second one.
        jobs: worker processes; None for one per processor, 1 for none (in this process).
        scheduler: address of a Dask scheduler whose workers take the place of local ones.
        on_progress: called after each motion.
        stopped: asked now and then whether to end after the motions in hand.

    Raises:
        InputError: nothing to run, a value that cannot be used, no scheduler at that address.
        DatabaseError: the database cannot be used.
        WorkFailedError: a worker died; what was finished is stored.
        StoppedError: `stopped` said so; what was finished is stored.
    """
    UnknownFieldError.reject(request, CampaignOptions, "a campaign")
    check_workers(jobs, scheduler)
    workforce = Workforce(jobs, scheduler, on_progress, stopped)
    suite, vertical = request.get("suite"), request.get("vertical", "without")
    motions: MotionChoice = {
        "suite": suite,
        "include_structures": request.get("include_structures", False),
        "where": request.get("where"),
    }
    full_map, histories = request.get("full_map", False), request.get("store_responses")
    options: dict[str, Any] = {
        name: value for name, value in request.items() if value is not None and value is not False
    }
    described = {name: options[name] for name in DESCRIBED if name in options}
    if sequence:
        sequences_of_kind(kind)
    cases = _cases(kind, described, [name for name in OPTIONS if name in options])
    extra = _extra_results(request.get("grid"), histories, full_map)
    depth = positive(request.get("map_depth", MAP_DEPTH), "map_depth", "a width of k_r/PGA")
    if sequence:
        if vertical != "without":
            raise InputError(
                "vertical cannot be combined with sequence: omit one of them",
                fields=("vertical", "sequence"),
            )
        return simulate_sequences(
            sequences_of_kind(kind),
            cases,
            db=db,
            motions=motions,
            seed=seed,
            draws=draws,
            workforce=workforce,
        )
    started = time.perf_counter()
    with opened_database(db) as engine:
        with engine.connect() as connection:
            plan = plan_campaign(connection, kind, cases, vertical=vertical, **motions)
            todo, stored = remaining_work(connection, plan, extra)
        settings = {
            "kind": kind,
            "suite": suite,
            "where": motions["where"],
            "vertical": vertical,
            **{name: list(value) for name, value in described.items() if name != "family"},
            "grid": list(extra.blocks),
            "store_responses": list(map(str, histories or ())),
            "map_depth": depth if full_map else None,
        }
        run = _Run(engine, plan, stored, lacking=sum(len(tasks) for _, tasks, _ in todo))
        work = (_with_samples(engine, *motion_tasks, depth) for motion_tasks in todo)
        workforce.carry_out(
            engine, settings, run_work, work, len(todo), run.take, total=run.total,
            resumed=run.resumed, started=started,
        )  # fmt: skip
    return run.summary(time.perf_counter() - started)


def _cases(kind: str, described: dict[str, Any], names: Sequence[str]) -> tuple[Case, ...]:
    """Return the combinations of the kind; options of other kinds are rejected."""
    campaign = campaign_of_kind(kind)
    for name in names:
        if name not in campaign.options:
            owners = [
                owner for owner in campaign_kinds() if name in campaign_of_kind(owner).options
            ]
            raise InputError(
                f"{name} requires kind {' or '.join(owners)}",
                fields=(name, "kind"),
            )
    return campaign.cases(**described)


class _Run:
    """Writer of one campaign, with its counts."""

    def __init__(
        self,
        engine: Engine,
        plan: CampaignPlan,
        stored: dict[str, KnownCombination],
        *,
        lacking: int,
    ) -> None:
        self._engine = engine
        self._plan = plan
        self._combinations = stored
        self.total = len(plan.cases)
        self.resumed = self.total - lacking
        self._runs = self._grid_runs = self._responses = 0

    def take(self, campaign_id: int, results: MotionResults) -> int:
        """Store and count the results of one motion; return their number."""
        for result in results.results:
            self._compare(result)
        _store(self._engine, campaign_id, results)
        for result in results.results:
            self._runs += result.runs
            self._grid_runs += 0 if result.blocks is None else len(result.blocks.outcome)
            self._responses += len(result.responses)
            if result.task.search or result.task.full_map:
                state = KnownCombination(0, "not_searched", None, False, None)
                if (now := result.critical) is not None:
                    state = KnownCombination(
                        0, now.status, now.kr_over_pga, now.certified, now.reentrant
                    )
                self._combinations[result.task.planned.natural_key] = state
        return len(results.results)

    def _compare(self, result: TaskResult) -> None:
        """Reject a repeated search that contradicts a stored one."""
        before = self._combinations.get(result.task.planned.natural_key)
        now = result.critical
        if before is None or now is None:
            return
        then, again = before.kr_over_pga or 0.0, now.kr_over_pga or 0.0
        if before.status != now.status or not math.isclose(then, again, rel_tol=SAME_VALUE):
            raise WorkFailedError(
                f"combination {before.id} is stored with status {before.status} and the critical "
                f"value {before.kr_over_pga!r}, the search repeated for its map gives {now.status} "
                f"and {now.kr_over_pga!r}: look at the database with  rbfrag db check"
            )

    def summary(self, seconds: float) -> CampaignSummary:
        """Return the summary of the campaign."""
        combinations = self._combinations.values()
        status = [combination.status for combination in combinations]
        return CampaignSummary(
            kind=self._plan.kind,
            combinations=self.total,
            found=status.count("found"),
            below_limit=status.count("below_limit"),
            no_motion=status.count("no_motion"),
            outside_model=status.count("outside_model"),
            not_searched=status.count("not_searched"),
            certified=sum(combination.certified for combination in combinations),
            reentrant=sum(bool(combination.reentrant) for combination in combinations),
            runs=self._runs,
            grid_runs=self._grid_runs,
            responses=self._responses,
            without_vertical=self._plan.without_vertical,
            seconds=seconds,
            resumed=self.resumed,
            warnings=self._plan.warnings,
        )


def _extra_results(
    grid: int | Sequence[float] | None,
    store_responses: Sequence[float | Literal["critical"]] | None,
    full_map: bool,
) -> ExtraResults:
    selected = store_responses or ()
    histories = [value for value in selected if value != "critical"]
    blocks = strengths_of(grid) if isinstance(grid, int) else checked_ratios(grid or (), "grid")
    return ExtraResults(
        full_map=full_map,
        blocks=blocks,
        histories=checked_ratios(histories, "store_responses"),
        critical_history="critical" in selected,
    )


def _with_samples(
    engine: Engine,
    motion_id: int,
    tasks: tuple[Task, ...],
    spectrum: Mapping[Polarity, Sequence[float]],
    map_depth: float,
) -> MotionWork:
    verticals = (task.planned.vertical_id for task in tasks)
    up = next((vertical_id for vertical_id in verticals if vertical_id is not None), None)
    # the connection is given back before the work is: a reader would hold up the writer
    with engine.connect() as connection:
        motion = load_motion(connection, motion_id)
        vertical = None if up is None else load_motion(connection, up)
    return MotionWork(motion_id, motion, vertical, tasks, spectrum, map_depth)


def _store(engine: Engine, campaign_id: int, results: MotionResults) -> None:
    by_key = {result.task.planned.natural_key: result for result in results.results}
    stored = {key: result for key, result in by_key.items() if not result.task.search}
    records = [
        CombinationRecord(
            natural_key=key,
            motion_id=results.motion_id,
            vertical_motion_id=result.task.planned.vertical_id,
            polarity=result.task.planned.polarity,
            result=result.critical,
            grid=result.grid,
            numerics_version=results.numerics_version,
            **vars(result.task.planned.case),
        )
        for key, result in by_key.items()
        if result.task.search
    ]
    grids = {key: result.grid for key, result in stored.items() if result.grid is not None}
    maps = {key: result.critical for key, result in stored.items() if result.critical is not None}
    blocks = {key: result.blocks for key, result in by_key.items() if result.blocks is not None}
    responses = [record for result in results.results for record in result.responses]
    with engine.begin() as connection:
        insert_combinations(connection, campaign_id, records)
        add_grids(connection, grids)
        add_maps(connection, maps)
        insert_points(connection, blocks)
        insert_responses(connection, responses)
        for polarity, (p2, x_m_s) in results.spectrum.items():
            store_spectrum(
                connection, results.motion_id, polarity=polarity, p2=p2, x_m_s=x_m_s,
                numerics_version=results.numerics_version,
            )  # fmt: skip
