"""Writing campaigns and the combinations they finish."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, bindparam, insert, select, update

from rbfrag.db.clock import utc_now
from rbfrag.db.insert import insert_rows
from rbfrag.db.natural_key import canonical_json, combination_key
from rbfrag.db.schema import campaign, combination, outcome_interval, simulation
from rbfrag.solver.results import (
    NUMERICS_VERSION,
    CriticalResult,
    OutcomeIntervals,
    SearchPoints,
)
from rbfrag.version import __version__

__all__ = [
    "CombinationRecord",
    "combination_key",
    "finish_campaign",
    "insert_combination",
    "insert_combinations",
    "known_keys",
    "known_statuses",
    "start_campaign",
]

_COLUMNS = (
    "natural_key", "campaign_id", "motion_id", "vertical_motion_id", "polarity", "kind", "linear",
    "p2", "settings", "numerics_version", "status", "search_limit", "kr_over_pga", "lower",
    "upper", "kr", "y_m_s", "certified", "k_up_over_pga", "undecided", "island_width",
    "kr_over_pga_resolved", "reentrant", "n_runs", "warnings",
)  # fmt: skip
_POINT_COLUMNS = ("combination_id", "kr_over_pga", "theta_n", "outcome")
_INTERVAL_COLUMNS = ("combination_id", "k_lo", "k_hi", "outcome")

_KEYS_AT_ONCE = 500  # below the number of variables that any SQLite build takes


@dataclass(frozen=True)
class CombinationRecord:
    """One critical search as it is stored.

    Args:
        natural_key: from :func:`rbfrag.db.natural_key.combination_key`.
        motion_id: the horizontal motion.
        vertical_motion_id: the vertical one, or None.
        result: what the solver answered.
        settings: the same that went into the key.
        kind: response kind.
        numerics_version: the same that went into the key.
    """

    natural_key: str
    motion_id: int
    vertical_motion_id: int | None
    result: CriticalResult
    settings: Mapping[str, object]
    kind: str = "toppling"
    numerics_version: str = NUMERICS_VERSION


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


def known_statuses(connection: Connection, keys: Iterable[str]) -> dict[str, str]:
    """Return the status of each combination that is stored already, by natural key.

    Args:
        connection: the database.
        keys: the natural keys asked about; those that are not stored are left out.
    """
    return {key: status for key, _, status in _found(connection, keys)}


def known_keys(connection: Connection, keys: Iterable[str]) -> set[str]:
    """Return those natural keys whose combinations are stored already."""
    return set(known_statuses(connection, keys))


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
    rows = [_combination_row(campaign_id, record) for record in new.values()]
    insert_rows(connection, combination, _COLUMNS, rows)
    ids = combination_ids(connection, new)
    intervals: list[tuple[object, ...]] = []
    points: list[tuple[object, ...]] = []
    for key, record in new.items():
        intervals += _interval_rows(ids[key], record.result.intervals)
        points += _point_rows(ids[key], record.result.points)
    insert_rows(connection, outcome_interval, _INTERVAL_COLUMNS, intervals)
    insert_rows(connection, simulation, _POINT_COLUMNS, points)
    return len(new)


def combination_ids(connection: Connection, keys: Iterable[str]) -> dict[str, int]:
    """Return the row id of each combination that is stored, by natural key.

    Args:
        connection: the database.
        keys: the natural keys asked about; those that are not stored are left out.
    """
    return {key: row_id for key, row_id, _ in _found(connection, keys)}


def _found(connection: Connection, keys: Iterable[str]) -> Iterator[tuple[str, int, str]]:
    wanted = list(dict.fromkeys(keys))
    query = select(combination.c.natural_key, combination.c.id, combination.c.status).where(
        combination.c.natural_key.in_(bindparam("keys", expanding=True))
    )
    for start in range(0, len(wanted), _KEYS_AT_ONCE):
        some = {"keys": wanted[start : start + _KEYS_AT_ONCE]}
        for row in connection.execute(query, some):
            yield row.natural_key, row.id, row.status


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
        float(result.p2),
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
    for k, theta, outcome in zip(
        points.kr_over_pga.tolist(), points.theta_n.tolist(), points.outcome, strict=True
    ):
        yield combination_id, k, None if math.isnan(theta) else theta, str(outcome)


def _number(value: float | None) -> float | None:
    # Drivers do not all understand numpy's scalars, and databases disagree about NaN.
    return None if value is None or math.isnan(value) else float(value)
