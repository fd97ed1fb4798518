"""Bring the tables of a database from before the first release to those of today.

Each schema before 0007 had the tables of the next one without some columns, so one road leads from
all of them: the old tables are set aside, those of :mod:`rbfrag.db.schema` are made, and the rows
move over.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import Connection, MetaData, Table, inspect, select, text, tuple_, update

from rbfrag.db.insert import table_digests
from rbfrag.db.keys import canonical_json, key_of_row
from rbfrag.db.motions import LATER_MEASURES, measures_of, samples_of_motions
from rbfrag.db.schema import combination, metadata, motion
from rbfrag.motions.ground_motion import GroundMotion

BEFORE = {
    ("motion", "source_sha256"): "samples_sha256",
    ("fragility_model", "kind"): "'toppling'",
    ("fragility_model", "form"): "1",
}
"""What later columns hold in rows from before them; the others are empty."""

_OF_ARRAYS = ("motion", "response")
_STRENGTHS_OF_SLIDING = 23


def renew_tables(connection: Connection) -> None:
    """Make all tables anew and move the rows, with foreign keys off where that is SQLite."""
    old = MetaData()
    present = set(inspect(connection).get_table_names())
    tables = [table for table in metadata.sorted_tables if table.name in present]
    for table in tables:
        _execute(connection, f"CREATE TABLE {table.name}_before AS SELECT * FROM {table.name}")
    for table in reversed(tables):
        _execute(connection, f"DROP TABLE {table.name}")
    metadata.create_all(connection, checkfirst=False)
    for table in tables:
        before = Table(f"{table.name}_before", old, autoload_with=connection)
        _move(connection, table, {column.name for column in before.c})
        before.drop(connection)
    if "digest" not in old.tables["combination_before"].c:
        _take_maps_out_of_keys(connection)
        _number_curves_of_sliding(connection)
    if LATER_MEASURES[0] not in old.tables["motion_before"].c:
        _fill_measures(connection)
    for table in tables:
        fill_digests(connection, table)


def _move(connection: Connection, table: Table, had: set[str]) -> None:
    values = {column.name: column.name for column in table.c if column.name in had}
    values |= {
        column: value
        for (name, column), value in BEFORE.items()
        if name == table.name and column not in had
    }
    values["digest"] = "0"  # until all columns are filled
    _execute(
        connection,
        f"INSERT INTO {table.name} ({', '.join(values)}) "
        f"SELECT {', '.join(values.values())} FROM {table.name}_before",
    )
    if connection.dialect.name == "postgresql" and "id" in table.c:
        # the server counts on from the row numbers that came along
        sequence = f"pg_get_serial_sequence('{table.name}', 'id')"
        _execute(connection, f"SELECT setval({sequence}, max(id)) FROM {table.name}")


def _take_maps_out_of_keys(connection: Connection) -> None:
    """Key combinations without how their map was made; of two that differ in it, keep the finer."""
    samples = samples_of_motions(connection)
    best: dict[str, tuple[tuple[object, ...], int, str]] = {}
    superseded: list[int] = []
    for row in connection.execute(select(combination).order_by(combination.c.id)).mappings():
        settings = json.loads(row["settings"])
        extent, depth = settings.pop("map", None), settings.pop("map_depth", None)
        stored = canonical_json(settings)
        key = key_of_row({**row, "settings": stored}, samples)
        order = (extent != "full", extent is None, depth or 0.0, row["id"])
        other = best.get(key)
        if other is not None:
            superseded.append(max((order, row["id"]), other[:2])[1])
        if other is None or order < other[0]:
            best[key] = (order, row["id"], stored)
    gone = [{"id": row_id} for row_id in superseded]
    for table, column in (
        ("simulation", "combination_id"),
        ("outcome_interval", "combination_id"),
        ("combination", "id"),
    ):
        _execute(connection, f"DELETE FROM {table} WHERE {column} = :id", gone)
    _execute(
        connection,
        "UPDATE combination SET natural_key = :key, settings = :settings WHERE id = :id",
        [{"key": key, "settings": stored, "id": i} for key, (_, i, stored) in best.items()],
    )


def _number_curves_of_sliding(connection: Connection) -> None:
    """Number the strengths of whole displacement curves: they are the grid of that kind."""
    rows = connection.execute(
        text(
            "SELECT combination_id, kr_over_pga FROM simulation WHERE combination_id IN "
            "(SELECT id FROM combination WHERE kind = 'sliding') "
            "ORDER BY combination_id, kr_over_pga"
        )
    ).all()
    curves: dict[int, list[float]] = {}
    for combination_id, strength in rows:
        curves.setdefault(combination_id, []).append(strength)
    _execute(
        connection,
        "UPDATE simulation SET grid = :grid WHERE combination_id = :id AND kr_over_pga = :strength",
        [
            {"grid": number, "id": combination_id, "strength": strength}
            for combination_id, strengths in curves.items()
            if len(strengths) == _STRENGTHS_OF_SLIDING
            for number, strength in enumerate(strengths)
        ],
    )


def _fill_measures(connection: Connection) -> None:
    """Calculate the later measures of the motions whose samples are there, one at a time."""
    ids = connection.scalars(select(motion.c.id).where(motion.c.samples.is_not(None))).all()
    for row_id in ids:
        query = select(motion.c.samples, motion.c.dt_s).where(motion.c.id == row_id)
        row = connection.execute(query).one()
        samples = np.frombuffer(bytes(row.samples), dtype="<f8").astype(np.float64)
        measures = measures_of(GroundMotion(samples, row.dt_s))
        values = {name: measures[name] for name in LATER_MEASURES}
        connection.execute(update(motion).where(motion.c.id == row_id).values(**values))


def fill_digests(connection: Connection, table: Table) -> None:
    """Write the digest of every row of a table."""
    columns = [column.name for column in table.c]
    keys = [column.name for column in table.primary_key.columns]
    condition = " AND ".join(f"{key} = :{key}" for key in keys)
    for rows in _batches(connection, table):
        digests = table_digests(table, columns, rows)
        _execute(
            connection,
            f"UPDATE {table.name} SET digest = :digest WHERE {condition}",
            [
                {"digest": digest} | {key: row[columns.index(key)] for key in keys}
                for digest, row in zip(digests, rows, strict=True)
            ],
        )


def _batches(connection: Connection, table: Table) -> Iterator[list[tuple[Any, ...]]]:
    # read by key and not by one open cursor, which writing to the same table would disturb
    keys = list(table.primary_key.columns)
    at_once = 16 if table.name in _OF_ARRAYS else 20_000
    query = select(table).order_by(*keys).limit(at_once)
    rows = connection.execute(query).all()
    while rows:
        yield [tuple(row) for row in rows]
        last = [rows[-1]._mapping[key] for key in keys]
        rows = connection.execute(query.where(tuple_(*keys) > tuple_(*last))).all()


def _execute(
    connection: Connection, statement: str, rows: Sequence[Mapping[str, Any]] = ({},)
) -> None:
    """Execute a statement for each row of parameters; for none of them, not at all."""
    if rows:
        connection.execute(text(statement), rows)
