"""What several migrations do: tables read as they are, rows changed by key, tables made anew."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from alembic import op

from rbfrag.db.insert import table_digests

_OF_ARRAYS = ("motion", "response")


def reflected(connection: sa.Connection, name: str) -> sa.Table:
    """Return a table as the database has it, without what it refers to."""
    return sa.Table(name, sa.MetaData(), autoload_with=connection, resolve_fks=False)


def execute_many(
    connection: sa.Connection, statement: str, values: Mapping[str, list[Any]]
) -> None:
    """Execute a statement for each row of parameters, which are given as columns by name."""
    parameters = [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]
    if parameters:
        connection.execute(sa.text(statement), parameters)


def fill_digests(connection: sa.Connection, name: str) -> None:
    """Write the digest of every row of a table, of the columns that it has now."""
    table = reflected(connection, name)
    columns = [column.name for column in table.c]
    keys = [column.name for column in table.primary_key.columns]
    condition = " AND ".join(f"{key} = :{key}" for key in keys)
    for rows in _batches(connection, table):
        values = {key: [row[columns.index(key)] for row in rows] for key in keys}
        values["digest"] = table_digests(table, columns, rows)
        execute_many(connection, f"UPDATE {name} SET digest = :digest WHERE {condition}", values)


def _batches(connection: sa.Connection, table: sa.Table) -> Iterator[list[tuple[Any, ...]]]:
    # read by key and not by one open cursor, which writing to the same table would disturb
    keys = list(table.primary_key.columns)
    at_once = 16 if table.name in _OF_ARRAYS else 20_000
    query = sa.select(table).order_by(*keys).limit(at_once)
    rows = connection.execute(query).all()
    while rows:
        yield [tuple(row) for row in rows]
        last = [rows[-1]._mapping[key] for key in keys]
        rows = connection.execute(query.where(sa.tuple_(*keys) > sa.tuple_(*last))).all()


def rebuild_table(
    name: str,
    nullable: Mapping[str, bool],
    dropped: Sequence[str],
    checks: Mapping[str, str],
    *,
    left_out: Sequence[str] = (),
    last: Sequence[str] = (),
) -> None:
    """Make an SQLite table anew as it is, but for what changes, and move its rows.

    Args:
        name: the table.
        nullable: whether columns may be empty, where that changes.
        dropped: checks that go, by the end of their names.
        checks: rules of those that come.
        left_out: columns that go.
        last: columns that come to stand at the end, in this order.
    """
    connection = op.get_bind()
    inspector = sa.inspect(connection)
    old = reflected(connection, name)
    indexes = connection.scalars(
        sa.text("SELECT sql FROM sqlite_master WHERE type = 'index' AND tbl_name = :name "
                "AND sql IS NOT NULL"), {"name": name},
    ).all()  # fmt: skip
    rules = {
        str(check["name"]): check["sqltext"]
        for check in inspector.get_check_constraints(name)
        if check["name"] not in {f"ck_{name}_{each}" for each in dropped}
    } | {f"ck_{name}_{each}": rule for each, rule in checks.items()}
    kept = [column.name for column in old.c if column.name not in left_out]
    columns = [each for each in kept if each not in last] + list(last)
    op.create_table(
        f"{name}_rebuilt",
        *(
            sa.Column(each, old.c[each].type, nullable=nullable.get(each, old.c[each].nullable))
            for each in columns
        ),
        *(sa.CheckConstraint(rule, name=op.f(each)) for each, rule in sorted(rules.items())),
        *(
            sa.ForeignKeyConstraint(
                key["constrained_columns"],
                [f"{key['referred_table']}.{column}" for column in key["referred_columns"]],
                name=op.f(str(key["name"])),
                ondelete=key["options"]["ondelete"],
            )
            for key in inspector.get_foreign_keys(name)
        ),
        sa.PrimaryKeyConstraint(
            *(column.name for column in old.primary_key.columns), name=op.f(f"pk_{name}")
        ),
        *(
            sa.UniqueConstraint(*unique["column_names"], name=op.f(str(unique["name"])))
            for unique in inspector.get_unique_constraints(name)
        ),
        sqlite_with_rowid=_has_rowid(connection, name),
    )
    listed = ", ".join(columns)
    op.execute(f"INSERT INTO {name}_rebuilt ({listed}) SELECT {listed} FROM {name}")
    op.drop_table(name)
    op.rename_table(f"{name}_rebuilt", name)
    for statement in indexes:
        op.execute(statement)


def _has_rowid(connection: sa.Connection, name: str) -> bool:
    # SQLAlchemy's inspector tells it from 2.1 on
    query = sa.text("SELECT sql FROM sqlite_master WHERE type = 'table' AND name = :name")
    return "WITHOUT ROWID" not in str(connection.scalar(query, {"name": name})).upper()
