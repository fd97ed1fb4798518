"""What a worker does on one motion of a campaign of blocks that slump or slide."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbfrag.campaign.kind_plan import KindCase
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import NUMERICS_VERSION, CriticalResult, Outcome, SearchPoints
from rbfrag.solver.search.displacement import (
    KY_OVER_PGA,
    SlidingBlocks,
    SlidingResult,
    critical_of,
)
from rbfrag.solver.search.scale import as_critical_result, critical_scales


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
        groups[case.kind, case.polarity, case.vertical_id, case.block_class].append(case)
    found: dict[str, CriticalResult] = {}
    for (kind, *_), cases in groups.items():
        find = _slumps if kind == "slumping" else _slides
        for case, result in zip(cases, find(work, cases), strict=True):
            found[case.natural_key] = result
    answers = tuple((case, found[case.natural_key]) for case in work.cases)
    return KindResults(work.motion_id, answers, NUMERICS_VERSION)


def _slumps(work: KindWork, cases: list[KindCase]) -> list[CriticalResult]:
    first = cases[0]
    one = first.block_class
    assert one is not None
    settings: dict[str, Any] = {
        name: first.settings[name] for name in ("search_limit", "scan_ratio", "bracket")
    }
    rotations: list[Any] = [case.settings["rotation_deg"] for case in cases]
    found = critical_scales(
        work.motion,
        one.block,
        rotations_deg=rotations,
        beta_deg=one.beta_deg,
        phi_deg=one.phi_deg,
        vertical=None if first.vertical_id is None else work.vertical,
        polarity=first.polarity,
        **settings,
    )
    return [as_critical_result(result) for result in found]


def _slides(work: KindWork, cases: list[KindCase]) -> list[CriticalResult]:
    first = cases[0]
    vertical = None if first.vertical_id is None else work.vertical
    drive = excitation(work.motion, vertical, first.polarity)
    answers = []
    for case in cases:
        settings: dict[str, Any] = dict(case.settings)
        # each for itself, so that an answer does not depend on what else was asked for
        blocks = SlidingBlocks(drive)
        found = critical_of(
            blocks,
            settings["displacement_m"],
            polarity=case.polarity,
            search_limit=settings["search_limit"],
            tolerance=settings["tolerance"],
            warnings=drive.warnings,
        )
        answers.append(_stored(found, _curve(blocks, found)))
    return answers


def _curve(blocks: SlidingBlocks, found: SlidingResult) -> SearchPoints:
    """Return displacements by falling k_y/PGA: the whole curve, or the ends of a bracket."""
    if found.status == "outside_model" or found.pga_g == 0.0:
        strengths: list[float] = []
    elif found.displacement_m == 0.0:
        strengths = sorted(KY_OVER_PGA, reverse=True)
    else:
        ends = {end for end in (found.lower, found.upper) if end is not None}
        strengths = sorted(ends, reverse=True)
    slid = np.array([blocks.displacement_m(k) for k in strengths], dtype=np.float64)
    return SearchPoints(
        kr_over_pga=np.array(strengths, dtype=np.float64),
        theta_n=np.full(slid.size, np.nan),
        outcome=(Outcome.STABLE.value,) * slid.size,
        displacement_m=slid,
    )


def _stored(found: SlidingResult, points: SearchPoints) -> CriticalResult:
    return CriticalResult(
        p2=np.nan,
        polarity=found.polarity,
        linear=False,
        pga_g=found.pga_g,
        status=found.status,
        search_limit=found.search_limit,
        kr_over_pga=found.ky_over_pga,
        lower=found.lower,
        upper=found.upper,
        kr=found.ky,
        y_m_s=None,
        # the displacement falls with the strength: there is one border, and it is bracketed
        certified=found.status != "outside_model",
        k_up_over_pga=None,
        undecided=None,
        island_width=None,
        kr_over_pga_resolved=None,
        reentrant=False,
        n_runs=found.n_runs,
        warnings=found.warnings,
        points=points,
    )
