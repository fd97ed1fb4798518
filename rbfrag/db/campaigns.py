"""Writing campaigns and the combinations they finish."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, bindparam, insert, select, update

from rbfrag.db.clock import utc_now
from rbfrag.db.insert import insert_rows
from rbfrag.db.keys import canonical_json, combination_key
from rbfrag.db.schema import campaign, combination, outcome_interval, simulation
from rbfrag.errors import InputError
from rbfrag.solver.results import (
    NUMERICS_VERSION,
    CriticalResult,
    OutcomeIntervals,
    SearchPoints,
)
from rbfrag.version import __version__

__all__ = [
    "CombinationRecord",
    "KnownCombination",
    "combination_key",
    "combinations_with_points",
    "finish_campaign",
    "insert_combination",
    "insert_combinations",
    "insert_points",
    "known_combinations",
    "known_keys",
    "start_campaign",
]

_COLUMNS = (
    "natural_key", "campaign_id", "motion_id", "vertical_motion_id", "polarity", "kind", "linear",
    "p2", "block", "settings", "numerics_version", "status", "search_limit", "kr_over_pga", "lower",
    "upper", "kr", "y_m_s", "certified", "k_up_over_pga", "undecided", "island_width",
    "kr_over_pga_resolved", "reentrant", "n_runs", "warnings",
)  # fmt: skip
_POINT_COLUMNS = ("combination_id", "kr_over_pga", "theta_n", "outcome", "displacement_m")
_INTERVAL_COLUMNS = ("combination_id", "k_lo", "k_hi", "outcome")

_KEYS_AT_ONCE = 500  # below the number of variables that any SQLite build takes


@dataclass(frozen=True)
class CombinationRecord:
    """One critical search as it is stored.

    Args:
        natural_key: from :func:`rbfrag.db.keys.combination_key`.
        motion_id: the horizontal motion.
        vertical_motion_id: the vertical one, or None.
        result: what the solver answered.
        settings: the same that went into the key.
        kind: response kind.
        numerics_version: the same that went into the key.
        block: which block it is, the same that went into the key; None for toppling.
    """

    natural_key: str
    motion_id: int
    vertical_motion_id: int | None
    result: CriticalResult
    settings: Mapping[str, object]
    kind: str = "toppling"
    numerics_version: str = NUMERICS_VERSION
    block: Mapping[str, object] | None = None


@dataclass(frozen=True)
class KnownCombination:
    """What a campaign asks about a combination that is stored already."""

    id: int
    status: str
    kr_over_pga: float | None
    certified: bool
    reentrant: bool


def start_campaign(
    connection: Connection,
    settings: Mapping[str, object],
    *,
    numerics_version: str = NUMERICS_VERSION,
) -> int:
    """Record that a campaign begins, and return its id.

    Args:
        connection: inside the caller's transaction.
        settings: what the user asked for; plain values.
        numerics_version: of the solver.
    """
    done = connection.execute(
        insert(campaign).values(
            settings=canonical_json(settings),
            numerics_version=numerics_version,
            rbfrag_version=__version__,
            started=utc_now(),
        )
    )
    assert done.inserted_primary_key is not None
    return int(done.inserted_primary_key[0])


def finish_campaign(connection: Connection, campaign_id: int) -> None:
    """Record that a campaign did all it was asked for."""
    connection.execute(
        update(campaign).where(campaign.c.id == campaign_id).values(finished=utc_now())
    )


def known_combinations(connection: Connection, keys: Iterable[str]) -> dict[str, KnownCombination]:
    """Return what is stored of each combination, by natural key.

    Args:
        connection: the database.
        keys: the natural keys asked about; those that are not stored are left out.
    """
    column = combination.c
    query = select(
        column.natural_key,
        column.id,
        column.status,
        column.kr_over_pga,
        column.certified,
        column.reentrant,
    ).where(column.natural_key.in_(bindparam("keys", expanding=True)))
    found: dict[str, KnownCombination] = {}
    for some in _portions(keys):
        for key, *values in connection.execute(query, {"keys": some}):
            found[key] = KnownCombination(*values)
    return found


def known_keys(connection: Connection, keys: Iterable[str]) -> set[str]:
    """Return those natural keys whose combinations are stored already."""
    return set(known_combinations(connection, keys))


def combinations_with_points(
    connection: Connection, keys: Iterable[str], kr_over_pga: Sequence[float]
) -> set[str]:
    """Return those natural keys whose combinations hold a simulation at each of some strengths.

    Args:
        connection: the database.
        keys: natural keys.
        kr_over_pga: block strengths over PGA, each once.
    """
    query = (
        select(combination.c.natural_key, simulation.c.kr_over_pga)
        .join(simulation)
        .where(combination.c.natural_key.in_(bindparam("keys", expanding=True)))
    )
    # Compared here: a long list of strengths is no list of variables for every database.
    wanted = set(kr_over_pga)
    found: Counter[str] = Counter()
    for some in _portions(keys):
        found.update(key for key, k in connection.execute(query, {"keys": some}) if k in wanted)
    return {key for key, number in found.items() if number == len(wanted)}


def insert_combination(
    connection: Connection,
    *,
    campaign_id: int,
    natural_key: str,
    motion_id: int,
    vertical_motion_id: int | None,
    result: CriticalResult,
    settings: Mapping[str, object],
    kind: str = "toppling",
    numerics_version: str = NUMERICS_VERSION,
) -> bool:
    """Store one critical search with its simulated points and its map of outcomes.

    The arguments are those of :class:`CombinationRecord`.

    Returns:
        True when stored; False when the key was there already and nothing was written.
    """
    record = CombinationRecord(
        natural_key=natural_key,
        motion_id=motion_id,
        vertical_motion_id=vertical_motion_id,
        result=result,
        settings=settings,
        kind=kind,
        numerics_version=numerics_version,
    )
    return insert_combinations(connection, campaign_id, [record]) == 1


def insert_combinations(
    connection: Connection, campaign_id: int, records: Sequence[CombinationRecord]
) -> int:
    """Store many critical searches, each with its simulated points and its map of outcomes.

    Args:
        connection: inside the caller's transaction, so that a combination is never there
            without what belongs to it.
        campaign_id: the campaign that made them; not part of what makes databases equal.
        records: the searches; one whose key is there already is left alone.

    Returns:
        How many were new.
    """
    there = known_keys(connection, (record.natural_key for record in records))
    new = {record.natural_key: record for record in records if record.natural_key not in there}
    # In one order: two campaigns on one server then wait for each other, never both at once.
    rows = [_combination_row(campaign_id, new[key]) for key in sorted(new)]
    insert_rows(connection, combination, _COLUMNS, rows)
    known = known_combinations(connection, new)
    # What another campaign stored meanwhile stays all its own: two processors may have made
    # maps that differ in the last bits, and a mixture of both would be none.
    own = _of_campaign(connection, campaign_id, new)
    new = {key: record for key, record in new.items() if key in own}
    intervals: list[tuple[object, ...]] = []
    for key, record in new.items():
        intervals += _interval_rows(known[key].id, record.result.intervals)
    insert_rows(connection, outcome_interval, _INTERVAL_COLUMNS, intervals)
    _insert_points(connection, known, {key: record.result.points for key, record in new.items()})
    return len(new)


def _of_campaign(connection: Connection, campaign_id: int, keys: Iterable[str]) -> set[str]:
    query = select(combination.c.natural_key).where(
        combination.c.natural_key.in_(bindparam("keys", expanding=True)),
        combination.c.campaign_id == campaign_id,
    )
    found: set[str] = set()
    for some in _portions(keys):
        found.update(connection.scalars(query, {"keys": some}))
    return found


def insert_points(connection: Connection, points: Mapping[str, SearchPoints]) -> None:
    """Store simulated blocks of combinations that are there; a strength that is there stays.

    Args:
        connection: inside the caller's transaction.
        points: the blocks, by the natural key of their combination.

    Raises:
        InputError: there is no such combination.
    """
    known = known_combinations(connection, points)
    missing = [key for key in points if key not in known]
    if missing:
        raise InputError(f"there is no combination {missing[0]} in the database")
    _insert_points(connection, known, points)


def _insert_points(
    connection: Connection,
    known: Mapping[str, KnownCombination],
    points: Mapping[str, SearchPoints],
) -> None:
    rows: list[tuple[object, ...]] = []
    for key, simulated in points.items():
        rows += _point_rows(known[key].id, simulated)
    insert_rows(connection, simulation, _POINT_COLUMNS, rows)


def _portions(keys: Iterable[str]) -> Iterator[list[str]]:
    wanted = list(dict.fromkeys(keys))
    for start in range(0, len(wanted), _KEYS_AT_ONCE):
        yield wanted[start : start + _KEYS_AT_ONCE]


def _combination_row(campaign_id: int, record: CombinationRecord) -> tuple[object, ...]:
    result = record.result
    return (
        record.natural_key,
        campaign_id,
        record.motion_id,
        record.vertical_motion_id,
        result.polarity,
        record.kind,
        bool(result.linear),
        _number(result.p2),
        None if record.block is None else canonical_json(record.block),
        canonical_json(record.settings),
        record.numerics_version,
        result.status,
        float(result.search_limit),
        _number(result.kr_over_pga),
        _number(result.lower),
        _number(result.upper),
        _number(result.kr),
        _number(result.y_m_s),
        bool(result.certified),
        _number(result.k_up_over_pga),
        _number(result.undecided),
        _number(result.island_width),
        _number(result.kr_over_pga_resolved),
        bool(result.reentrant),
        int(result.n_runs),
        json.dumps(list(result.warnings)),
    )


def _interval_rows(
    combination_id: int, intervals: OutcomeIntervals
) -> Iterator[tuple[object, ...]]:
    for low, high, outcome in zip(
        intervals.k_lo.tolist(), intervals.k_hi.tolist(), intervals.outcome, strict=True
    ):
        yield combination_id, low, high, outcome


def _point_rows(combination_id: int, points: SearchPoints) -> Iterator[tuple[object, ...]]:
    # A search may come back to a point; a run of the same input gives the same answer.
    slid = points.displacement_m
    rows = zip(
        points.kr_over_pga.tolist(),
        points.theta_n.tolist(),
        points.outcome,
        [None] * len(points.outcome) if slid is None else slid.tolist(),
        strict=True,
    )
    for k, theta, outcome, displacement_m in rows:
        yield combination_id, k, _number(theta), str(outcome), _number(displacement_m)


def _number(value: float | None) -> float | None:
    # Drivers do not all understand numpy's scalars, and databases disagree about NaN.
    return None if value is None or math.isnan(value) else float(value)
