"""Campaigns of blocks that slump or slide: workers compute, one writer stores."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from sqlalchemy import Engine

from rbfrag.campaign.executors.choice import CLUSTER, check_workers, executor
from rbfrag.campaign.kind_plan import (
    KindCase,
    KindMotionPlan,
    KindPlan,
    plan_kind,
)
from rbfrag.campaign.kind_worker import KindResults, KindWork, run_kind_work
from rbfrag.campaign.made_on import made_on
from rbfrag.campaign.progress import CampaignProgress
from rbfrag.db.campaigns import (
    CombinationRecord,
    KnownCombination,
    finish_campaign,
    insert_combinations,
    known_combinations,
    start_campaign,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.db.queries import Vertical
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.solver.kind import Case
from rbfrag.solver.kinds import model_of_kind
from rbfrag.solver.models.sliding import THRESHOLDS_M
from rbfrag.solver.models.slumping import FAMILY, ROTATIONS_DEG, BlockClass
from rbfrag.solver.results import NUMERICS_VERSION


@dataclass(frozen=True)
class KindSummary:
    """What a finished campaign reports.

    Args:
        kind: ``slumping`` or ``sliding``.
        combinations: critical values asked for.
        found: of these, found.
        below_limit: nothing fails down to the search limit, or to where the model ends.
        no_motion: the motion never moves such a block.
        outside_model: the motion is outside the model.
        reentrant: with a stronger record that was seen to spare the block.
        runs: simulations made by this run.
        without_vertical: horizontal motions that vertical shaking was asked for and have none.
        seconds: wall time of this run.
        resumed: combinations that were stored before.
        warnings: what a reader of the results should know.
    """

    kind: str
    combinations: int
    found: int
    below_limit: int
    no_motion: int
    outside_model: int
    reentrant: int
    runs: int
    without_vertical: int
    seconds: float
    resumed: int
    warnings: tuple[str, ...] = field(default=())

    def as_dict(self) -> dict[str, Any]:
        """Return the keys of the JSON contract."""
        return {**self.__dict__, "warnings": list(self.warnings)}


def simulate_kind(
    db: str | os.PathLike[str] | None = None,
    *,
    kind: Literal["slumping", "sliding"],
    suite: str | None = None,
    rotations_deg: Sequence[float | None] = ROTATIONS_DEG,
    displacements_m: Sequence[float] = THRESHOLDS_M,
    family: Sequence[BlockClass] = FAMILY,
    vertical: Vertical = "without",
    jobs: int | None = None,
    scheduler: str | None = None,
    on_progress: Callable[[CampaignProgress], None] | None = None,
) -> KindSummary:
    """Find the critical values of blocks that slump, or slide, under every motion; store them.

    Slumping: the factor on each record that brings each block of the documented family down
    (`rbfrag.solver.models.slumping`). Sliding: the strength that slides each stated
    displacement, and the displacements of blocks of 23 strengths, on a level plane. What is
    stored already is not computed again; each motion is stored in one transaction, and a run that
    was interrupted is resumed by the same call.

    Args:
        db: the database (path, URL, or None for the default).
        kind: ``slumping`` or ``sliding``.
        suite: only the motions of this suite.
        rotations_deg: slumping: rotations that count as failure [deg]; None for failure past
            recovery.
        displacements_m: sliding: displacements [m].
        family: slumping: the blocks.
        vertical: ``without`` vertical motion, ``with`` that of the same recording, or ``both``.
        jobs: worker processes; None for one per processor, 1 for none (in this process).
        scheduler: address of a Dask scheduler whose workers take the place of local ones.
        on_progress: called after each motion.

    Raises:
        InputError: nothing to run, a value that cannot be used, no scheduler at that address.
        DatabaseError: the database cannot be used.
        WorkFailedError: a worker died; what was finished is stored.
    """
    check_workers(jobs, scheduler)
    if kind == "slumping":
        criteria = model_of_kind(kind).cases(rotations_deg=rotations_deg, family=family)
        asked: dict[str, object] = {"rotations_deg": list(rotations_deg)}
    elif kind == "sliding":
        criteria = model_of_kind(kind).cases(displacements_m=displacements_m)
        asked = {"displacements_m": list(displacements_m)}
    else:
        raise InputError(f"--kind {kind}: campaigns are of toppling, slumping or sliding")
    started = time.perf_counter()
    with opened_database(db) as engine:
        plan, known = _plan(engine, criteria, suite, vertical)
        todo = list(_todo(plan, known))
        with executor(run_kind_work, jobs, scheduler if todo else None) as execute:
            settings = {
                "kind": kind,
                "suite": suite,
                "vertical": vertical,
                **asked,
                "made_on": made_on() if scheduler is None else CLUSTER,
            }
            with engine.begin() as connection:
                campaign_id = start_campaign(connection, settings)
            total = len(plan.cases)
            resumed = done = len(known)
            runs = 0
            _tell(on_progress, done, total, resumed, started)
            for answer in execute(_work(engine, todo), len(todo)):
                _store(engine, campaign_id, answer)
                for case, result in answer.results:
                    known[case.natural_key] = KnownCombination(
                        0,
                        result.status,
                        result.kr_over_pga,
                        result.certified,
                        bool(result.reentrant),
                    )
                    runs += result.n_runs
                done += len(answer.results)
                _tell(on_progress, done, total, resumed, started)
            with engine.begin() as connection:
                finish_campaign(connection, campaign_id)
    status = [each.status for each in known.values()]
    return KindSummary(
        kind=kind,
        combinations=total,
        found=status.count("found"),
        below_limit=status.count("below_limit"),
        no_motion=status.count("no_motion"),
        outside_model=status.count("outside_model"),
        reentrant=sum(bool(each.reentrant) for each in known.values()),
        runs=runs,
        without_vertical=plan.without_vertical,
        seconds=time.perf_counter() - started,
        resumed=resumed,
        warnings=plan.warnings,
    )


def _plan(
    engine: Engine, criteria: Sequence[Case], suite: str | None, vertical: Vertical
) -> tuple[KindPlan, dict[str, KnownCombination]]:
    with engine.connect() as connection:
        plan = plan_kind(connection, criteria, suite=suite, vertical=vertical)
        known = known_combinations(connection, (case.natural_key for case in plan.cases))
    return plan, known


def _todo(
    plan: KindPlan, known: Mapping[str, KnownCombination]
) -> Iterator[tuple[KindMotionPlan, tuple[KindCase, ...]]]:
    for each in plan.motions:
        left = tuple(case for case in each.cases if case.natural_key not in known)
        if left:
            yield each, left


def _work(
    engine: Engine, todo: Sequence[tuple[KindMotionPlan, tuple[KindCase, ...]]]
) -> Iterator[KindWork]:
    for plan, cases in todo:
        up = next((case.vertical_id for case in cases if case.vertical_id is not None), None)
        # the connection is given back before the work is: a reader would hold up the writer
        with engine.connect() as connection:
            motion = load_motion(connection, plan.motion.id)
            vertical = None if up is None else load_motion(connection, up)
        yield KindWork(plan.motion.id, motion, vertical, cases)


def _store(engine: Engine, campaign_id: int, answer: KindResults) -> None:
    if answer.numerics_version != NUMERICS_VERSION:
        raise WorkFailedError(
            f"a worker computes with numerics version {answer.numerics_version}, this rbfrag "
            f"with {NUMERICS_VERSION}: install the same version on all machines"
        )
    records = [
        CombinationRecord(
            natural_key=case.natural_key,
            motion_id=answer.motion_id,
            vertical_motion_id=case.vertical_id,
            result=result,
            settings=case.settings,
            kind=case.kind,
            numerics_version=answer.numerics_version,
            block=case.block,
        )
        for case, result in answer.results
    ]
    with engine.begin() as connection:
        insert_combinations(connection, campaign_id, records)


def _tell(
    on_progress: Callable[[CampaignProgress], None] | None,
    done: int,
    total: int,
    resumed: int,
    started: float,
) -> None:
    if on_progress is not None:
        on_progress(CampaignProgress(done, total, resumed, time.perf_counter() - started))
