"""Data dictionary: meaning of every column, from the schema; tables as pandas DataFrames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import Boolean, Connection, Double, Integer, LargeBinary, Table, select

from rbfrag.db.location import SCHEMA_REVISION
from rbfrag.db.schema import metadata
from rbfrag.db.views import views
from rbfrag.errors import InputError

_TYPES = (
    ("true/false", Boolean),
    ("integer", Integer),
    ("number", Double),
    ("array", LargeBinary),
)


@dataclass(frozen=True)
class ColumnMeaning:
    """One column.

    Args:
        type: ``integer``, ``number`` (float64), ``true/false``, ``text`` or ``array`` (float64).
        unit: its unit; empty for none, ``k_r/PGA`` for a k_r over the motion's PGA in g.
        meaning: one sentence.
        may_be_missing: whether a row may have no value.
        refers_to: the table and column it points to; empty for none.
    """

    name: str
    type: str
    unit: str
    meaning: str
    may_be_missing: bool
    refers_to: str


@dataclass(frozen=True)
class TableMeaning:
    """One table.

    Args:
        meaning: one sentence.
        columns: its columns, in order.
    """

    name: str
    meaning: str
    columns: tuple[ColumnMeaning, ...]


def data_dictionary() -> tuple[TableMeaning, ...]:
    """Return every table with every column."""
    return tuple(map(table_meaning, metadata.tables.values()))


def view_dictionary() -> tuple[TableMeaning, ...]:
    """Return every view with every column."""
    return tuple(map(table_meaning, views.tables.values()))


def table_meaning(table: Table) -> TableMeaning:
    """Return the meaning of one table of the schema."""
    columns = (
        ColumnMeaning(
            name=column.name,
            type="integer"
            if column.foreign_keys
            else next((name for name, kind in _TYPES if isinstance(column.type, kind)), "text"),
            unit=column.info["unit"],
            meaning=column.info["meaning"],
            may_be_missing=bool(column.nullable),
            refers_to=next((key.target_fullname for key in column.foreign_keys), ""),
        )
        for column in table.columns
    )
    return TableMeaning(table.name, table.info["meaning"], tuple(columns))


def dictionary_as_json() -> dict[str, Any]:
    """Return the dictionary as a JSON document: schema revision, tables and views."""
    return {
        "schema": SCHEMA_REVISION,
        "tables": [asdict(table) for table in data_dictionary()],
        "views": [asdict(view) for view in view_dictionary()],
    }


def dictionary_as_markdown() -> str:
    """Return the dictionary as Markdown, one section per table."""
    return "\n".join(
        f"## {table.name}\n\n{table.meaning}\n\n{columns_as_markdown(table.columns)}"
        for table in (*data_dictionary(), *view_dictionary())
    )


def columns_as_markdown(columns: Iterable[ColumnMeaning]) -> str:
    """Return the Markdown table of some columns."""
    lines = ["| column | type | unit | meaning |", "| --- | --- | --- | --- |"]
    for column in columns:
        notes = [column.meaning]
        if column.refers_to:
            notes.append(f"refers to {column.refers_to}")
        if column.may_be_missing and "missing" not in column.meaning:
            notes.append("may be missing")
        text = "; ".join(notes).replace("|", "\\|")
        lines.append(f"| {column.name} | {column.type} | {column.unit or '-'} | {text} |")
    return "\n".join(lines) + "\n"


if TYPE_CHECKING:
    import pandas as pd

TABLES: dict[str, TableMeaning] = {table.name: table for table in data_dictionary()}
VIEWS: dict[str, TableMeaning] = {view.name: view for view in view_dictionary()}
"""Every table and every view by name, with the meaning of its columns."""

_ROWS = 1 << 16
_ROWS_OF_ARRAYS = 16  # a history or a record is a megabyte


def chosen_columns(
    table: str, columns: Sequence[str] | None = None, *, arrays: bool = False
) -> tuple[ColumnMeaning, ...]:
    """Return the named columns, or all of a table; samples and histories only with `arrays`.

    Raises:
        InputError: there is no such table or column; the message lists those there are.
    """
    meaning = {**TABLES, **VIEWS}.get(table)
    if meaning is None:
        names = ", ".join([*TABLES, *VIEWS])
        raise InputError(f"unknown table {table!r}; the tables are {names}")
    if columns is None:
        return tuple(c for c in meaning.columns if arrays or c.type != "array")
    by_name = {column.name: column for column in meaning.columns}
    for name in columns:
        if name not in by_name:
            raise InputError(f"table {table} has no column {name!r}; it has: {', '.join(by_name)}")
    return tuple(by_name[name] for name in dict.fromkeys(columns))


def frames(
    connection: Connection, table: str, columns: Sequence[ColumnMeaning]
) -> Iterator[pd.DataFrame]:
    """Yield a table in key order, in chunks of bounded memory; at least one."""
    # Imported here: no other answer of rbfrag needs pandas.
    import pandas as pd

    source = {**metadata.tables, **views.tables}[table]
    rows = _ROWS_OF_ARRAYS if any(column.type == "array" for column in columns) else _ROWS
    query = select(*(source.c[column.name] for column in columns))
    query = query.order_by(*source.primary_key.columns).execution_options(yield_per=rows)
    text = pd.Series([""]).dtype  # pandas 2 knows objects, pandas 3 has a type of its own
    types = {}
    for column in columns:
        wide = "Int64" if column.may_be_missing else "int64"
        truth = "object" if column.may_be_missing else "bool"
        kinds = {"number": "float64", "integer": wide, "true/false": truth, "text": text}
        types[column.name] = kinds.get(column.type, "object")
    for frame in pd.read_sql_query(query, connection, chunksize=rows):
        for column in columns:
            if column.type == "array":
                frame[column.name] = frame[column.name].map(
                    lambda blob: np.frombuffer(blob, dtype="<f8"), na_action="ignore"
                )
        yield frame.astype(types)
