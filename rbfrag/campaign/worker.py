"""What a worker does: everything that is asked of one motion, arrays in, results out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rbfrag.campaign.grid import run_grid
from rbfrag.campaign.open_blocks import open_blocks
from rbfrag.campaign.plan import Case
from rbfrag.campaign.spectra import SpectrumPart, spectrum_parts
from rbfrag.db.keys import response_key
from rbfrag.db.responses import ResponseRecord
from rbfrag.fragility.fit.source import kr_over_pga_of_grid
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.solver.excitation import kept_excitation
from rbfrag.solver.results import MAP_DEPTH, NUMERICS_VERSION, CriticalResult, SearchPoints
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond


@dataclass(frozen=True)
class Task:
    """What is still to do for one combination.

    Args:
        case: the combination.
        search: make the critical search; False when its answer is stored.
        grid: k_r/PGA of blocks to run for themselves, falling.
        histories: k_r/PGA of blocks whose motion in time is to be kept.
        critical_history: keep that of the critical block too.
        critical_kr_over_pga: the critical value, where it is stored already.
    """

    case: Case
    search: bool = True
    grid: tuple[float, ...] = ()
    histories: tuple[float, ...] = ()
    critical_history: bool = False
    critical_kr_over_pga: float | None = None


@dataclass(frozen=True, eq=False)
class TaskResult:
    """What a task gave; None and () where nothing was asked for.

    Args:
        case: the combination.
        search: its search.
        blocks: blocks run for themselves: of the requested grid, and those that the map left open.
        grid_runs: how many of them were requested.
        responses: histories.
    """

    case: Case
    search: CriticalResult | None
    blocks: SearchPoints | None
    grid_runs: int
    responses: tuple[ResponseRecord, ...]

    @property
    def runs(self) -> int:
        """How many simulations were made."""
        return (
            (0 if self.search is None else self.search.n_runs)
            + (0 if self.blocks is None else len(self.blocks.outcome))
            + len(self.responses)
        )


@dataclass(frozen=True, eq=False)
class MotionWork:
    """One horizontal motion with all that is to do on it: it travels once.

    Args:
        motion_id: row id of the motion.
        motion: the motion.
        vertical: the vertical one of its recording, if a task needs it.
        tasks: what to do.
        spectrum: p² [1/s²] at which to compute its toppling spectrum, by polarity.
        map_depth: width of k_r/PGA that the maps may leave undecided at a border.
    """

    motion_id: int
    motion: GroundMotion
    vertical: GroundMotion | None
    tasks: tuple[Task, ...]
    spectrum: Mapping[Polarity, Sequence[float]]
    map_depth: float = MAP_DEPTH


@dataclass(frozen=True, eq=False)
class MotionResults:
    """The answers, in the order of the tasks, and the numerics of whoever gave them."""

    motion_id: int
    results: tuple[TaskResult, ...]
    spectrum: tuple[SpectrumPart, ...]
    numerics_version: str


def run_work(work: MotionWork) -> MotionResults:
    """Do everything that is asked of one motion."""
    results = tuple(_run_task(work, task) for task in work.tasks)
    spectrum = spectrum_parts(work.motion, work.spectrum)
    return MotionResults(work.motion_id, results, spectrum, NUMERICS_VERSION)


def _run_task(work: MotionWork, task: Task) -> TaskResult:
    case = task.case
    vertical = None if case.vertical_id is None else work.vertical
    search = None
    critical_kr_over_pga = task.critical_kr_over_pga
    if task.search:
        search = critical(
            work.motion,
            p2=case.p2,
            polarity=case.polarity,
            vertical=vertical,
            full_map=True,
            map_depth=work.map_depth,
        )
        critical_kr_over_pga = search.kr_over_pga
    strengths = set(task.grid)
    if search is not None:
        blocks = kr_over_pga_of_grid(case.p2, work.motion.pgv_m_s, work.motion.pga_g)
        strengths.update(open_blocks(search, blocks))
    alone = None
    if strengths:
        drive = kept_excitation(work.motion, vertical, case.polarity)
        alone = run_grid(drive, case.p2, sorted(strengths, reverse=True))
    wanted = list(task.histories)
    if task.critical_history and critical_kr_over_pga is not None:
        wanted.append(critical_kr_over_pga)
    responses = tuple(_history(work, case, vertical, ratio) for ratio in dict.fromkeys(wanted))
    return TaskResult(case, search, alone, len(task.grid), responses)


def _history(
    work: MotionWork, case: Case, vertical: GroundMotion | None, kr_over_pga: float
) -> ResponseRecord:
    motion = work.motion
    assert motion.dt_s is not None  # the database holds no other motions
    kr = kr_over_pga * motion.pga_g
    response = respond(
        motion, p2=case.p2, kr=kr, vertical=vertical, polarity=case.polarity, history=True
    )
    key = response_key(
        motion_sha256=motion.sha256,
        dt_s=motion.dt_s,
        vertical_sha256=None if vertical is None else vertical.sha256,
        polarity=case.polarity,
        kind=response.kind,
        p2=case.p2,
        kr=kr,
        numerics_version=NUMERICS_VERSION,
    )
    return ResponseRecord(
        natural_key=key,
        motion_id=work.motion_id,
        vertical_motion_id=case.vertical_id,
        polarity=case.polarity,
        p2=case.p2,
        kr=kr,
        response=response,
        numerics_version=NUMERICS_VERSION,
    )
