"""The columns of a table of blocks, in a file, as GeoJSON points or as given; rectangles in it."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.excel_text import as_text, as_written, changed_texts
from rbfrag.exchange.points import SUFFIXES as GEOJSON
from rbfrag.exchange.points import read_points
from rbfrag.exchange.tables.files import (
    place_word,
    table_parts,
    table_path,
    table_source,
    table_writer,
)
from rbfrag.exchange.tables.parts import Part, Parts, cells_of
from rbfrag.files import reading, written_whole
from rbfrag.fragility.unusable import in_list
from rbfrag.question.fields import BlockFields, column_of
from rbfrag.question.table import Column, Header, Numeric, columns_in

BLOCK_FIELDS = {column_of(name): name for name in BlockFields.__optional_keys__}
"""The fields that describe blocks, by what written tables call them."""

TABLE = "a block table"
"""What messages say that a file should hold."""


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


def read_columns(
    path: str | os.PathLike[str],
    names: Sequence[str],
    *,
    optional: Sequence[str] = (),
    texts: Sequence[str] = (),
    faults: dict[int, str] | None = None,
) -> dict[str, NDArray[Any]]:
    """Return columns of a block table by name; an empty number is NaN.

    Args:
        path: file ending in ``.csv``, ``.xlsx`` or ``.parquet``.
        names: columns of numbers that must be there.
        optional: further columns of numbers, where the table has them.
        texts: columns of texts, where the table has them.
        faults: takes what is wrong with rows, by their index; their numbers are NaN. None refuses
            a table that has such rows.

    Raises:
        InputError: the file cannot be read, lacks a column, or cells hold no numbers; the
            message names the lines.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    table = read_cells(path, (*names, *optional), texts, needed=names)
    if faults is not None:
        faults.update(table.faults)
    elif table.faults:
        wrong = {table.place(i): fault for i, fault in sorted(table.faults.items())}
        raise InputError(f"{path}, {in_list(wrong, wrong.values())}")
    return table.columns


class Cells(NamedTuple):
    """The cells of some columns.

    Args:
        columns: arrays of numbers, NaN where there is none, and of texts, by name.
        faults: what is wrong with rows, by their index.
        lines: number of each row in its file.
        word: what that is the number of: line, row or feature.
        header: all columns of the table, as it calls them.
        stated: which of them state which fields.
    """

    columns: dict[str, NDArray[Any]]
    faults: dict[int, str]
    lines: Sequence[int]
    word: str
    header: Sequence[str]
    stated: Header

    def place(self, i: int) -> str:
        """Return where a row stands, as its file shows it."""
        return f"{self.word} {self.lines[i]}"


def read_cells(
    source: str | os.PathLike[str] | Mapping[str, Any],
    numbers: Sequence[str],
    texts: Sequence[str],
    *,
    needed: Sequence[str] = (),
) -> Cells:
    """Return the cells of some columns of a table, of those that it has.

    Args:
        source: a table's file, a file of GeoJSON points, or columns by name.
        numbers: columns of numbers.
        texts: columns of texts.
        needed: those that must be there.
    """
    with ExitStack() as stack:
        name, word, header, parts = _opened(source, numbers, stack)
        stated = columns_in(header, name, (*numbers, *texts))
        known = {
            each: stated.columns.get(each, Column(each, 1.0))
            for each in (*numbers, *texts)
            if each in header or each in stated.columns
        }
        for each in needed:
            if each not in known:
                have = ", ".join(header) or "none"
                raise InputError(f"{name}: there is no column {each}; the columns are {have}")
        collected: dict[str, list[NDArray[Any]]] = {
            each: [np.empty(0, dtype=object if each in texts else np.float64)] for each in known
        }
        faults: dict[int, str] = {}
        lines: list[int] = []
        for part in parts:
            wrong = dict(part.faults)
            for each, arrays in collected.items():
                if each in texts:
                    cells = [
                        checked_name(as_written(str(cell).strip()), f"{name}: a cell of {each}")
                        for cell in cells_of(part.cells[known[each].header])
                    ]
                    arrays.append(np.array(cells, dtype=object))
                else:
                    values, others = part.numbers(known[each].header)
                    wrong = others | wrong
                    arrays.append(values * known[each].factor)
            faults |= {len(lines) + i: fault for i, fault in wrong.items()}
            lines.extend(part.lines)
        columns = {each: np.concatenate(arrays) for each, arrays in collected.items()}
        return Cells(columns, faults, lines, word, header, stated)


def _opened(
    source: str | os.PathLike[str] | Mapping[str, Any], numbers: Sequence[str], stack: ExitStack
) -> tuple[str, str, list[str], Parts]:
    """Return what a table is called, what its rows are, its columns and its parts."""
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        if path.suffix.lower() in GEOJSON:
            part = read_points(path)
            return str(path), "feature", [*part.cells], iter([part])
        path = table_source(path)
        stack.enter_context(_reading(path))
        header, parts, _ = table_parts(path, Numeric(numbers), stack)
        return str(path), place_word(path), header, parts
    part = given_part(source)
    return "blocks", "row", [*part.cells], iter([part])


@contextmanager
def _reading(source: Path) -> Iterator[None]:
    try:
        with reading(source, TABLE):
            yield
    except csv.Error as error:
        raise InputError(f"{source}: not a CSV file: {error}") from None


def given_part(columns: Mapping[str, Any]) -> Part:
    """Return columns by name, such as a pandas table, as the rows of a table."""
    cells = {str(name): np.ravel(np.asarray(column)) for name, column in columns.items()}
    if len({column.size for column in cells.values()}) > 1:
        sizes = ", ".join(f"{name} {column.size}" for name, column in cells.items())
        raise InputError(f"the columns of the blocks differ in length: {sizes}")
    size = next((column.size for column in cells.values()), 0)
    return Part(
        range(1, size + 1),
        {
            name: column.astype(np.float64)
            if column.dtype.kind in "iuf"
            else [None if _is_missing(cell) else cell for cell in column.tolist()]
            for name, column in cells.items()
        },
    )


def _is_missing(cell: object) -> bool:
    """Whether a cell is empty, as Python, numpy and pandas have it."""
    is_nan = isinstance(cell, float) and math.isnan(cell)
    return cell is None or is_nan or type(cell).__name__ in ("NAType", "NaTType")
