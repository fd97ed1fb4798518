"""A table of blocks, read and written with answers some thousand rows at a time."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError

ROWS = 1 << 18
"""Rows that are read, answered and written at a time."""

Parts = Iterator[tuple[int, dict[str, Any]]]
"""Number of the first line or row, and columns by name: arrays of numbers, or other cells."""

Write = Callable[[dict[str, Any], dict[str, NDArray[Any]]], None]
"""Writes one part of the table and its answers."""


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and pyarrow.parquet, or say which extra brings them."""
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise MissingExtraError("Parquet files need pyarrow", "parquet") from None
    return arrow, parquet


def csv_rows(origin: Path, numeric: Sequence[str], stack: ExitStack) -> tuple[list[str], Parts]:
    """Return the names of the columns of a CSV file, and its parts, read cell by cell as texts.

    The stack closes the file at the end. A line with too few or too many cells is an InputError.
    """
    del numeric
    reader = csv.reader(stack.enter_context(origin.open(newline="", encoding="utf-8-sig")))
    header = [cell.strip() for cell in next(reader, [])]
    return header, _cell_by_cell(origin, header, reader)


def csv_parts(origin: Path, numeric: Sequence[str], stack: ExitStack) -> tuple[list[str], Parts]:
    """Return the same as :func:`csv_rows`, by pyarrow where it is installed, ten times as fast.

    What pyarrow cannot read is read again cell by cell, for a message that names the line.
    """
    file = stack.enter_context(origin.open(newline="", encoding="utf-8-sig"))
    reader = csv.reader(file)
    header = [cell.strip() for cell in next(reader, [])]
    try:
        arrow, _ = pyarrow()
        from pyarrow import csv as arrow_csv
    except MissingExtraError:
        return header, _cell_by_cell(origin, header, reader)
    return header, _fast_csv(origin, header, numeric, reader, arrow, arrow_csv)


def _fast_csv(
    origin: Path, header: list[str], numeric: Sequence[str], reader: Any, arrow: Any, arrow_csv: Any
) -> Parts:
    kinds = {name: arrow.float64() if name in numeric else arrow.string() for name in header}
    first, done = 2, 0
    try:
        batches = arrow_csv.open_csv(
            origin,
            read_options=arrow_csv.ReadOptions(
                column_names=header, skip_rows=1, block_size=1 << 25, use_threads=False
            ),
            parse_options=arrow_csv.ParseOptions(newlines_in_values=True),
            convert_options=arrow_csv.ConvertOptions(column_types=kinds, strings_can_be_null=False),
        )
        for batch in batches:
            part: dict[str, Any] = {}
            for name, column in zip(header, batch.columns, strict=True):
                if name in numeric:
                    part[name] = np.array(column.to_numpy(zero_copy_only=False))
                else:
                    part[name] = column.to_pylist() if name == "mode" else column
            if batch.num_rows:
                yield first, part
            first += batch.num_rows
            done += batch.num_rows
    except arrow.ArrowException:
        # cell by cell from the first row that was not handed out
        yield from _cell_by_cell(origin, header, reader, done)


def _cell_by_cell(origin: Path, header: list[str], reader: Any, done: int = 0) -> Parts:
    rows: list[list[str]] = []
    first = reader.line_num + 1
    for number, row in enumerate(row for row in reader if row):
        if number < done:
            first = reader.line_num + 1
            continue
        if len(row) != len(header):
            raise InputError(
                f"{origin}, line {reader.line_num}: {len(row)} cells under {len(header)} columns"
            )
        rows.append(row)
        if len(rows) == ROWS:
            yield first, dict(zip(header, map(list, zip(*rows, strict=True)), strict=True))
            rows, first = [], reader.line_num + 1
    if rows:
        yield first, dict(zip(header, map(list, zip(*rows, strict=True)), strict=True))


def parquet_parts(
    origin: Path, numeric: Sequence[str], stack: ExitStack
) -> tuple[list[str], Parts]:
    """Return the names of the columns of a Parquet file, and its parts."""
    arrow, parquet = pyarrow()
    try:
        file = stack.enter_context(parquet.ParquetFile(origin))
    except (arrow.ArrowException, UnicodeError) as error:
        raise InputError(f"{origin}: not a Parquet file: {error}") from None
    header = list(file.schema_arrow.names)

    def batches() -> Iterator[Any]:
        try:
            yield from file.iter_batches(batch_size=ROWS)
        except (arrow.ArrowException, OSError, UnicodeError) as error:
            raise InputError(
                f"{origin}: the Parquet file is damaged: {error}; write it again"
            ) from None

    def parts() -> Parts:
        first = 1
        for group in batches():
            part: dict[str, Any] = {}
            for name, column in zip(header, group.columns, strict=True):
                if name in numeric:
                    try:
                        column = column.cast(arrow.float64()).to_numpy(zero_copy_only=False)
                    except arrow.ArrowException:
                        raise InputError(f"{origin}: the column {name} holds no numbers") from None
                    part[name] = np.array(column, dtype=np.float64)
                else:
                    part[name] = column.to_pylist() if name == "mode" else column
            yield first, part
            first += group.num_rows

    return header, parts()


def numbers(origin: Path, column: str, cells: Any, first_line: int) -> NDArray[np.float64]:
    """Return the numbers of some cells; NaN where one is empty."""
    if isinstance(cells, np.ndarray):
        return cells
    values = np.empty(len(cells))
    for i, cell in enumerate(cells):
        try:
            values[i] = float(cell.strip() or "nan")
        except ValueError:
            raise InputError(
                f"{origin}, line {first_line + i}: {column} = {cell.strip()!r} is not a number"
            ) from None
    return values


def csv_writer(
    partial: Path,
    header: list[str],
    answers: Sequence[str],
    numeric: Sequence[str],
    stack: ExitStack,
) -> Write:
    """Return a function that writes parts as CSV: NaN is an empty cell."""
    file = stack.enter_context(partial.open("w", newline="", encoding="utf-8"))
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([*header, *answers])
    try:
        arrow, _ = pyarrow()
        from pyarrow import csv as arrow_csv
    except MissingExtraError:

        def write_cells(part: dict[str, Any], answer: dict[str, NDArray[Any]]) -> None:
            columns = [cells_of(part[name]) for name in header]
            columns += [cells_of(answer[name]) for name in answers]
            writer.writerows(zip(*columns, strict=True))

        return write_cells

    file.flush()
    options = arrow_csv.WriteOptions(include_header=False, batch_size=1 << 16)
    stream = stack.enter_context(partial.open("ab"))

    def write(part: dict[str, Any], answer: dict[str, NDArray[Any]]) -> None:
        table = arrow.table(_columns(arrow, part, answer, header, answers, numeric, bare=True))
        arrow_csv.write_csv(table, stream, options)

    return write


def cells_of(column: Any) -> list[Any]:
    """Return what a column's cells hold in CSV: nothing for NaN and null."""
    if not isinstance(column, np.ndarray):
        values: list[Any] = column if isinstance(column, list) else column.to_pylist()
        return ["" if value is None else value for value in values]
    if column.dtype.kind == "f":
        return ["" if value != value else value for value in column.tolist()]
    if column.dtype.kind == "b":
        return ["true" if value else "false" for value in column.tolist()]
    return list(column.tolist())


def arrow_array(arrow: Any, values: NDArray[Any], *, bare: bool = False) -> Any:
    """Return an array as Arrow has it: NaN is null; `bare` makes empty texts null, too."""
    if values.dtype.kind in "OU":
        empty = np.equal(values, "") if bare else None
        return arrow.array(values, type=arrow.string(), mask=empty)
    return arrow.array(values, mask=np.isnan(values) if values.dtype.kind == "f" else None)


def parquet_writer(
    partial: Path,
    header: list[str],
    answers: Sequence[str],
    numeric: Sequence[str],
    stack: ExitStack,
) -> Write:
    """Return a function that writes parts as Parquet, where NaN is null; as :func:`csv_writer`."""
    arrow, parquet = pyarrow()
    open_file: list[Any] = []

    def write(part: dict[str, Any], answer: dict[str, NDArray[Any]]) -> None:
        table = arrow.table(_columns(arrow, part, answer, header, answers, numeric, bare=False))
        if not open_file:
            texts = [field.name for field in table.schema if arrow.types.is_string(field.type)]
            parquet_file = parquet.ParquetWriter(partial, table.schema, use_dictionary=texts)
            open_file.append(stack.enter_context(parquet_file))
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
            column = arrow_array(arrow, column)
        if bare and arrow.types.is_string(column.type):
            column = arrow.compute.replace_with_mask(
                column, arrow.compute.equal(column, ""), arrow.scalar(None, arrow.string())
            )
        columns[name] = column
    return columns | {name: arrow_array(arrow, answer[name], bare=bare) for name in answers}
