"""Inserts that may be repeated: a row whose natural key is there already is left alone."""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy import Connection, Table
from sqlalchemy.dialects import postgresql, sqlite


def insert_if_new(connection: Connection, table: Table, values: Mapping[str, object]) -> bool:
    """Insert one row unless a unique key of the table holds it already.

    Args:
        connection: inside the caller's transaction.
        table: the table.
        values: column values by name.

    Returns:
        True when the row was inserted.
    """
    build = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    # psycopg forgets the count when the cursor closes, unless it is asked to keep it.
    statement = build(table).values(**values).on_conflict_do_nothing().inline()
    done = connection.execute(statement, execution_options={"preserve_rowcount": True})
    return done.rowcount == 1
