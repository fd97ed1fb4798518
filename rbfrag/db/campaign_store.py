"""Writing campaigns and the combinations they finish."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping

from sqlalchemy import Connection, bindparam, insert, select, update

from rbfrag.db.clock import utc_now
from rbfrag.db.insert import insert_if_new
from rbfrag.db.natural_key import canonical_json, combination_key
from rbfrag.db.schema import campaign, combination, simulation
from rbfrag.solver.results import NUMERICS_VERSION, CriticalResult, SearchPoints
from rbfrag.version import __version__

__all__ = [
    "combination_key",
    "finish_campaign",
    "insert_combination",
    "known_keys",
    "known_statuses",
    "start_campaign",
]

_KEYS_AT_ONCE = 500  # below the number of variables that any SQLite build takes


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
    wanted = list(dict.fromkeys(keys))
    query = select(combination.c.natural_key, combination.c.status).where(
        combination.c.natural_key.in_(bindparam("keys", expanding=True))
    )
    found: dict[str, str] = {}
    for start in range(0, len(wanted), _KEYS_AT_ONCE):
        some = {"keys": wanted[start : start + _KEYS_AT_ONCE]}
        found.update({row.natural_key: row.status for row in connection.execute(query, some)})
    return found


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
    """Store one critical search with all its simulated points.

    Args:
        connection: inside the caller's transaction: one per combination keeps what is done.
        campaign_id: the campaign that made it; not part of what makes databases equal.
        natural_key: from :func:`rbfrag.db.natural_key.combination_key`.
        motion_id: the horizontal motion.
        vertical_motion_id: the vertical one, or None.
        result: what the solver answered.
        settings: the same that went into the key.
        kind: response kind.
        numerics_version: the same that went into the key.

    Returns:
        True when stored; False when the key was there already and nothing was written.
    """
    new = insert_if_new(
        connection,
        combination,
        {
            "natural_key": natural_key,
            "campaign_id": campaign_id,
            "motion_id": motion_id,
            "vertical_motion_id": vertical_motion_id,
            "polarity": result.polarity,
            "kind": kind,
            "linear": bool(result.linear),
            "p2": float(result.p2),
            "settings": canonical_json(settings),
            "numerics_version": numerics_version,
            "status": result.status,
            "search_limit": float(result.search_limit),
            "kr_over_pga": _number(result.kr_over_pga),
            "lower": _number(result.lower),
            "upper": _number(result.upper),
            "kr": _number(result.kr),
            "y_m_s": _number(result.y_m_s),
            "certified": bool(result.certified),
            "k_up_over_pga": _number(result.k_up_over_pga),
            "undecided": _number(result.undecided),
            "island_width": _number(result.island_width),
            "kr_over_pga_resolved": _number(result.kr_over_pga_resolved),
            "reentrant": bool(result.reentrant),
            "n_runs": int(result.n_runs),
            "warnings": json.dumps(list(result.warnings)),
        },
    )
    if not new:
        return False
    combination_id = connection.execute(
        select(combination.c.id).where(combination.c.natural_key == natural_key)
    ).scalar_one()
    rows = _simulation_rows(combination_id, result.points)
    if rows:
        connection.execute(insert(simulation), rows)
    return True


def _simulation_rows(combination_id: int, points: SearchPoints) -> list[dict[str, object]]:
    # A search may come back to a point; a run of the same input gives the same answer.
    by_strength = {
        k: (theta, str(outcome))
        for k, theta, outcome in zip(
            points.kr_over_pga.tolist(), points.theta_n.tolist(), points.outcome, strict=True
        )
    }
    return [
        {
            "combination_id": combination_id,
            "kr_over_pga": k,
            "theta_n": None if math.isnan(theta) else theta,
            "outcome": outcome,
        }
        for k, (theta, outcome) in by_strength.items()
    ]


def _number(value: float | None) -> float | None:
    # Drivers do not all understand numpy's scalars, and databases disagree about NaN.
    return None if value is None or math.isnan(value) else float(value)
