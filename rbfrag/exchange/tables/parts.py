"""Rows of a table of blocks, a few thousand at a time, independent of the file format."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MissingExtraError
from rbfrag.files import is_numeral
from rbfrag.question.table import ROWS_ABOVE, header_row, number_with_unit
from rbfrag.results.diagnostic import Diagnostic

ROWS = 1 << 18
"""Rows that are read, answered and written at a time."""


@dataclass(frozen=True, eq=False)
class TablePart:
    """A range of rows of a table.

    Args:
        lines: number of each row in its file: of its first line in CSV, of its row of the sheet.
        cells: columns by name: arrays of numbers, lists of cells, or arrays of Arrow.
        faults: what is wrong with a whole row, by its index.
        decimal: what may stand before the decimals of a number that is a text.
    """

    lines: Sequence[int]
    cells: dict[str, Any]
    faults: Mapping[int, str] = field(default_factory=dict)
    decimal: str = ".,"

    def without(self, rows: Sequence[int]) -> TablePart:
        """Return the part without some of its rows, by their indices."""
        if not rows:
            return self
        keep = [i for i in range(len(self.lines)) if i not in {*rows}]

        def select(column: Any) -> Any:
            if isinstance(column, list):
                return [column[i] for i in keep]
            return column[keep] if isinstance(column, np.ndarray) else column.take(keep)

        return TablePart(
            [self.lines[i] for i in keep],
            {name: select(column) for name, column in self.cells.items()},
            {new: self.faults[old] for new, old in enumerate(keep) if old in self.faults},
            self.decimal,
        )

    def numbers(
        self, column: str, unit: str = "", factor: float = 1.0
    ) -> tuple[NDArray[np.float64], dict[int, str]]:
        """Return the numbers of a column, NaN for empty cells, and the errors of invalid cells.

        Args:
            column: its name.
            unit: unit of its field, for cells that carry a unit of their own.
            factor: what turns the other cells into that unit.

        Returns:
            The numbers in the unit, and by index the cells that are none, in words.
        """
        cells = self.cells[column]
        if isinstance(cells, np.ndarray):
            return cells if factor == 1.0 else cells * factor, {}
        if "." in self.decimal:
            with suppress(AttributeError, ValueError):  # else they are looked at one by one
                numbers = np.array([float(c) if c.strip() else np.nan for c in cells])
                return numbers if factor == 1.0 else numbers * factor, {}
        values, faults = np.full(len(cells), np.nan), {}
        for i, cell in enumerate(cells):
            try:
                values[i] = _number(cell, self.decimal) * factor
            except (ValueError, OverflowError) as error:
                # "7°" and "30 cm" carry a unit, which goes before that of the header
                bare = not isinstance(cell, str) or is_numeral(cell.strip().replace(",", "."))
                number = None if bare else number_with_unit(cell, unit)
                if number is None:
                    faults[i] = f"{column} {error}"
                else:
                    values[i] = number
        return values, faults


Parts = Iterator[TablePart]

Write = Callable[[TablePart, Mapping[str, NDArray[Any]]], None]
"""Writes one part of the table, and its answers."""

Rows = Iterator[tuple[int, Sequence[Any]]]
"""Rows of a table that are not empty, each with its number in the file."""


@dataclass(frozen=True)
class Dialect:
    """Format of a CSV file.

    Args:
        delimiter: what stands between cells: a comma, a semicolon or a tab.
        decimal: what stands before decimals: a point or a comma.
        marked: whether it begins with a byte-order mark, as spreadsheets write it.
        encoding: how it is read; it is written in UTF-8.
    """

    delimiter: str = ","
    decimal: str = "."
    marked: bool = False
    encoding: str = "utf-8-sig"


@dataclass(eq=False)
class TableFile:
    """An open table.

    Args:
        names: what its columns are called; empty for one without a name.
        read: returns its parts, by the columns that hold numbers.
        remarks: warnings about the table; complete when its parts have been read.
        word: what its rows are counted by: line, row or feature.
        dialect: how to write CSV that is like it.
        sheets: the sheets of a workbook of which none was named.
    """

    names: Sequence[str]
    read: Callable[[Container[str]], Parts]
    remarks: list[Diagnostic] = field(default_factory=list)
    word: str = "row"
    dialect: Dialect = field(default_factory=Dialect)
    sheets: Sequence[str] = ()

    @property
    def header(self) -> list[str]:
        """Names of the columns, without unnamed ones."""
        return [name for name in self.names if name]

    def parts(self, numeric: Container[str]) -> Parts:
        """Yield the parts without unnamed columns."""
        nameless = [key for key, name in zip(keys(self.names), self.names, strict=True) if not name]
        for part in self.read(numeric):
            for key in nameless:
                remark = Diagnostic(f"{key} is ignored and not written", "table_layout")
                if any(cells_of(part.cells.pop(key))) and remark not in self.remarks:
                    self.remarks.append(remark)
            yield part


def keys(names: Sequence[str]) -> list[str]:
    """Return the keys of the cells: the names of columns, or a text for unnamed ones."""
    return [name or f"column {i} without a name" for i, name in enumerate(names, 1)]


def split_header(rows: Rows, word: str) -> tuple[list[str], int, Rows, list[Diagnostic]]:
    """Return the column names, the number of their row, the rows below, and the remarks.

    Args:
        rows: the rows of a table.
        word: what their numbers count.
    """
    first = list(islice(rows, ROWS_ABOVE))
    at = header_row([cells for _, cells in first])
    line, cells = first[at] if first else (0, ())
    names = ["" if cell is None else str(cell).strip() for cell in cells]
    while names and not names[-1]:  # spreadsheets write delimiters behind the last column
        names.pop()
    text = f"the names of the columns are in {word} {line}: the lines above are ignored"
    remarks = [Diagnostic(text, "table_layout")] if at else []
    return names, line, chain(first[at + 1 :], rows), remarks


def parts_of_rows(
    names: Sequence[str], rows: Rows, *, empty: str | None = "", decimal: str = ".,"
) -> Parts:
    """Yield the parts of a table that is read row by row.

    Args:
        names: of its columns.
        rows: the rows below them.
        empty: an empty cell; where it is None a row may end before the last column.
        decimal: as of :class:`TablePart`.
    """
    width = len(names)
    while chunk := list(islice(rows, ROWS)):
        faults, chunk_rows = {}, []
        for i, (_, row) in enumerate(chunk):
            if len(row) != width:
                size = max((j for j, cell in enumerate(row, 1) if cell or cell == 0), default=0)
                if size > width or (len(row) < width and empty is not None):
                    faults[i] = f"{max(size, len(row[:width]))} cells under {width} columns"
                row = [*row[:width], *[empty] * (width - len(row))]
            chunk_rows.append(row)
        columns = map(list, zip(*chunk_rows, strict=True))
        lines = [line for line, _ in chunk]
        yield TablePart(lines, dict(zip(keys(names), columns, strict=True)), faults, decimal)


def _number(cell: object, decimal: str) -> float:
    """Return the number of a cell, or raise a ValueError that describes the content."""
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
    shown, pointed = f"= {text[:40]!r}", text.replace(",", ".")
    is_number = is_numeral(text)
    if is_number and ("." in decimal or "." not in text):
        return float(text)
    if is_number:
        raise ValueError(f"{shown} has a decimal point, and the table has decimal commas")
    if "." in text or not is_numeral(pointed):
        raise ValueError(f"{shown} is not a number")
    if decimal != "," and re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", text):
        raise ValueError(f"{shown} is {pointed} or {text.replace(',', '')}: write it as a number")
    return float(pointed)


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and pyarrow.parquet, or name the extra that installs them."""
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise MissingExtraError("Parquet files require pyarrow", "parquet") from None
    return arrow, parquet


def cells_of(column: Any) -> list[Any]:
    """Return the cells of a column as text; empty for NaN and null."""
    if not isinstance(column, np.ndarray):
        values: list[Any] = column if isinstance(column, list) else column.to_pylist()
        return ["" if value is None else value for value in values]
    if column.dtype.kind == "f":
        return ["" if value != value else value for value in column.tolist()]
    if column.dtype.kind == "b":
        return ["true" if value else "false" for value in column.tolist()]
    return list(column.tolist())


def columns_to_write(
    part: TablePart, header: Sequence[str], numeric: Container[str]
) -> Iterator[tuple[str, Any]]:
    """Yield the columns of a part: numbers as arrays, unless a cell is not a number."""
    for name in header:
        cells = part.cells[name]
        if isinstance(cells, list) and name in numeric:
            values, faults = part.numbers(name)
            yield name, cells if faults else values
        else:
            yield name, cells
