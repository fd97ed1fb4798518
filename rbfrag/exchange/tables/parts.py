"""Rows of a table of blocks, some thousand at a time, whatever file they come from."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MissingExtraError

ROWS = 1 << 18
"""Rows that are read, answered and written at a time."""

TEXTS = ("mode", "kind")
"""Columns of texts that are looked into: which model may answer."""


@dataclass(frozen=True, eq=False)
class Part:
    """Some rows of a table.

    Args:
        lines: number of each row in its file: of its first line in CSV, of its row of the sheet.
        cells: columns by name: arrays of numbers, lists of cells, or arrays of Arrow.
        faults: what is wrong with a whole row, by its index.
        decimal: what stands before the decimals of a number that is a text.
    """

    lines: Sequence[int]
    cells: dict[str, Any]
    faults: Mapping[int, str] = field(default_factory=dict)
    decimal: str = "."

    def numbers(self, column: str) -> tuple[NDArray[np.float64], dict[int, str]]:
        """Return the numbers of a column, NaN where a cell is empty, and what the others are.

        Returns:
            The numbers, and by index the cells that are none, in words.
        """
        cells = self.cells[column]
        if isinstance(cells, np.ndarray):
            return cells, {}
        if self.decimal == ".":
            try:
                return np.array([float(c) if c.strip() else np.nan for c in cells]), {}
            except (AttributeError, ValueError):
                pass  # an empty cell or number of a sheet, or a text: one by one
        values, faults = np.full(len(cells), np.nan), {}
        for i, cell in enumerate(cells):
            try:
                values[i] = _number(cell, self.decimal)
            except (ValueError, OverflowError) as error:
                faults[i] = f"{column} {error}"
        return values, faults


Parts = Iterator[Part]

Write = Callable[[Part, Mapping[str, NDArray[Any]]], None]
"""Writes one part of the table, and its answers."""


def _number(cell: object, decimal: str) -> float:
    """Return the number of a cell, or raise a ValueError that says what it is instead."""
    if cell is None:
        return np.nan
    if isinstance(cell, bool):
        raise ValueError(f"is {str(cell).upper()}, not a number")
    if isinstance(cell, int | float):
        return float(cell)
    if isinstance(cell, datetime.date | datetime.time | datetime.timedelta):
        raise ValueError(f"is the date {cell}, not a number: format the cell as a number")
    text = str(cell).strip()
    if not text:
        return np.nan
    shown = f"= {text[:40]!r}"
    try:
        if decimal == ".":
            return float(text)
        if "." not in text:
            return float(text.replace(",", "."))
    except ValueError:
        pass
    if decimal != "." and _is_number(text):
        raise ValueError(f"{shown} has a decimal point, and the table has decimal commas")
    if _is_number(text.replace(",", ".")):
        raise ValueError(
            f"{shown} is not a number: a decimal comma goes with semicolons between the cells"
        )
    raise ValueError(f"{shown} is not a number")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and pyarrow.parquet, or say which extra brings them."""
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise MissingExtraError("Parquet files need pyarrow", "parquet") from None
    return arrow, parquet


def cells_of(column: Any) -> list[Any]:
    """Return what a column's cells hold as text: nothing for NaN and null."""
    if not isinstance(column, np.ndarray):
        values: list[Any] = column if isinstance(column, list) else column.to_pylist()
        return ["" if value is None else value for value in values]
    if column.dtype.kind == "f":
        return ["" if value != value else value for value in column.tolist()]
    if column.dtype.kind == "b":
        return ["true" if value else "false" for value in column.tolist()]
    return list(column.tolist())


def columns_to_write(
    part: Part, header: Sequence[str], numeric: Container[str]
) -> Iterator[tuple[str, Any]]:
    """Yield the columns of a part: numbers as arrays, but for those with a cell that is none."""
    for name in header:
        cells = part.cells[name]
        if isinstance(cells, list) and name in numeric:
            values, faults = part.numbers(name)
            yield name, cells if faults else values
        else:
            yield name, cells
