"""The files that a table of blocks is read from and written to: one reader, one writer."""

from __future__ import annotations

import os
from collections.abc import Container, Sequence
from contextlib import ExitStack
from pathlib import Path

from rbfrag.errors import InputError
from rbfrag.exchange.tables.csv_file import csv_writer, open_csv
from rbfrag.exchange.tables.parquet import open_parquet, parquet_writer
from rbfrag.exchange.tables.parts import Dialect, TableFile, Write, pyarrow
from rbfrag.exchange.tables.workbook import open_workbook, openpyxl, workbook_writer
from rbfrag.files import output_path

SUFFIXES = (".csv", ".xlsx", ".parquet")
"""File types of a table of blocks."""


def table_path(path: str | os.PathLike[str]) -> Path:
    """Return the path if a table can be written there; ask before long work."""
    target = output_path(path, SUFFIXES, "table")
    need = {".parquet": pyarrow, ".xlsx": openpyxl}.get(target.suffix.lower())
    if need is not None:
        need()
    return target


def open_table(
    source: Path, stack: ExitStack, *, sheet: str | None = None, fast: bool = False
) -> TableFile:
    """Return a table that is open.

    Args:
        source: the file.
        stack: closes it at the end.
        sheet: of a workbook, the name of the sheet; None for the first.
        fast: read CSV by pyarrow where it is installed, which takes a third of a second to load.

    Raises:
        InputError: the file cannot be read, or has no such sheet.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    suffix = source.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{source}: a block table ends in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}, not "
            f"{source.suffix!r}"
        )
    if suffix == ".xlsx":
        return open_workbook(source, stack, sheet)
    if sheet is not None:
        raise InputError(f"{source} has no sheet {sheet!r}: only workbooks (.xlsx) have sheets")
    if suffix == ".parquet":
        return open_parquet(source, stack)
    return open_csv(source, stack, fast=fast)


def table_writer(
    partial: Path,
    header: Sequence[str],
    answers: Sequence[str] = (),
    *,
    numeric: Container[str] = (),
    stack: ExitStack,
    dialect: Dialect | None = None,
    fast: bool = False,
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
    """
    suffix = partial.suffix.lower()
    if suffix == ".csv":
        return csv_writer(partial, header, answers, numeric, stack, dialect or Dialect(), fast=fast)
    make = parquet_writer if suffix == ".parquet" else workbook_writer
    return make(partial, header, answers, numeric, stack)
