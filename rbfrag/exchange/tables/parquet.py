"""Tables of blocks as Parquet files and Arrow arrays."""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.tables import parts
from rbfrag.exchange.tables.parts import Parts, TableFile, TablePart, Write, keys, pyarrow
from rbfrag.results.diagnostic import as_documents


def open_parquet(origin: Path, stack: ExitStack) -> TableFile:
    """Return an open Parquet file, which the stack closes."""
    arrow, parquet = pyarrow()
    try:
        file = stack.enter_context(parquet.ParquetFile(origin))
    except (arrow.ArrowException, UnicodeError) as error:
        raise InputError(f"{origin}: not a Parquet file: {error}") from None
    names = list(file.schema_arrow.names)

    def batches() -> Iterator[Any]:
        try:
            yield from file.iter_batches(batch_size=parts.ROWS)
        except (arrow.ArrowException, OSError, UnicodeError) as error:
            raise InputError(
                f"{origin}: the Parquet file is damaged: {error}; write it again"
            ) from None

    def read(numeric: Container[str]) -> Parts:
        first = 1
        for group in batches():
            lines: Sequence[int] = range(first, first + group.num_rows)
            first += group.num_rows
            for name, column in zip(names, group.columns, strict=True):
                if _is_text(arrow, column):
                    _reject_other_text(arrow, column, f"{origin}: column {name}", lines[0])
            blank = blank_rows(arrow, group)
            if blank.any():
                lines = [line for line, nothing in zip(lines, blank, strict=True) if not nothing]
                group = group.filter(arrow.array(~blank))
            cells: dict[str, Any] = {}
            for name, column in zip(keys(names), group.columns, strict=True):
                if name in numeric and _is_text(arrow, column):
                    cells[name] = column.to_pylist()
                elif name in numeric:
                    try:
                        column = column.cast(arrow.float64()).to_numpy(zero_copy_only=False)
                    except arrow.ArrowException:
                        raise InputError(f"{origin}: the column {name} must have numbers") from None
                    cells[name] = np.array(column, dtype=np.float64)
                else:
                    cells[name] = column
            yield TablePart(lines, cells)

    return TableFile(names, read)


def _is_text(arrow: Any, column: Any) -> bool:
    return bool(arrow.types.is_string(column.type) or arrow.types.is_large_string(column.type))


def _reject_other_text(arrow: Any, column: Any, where: str, first: int) -> None:
    """Reject text that is not UTF-8, which Parquet does not check."""
    try:
        column.validate(full=True)
    except arrow.ArrowInvalid:
        for row, cell in enumerate(column.cast(arrow.binary()).to_pylist(), first):
            try:
                (cell or b"").decode()
            except UnicodeDecodeError:
                raise InputError(f"{where}, row {row}: the text is not UTF-8") from None


def blank_rows(arrow: Any, batch: Any) -> NDArray[np.bool_]:
    """Return which rows have only empty cells."""
    import pyarrow.compute as compute

    blank = np.ones(batch.num_rows, dtype=np.bool_)
    for column in batch.columns:
        if not blank.any():
            break
        empty = compute.is_null(column, nan_is_null=True)
        if _is_text(arrow, column):
            empty = compute.or_(empty, compute.equal(compute.fill_null(column, ""), ""))
        blank &= empty.to_numpy(zero_copy_only=False)
    return blank


def parquet_writer(
    partial: Path,
    header: Sequence[str],
    answers: Sequence[str],
    numeric: Container[str],
    stack: ExitStack,
    notes: Sequence[str] = (),
) -> Write:
    """Return a function that writes parts as Parquet, where NaN is null, and notes as metadata."""
    arrow, parquet = pyarrow()
    open_file: list[Any] = []

    def add_notes() -> None:
        if open_file and notes:
            text = json.dumps(as_documents(notes), ensure_ascii=False)
            open_file[0].add_key_value_metadata({"notes": text})

    def write(part: TablePart, answer: Mapping[str, NDArray[Any]]) -> None:
        # a column of numbers has no place for a cell that is none: its reason tells of it
        columns = {
            name: part.numbers(name)[0] if name in numeric else part.cells[name] for name in header
        }
        arrays = arrow_columns(arrow, columns.items())
        arrays |= {name: arrow_array(arrow, answer[name]) for name in answers}
        table = arrow.table(arrays)
        if not open_file:
            texts = [column.name for column in table.schema if arrow.types.is_string(column.type)]
            parquet_file = parquet.ParquetWriter(partial, table.schema, use_dictionary=texts)
            open_file.append(stack.enter_context(parquet_file))
            stack.callback(add_notes)
        open_file[0].write_table(table.cast(open_file[0].schema))

    return write


def arrow_array(arrow: Any, values: NDArray[Any], *, bare: bool = False) -> Any:
    """Return an Arrow array: NaN is null; with `bare`, empty texts are null, too."""
    if values.dtype.kind in "OU":
        empty = np.equal(values, "") if bare else None
        return arrow.array(values, type=arrow.string(), mask=empty)
    return arrow.array(values, mask=np.isnan(values) if values.dtype.kind == "f" else None)


def arrow_columns(
    arrow: Any, columns: Iterable[tuple[str, Any]], *, bare: bool = False
) -> dict[str, Any]:
    """Return columns as Arrow arrays; with `bare`, empty texts are null."""
    arrays: dict[str, Any] = {}
    for name, column in columns:
        if isinstance(column, list):
            texts = [None if cell is None else str(cell) for cell in column]
            column = arrow.array(texts, type=arrow.string())
        if isinstance(column, np.ndarray):
            column = arrow_array(arrow, column)
        if bare and arrow.types.is_string(column.type):
            column = arrow.compute.replace_with_mask(
                column, arrow.compute.equal(column, ""), arrow.scalar(None, arrow.string())
            )
        arrays[name] = column
    return arrays
