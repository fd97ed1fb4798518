"""All writes of rows: repeatable inserts, updates and deletions, with their digests and ledger
entries.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from typing import Any

from sqlalchemy import (
    Boolean,
    ColumnElement,
    Connection,
    Float,
    Integer,
    LargeBinary,
    Select,
    Table,
    bindparam,
    delete,
    insert,
    select,
    tuple_,
    update,
)
from sqlalchemy.dialects import postgresql, sqlite

from rbfrag.db.keys import NOT_DIGESTED, ValueType, row_digests
from rbfrag.db.ledger import tally
from rbfrag.db.schema import metadata
from rbfrag.errors import DatabaseError

# psycopg forgets the count when the cursor closes, unless it is asked to keep it
_COUNTED = {"preserve_rowcount": True}
_KEYS_AT_ONCE = 500
_VALUE_TYPES: tuple[tuple[type, ValueType], ...] = (
    (Boolean, "boolean"), (Float, "float"), (Integer, "integer"), (LargeBinary, "bytes")
)  # fmt: skip
_ROWS_AT_ONCE = 5_000


def insert_if_new(connection: Connection, table: Table, values: Mapping[str, object]) -> bool:
    """Insert one row unless its unique key is already in the table.

    Returns:
        True when the row was inserted.
    """
    build = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    row = _digested(table, values)
    statement = build(table).values(**row).on_conflict_do_nothing().inline()
    result = connection.execute(statement, execution_options=_COUNTED)
    if result.rowcount == 1:
        _tally_one(connection, table, row)
    return result.rowcount == 1


def insert_row(connection: Connection, table: Table, values: Mapping[str, object]) -> int:
    """Insert one row and return its id."""
    row = _digested(table, values)
    result = connection.execute(insert(table).values(**row))
    assert result.inserted_primary_key is not None
    _tally_one(connection, table, row)
    return int(result.inserted_primary_key[0])


def insert_rows(
    connection: Connection,
    table: Table,
    columns: Sequence[str],
    rows: Sequence[tuple[object, ...]],
    *,
    on_conflict: str = "DO NOTHING",
) -> None:
    """Insert many rows at driver speed; rows with an existing key are skipped.

    The rows go to the driver's `executemany` as they are: SQLAlchemy's own treatment of each
    value would cost more than the insertion.

    Args:
        columns: names of the columns that the rows fill.
        rows: tuples of None, bool, int, float, str and bytes, in the order of `columns`; numpy's
            scalars are not understood by every driver.
        on_conflict: SQL that says what becomes of a row whose primary key is there.
    """
    if not rows:
        return
    unknown = [name for name in columns if name not in table.c]
    if unknown:
        raise ValueError(f"table {table.name} has no column {unknown[0]!r}")
    digests = table_digests(table, columns, rows)
    mark = "?" if connection.dialect.paramstyle == "qmark" else "%s"
    statement = (
        f"INSERT INTO {table.name} ({', '.join(columns)}, digest) "
        f"VALUES ({', '.join(mark for _ in columns)}, {mark}) ON CONFLICT "
    )
    values = [(*row, digest) for row, digest in zip(rows, digests, strict=True)]
    connection.exec_driver_sql("SAVEPOINT many")
    result = connection.exec_driver_sql(
        f"{statement} DO NOTHING", values, execution_options=_COUNTED
    )
    if result.rowcount == len(rows):
        tally(connection, table, columns, rows, digests)
    else:  # some key was there: only one by one it shows which
        connection.exec_driver_sql("ROLLBACK TO SAVEPOINT many")
        for row in values:
            _insert_one(connection, table, (*columns, "digest"), row, f"{statement} {on_conflict}")
    connection.exec_driver_sql("RELEASE SAVEPOINT many")


def _insert_one(
    connection: Connection,
    table: Table,
    columns: Sequence[str],
    row: tuple[object, ...],
    statement: str,
) -> None:
    """Insert a row by a statement that may instead change the row with its key."""
    named = dict(zip(columns, row, strict=True))
    before = None
    if "DO UPDATE" in statement:
        key = [column == named[column.name] for column in table.primary_key.columns]
        before = connection.scalar(select(table.c.digest).where(*key).with_for_update())
    result = connection.exec_driver_sql(statement, row, execution_options=_COUNTED)
    if result.rowcount:
        _tally_one(connection, table, named)
        if before is not None:
            _tally_one(connection, table, {**named, "digest": before}, sign=-1)


def _tally_one(
    connection: Connection, table: Table, row: Mapping[str, Any], *, sign: int = 1
) -> None:
    tally(connection, table, [*row], [[*row.values()]], [row["digest"]], sign=sign)


def update_rows(
    connection: Connection, table: Table, where: ColumnElement[bool], values: Mapping[str, object]
) -> None:
    """Update columns of the rows that meet a condition.

    Raises:
        DatabaseError: such a row was altered; a digest of the changed row would hide that.
    """
    for row in connection.execute(select(table).where(where).with_for_update()).mappings().all():
        reject_altered(table, {**row})
        changed = _digested(table, {**row, **values})
        connection.execute(
            update(table)
            .where(*(column == row[column.name] for column in table.primary_key.columns))
            .values(**values, digest=changed["digest"])
        )
        _tally_one(connection, table, {**row}, sign=-1)
        _tally_one(connection, table, changed)


def delete_rows(connection: Connection, table: Table, *where: ColumnElement[bool]) -> None:
    """Delete the rows that meet all conditions."""
    for row in connection.execute(select(table).where(*where).with_for_update()).mappings():
        _tally_one(connection, table, {**row}, sign=-1)
    connection.execute(delete(table).where(*where))


def keep_writers_out(connection: Connection) -> None:
    """Block other writing transactions during this one, as SQLite does by default."""
    if connection.dialect.name == "postgresql":
        names = ", ".join(sorted(metadata.tables))
        connection.exec_driver_sql(f"LOCK TABLE {names} IN SHARE ROW EXCLUSIVE MODE")


def reject_altered(table: Table, row: Mapping[str, Any]) -> None:
    """Reject a row whose values differ from those written."""
    try:
        sound = _digested(table, row)["digest"] == row["digest"]
    except (ValueError, TypeError, ArithmeticError):  # a value of another type than its column's
        sound = False
    if not sound:
        at = ", ".join(str(row[column.name]) for column in table.primary_key.columns)
        raise DatabaseError(
            f"row {at} of the table {table.name} is damaged (its digest differs) and is not "
            "changed: run  rbfrag db check  and restore the database from a backup"
        )


def table_digests(
    table: Table, columns: Sequence[str], rows: Sequence[Sequence[object]]
) -> list[int]:
    """Return the digests of rows of a table.

    Args:
        columns: names of the columns that the rows fill; the others are NULL.
        rows: their values, in the order of `columns`.
    """
    filled = dict(zip(columns, zip(*rows, strict=True), strict=True))
    missing = (None,) * len(rows)
    types = _digested_columns(table)
    return row_digests(list(types.values()), [filled.get(name, missing) for name in types])


def _digested(table: Table, values: Mapping[str, object]) -> dict[str, object]:
    (digest,) = table_digests(table, list(values), [list(values.values())])
    return {**values, "digest": digest}


@cache
def _digested_columns(table: Table) -> dict[str, ValueType]:
    """Return the types of the columns in the digest, by name, in the order of names."""
    return {
        name: next((value for kind, value in _VALUE_TYPES if isinstance(column.type, kind)), "text")
        for name, column in sorted(table.c.items())
        if name not in NOT_DIGESTED
    }


def utc_now() -> str:
    """Return the current UTC time in ISO 8601, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def renew_digests(connection: Connection, table: Table, before: Table | None = None) -> None:
    """Recompute the digest of every row, for the present columns of the table.

    Args:
        before: the table that the stored digests are of. A row whose values have not its stored
            digest was altered, and keeps it, so that it is still found. None to take all rows as
            they are.
    """
    columns = [column.name for column in table.c]
    keys = list(table.primary_key.columns)
    if not keys:
        raise ValueError(f"table {table.name} has no primary key")
    change = (
        update(table)
        .where(*(key == bindparam(f"at_{key.name}") for key in keys))
        .values(digest=bindparam("renewed"))
    )
    # read by key and not by one open cursor, which writing to the same table would disturb
    holds_arrays = any(isinstance(column.type, LargeBinary) for column in table.c)
    query = select(table).order_by(*keys).limit(16 if holds_arrays else _ROWS_AT_ONCE)
    rows = connection.execute(query).all()
    while rows:
        expected = [row.digest for row in rows]
        if before is not None:
            names = [column.name for column in before.c]
            values = [[row._mapping[name] for name in names] for row in rows]
            expected = table_digests(before, names, values)
        renewed = table_digests(table, columns, rows)
        intact = [
            (row, digest)
            for row, digest, former in zip(rows, renewed, expected, strict=True)
            if row.digest == former
        ]
        if intact:
            changes = [
                {"renewed": digest} | {f"at_{key.name}": row._mapping[key.name] for key in keys}
                for row, digest in intact
            ]
            connection.execute(change, changes)
            changed, digests = zip(*intact, strict=True)
            tally(connection, table, columns, changed, [row.digest for row in changed], sign=-1)
            tally(connection, table, columns, changed, digests)
        last = [rows[-1]._mapping[key.name] for key in keys]
        rows = connection.execute(query.where(tuple_(*keys) > tuple_(*last))).all()


def storable(text: str) -> str:
    r"""Return text without characters that databases reject, visibly replaced.

    File names may hold bytes that are no text, and damaged headers hold NUL; both become
    ``\x..`` instead of failing the insert.
    """
    visible = text.replace("\x00", "\\x00")
    return visible.encode("utf-8", "backslashreplace").decode("utf-8")


def rows_of_keys(
    connection: Connection, query: Select[Any], column: ColumnElement[str], keys: Iterable[str]
) -> Iterator[Any]:
    """Yield the rows whose column is one of many keys, in any order."""
    query = query.where(column.in_(bindparam("keys", expanding=True)))
    unique_keys = list(dict.fromkeys(keys))
    # as many at a time as any SQLite build takes variables
    for start in range(0, len(unique_keys), _KEYS_AT_ONCE):
        yield from connection.execute(query, {"keys": unique_keys[start : start + _KEYS_AT_ONCE]})
