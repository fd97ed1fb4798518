"""Plan of a campaign: its motions and combinations, and the remaining work."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypedDict

import numpy as np
from sqlalchemy import Connection

from rbfrag.campaign.kind import Case
from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.campaign.worker import PlannedCase, Task
from rbfrag.db.campaigns import (
    KnownCombination,
    SpectrumKey,
    combinations_with_points,
    known_combinations,
    known_keys,
    spectrum_values,
)
from rbfrag.db.keys import combination_key
from rbfrag.db.motions import motion_rows
from rbfrag.db.rows import MotionRow, Vertical
from rbfrag.db.vertical_pairs import VerticalPair, vertical_pairs
from rbfrag.errors import InputError
from rbfrag.motions.quality import DIRECTION_GUESSED, STRUCTURE
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import facts_of
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import NUMERICS_VERSION, POLARITIES, SEARCH_LIMIT, Polarity

GRID_TOP = 0.99
"""Largest k/PGA of blocks given by their number: the dissertation's first."""

MOST_VALUES = 10_000


@dataclass(frozen=True)
class ExtraResults:
    """Results requested in addition to the critical values and the outcome grid.

    Args:
        full_map: the map of the intervals that fail and that do not.
        blocks: k/PGA of blocks to run for themselves, falling.
        histories: k/PGA of blocks whose motion in time is to be kept, falling.
        critical_history: keep that of each critical block.
    """

    full_map: bool = False
    blocks: tuple[float, ...] = ()
    histories: tuple[float, ...] = ()
    critical_history: bool = False


@dataclass(frozen=True)
class MotionPlan:
    """All combinations of one horizontal motion, so that its samples are sent once.

    Args:
        vertical: the vertical motion of its recording, where some of the cases need it.
    """

    motion: MotionRow
    vertical: VerticalPair | None
    cases: tuple[PlannedCase, ...]


@dataclass(frozen=True)
class CampaignPlan:
    """Combinations of a campaign.

    Args:
        motions: the longest records first, so that no worker is left with one at the end.
        without_vertical: horizontal motions that vertical shaking was asked for and have none.
        warnings: sentences about these and about sensors.
    """

    kind: str
    motions: tuple[MotionPlan, ...]
    without_vertical: int
    warnings: tuple[str, ...]

    @property
    def cases(self) -> list[PlannedCase]:
        """All combinations."""
        return [case for plan in self.motions for case in plan.cases]


MotionTasks = tuple[int, tuple[Task, ...], dict[Polarity, tuple[float, ...]]]
"""Remaining work on one horizontal motion: its id, the tasks of its combinations, and the p² [1/s²]
at which its toppling spectrum is missing, by polarity."""


def plan_campaign(
    connection: Connection,
    kind: str,
    cases: Sequence[Case],
    *,
    suite: str | None,
    vertical: Vertical = "without",
    include_structures: bool = False,
    where: str | None = None,
) -> CampaignPlan:
    """Return every combination: horizontal motions x with or without vertical x polarity x cases.

    Args:
        cases: the blocks and what counts as failure, from the kind.
        suite: only the horizontal motions of this suite; their verticals need not be in it.
        vertical: ``without`` vertical motion, ``with`` that of the same recording, or ``both``.
        include_structures: use motions of sensors on structures, too.
        where: only horizontal motions that meet this condition.

    Raises:
        InputError: no such suite, no horizontal motion, none with a vertical one where it is
            needed.
    """
    if vertical not in ("without", "with", "both"):
        raise InputError(
            f"vertical must be without, with or both, not {vertical!r}", fields=("vertical",)
        )
    rows, warnings = horizontal_motions(
        connection, suite=suite, include_structures=include_structures, where=where
    )
    companions = {} if vertical == "without" else vertical_pairs(connection, suite=suite)
    pairs = [companions[row.id] for row in rows if row.id in companions]
    fitting = {pair.motion_id: pair for pair in pairs if pair.vertical_id is not None}
    lacking = [pair.reason for pair in pairs if pair.vertical_id is None]
    if vertical != "without" and not fitting:
        raise InputError(
            f"none of the {len(rows)} horizontal motions has a vertical one that fits: "
            f"{_first(lacking)}; add the vertical components, or omit them"
        )
    if lacking:
        treatment = "left out" if vertical == "with" else "shaken without one only"
        text = (
            f"{len(lacking)} of {len(rows)} horizontal motions have no vertical one that fits and "
            f"are {treatment}: {_first(lacking)}"
        )
        warnings.append(Diagnostic(text, "no_vertical"))
    plans = []
    for row in rows:
        companion = fitting.get(row.id)
        verticals: list[VerticalPair | None] = [] if vertical == "with" else [None]
        verticals += [] if companion is None else [companion]
        planned = tuple(
            _planned(row, up, polarity, case)
            for up in verticals
            for polarity in campaign_of_kind(kind).polarities
            for case in cases
        )
        plans.append(MotionPlan(row, companion, planned))
    ordered = sorted((p for p in plans if p.cases), key=lambda p: (-p.motion.npts, p.motion.id))
    return CampaignPlan(kind, tuple(ordered), len(lacking), tuple(warnings))


def remaining_work(
    connection: Connection, plan: CampaignPlan, extra: ExtraResults
) -> tuple[list[MotionTasks], dict[str, KnownCombination]]:
    """Return the part of a plan that is not stored yet, and the state of stored combinations.

    Args:
        extra: results requested in addition to critical values and outcome grids.

    Returns:
        The motions with remaining work, in the order of the plan; stored combinations by natural
        key.
    """
    combinations = known_combinations(connection, (case.natural_key for case in plan.cases))
    with_blocks = (
        combinations_with_points(connection, combinations, extra.blocks) if extra.blocks else set()
    )
    keys = []
    for motion in plan.motions:
        for case in motion.cases:
            there = combinations.get(case.natural_key)
            critical = None if there is None else there.kr_over_pga
            of_critical = [critical] if extra.critical_history and critical is not None else []
            keys += [_history_key(motion, case, k) for k in (*extra.histories, *of_critical)]
    histories = known_keys(connection, keys, "response")
    # X(p) is a measure of blocks that are described by p² and backed by a slope
    facts = facts_of(plan.kind)
    described = "p2" in facts.parameters and not facts.free_standing
    sizes = list(dict.fromkeys(c.case.p2 for c in plan.cases if c.case.p2 and described))
    spectra = spectrum_values(connection, p2=sizes) if sizes else {}
    work: list[MotionTasks] = []
    for motion in plan.motions:
        tasks = [
            _task(motion, case, combinations, with_blocks, histories, extra)
            for case in motion.cases
        ]
        remaining = tuple(task for task in tasks if task.asks)
        spectrum = missing_sizes(spectra, motion.motion.id, sizes)
        if remaining or spectrum:
            work.append((motion.motion.id, remaining, spectrum))
    return work, combinations


def missing_sizes(
    spectra: Container[SpectrumKey], motion_id: int, p2: Sequence[float]
) -> dict[Polarity, tuple[float, ...]]:
    """Return the p² [1/s²] at which X(p) of a motion is not stored, by polarity.

    Args:
        p2: frequency parameters asked for [1/s²].
    """
    missing: dict[Polarity, tuple[float, ...]] = {}
    for polarity in POLARITIES:
        sizes = tuple(size for size in map(float, p2) if (motion_id, polarity, size) not in spectra)
        if sizes:
            missing[polarity] = sizes
    return missing


def strengths_of(number: int) -> tuple[float, ...]:
    """Return strengths independent of any outcome: equal steps of ln(k/PGA).

    Args:
        number: how many values, from 0.99 down to the search limit 0.01; at least 2.
    """
    if not 2 <= number <= MOST_VALUES:
        raise InputError(
            f"grid: the number of values must be 2 to {MOST_VALUES}, not {number}", fields=("grid",)
        )
    values = np.geomspace(GRID_TOP, SEARCH_LIMIT, number)
    values[[0, -1]] = GRID_TOP, SEARCH_LIMIT
    return tuple(values.tolist())


def checked_ratios(values: Sequence[float], name: str) -> tuple[float, ...]:
    """Return k/PGA values in stored form, decreasing and unique.

    Raises:
        InputError: a value that is not positive and finite, or one that repeats.
    """
    ratios = sorted((positive(value, name, "k_r/PGA") for value in values), reverse=True)
    for ratio, next_one in pairwise(ratios):
        if ratio == next_one:
            raise InputError(
                f"{name}: {ratio:g} is in the list twice: give each value once", fields=(name,)
            )
    return tuple(ratios)


def _planned(
    row: MotionRow, up: VerticalPair | None, polarity: Polarity, case: Case
) -> PlannedCase:
    key = combination_key(
        motion_sha256=row.sha256,
        dt_s=row.dt_s,
        vertical_sha256=None if up is None else up.vertical_sha256,
        polarity=polarity,
        kind=case.kind,
        p2=case.p2,
        settings=case.settings,
        numerics_version=NUMERICS_VERSION,
        block=case.block,
    )
    return PlannedCase(key, polarity, None if up is None else up.vertical_id, case)


def _task(
    motion: MotionPlan,
    planned: PlannedCase,
    combinations: Mapping[str, KnownCombination],
    with_blocks: set[str],
    histories: set[str],
    extra: ExtraResults,
) -> Task:
    there = combinations.get(planned.natural_key)
    moves = motion.motion.pga_g > 0.0  # without motion k/PGA says nothing
    critical = None if there is None else there.kr_over_pga
    lacks_grid = there is None or (
        not there.gridded
        and there.status != "outside_model"
        and len(campaign_of_kind(planned.case.kind).grid(planned.case, motion.motion)) > 0
    )
    return Task(
        planned=planned,
        search=there is None,
        grid=moves and lacks_grid,
        full_map=extra.full_map
        and (there is None or (not there.mapped and there.status in ("found", "below_limit"))),
        blocks=extra.blocks if moves and planned.natural_key not in with_blocks else (),
        histories=tuple(
            ratio
            for ratio in extra.histories
            if moves and _history_key(motion, planned, ratio) not in histories
        ),
        critical_history=extra.critical_history
        and (
            there is None
            or (critical is not None and _history_key(motion, planned, critical) not in histories)
        ),
        critical_k_over_pga=critical,
    )


def _history_key(motion: MotionPlan, planned: PlannedCase, k_over_pga: float) -> str:
    up = motion.vertical if planned.vertical_id is not None else None
    return planned.history_key(
        motion.motion, None if up is None else up.vertical_sha256, k_over_pga
    )


def _first(reasons: Sequence[str], at_most: int = 3) -> str:
    different = list(dict.fromkeys(reasons))
    more = f"; and {len(different) - at_most} more" if len(different) > at_most else ""
    return "; ".join(different[:at_most]) + more


class MotionChoice(TypedDict):
    """Selection of the motions of a campaign."""

    suite: str | None
    include_structures: bool
    where: str | None


def horizontal_motions(
    connection: Connection,
    *,
    suite: str | None = None,
    include_structures: bool = False,
    where: str | None = None,
) -> tuple[list[MotionRow], list[str]]:
    """Return the horizontal motions of a campaign by id, and warnings about their sensors.

    Args:
        suite: only the motions of this suite.
        include_structures: use motions of sensors on structures, too.
        where: only motions that meet this condition.

    Raises:
        InputError: no such suite, no horizontal motion, or a condition that is not supported.
    """
    rows_of_suite = motion_rows(connection, suite=suite, where=where)
    every = [row for row in rows_of_suite if not row.is_vertical]
    place = "the database" if suite is None else f"suite {suite!r}"
    if not every and where is not None:
        raise InputError(
            f"where: no horizontal motion in {place} meets {where}: change the condition",
            fields=("where",),
        )
    if not every:
        raise InputError(
            f"no horizontal motions in {place}: add some with  rbfrag motions add PATH"
        )
    rows = [row for row in every if include_structures or STRUCTURE not in row.flags]
    if not rows:
        raise InputError(
            f"all {len(every)} horizontal motions in {place} were recorded on structures: add "
            "others, or set include_structures",
            fields=("include_structures",),
        )
    warnings: list[str] = []
    if len(rows) < len(every):
        text = (
            f"{len(every) - len(rows)} of {len(every)} horizontal motions were recorded on "
            "structures and are excluded: they are not ground motion"
        )
        warnings.append(Diagnostic(text, "structure"))
    if guessed := sum(DIRECTION_GUESSED in row.flags for row in rows):
        text = (
            f"the direction of {guessed} of {len(rows)} motions is guessed: a vertical one among "
            "them is simulated as a horizontal; give is_vertical in a table of metadata"
        )
        warnings.append(Diagnostic(text, "direction_guessed"))
    return rows, warnings
