"""Values that no writer of rbfrag stored: altered ones, NaN and infinities."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, Double, LargeBinary, or_, select
from sqlalchemy.sql.elements import ColumnElement

from rbfrag.db.check.finding import Finding
from rbfrag.db.insert import table_digests
from rbfrag.db.schema import metadata

_GREATEST = 1.7976931348623157e308

ALTERED = "its values are not those that were written: its digest differs"


def check_digests(connection: Connection) -> Iterator[Finding]:
    """Yield every row whose values were altered after rbfrag wrote it.

    Args:
        connection: the database, inside one transaction.
    """
    for name, table in sorted(metadata.tables.items()):
        key = list(table.primary_key.columns)
        columns = [column.name for column in table.c]
        holds_arrays = any(isinstance(column.type, LargeBinary) for column in table.c)
        query = select(table).order_by(*key)
        rows_at_once = 16 if holds_arrays else 1 << 14
        result = connection.execute(query, execution_options={"yield_per": rows_at_once})
        for rows in result.partitions():
            digests = table_digests(table, columns, rows)
            for row, digest in zip(rows, digests, strict=True):
                if row.digest != digest:
                    at = ", ".join(str(row._mapping[column]) for column in key)
                    yield Finding(name, at, ALTERED)


def check_numbers(connection: Connection) -> Iterator[Finding]:
    """Yield every row with a number that is not finite.

    Args:
        connection: the database, inside one transaction.
    """
    for name, table in sorted(metadata.tables.items()):
        doubles = [column for column in table.c if isinstance(column.type, Double)]
        if not doubles:
            continue
        key = list(table.primary_key.columns)
        # PostgreSQL sorts NaN above every number; SQLite holds it as NULL.
        wrong: list[ColumnElement[bool]] = [
            or_(column > _GREATEST, column < -_GREATEST) for column in doubles
        ]
        query = select(*key, *doubles).where(or_(*wrong))
        for row in connection.execute(query).mappings():
            bad = [c.name for c in doubles if row[c.name] is not None and not _finite(row[c.name])]
            at = ", ".join(str(row[column.name]) for column in key)
            yield Finding(name, at, f"{', '.join(bad)}: not a finite number")


def _finite(value: float) -> bool:
    return abs(value) <= _GREATEST
