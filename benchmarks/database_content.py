"""What a database says, apart from when and in which order it was written.

Equal databases in the sense used here: the same rows by natural key, row ids, times and
campaigns left out. A campaign that was killed and run again ends equal to one that was not.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

from sqlalchemy import Connection, Select, select

from rbfrag.db.schema import (
    combination,
    earthquake,
    fragility_model,
    motion,
    motion_spectrum,
    outcome_interval,
    recording,
    recording_spectrum,
    response,
    shock_pair,
    simulation,
    suite,
    suite_motion,
    toppling_spectrum,
    vertical,
    with_motions,
)

# When, by which run and under which row number something was written; a digest is of these too.
_INCIDENTAL = {"id", "campaign_id", "added", "created", "digest"}

_motion_key = (motion.c.samples_sha256, motion.c.dt_s)


def content_digest(connection: Connection) -> str:
    """Return a hash that is the same for equal databases.

    Args:
        connection: the database, inside one transaction, so that no table changes meanwhile.
    """
    digest = hashlib.sha256()
    for table in _QUERIES:
        digest.update(f"table {table}\n".encode())
        for row in table_rows_by_natural_key(connection, table):
            digest.update(repr(row).encode())
            digest.update(b"\n")
    return digest.hexdigest()


def table_rows_by_natural_key(connection: Connection, table: str) -> Iterator[tuple[object, ...]]:
    """Yield a table's rows sorted by natural key, what is incidental left out.

    Args:
        connection: the database.
        table: one of :data:`CONTENT_TABLES`.

    Returns:
        Tuples that start with the natural key; BLOBs as their sha256.
    """
    rows = (tuple(map(_plain, row)) for row in connection.execute(_QUERIES[table]))
    # Sorted here: two databases may not agree on how text sorts.
    yield from sorted(rows, key=repr)


def _plain(value: object) -> object:
    if isinstance(value, bytes | memoryview):
        return hashlib.sha256(value).hexdigest()
    return value


def _own_columns(table: Any, *without: str) -> list[Any]:
    skipped = _INCIDENTAL.union(without)
    return [column for column in table.c if column.name not in skipped]


def _queries() -> dict[str, Select[Any]]:
    event_key = (earthquake.c.event_id, earthquake.c.guessed)
    combination_key = combination.c.natural_key
    labelled = {
        table: select(
            table.c.natural_key,
            *_motion_key,
            vertical.c.samples_sha256,
            vertical.c.dt_s,
            *_own_columns(table, "natural_key", "motion_id", "vertical_motion_id"),
        ).select_from(with_motions(table))
        for table in (combination, response)
    }
    first = motion.alias("first")
    other_keys = first.c.samples_sha256, *_motion_key
    return {
        "earthquake": select(*_own_columns(earthquake)),
        "recording": select(*event_key, *_own_columns(recording, "earthquake_id")).select_from(
            recording.join(earthquake)
        ),
        "motion": select(
            *_motion_key,
            *event_key,
            recording.c.name,
            recording.c.station,
            *_own_columns(motion, "recording_id", "samples_sha256", "dt_s"),
        ).select_from(motion.join(recording).join(earthquake)),
        "suite": select(*_own_columns(suite)),
        "suite_motion": select(suite.c.name, *_motion_key).select_from(
            suite_motion.join(suite).join(motion)
        ),
        "motion_spectrum": select(
            *_motion_key, *_own_columns(motion_spectrum, "motion_id")
        ).select_from(motion_spectrum.join(motion)),
        "recording_spectrum": select(
            *other_keys, *_own_columns(recording_spectrum, "motion_id", "other_motion_id")
        ).select_from(
            recording_spectrum.join(motion, motion.c.id == recording_spectrum.c.motion_id).join(
                first, first.c.id == recording_spectrum.c.other_motion_id
            )
        ),
        "toppling_spectrum": select(
            *_motion_key, *_own_columns(toppling_spectrum, "motion_id")
        ).select_from(toppling_spectrum.join(motion)),
        "combination": labelled[combination],
        "outcome_interval": select(
            combination_key, *_own_columns(outcome_interval, "combination_id")
        ).select_from(outcome_interval.join(combination)),
        "simulation": select(
            combination_key, *_own_columns(simulation, "combination_id")
        ).select_from(simulation.join(combination)),
        "response": labelled[response],
        "shock_pair": select(
            shock_pair.c.natural_key,
            *other_keys,
            *_own_columns(shock_pair, "natural_key", "first_motion_id", "second_motion_id"),
        ).select_from(
            shock_pair.join(motion, motion.c.id == shock_pair.c.second_motion_id).join(
                first, first.c.id == shock_pair.c.first_motion_id
            )
        ),
        "fragility_model": select(*_own_columns(fragility_model)),
    }


_QUERIES = _queries()

CONTENT_TABLES = tuple(_QUERIES)
"""The tables that make databases equal or not."""
