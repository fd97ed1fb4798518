"""Which critical searches a campaign is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.db.campaign_store import combination_key
from rbfrag.db.motion_store import motion_rows
from rbfrag.db.rows import MotionRow
from rbfrag.errors import InputError
from rbfrag.solver.respond import positive
from rbfrag.solver.results import NUMERICS_VERSION, POLARITIES, SEARCH_LIMIT, Polarity

DEFAULT_P2 = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1)
"""The dissertation's block sizes, as p² [1/s²]: 0.25 m to 74 m from centroid to toe."""

SETTINGS = {"search_limit": SEARCH_LIMIT, "map": "full"}
"""What else decides an answer, as it goes into the natural key: how far down the search goes,
and that it maps every toppling and safe interval on the way."""


@dataclass(frozen=True)
class Case:
    """One critical search of one motion."""

    natural_key: str
    polarity: Polarity
    p2: float


@dataclass(frozen=True)
class MotionPlan:
    """All searches of one motion, so that its samples travel once."""

    motion_id: int
    name: str
    cases: tuple[Case, ...]


def plan_campaign(
    connection: Connection, *, suite: str | None, p2: Sequence[float]
) -> list[MotionPlan]:
    """Return every search of a campaign: horizontal motions x polarity x p².

    Args:
        connection: the database.
        suite: only the motions of this suite.
        p2: frequency parameters [1/s²].

    Raises:
        InputError: no such suite, no horizontal motion, a p² that is not positive or repeats.
    """
    sizes = [positive(value, "p2", "1/s²") for value in p2]
    repeated = sorted({value for value in sizes if sizes.count(value) > 1})
    if repeated:
        raise InputError(f"p2 = {repeated[0]:g} is in the list twice: name each value once")
    if not sizes:
        raise InputError("the list of p2 is empty: name at least one value in 1/s²")
    rows = [row for row in motion_rows(connection, suite=suite) if not row.is_vertical]
    if not rows:
        where = "the database" if suite is None else f"suite {suite!r}"
        raise InputError(
            f"there is no horizontal motion in {where}: rbfrag motions add PATH  brings some"
        )
    return [
        MotionPlan(
            motion_id=row.id,
            name=row.name,
            cases=tuple(_case(row, polarity, value) for value in sizes for polarity in POLARITIES),
        )
        for row in rows
    ]


def _case(row: MotionRow, polarity: Polarity, p2: float) -> Case:
    key = combination_key(
        motion_sha256=row.sha256,
        dt_s=row.dt_s,
        vertical_sha256=None,
        polarity=polarity,
        kind="toppling",
        p2=p2,
        settings=SETTINGS,
        numerics_version=NUMERICS_VERSION,
    )
    return Case(natural_key=key, polarity=polarity, p2=p2)
