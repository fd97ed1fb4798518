"""Worker of a campaign: all computations for one motion, arrays in, results out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rbfrag.campaign.kind import Case, CaseRequest, CaseResult, SingleBlockCampaign
from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.db.campaigns import ResponseRecord
from rbfrag.db.keys import response_key
from rbfrag.db.rows import MotionRow
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.kind import Shaking
from rbfrag.solver.results import MAP_DEPTH, NUMERICS_VERSION, FloatArray, Polarity, SearchPoints


@dataclass(frozen=True)
class PlannedCase:
    """One combination: a case under one horizontal motion, with its vertical motion."""

    natural_key: str
    polarity: Polarity
    vertical_id: int | None
    case: Case

    def history_key(
        self, motion: GroundMotion | MotionRow, vertical_sha256: str | None, k_over_pga: float
    ) -> str:
        """Return the natural key of the response history of one block."""
        assert motion.dt_s is not None  # the database holds no other motions
        return response_key(
            motion_sha256=motion.sha256,
            dt_s=motion.dt_s,
            vertical_sha256=vertical_sha256,
            polarity=self.polarity,
            kind=self.case.kind,
            p2=self.case.size,
            kr=k_over_pga * motion.pga_g,
            numerics_version=NUMERICS_VERSION,
        )


@dataclass(frozen=True)
class Task:
    """Remaining work of one combination.

    Args:
        search: look for the critical value; False when it is stored.
        grid: run the outcome grid of the kind; False when it is stored.
        full_map: map what fails and what does not; the search is repeated for it.
        blocks: k/PGA of blocks to run for themselves, falling.
        histories: k/PGA of blocks whose motion in time is to be kept.
        critical_history: keep that of the critical block too.
        critical_k_over_pga: the critical value, where it is stored already.
    """

    planned: PlannedCase
    search: bool = True
    grid: bool = True
    full_map: bool = False
    blocks: tuple[float, ...] = ()
    histories: tuple[float, ...] = ()
    critical_history: bool = False
    critical_k_over_pga: float | None = None

    @property
    def asks(self) -> bool:
        """True if any work remains."""
        parts = (self.search, self.grid, self.full_map, self.blocks, self.histories)
        return any(parts) or self.critical_history


@dataclass(frozen=True, eq=False)
class TaskResult:
    """Results of a task; None and () if not requested.

    Args:
        critical: the search; None also where the kind has none.
        grid: outcomes of its grid.
        blocks: blocks run for themselves.
        responses: histories.
    """

    task: Task
    critical: CriticalResult | None
    grid: SearchPoints | None
    blocks: SearchPoints | None
    responses: tuple[ResponseRecord, ...]

    @property
    def runs(self) -> int:
        """Number of simulations."""
        searched = 0 if self.critical is None else self.critical.n_runs
        points = sum(len(part.outcome) for part in (self.grid, self.blocks) if part is not None)
        return searched + points + len(self.responses)


@dataclass(frozen=True, eq=False)
class MotionWork:
    """One horizontal motion with all work on it, sent once.

    Args:
        vertical: the vertical one of its recording, if a task needs it.
        spectrum: p² [1/s²] at which to compute its toppling spectrum, by polarity.
        map_depth: width of k/PGA that maps may leave undecided at a border.
    """

    motion_id: int
    motion: GroundMotion
    vertical: GroundMotion | None
    tasks: tuple[Task, ...]
    spectrum: Mapping[Polarity, Sequence[float]]
    map_depth: float = MAP_DEPTH


@dataclass(frozen=True, eq=False)
class MotionResults:
    """Results in the order of the tasks, and the numerics version of the worker.

    Args:
        spectrum: p² [1/s²] and X(p) [m/s] of the toppling spectrum, by polarity.
    """

    motion_id: int
    results: tuple[TaskResult, ...]
    spectrum: Mapping[Polarity, tuple[Sequence[float], FloatArray]]
    numerics_version: str


def run_work(work: MotionWork) -> MotionResults:
    """Run all work on one motion."""
    # together: cases of one excitation share what the kind derives from it
    groups: defaultdict[tuple[object, ...], list[Task]] = defaultdict(list)
    for task in work.tasks:
        planned = task.planned
        parts = (task.search or task.full_map, task.grid, task.full_map)
        groups[(planned.case.kind, planned.polarity, planned.vertical_id, *parts)].append(task)
    by_key: dict[str, TaskResult] = {}
    for tasks in groups.values():
        for result in _run_group(work, tasks):
            by_key[result.task.planned.natural_key] = result
    spectrum = {
        polarity: (p2, toppling_spectrum(work.motion, p2, polarity))
        for polarity, p2 in work.spectrum.items()
    }
    results = tuple(by_key[task.planned.natural_key] for task in work.tasks)
    return MotionResults(work.motion_id, results, spectrum, NUMERICS_VERSION)


def _run_group(work: MotionWork, tasks: list[Task]) -> list[TaskResult]:
    """Run tasks with the same request under the same excitation."""
    first = tasks[0]
    kind = campaign_of_kind(first.planned.case.kind)
    vertical = None if first.planned.vertical_id is None else work.vertical
    shaking = Shaking(work.motion, vertical, first.planned.polarity)
    search = first.search or first.full_map
    answers = [CaseResult(None, None)] * len(tasks)
    if search or first.grid:
        request = CaseRequest(search, first.grid, first.full_map, work.map_depth)
        answers = kind.run_cases(shaking, [task.planned.case for task in tasks], request)
    results = []
    for task, answer in zip(tasks, answers, strict=True):
        critical = answer.critical
        blocks = None
        if task.blocks:
            assert isinstance(kind, SingleBlockCampaign)
            blocks = kind.run_blocks(shaking, task.planned.case, task.blocks)
        ratios = list(task.histories)
        value = task.critical_k_over_pga if critical is None else critical.kr_over_pga
        if task.critical_history and value is not None:
            ratios.append(value)
        histories = (_history(work, task.planned, shaking, k) for k in dict.fromkeys(ratios))
        results.append(TaskResult(task, critical, answer.grid, blocks, tuple(histories)))
    return results


def _history(
    work: MotionWork, planned: PlannedCase, shaking: Shaking, k_over_pga: float
) -> ResponseRecord:
    motion, vertical, case = work.motion, shaking.vertical, planned.case
    kind = campaign_of_kind(case.kind)
    assert isinstance(kind, SingleBlockCampaign)
    response = kind.history(shaking, case, k_over_pga)
    return ResponseRecord(
        natural_key=planned.history_key(
            motion, None if vertical is None else vertical.sha256, k_over_pga
        ),
        motion_id=work.motion_id,
        vertical_motion_id=planned.vertical_id,
        polarity=planned.polarity,
        p2=case.size,
        kr=k_over_pga * motion.pga_g,
        response=response,
        numerics_version=NUMERICS_VERSION,
    )
