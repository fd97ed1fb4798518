"""What of a plan is still to do: what the database holds already is not computed again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.campaign.plan import CampaignPlan, Case, MotionPlan
from rbfrag.campaign.spectra import missing_sizes
from rbfrag.campaign.worker import Task
from rbfrag.db.campaigns import (
    KnownCombination,
    combinations_with_points,
    known_combinations,
)
from rbfrag.db.keys import response_key
from rbfrag.db.responses import known_responses
from rbfrag.db.spectra import spectrum_values
from rbfrag.motions.polarity import Polarity
from rbfrag.solver.results import NUMERICS_VERSION


@dataclass(frozen=True)
class Wanted:
    """What is asked for beside the critical search and its map.

    Args:
        grid: k_r/PGA of blocks to run for themselves, falling.
        histories: k_r/PGA of blocks whose motion in time is to be kept, falling.
        critical_history: keep that of each critical block.
    """

    grid: tuple[float, ...] = ()
    histories: tuple[float, ...] = ()
    critical_history: bool = False


@dataclass(frozen=True)
class MotionTasks:
    """What is to do on one horizontal motion.

    Args:
        plan: the motion.
        tasks: what its combinations lack.
        spectrum: p² [1/s²] at which its toppling spectrum is missing, by polarity.
    """

    plan: MotionPlan
    tasks: tuple[Task, ...]
    spectrum: dict[Polarity, tuple[float, ...]]


@dataclass(frozen=True)
class Todo:
    """The work that is left.

    Args:
        motions: those with something left to do, in the order of the plan.
        known: what is stored of each combination, by natural key.
    """

    motions: tuple[MotionTasks, ...]
    known: dict[str, KnownCombination]

    @property
    def tasks(self) -> int:
        """Number of combinations with something left to do."""
        return sum(len(each.tasks) for each in self.motions)


def still_to_do(connection: Connection, plan: CampaignPlan, wanted: Wanted) -> Todo:
    """Compare a plan with what is stored.

    Args:
        connection: the database.
        plan: the campaign.
        wanted: what it asks for beside the searches.
    """
    keys = [case.natural_key for case in plan.cases]
    known = known_combinations(connection, keys)
    gridded = combinations_with_points(connection, known, wanted.grid) if wanted.grid else set()
    asked = [
        (motion, case, _ratios(known.get(case.natural_key), wanted))
        for motion in plan.motions
        for case in motion.cases
    ]
    stored = known_responses(
        connection,
        (_key(motion, case, ratio) for motion, case, ratios in asked for ratio in ratios),
    )
    sizes = list(dict.fromkeys(case.p2 for case in plan.cases))
    spectra = spectrum_values(connection, p2=sizes)
    motions = []
    for motion in plan.motions:
        tasks = [_task(motion, case, known, gridded, stored, wanted) for case in motion.cases]
        left = tuple(task for task in tasks if task is not None)
        spectrum = missing_sizes(spectra, motion.motion.id, sizes)
        if left or spectrum:
            motions.append(MotionTasks(motion, left, spectrum))
    return Todo(tuple(motions), known)


def _task(
    motion: MotionPlan,
    case: Case,
    known: Mapping[str, KnownCombination],
    gridded: set[str],
    stored: set[str],
    wanted: Wanted,
) -> Task | None:
    there = known.get(case.natural_key)
    moves = motion.motion.pga_g > 0.0  # without motion k_r/PGA says nothing
    critical = None if there is None else there.kr_over_pga
    histories = tuple(
        ratio for ratio in wanted.histories if moves and _key(motion, case, ratio) not in stored
    )
    keep_critical = wanted.critical_history and (
        there is None or (critical is not None and _key(motion, case, critical) not in stored)
    )
    task = Task(
        case=case,
        search=there is None,
        grid=wanted.grid if moves and case.natural_key not in gridded else (),
        histories=histories,
        critical_history=keep_critical,
        critical_kr_over_pga=critical,
    )
    return task if task.search or task.grid or histories or keep_critical else None


def _ratios(there: KnownCombination | None, wanted: Wanted) -> Iterable[float]:
    yield from wanted.histories
    if wanted.critical_history and there is not None and there.kr_over_pga is not None:
        yield there.kr_over_pga


def _key(motion: MotionPlan, case: Case, kr_over_pga: float) -> str:
    row = motion.motion
    up = motion.vertical if case.vertical_id is not None else None
    return response_key(
        motion_sha256=row.sha256,
        dt_s=row.dt_s,
        vertical_sha256=None if up is None else up.vertical_sha256,
        polarity=case.polarity,
        kind="toppling",
        p2=case.p2,
        kr=kr_over_pga * row.pga_g,
        numerics_version=NUMERICS_VERSION,
    )
