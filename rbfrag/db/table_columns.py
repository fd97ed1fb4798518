"""Whole tables as columns, in batches: no object per row beyond what the driver makes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Column, Connection, select

from rbfrag.db.data_dictionary import ColumnMeaning, TableMeaning, data_dictionary
from rbfrag.db.schema import metadata
from rbfrag.errors import InputError

TABLES: Mapping[str, TableMeaning] = {table.name: table for table in data_dictionary()}
"""Every table by name, with the meaning of its columns."""

_ROWS = 1 << 16
_ROWS_OF_ARRAYS = 16  # a history or a record is a megabyte


@dataclass(frozen=True)
class Batch:
    """Some rows of a table, column by column.

    Args:
        columns: what the columns are.
        values: the values of each, as the database gives them; None where missing.
    """

    columns: tuple[ColumnMeaning, ...]
    values: tuple[tuple[Any, ...], ...]


def chosen_columns(
    table: str, columns: Sequence[str] | None = None, *, arrays: bool = False
) -> tuple[ColumnMeaning, ...]:
    """Return the columns that a reader gets.

    Args:
        table: name of the table.
        columns: names of the columns, in the order wanted; None for all.
        arrays: whether all includes samples and histories.

    Raises:
        InputError: there is no such table or column; the message lists those there are.
    """
    meaning = TABLES.get(table)
    if meaning is None:
        raise InputError(f"there is no table {table!r}; there are: {', '.join(TABLES)}")
    if columns is None:
        return tuple(c for c in meaning.columns if arrays or c.type != "array")
    by_name = {column.name: column for column in meaning.columns}
    for name in columns:
        if name not in by_name:
            raise InputError(f"table {table} has no column {name!r}; it has: {', '.join(by_name)}")
    return tuple(by_name[name] for name in dict.fromkeys(columns))


def column_batches(
    connection: Connection, table: str, columns: Sequence[ColumnMeaning]
) -> Iterator[Batch]:
    """Yield the rows of a table in the order of its key, so many at a time that memory is bounded.

    Args:
        connection: the database, inside one transaction.
        table: name of the table.
        columns: from :func:`chosen_columns`.
    """
    source = metadata.tables[table]
    wanted: list[Column[Any]] = [source.c[column.name] for column in columns]
    rows = _ROWS_OF_ARRAYS if any(column.type == "array" for column in columns) else _ROWS
    query = select(*wanted).order_by(*source.primary_key.columns)
    result = connection.execute(query, execution_options={"yield_per": rows})
    for part in result.partitions():
        yield Batch(tuple(columns), tuple(zip(*part, strict=True)))


def read_columns(
    connection: Connection,
    table: str,
    columns: Sequence[str] | None = None,
    *,
    arrays: bool = False,
) -> dict[str, NDArray[Any]]:
    """Return a table as numpy arrays by column name, in the order of its key.

    A missing number is NaN, and an integer column that may miss a value is float64; text,
    times and JSON are arrays of str, and a true/false column that may miss a value is one of
    objects, None where missing; samples and histories are arrays of
    float64 arrays.

    Args:
        connection: the database, inside one transaction.
        table: name of the table.
        columns: names of the columns; None for all, but samples and histories only with
            `arrays`.
        arrays: include samples and histories.
    """
    chosen = chosen_columns(table, columns, arrays=arrays)
    parts: list[list[NDArray[Any]]] = [[] for _ in chosen]
    for batch in column_batches(connection, table, chosen):
        for column, values, part in zip(chosen, batch.values, parts, strict=True):
            part.append(_as_array(column, values))
    return {
        column.name: np.concatenate(part) if part else _as_array(column, ())
        for column, part in zip(chosen, parts, strict=True)
    }


def _as_array(column: ColumnMeaning, values: Sequence[Any]) -> NDArray[Any]:
    if column.type == "number" or (column.type == "integer" and column.may_be_missing):
        return np.array(values, dtype=np.float64)  # None becomes NaN
    if column.type == "integer":
        return np.array(values, dtype=np.int64)
    if column.type == "true/false" and not column.may_be_missing:
        return np.array(values, dtype=np.bool_)
    made = np.empty(len(values), dtype=object)
    if column.type == "array":
        for i, blob in enumerate(values):
            made[i] = None if blob is None else np.frombuffer(blob, dtype="<f8")
    else:
        made[:] = values
    return made
