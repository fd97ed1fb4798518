"""Files of block tables: one reader and one writer for all formats."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.map_files import SUFFIXES as GEOJSON
from rbfrag.exchange.map_files import read_points
from rbfrag.exchange.tables.csv_file import as_text, changed_texts, csv_writer, open_csv
from rbfrag.exchange.tables.parquet import open_parquet, parquet_writer
from rbfrag.exchange.tables.parts import Dialect, TableFile, TablePart, Write, pyarrow
from rbfrag.exchange.tables.workbook import open_workbook, openpyxl, workbook_writer
from rbfrag.files import WORKBOOKS, output_path, reading, write_text, written_whole
from rbfrag.results.diagnostic import as_documents

SUFFIXES = (".csv", ".xlsx", ".parquet")
"""File types of a table of blocks, of which .ods is read too."""

MOST_BYTES = 1 << 36
"""Larger tables are rejected: a thousand million blocks need no more."""

_LARGE = 1 << 20
"""Bytes of CSV that are worth loading pyarrow for, which takes a third of a second."""


def table_path(path: str | os.PathLike[str]) -> Path:
    """Return the path if a table can be written there; ask before long work."""
    target = output_path(path, SUFFIXES, "table")
    need = {".parquet": pyarrow, ".xlsx": openpyxl}.get(target.suffix.lower())
    if need is not None:
        need()
    return target


def open_table(
    source: str | os.PathLike[str] | Mapping[str, Any],
    stack: ExitStack,
    *,
    sheet: str | None = None,
) -> TableFile:
    """Return an open table of blocks.

    Args:
        source: a table's file, a file of GeoJSON points, or columns by name, such as a pandas
            table.
        stack: closes it at the end, and says in words what is wrong with the file.
        sheet: of a workbook, the name of the sheet; None for the first.

    Raises:
        InputError: the file cannot be read, or has no such sheet.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    if not isinstance(source, str | os.PathLike):
        return _of_one_part(_given_part(source), "row")
    path = Path(source)
    suffix = path.suffix.lower()
    if sheet is not None and suffix not in WORKBOOKS:
        raise InputError(f"{path} has no sheet {sheet!r}: only workbooks (.xlsx) have sheets")
    if suffix in GEOJSON:
        return _of_one_part(read_points(path), "feature")
    if suffix not in (*SUFFIXES, *WORKBOOKS):
        raise InputError(
            f"{path}: unsupported table format {path.suffix!r}; use {', '.join(SUFFIXES)} or .ods"
        )
    stack.enter_context(_reading(path))
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise InputError(f"{path} has {size} bytes: too large for a block table")
    if suffix in WORKBOOKS:
        return open_workbook(path, stack, sheet)
    if suffix == ".parquet":
        return open_parquet(path, stack)
    return open_csv(path, stack, fast=size > _LARGE)


@contextmanager
def _reading(source: Path) -> Iterator[None]:
    try:
        with reading(source, "a block table"):
            yield
    except csv.Error as error:
        raise InputError(f"{source}: not a CSV file: {error}") from None


def _of_one_part(part: TablePart, word: str) -> TableFile:
    return TableFile([*part.cells], lambda _: iter([part]), word=word)


def _given_part(columns: Mapping[str, Any]) -> TablePart:
    """Return columns given by name, such as a pandas table, as the rows of a table."""
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

    return TablePart(range(1, size + 1), {name: as_cells(column) for name, column in cells.items()})


def table_writer(
    partial: Path,
    header: Sequence[str],
    answers: Sequence[str] = (),
    *,
    numeric: Container[str] = (),
    stack: ExitStack,
    dialect: Dialect | None = None,
    fast: bool = False,
    notes: Sequence[str] = (),
) -> Write:
    """Return a function that writes the parts of a table and their answers.

    Args:
        partial: the file; what its name ends in says of which type it is.
        header: columns of the parts that are written.
        answers: columns of the answers.
        numeric: columns of the parts that hold numbers.
        stack: closes the file at the end.
        dialect: how CSV is written; None for commas and points.
        fast: write CSV by pyarrow where it is installed.
        notes: warnings, which may still grow until the stack closes; those of CSV are written by
            :func:`write_csv_notes`.
    """
    suffix = partial.suffix.lower()
    if suffix == ".csv":
        return csv_writer(partial, header, answers, numeric, stack, dialect or Dialect(), fast=fast)
    make = parquet_writer if suffix == ".parquet" else workbook_writer
    return make(partial, header, answers, numeric, stack, notes)


def write_csv_notes(target: Path, notes: Sequence[str]) -> None:
    """Write the warnings about a CSV table to a metadata file, as CSV on the Web (W3C, 2015).

    The file is called as the table, with ``-metadata.json`` behind. Other types of tables hold
    their notes themselves.
    """
    path = target.with_name(f"{target.name}-metadata.json")
    if target.suffix.lower() != ".csv" or not (notes or path.exists()):
        return
    document = {
        "@context": "http://www.w3.org/ns/csvw",
        "url": target.name,
        "notes": as_documents(notes),
    }
    write_text(json.dumps(document, ensure_ascii=False, indent=2) + "\n", path)


def write_block_table(
    columns: Mapping[str, NDArray[Any]],
    path: str | os.PathLike[str],
    *,
    excel_text: bool = False,
    notes: Sequence[str] = (),
) -> Path:
    """Write a table of blocks, completely or not at all, and return its path.

    Numbers keep all their digits. NaN is an empty cell in CSV and null in Parquet.

    Args:
        columns: arrays of one length by column name, units in the names.
        path: file to write, ``.csv``, ``.xlsx`` or ``.parquet``; an existing file is replaced.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).
        notes: warnings: a sheet of a workbook, metadata of Parquet, a file next to CSV.
    """
    target = table_path(path)
    if excel_text and target.suffix.lower() == ".csv":
        columns = changed_texts(columns, as_text)
    length = len(next(iter(columns.values())))
    with written_whole(target, "table") as partial, ExitStack() as stack:
        write = table_writer(partial, [*columns], stack=stack, notes=notes)
        write(TablePart(range(length), dict(columns)), {})
    write_csv_notes(target, notes)
    return target
