"""A table of blocks as Parquet, and as Arrow has it."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.tables import parts
from rbfrag.exchange.tables.parts import TEXTS, Part, Parts, Write, pyarrow


def parquet_parts(
    origin: Path, numeric: Container[str], stack: ExitStack
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
            yield from file.iter_batches(batch_size=parts.ROWS)
        except (arrow.ArrowException, OSError, UnicodeError) as error:
            raise InputError(
                f"{origin}: the Parquet file is damaged: {error}; write it again"
            ) from None

    def read() -> Parts:
        first = 1
        for group in batches():
            cells: dict[str, Any] = {}
            for name, column in zip(header, group.columns, strict=True):
                is_text = arrow.types.is_string(column.type) or arrow.types.is_large_string(
                    column.type
                )
                if name in TEXTS or (name in numeric and is_text):
                    cells[name] = column.to_pylist()
                elif name in numeric:
                    try:
                        column = column.cast(arrow.float64()).to_numpy(zero_copy_only=False)
                    except arrow.ArrowException:
                        raise InputError(f"{origin}: the column {name} holds no numbers") from None
                    cells[name] = np.array(column, dtype=np.float64)
                else:
                    cells[name] = column
            yield Part(range(first, first + group.num_rows), cells)
            first += group.num_rows

    return header, read()


def parquet_writer(
    partial: Path,
    header: Sequence[str],
    answers: Sequence[str],
    numeric: Container[str],
    stack: ExitStack,
) -> Write:
    """Return a function that writes parts as Parquet, where NaN is null."""
    arrow, parquet = pyarrow()
    open_file: list[Any] = []

    def write(part: Part, answer: Mapping[str, NDArray[Any]]) -> None:
        # a column of numbers has no place for a cell that is none: its reason tells of it
        columns = {
            name: part.numbers(name)[0] if name in numeric else part.cells[name] for name in header
        }
        arrays = arrow_columns(arrow, columns.items())
        arrays |= {name: arrow_array(arrow, answer[name]) for name in answers}
        table = arrow.table(arrays)
        if not open_file:
            texts = [each.name for each in table.schema if arrow.types.is_string(each.type)]
            parquet_file = parquet.ParquetWriter(partial, table.schema, use_dictionary=texts)
            open_file.append(stack.enter_context(parquet_file))
        open_file[0].write_table(table.cast(open_file[0].schema))

    return write


def arrow_array(arrow: Any, values: NDArray[Any], *, bare: bool = False) -> Any:
    """Return an array as Arrow has it: NaN is null; `bare` makes empty texts null, too."""
    if values.dtype.kind in "OU":
        empty = np.equal(values, "") if bare else None
        return arrow.array(values, type=arrow.string(), mask=empty)
    return arrow.array(values, mask=np.isnan(values) if values.dtype.kind == "f" else None)


def arrow_columns(
    arrow: Any, columns: Iterable[tuple[str, Any]], *, bare: bool = False
) -> dict[str, Any]:
    """Return columns as Arrow arrays; `bare` leaves empty texts out."""
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
