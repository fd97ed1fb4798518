"""A table of blocks with answers, written some thousand rows at a time."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MissingExtraError
from rbfrag.exchange.block_table import pyarrow

Write = Callable[[dict[str, Any], dict[str, NDArray[Any]]], None]
"""Writes one part of the table and its answers."""


def csv_writer(
    partial: Path,
    header: list[str],
    answers: Sequence[str],
    numeric: Sequence[str],
    stack: ExitStack,
) -> Write:
    """Return a function that writes parts as CSV: NaN is an empty cell.

    Args:
        partial: the file.
        header: names of the columns of the table that are kept.
        answers: names of the columns that are appended.
        numeric: columns that hold numbers.
        stack: closes the file at the end.
    """
    file = stack.enter_context(partial.open("w", newline="", encoding="utf-8"))
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([*header, *answers])
    try:
        arrow, _ = pyarrow()
        from pyarrow import csv as arrow_csv
    except MissingExtraError:

        def write_cells(part: dict[str, Any], answer: dict[str, NDArray[Any]]) -> None:
            columns = [_cells(part[name]) for name in header]
            columns += [_cells(answer[name]) for name in answers]
            writer.writerows(zip(*columns, strict=True))

        return write_cells

    file.flush()
    options = arrow_csv.WriteOptions(include_header=False, batch_size=1 << 16)
    stream = stack.enter_context(partial.open("ab"))

    def write(part: dict[str, Any], answer: dict[str, NDArray[Any]]) -> None:
        table = arrow.table(_columns(arrow, part, answer, header, answers, numeric, bare=True))
        arrow_csv.write_csv(table, stream, options)

    return write


def _cells(column: Any) -> list[Any]:
    if not isinstance(column, np.ndarray):
        values: list[Any] = column if isinstance(column, list) else column.to_pylist()
        return ["" if value is None else value for value in values]
    if column.dtype.kind == "f":
        return ["" if value != value else value for value in column.tolist()]
    if column.dtype.kind == "b":
        return ["true" if value else "false" for value in column.tolist()]
    return list(column.tolist())


def parquet_writer(
    partial: Path,
    header: list[str],
    answers: Sequence[str],
    numeric: Sequence[str],
    stack: ExitStack,
) -> Write:
    """Return a function that writes parts as Parquet: NaN is null.

    Args:
        partial: the file.
        header: names of the columns of the table that are kept.
        answers: names of the columns that are appended.
        numeric: columns that hold numbers.
        stack: closes the file at the end.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    arrow, parquet = pyarrow()
    open_file: list[Any] = []

    def write(part: dict[str, Any], answer: dict[str, NDArray[Any]]) -> None:
        table = arrow.table(_columns(arrow, part, answer, header, answers, numeric, bare=False))
        if not open_file:
            texts = [field.name for field in table.schema if arrow.types.is_string(field.type)]
            made = parquet.ParquetWriter(partial, table.schema, use_dictionary=texts)
            open_file.append(stack.enter_context(made))
        open_file[0].write_table(table.cast(open_file[0].schema))

    return write


def _columns(
    arrow: Any,
    part: dict[str, Any],
    answer: dict[str, NDArray[Any]],
    header: list[str],
    answers: Sequence[str],
    numeric: Sequence[str],
    *,
    bare: bool,
) -> dict[str, Any]:
    """Return the columns as Arrow arrays; `bare` leaves empty texts out."""
    columns: dict[str, Any] = {}
    for name in header:
        column = part[name]
        if isinstance(column, list):
            if name in numeric:
                column = np.array([float(c) if c.strip() else np.nan for c in column])
            else:
                column = arrow.array(column, type=arrow.string())
        if isinstance(column, np.ndarray):
            column = arrow.array(column, mask=np.isnan(column))
        if bare and arrow.types.is_string(column.type):
            column = arrow.compute.replace_with_mask(
                column, arrow.compute.equal(column, ""), arrow.scalar(None, arrow.string())
            )
        columns[name] = column
    for name in answers:
        values = answer[name]
        if values.dtype.kind == "O":
            empty = np.equal(values, "") if bare else None
            columns[name] = arrow.array(values, type=arrow.string(), mask=empty)
        else:
            missing = np.isnan(values) if values.dtype.kind == "f" else None
            columns[name] = arrow.array(values, mask=missing)
    return columns
