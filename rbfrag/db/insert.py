"""Inserts that may be repeated: a row whose natural key is there already is left alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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


def insert_rows(
    connection: Connection,
    table: Table,
    columns: Sequence[str],
    rows: Sequence[tuple[object, ...]],
) -> None:
    """Insert many rows at the speed of the driver; those whose key is there are left alone.

    The rows go to the driver's `executemany` as they are: SQLAlchemy's own treatment of each
    value would cost more than the insertion.

    Args:
        connection: inside the caller's transaction.
        table: the table.
        columns: names of the columns that the rows fill.
        rows: tuples of None, bool, int, float, str and bytes, in the order of `columns`; numpy's
            scalars are not understood by every driver.
    """
    if not rows:
        return
    unknown = [name for name in columns if name not in table.c]
    if unknown:
        raise ValueError(f"table {table.name} has no column {unknown[0]!r}")
    mark = "?" if connection.dialect.paramstyle == "qmark" else "%s"
    connection.exec_driver_sql(
        f"INSERT INTO {table.name} ({', '.join(columns)}) "
        f"VALUES ({', '.join(mark for _ in columns)}) ON CONFLICT DO NOTHING",
        list(rows),
    )
