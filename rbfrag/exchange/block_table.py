"""A table of blocks: what its columns state, and of which rows something is wrong."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.excel_text import as_written
from rbfrag.exchange.tables.files import open_table
from rbfrag.exchange.tables.parts import Parts, TableFile, TablePart, cells_of
from rbfrag.fragility.lookup import block_of
from rbfrag.question.blocks import kinds_by_numbers
from rbfrag.question.fields import BlockFields, MeasureFields, column_of, names_of
from rbfrag.question.sections import ANGLES
from rbfrag.question.shapes import OF_A_SHAPE, SHAPES, SPACE
from rbfrag.question.table import Header, columns_in

TEXTS = ("block_id", "site_id", "kind", "mode", "crs", *SPACE)
"""Columns of texts."""

IF_EMPTY = {"count": 1.0, "weight": 1.0, "amplification": 1.0}
"""What an empty cell stands for; of a standard deviation it is 0."""


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
    def numeric(self) -> frozenset[str]:
        """The columns that hold numbers, as it calls them."""
        return frozenset(
            column.header for name, column in self.stated.columns.items() if name not in self.texts
        )

    @property
    def parts(self) -> Parts:
        """Its rows, some thousand at a time."""
        return self.file.parts(self.numeric)

    def numbers(self, part: TablePart) -> tuple[dict[str, NDArray[np.float64]], dict[int, str]]:
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
            stands_for = 0.0 if name.endswith("_sigma") else IF_EMPTY.get(name)
            numbers[name] = values if stands_for is None else np.where(empty, stands_for, values)
        return numbers, faults

    def text(self, part: TablePart, name: str) -> list[str] | None:
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
        named = [name for name in self.file.header if name not in empty]
        return (*self.file.remarks, *self.stated.remarks, *self.stated.unread(named, read))

    def check(self, given: Collection[str] = (), kind: str | None = None) -> None:
        """Refuse a table that describes no blocks.

        Args:
            given: fields that are stated of all blocks.
            kind: how the blocks fail; None for what they are given by.
        """
        known = {*self.stated.columns, *given}
        known |= {angle for plane, angle in ANGLES.items() if plane in known}
        if not kinds_by_numbers(known) and not any(known.issuperset(shape) for shape in SHAPES):
            block = block_of(known, kind)
            missing = next(name for name in block.names if name not in known)
            sides = ", nor height_m and width_m" if "kr" in block.names else ""
            self._refuse(f"{column_of(missing)}{sides}")

    def check_read(self, given: Collection[str], read: Collection[str]) -> None:
        """Refuse what is stated of all blocks, and no answer depends on."""
        for name in given:
            if name in names_of(BlockFields) and name not in read:
                text = f"{name} does not go with the blocks of {self.name}: leave it out"
                raise InputError(text, fields=(name,))

    @contextmanager
    def named(self) -> Iterator[None]:
        """Name the table where something is refused of all of its blocks."""
        try:
            yield
        except InputError as error:
            raise InputError(f"{self.name}: {error}", fields=error.fields) from None

    def need(self, names: Collection[str]) -> None:
        """Refuse a table without some columns."""
        for name in names:
            if name not in self.stated.columns:
                self._refuse(name)

    def _refuse(self, missing: str) -> None:
        have = ", ".join(self.file.header) or "none"
        if len(self.file.sheets) > 1:
            have += f" (of the first sheet; the sheets are {', '.join(self.file.sheets)})"
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
    texts: Collection[str] = TEXTS,
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
        file = open_table(source, stack, sheet=sheet)
        name = str(source) if isinstance(source, str | os.PathLike) else "blocks"
        yield BlockTable(name, file, columns_in(file.header, name, (*read, *texts)), texts)


def stated_rows(
    source: str | os.PathLike[str], given: Mapping[str, Any], *, sheet: str | None = None
) -> tuple[list[dict[str, Any]], tuple[str, ...]]:
    """Return what each row of a table states, beside ``given``, and the remarks of the table."""
    read = names_of(BlockFields, MeasureFields)
    texts = (*TEXTS, "component")
    with opened_table(source, read, texts, sheet=sheet) as table:
        table.check(given, given.get("kind"))
        columns, faults, _ = table.whole()
    rows = []
    for i, cells in enumerate(zip(*(column.tolist() for column in columns.values()), strict=True)):
        row = {n: v for n, v in zip(columns, cells, strict=True) if v == v and v != ""}
        if kinds_by_numbers(row):  # which go before a shape
            row = {name: row[name] for name in row if name not in OF_A_SHAPE}
        rows.append({**given, **row, **({"reason": faults[i]} if i in faults else {})})
    return rows, table.remarks((*read, *texts))
