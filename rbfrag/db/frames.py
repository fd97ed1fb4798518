"""Tables as pandas DataFrames, in chunks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from sqlalchemy import Connection, select

from rbfrag.db.data_dictionary import ColumnMeaning, TableMeaning, data_dictionary
from rbfrag.db.schema import metadata
from rbfrag.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

TABLES: dict[str, TableMeaning] = {table.name: table for table in data_dictionary()}
"""Every table by name, with the meaning of its columns."""

_ROWS = 1 << 16
_ROWS_OF_ARRAYS = 16  # a history or a record is a megabyte


def chosen_columns(
    table: str, columns: Sequence[str] | None = None, *, arrays: bool = False
) -> tuple[ColumnMeaning, ...]:
    """Return the named columns, or all of a table; samples and histories only with `arrays`.

    Raises:
        InputError: there is no such table or column; the message lists those there are.
    """
    meaning = TABLES.get(table)
    if meaning is None:
        raise InputError(f"unknown table {table!r}; the tables are {', '.join(TABLES)}")
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

    source = metadata.tables[table]
    rows = _ROWS_OF_ARRAYS if any(column.type == "array" for column in columns) else _ROWS
    query = select(*(source.c[column.name] for column in columns))
    query = query.order_by(*source.primary_key.columns).execution_options(yield_per=rows)
    text = pd.Series([""]).dtype  # pandas 2 knows objects, pandas 3 has a type of its own
    types = {
        column.name: text if column.type == "text" else _frame_type(column) for column in columns
    }
    for frame in pd.read_sql_query(query, connection, chunksize=rows):
        for column in columns:
            if column.type == "array":
                frame[column.name] = frame[column.name].map(
                    lambda blob: np.frombuffer(blob, dtype="<f8"), na_action="ignore"
                )
        yield frame.astype(types)


def _frame_type(column: ColumnMeaning) -> str:
    if column.type == "number":
        return "float64"
    if column.type == "integer":
        return "Int64" if column.may_be_missing else "int64"
    return "bool" if column.type == "true/false" and not column.may_be_missing else "object"
