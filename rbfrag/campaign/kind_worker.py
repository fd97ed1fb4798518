"""What a worker does on one motion of a campaign of blocks that slump or slide."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Any

from rbfrag.campaign.kind_plan import KindCase
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.kind import Case
from rbfrag.solver.kinds import model_of_kind
from rbfrag.solver.results import NUMERICS_VERSION, CriticalResult, SearchPoints


@dataclass(frozen=True, eq=False)
class KindWork:
    """One horizontal motion with the critical values that are wanted of it.

    Args:
        motion_id: row id of the motion.
        motion: the motion.
        vertical: the vertical one of its recording, if a case needs it.
        cases: what to find.
    """

    motion_id: int
    motion: GroundMotion
    vertical: GroundMotion | None
    cases: tuple[KindCase, ...]


@dataclass(frozen=True, eq=False)
class KindResults:
    """The answers, in the order of the cases, and the numerics of whoever gave them."""

    motion_id: int
    results: tuple[tuple[KindCase, CriticalResult], ...]
    numerics_version: str


def run_kind_work(work: KindWork) -> KindResults:
    """Find every critical value that is wanted of one motion."""
    groups: defaultdict[Any, list[KindCase]] = defaultdict(list)
    for case in work.cases:
        groups[case.kind, case.polarity, case.vertical_id].append(case)
    found: dict[str, CriticalResult] = {}
    for (kind, polarity, vertical_id), cases in groups.items():
        vertical = None if vertical_id is None else work.vertical
        blocks = [Case(kind, None, case.block, case.settings) for case in cases]
        results = model_of_kind(kind).run_cases(work.motion, vertical, polarity, blocks)
        for case, result in zip(cases, results, strict=True):
            assert result.critical is not None
            found[case.natural_key] = result.critical
            grid = result.grid
            if grid is not None and case.settings.get("displacement_m") == 0.0:
                falling = SearchPoints(
                    grid.kr_over_pga[::-1],
                    grid.theta_n,
                    grid.outcome,
                    None if grid.displacement_m is None else grid.displacement_m[::-1],
                )
                found[case.natural_key] = replace(result.critical, points=falling)
    answers = tuple((case, found[case.natural_key]) for case in work.cases)
    return KindResults(work.motion_id, answers, NUMERICS_VERSION)
