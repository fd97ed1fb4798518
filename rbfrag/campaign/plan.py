"""Which critical searches a campaign is made of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.db.campaigns import combination_key
from rbfrag.db.motions import motion_rows
from rbfrag.db.queries import Vertical
from rbfrag.db.rows import MotionRow
from rbfrag.db.vertical_pairs import VerticalPair, vertical_pairs
from rbfrag.errors import InputError
from rbfrag.solver.results import MAP_DEPTH, NUMERICS_VERSION, POLARITIES, SEARCH_LIMIT, Polarity
from rbfrag.solver.toppling_run import positive

SETTINGS = {"search_limit": SEARCH_LIMIT, "map": "full", "map_depth": MAP_DEPTH}
"""What else decides an answer, as it goes into the natural key: how far down the search goes,
that it maps every toppling and safe interval on the way, and how finely."""


@dataclass(frozen=True)
class Case:
    """One critical search of one motion.

    Args:
        natural_key: of the combination.
        polarity: ``forward`` or ``reverse``.
        p2: frequency parameter of the block [1/s²].
        vertical_id: the vertical motion that goes with it, or None.
    """

    natural_key: str
    polarity: Polarity
    p2: float
    vertical_id: int | None = None


@dataclass(frozen=True)
class MotionPlan:
    """All searches of one horizontal motion, so that its samples travel once.

    Args:
        motion: the horizontal motion.
        vertical: the vertical motion of its recording, where some of the cases need it.
        cases: the searches.
    """

    motion: MotionRow
    vertical: VerticalPair | None
    cases: tuple[Case, ...]


@dataclass(frozen=True)
class CampaignPlan:
    """What a campaign is made of.

    Args:
        motions: the longest records first, so that no worker is left with one at the end.
        settings: what else decides an answer, as it went into the natural keys.
        without_vertical: horizontal motions that vertical shaking was asked for and have none.
        warnings: sentences about these.
    """

    motions: tuple[MotionPlan, ...]
    settings: Mapping[str, object]
    without_vertical: int
    warnings: tuple[str, ...]

    @property
    def cases(self) -> list[Case]:
        """All searches."""
        return [case for plan in self.motions for case in plan.cases]


def plan_campaign(
    connection: Connection,
    *,
    suite: str | None,
    p2: Sequence[float],
    vertical: Vertical = "without",
    map_depth: float = MAP_DEPTH,
) -> CampaignPlan:
    """Return every search: horizontal motions x vertical or not x polarity x p².

    Args:
        connection: the database.
        suite: only the horizontal motions of this suite; their verticals need not be in it.
        p2: frequency parameters [1/s²].
        vertical: ``without`` vertical motion, ``with`` that of the same recording, or ``both``.
        map_depth: width of k_r/PGA that the maps may leave undecided at a border.

    Raises:
        InputError: no such suite, no horizontal motion, none with a vertical one where it is
            needed, a p² that is not positive or repeats.
    """
    sizes = _sizes(p2)
    chosen = chosen_motions(connection, suite=suite, vertical=vertical)
    settings = {**SETTINGS, "map_depth": positive(map_depth, "map_depth", "a width of k_r/PGA")}
    plans = [
        MotionPlan(
            motion=row,
            vertical=chosen.fitting.get(row.id),
            cases=tuple(
                _case(row, up, polarity, value, settings)
                for up in excitations(vertical, chosen.fitting.get(row.id))
                for value in sizes
                for polarity in POLARITIES
            ),
        )
        for row in chosen.rows
    ]
    return CampaignPlan(
        motions=tuple(
            sorted(
                (plan for plan in plans if plan.cases), key=lambda p: (-p.motion.npts, p.motion.id)
            )
        ),
        settings=settings,
        without_vertical=chosen.without_vertical,
        warnings=chosen.warnings,
    )


@dataclass(frozen=True)
class ChosenMotions:
    """The horizontal motions of a campaign.

    Args:
        rows: the motions.
        fitting: the vertical motion that goes with each, by row id, where there is one.
        without_vertical: how many were to have a vertical one and have none.
        warnings: sentences about these.
    """

    rows: tuple[MotionRow, ...]
    fitting: Mapping[int, VerticalPair]
    without_vertical: int
    warnings: tuple[str, ...]


def chosen_motions(
    connection: Connection, *, suite: str | None, vertical: Vertical
) -> ChosenMotions:
    """Return the horizontal motions of a campaign with their vertical ones.

    Args:
        connection: the database.
        suite: only the horizontal motions of this suite; their verticals need not be in it.
        vertical: ``without`` vertical motion, ``with`` that of the same recording, or ``both``.

    Raises:
        InputError: no such suite, no horizontal motion, none with a vertical one where it is
            needed.
    """
    if vertical not in ("without", "with", "both"):
        raise InputError(f"--vertical must be without, with or both, not {vertical!r}")
    rows = [row for row in motion_rows(connection, suite=suite) if not row.is_vertical]
    if not rows:
        where = "the database" if suite is None else f"suite {suite!r}"
        raise InputError(
            f"there is no horizontal motion in {where}: rbfrag motions add PATH  brings some"
        )
    pairs = {} if vertical == "without" else vertical_pairs(connection, suite=suite)
    fitting = {each.motion_id: each for each in pairs.values() if each.vertical_id is not None}
    lacking = [each.reason for each in pairs.values() if each.vertical_id is None]
    if vertical != "without" and not fitting:
        raise InputError(
            f"none of the {len(rows)} horizontal motions has a vertical one that fits: "
            f"{_first(lacking)}; add the vertical components, or leave --vertical out"
        )
    warnings = []
    if lacking:
        left = "left out" if vertical == "with" else "shaken without one only"
        warnings.append(
            f"{len(lacking)} of {len(rows)} horizontal motions have no vertical one that fits and "
            f"are {left}: {_first(lacking)}"
        )
    return ChosenMotions(tuple(rows), fitting, len(lacking), tuple(warnings))


def _sizes(p2: Sequence[float]) -> list[float]:
    sizes = [positive(value, "p2", "1/s²") for value in p2]
    repeated = sorted({value for value in sizes if sizes.count(value) > 1})
    if repeated:
        raise InputError(f"p2 = {repeated[0]:g} is in the list twice: name each value once")
    if not sizes:
        raise InputError("the list of p2 is empty: name at least one value in 1/s²")
    return sizes


def excitations(
    vertical: Vertical, companion: VerticalPair | None
) -> Iterable[VerticalPair | None]:
    """Yield the vertical motions that a horizontal one is shaken with, None for without."""
    if vertical != "with":
        yield None
    if vertical != "without" and companion is not None:
        yield companion


def _case(
    row: MotionRow,
    up: VerticalPair | None,
    polarity: Polarity,
    p2: float,
    settings: Mapping[str, object],
) -> Case:
    key = combination_key(
        motion_sha256=row.sha256,
        dt_s=row.dt_s,
        vertical_sha256=None if up is None else up.vertical_sha256,
        polarity=polarity,
        kind="toppling",
        p2=p2,
        settings=settings,
        numerics_version=NUMERICS_VERSION,
    )
    return Case(
        natural_key=key,
        polarity=polarity,
        p2=p2,
        vertical_id=None if up is None else up.vertical_id,
    )


def _first(reasons: Sequence[str], at_most: int = 3) -> str:
    different = list(dict.fromkeys(reasons))
    more = f"; and {len(different) - at_most} more" if len(different) > at_most else ""
    return "; ".join(different[:at_most]) + more
