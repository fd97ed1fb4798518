"""A table of blocks, in a file, as GeoJSON points or as given: which column states which field."""

from __future__ import annotations

import csv
import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.excel_text import as_text, as_written, changed_texts
from rbfrag.exchange.points import SUFFIXES as GEOJSON
from rbfrag.exchange.points import read_points
from rbfrag.exchange.tables.files import (
    open_table,
    table_path,
    table_writer,
)
from rbfrag.exchange.tables.parts import Part, Parts, TableFile, cells_of
from rbfrag.files import reading, written_whole
from rbfrag.fragility.lookup import block_of
from rbfrag.question.blocks import kinds_by_numbers
from rbfrag.question.fields import BlockFields, column_of, columns_declared, names_of
from rbfrag.question.shapes import SHAPES
from rbfrag.question.table import Header, columns_in

BLOCK_FIELDS = {column_of(name): name for name in names_of(BlockFields)}
"""The fields that describe blocks, by what written tables call them."""

IF_EMPTY = {name: 0.0 for name in columns_declared() if name.endswith("_sigma")} | {
    "count": 1.0,
    "weight": 1.0,
}
"""What an empty cell of a field stands for."""

_LARGE = 1 << 20
"""Bytes of CSV that are worth loading pyarrow for."""


def write_block_table(
    columns: Mapping[str, NDArray[Any]],
    path: str | os.PathLike[str],
    *,
    excel_text: bool = False,
) -> Path:
    """Write a table of blocks, whole or not at all, and return its path.

    Numbers keep all their digits. NaN is an empty cell in CSV and null in Parquet.

    Args:
        columns: arrays of one length by column name, units in the names.
        path: file to write, ``.csv``, ``.xlsx`` or ``.parquet``; an existing file is replaced.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).
    """
    target = table_path(path)
    if excel_text and target.suffix.lower() == ".csv":
        columns = changed_texts(columns, as_text)
    length = len(next(iter(columns.values())))
    with written_whole(target, "table") as partial, ExitStack() as stack:
        write = table_writer(partial, [*columns], stack=stack)
        write(Part(range(length), dict(columns)), {})
    return target


@dataclass(frozen=True, eq=False)
class BlockTable:
    """A table of blocks that is open.

    Args:
        name: what messages call it.
        file: what is open.
        stated: which columns state which fields.
        texts: fields that are texts.
        filled: fields of numbers that a cell has been read of.
    """

    name: str
    file: TableFile
    stated: Header
    texts: Collection[str]
    filled: set[str] = field(default_factory=set)

    @property
    def word(self) -> str:
        """What its rows are counted by."""
        return self.file.word

    @property
    def header(self) -> list[str]:
        """What its columns are called."""
        return self.file.header

    @property
    def numeric(self) -> frozenset[str]:
        """The columns that hold numbers, as it calls them."""
        return frozenset(
            column.header for name, column in self.stated.columns.items() if name not in self.texts
        )

    @property
    def parts(self) -> Parts:
        """Its rows, some thousand at a time."""
        return self.file.parts(self.numeric)

    def numbers(self, part: Part) -> tuple[dict[str, NDArray[np.float64]], dict[int, str]]:
        """Return the numbers of some rows by field, and what is wrong with rows by their index."""
        numbers, faults = {}, dict(part.faults)
        for name, (header, factor) in self.stated.columns.items():
            if name in self.texts:
                continue
            values, others = part.numbers(header)
            faults = others | faults
            values = values if factor == 1.0 else values * factor
            empty = np.isnan(values)
            if others or not empty.all():
                self.filled.add(name)
            numbers[name] = np.where(empty, IF_EMPTY[name], values) if name in IF_EMPTY else values
        return numbers, faults

    def text(self, part: Part, name: str) -> list[str] | None:
        """Return the texts of some rows; None where the table has no column of that field."""
        column = self.stated.columns.get(name)
        if column is None:
            return None
        what = f"{self.name}: a cell of {name}"
        return [
            checked_name(as_written(str(cell).strip()), what)
            for cell in cells_of(part.cells[column.header])
        ]

    def remarks(self, read: Collection[str]) -> tuple[str, ...]:
        """Return what is to be said of its columns.

        Args:
            read: the fields that the answer depends on, or hands on.
        """
        empty = {c.header for name, c in self.stated.columns.items() if name not in self.filled}
        named = [name for name in self.header if name not in empty]
        return (*self.file.remarks, *self.stated.remarks, *self.stated.unread(named, read))

    def check(self, given: Collection[str] = (), kind: str | None = None) -> None:
        """Refuse a table that describes no blocks.

        Args:
            given: fields that are stated of all blocks.
            kind: how the blocks fail; None for what they are given by.
        """
        known = {*self.stated.columns, *given}
        if not kinds_by_numbers(known) and not any(known.issuperset(shape) for shape in SHAPES):
            block = block_of(known, kind)
            missing = next(name for name in block.names if name not in known)
            sides = ", nor height_m and width_m" if "kr" in block.names else ""
            self._refuse(f"{column_of(missing)}{sides}")

    def need(self, names: Collection[str]) -> None:
        """Refuse a table without some columns."""
        for name in names:
            if name not in self.stated.columns:
                self._refuse(name)

    def _refuse(self, missing: str) -> None:
        have = ", ".join(self.header) or "none"
        raise InputError(f"{self.name}: there is no column {missing}; the columns are {have}")

    def whole(self) -> tuple[dict[str, NDArray[Any]], dict[int, str], list[int]]:
        """Return its columns by field, what is wrong with rows, and the numbers of all rows."""
        collected: dict[str, list[NDArray[Any]]] = {
            name: [np.empty(0, dtype=object if name in self.texts else np.float64)]
            for name in self.stated.columns
        }
        faults: dict[int, str] = {}
        lines: list[int] = []
        for part in self.parts:
            numbers, wrong = self.numbers(part)
            for name, arrays in collected.items():
                arrays.append(
                    numbers[name]
                    if name in numbers
                    else np.array(self.text(part, name), dtype=object)
                )
            faults |= {len(lines) + i: fault for i, fault in wrong.items()}
            lines.extend(part.lines)
        return {n: np.concatenate(arrays) for n, arrays in collected.items()}, faults, lines


@contextmanager
def opened_table(
    source: str | os.PathLike[str] | Mapping[str, Any],
    read: Collection[str],
    texts: Collection[str] = ("block_id", "site_id", "kind", "mode"),
    *,
    sheet: str | None = None,
) -> Iterator[BlockTable]:
    """Open a table of blocks.

    Args:
        source: a table's file, a file of GeoJSON points, or columns by name, such as a pandas
            table.
        read: fields of numbers, and other columns by their own names, that may be read.
        texts: the same of texts.
        sheet: of a workbook, the name of the sheet; None for the first.

    Raises:
        InputError: the file cannot be read, or a column cannot be meant as it is called.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    with ExitStack() as stack:
        name = str(source) if isinstance(source, str | os.PathLike) else "blocks"
        if not isinstance(source, str | os.PathLike):
            file = _of_one_part(given_part(source), "row")
        elif (path := Path(source)).suffix.lower() in GEOJSON:
            file = _of_one_part(read_points(path), "feature")
        else:
            stack.enter_context(_reading(path))
            fast = path.is_file() and path.stat().st_size > _LARGE
            file = open_table(path, stack, sheet=sheet, fast=fast)
        stated = columns_in(file.header, name, (*read, *texts))
        yield BlockTable(name, file, stated, texts)


@contextmanager
def _reading(source: Path) -> Iterator[None]:
    try:
        with reading(source, "a block table"):
            yield
    except csv.Error as error:
        raise InputError(f"{source}: not a CSV file: {error}") from None


def _of_one_part(part: Part, word: str) -> TableFile:
    return TableFile([*part.cells], lambda _: iter([part]), word=word)


def given_part(columns: Mapping[str, Any]) -> Part:
    """Return columns by name, such as a pandas table, as the rows of a table."""
    cells = {str(name): np.ravel(np.asarray(column)) for name, column in columns.items()}
    if len({column.size for column in cells.values()}) > 1:
        sizes = ", ".join(f"{name} {column.size}" for name, column in cells.items())
        raise InputError(f"the columns of the blocks differ in length: {sizes}")
    size = next((column.size for column in cells.values()), 0)

    def as_cells(column: NDArray[Any]) -> Any:
        if column.dtype.kind in "iuf":
            return column.astype(np.float64)
        # what is missing is None, NaN, NaT or NA, as Python, numpy and pandas have it
        return [
            None if type(cell).__name__ == "NAType" or cell != cell else cell
            for cell in column.tolist()
        ]

    return Part(range(1, size + 1), {name: as_cells(column) for name, column in cells.items()})
