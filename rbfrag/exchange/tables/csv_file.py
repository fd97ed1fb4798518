"""Tables of blocks as CSV: with commas, or with semicolons and decimal commas.

Excel, and others like it, compute a cell that begins with = + - or @, whatever program wrote the
file; a leading apostrophe tells them that it is text. Readers here take such an apostrophe off.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Container, Generator, Mapping, Sequence
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.tables.parquet import arrow_array, arrow_columns, blank_rows
from rbfrag.exchange.tables.parts import (
    Dialect,
    Parts,
    Rows,
    TableFile,
    TablePart,
    Write,
    cells_of,
    columns_to_write,
    keys,
    parts_of_rows,
    pyarrow,
    split_header,
)
from rbfrag.files import encoding_of
from rbfrag.question.table import ROWS_ABOVE, fields_stated, header_row
from rbfrag.results.diagnostic import Diagnostic

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-](inf|nan)", re.ASCII)
_SUSPECT = r"^'?[=+\-@]"


def is_formula(text: str) -> bool:
    """Return whether a spreadsheet would evaluate a cell; a number is not a formula."""
    return text[:1] in ("=", "+", "-", "@") and not _NUMBER.fullmatch(text)


def as_text(text: str) -> str:
    """Return a cell in the form that spreadsheets accept as text."""
    return f"'{text}" if is_formula(text) else text


def as_written(text: str) -> str:
    """Return the original cell: the inverse of :func:`as_text`."""
    return text[1:] if text[:1] == "'" and is_formula(text[1:]) else text


def changed_texts(columns: Mapping[str, Any], change: Callable[[str], str]) -> dict[str, Any]:
    """Return columns with their texts converted; columns without a suspect cell are unchanged.

    Args:
        columns: by name; lists, arrays of numpy or of Arrow. Numbers are left alone.
        change: :func:`as_text` or :func:`as_written`.
    """
    return {
        name: [change(cell) if isinstance(cell, str) else cell for cell in cells_of(column)]
        if _suspect(column)
        else column
        for name, column in columns.items()
    }


def formula_warnings(columns: Mapping[str, Any]) -> list[Diagnostic]:
    """Return a warning that names the first cell that spreadsheets evaluate, or an empty list."""
    for name, column in columns.items():
        for cell in _texts(column) if _suspect(column) else ():
            if is_formula(cell):
                text = (
                    f"the cell {cell[:40]!r} of the column {name} begins with {cell[0]}, which "
                    "Excel takes for a formula; excel_text writes it as text"
                )
                return [Diagnostic(text, "spreadsheet_formula", fields=("excel_text",))]
    return []


def _suspect(column: Any) -> bool:
    """Return whether a column has texts that may be, or may have been, formulas."""
    if isinstance(column, np.ndarray) and column.dtype.kind not in "OU":
        return False
    if isinstance(column, list | np.ndarray):
        return any(re.match(_SUSPECT, cell) for cell in _texts(column))
    import pyarrow
    import pyarrow.compute

    if not pyarrow.types.is_string(column.type):
        return False
    suspects = pyarrow.compute.match_substring_regex(column, _SUSPECT)
    return bool(pyarrow.compute.any(suspects).as_py())


def _texts(column: Any) -> list[str]:
    return [cell for cell in cells_of(column) if isinstance(cell, str)]


NOTE = "# note"
"""First cell of a line below a table that holds a warning about it."""

_PEEK = 1 << 16
_BOM = b"\xef\xbb\xbf"


def dialect_of(origin: Path) -> Dialect:
    """Return the dialect of a CSV file, detected from its header and first cells."""
    with origin.open("rb") as file:
        start = file.read(_PEEK)
    encoding = encoding_of(start)
    if b"\0" in start and encoding != "utf-16":
        raise InputError(f"{origin} is binary, not text: give a block table as CSV")
    lines = start.decode(encoding, "replace").splitlines() or [""]

    def rows(delimiter: str) -> list[list[str]]:
        return list(csv.reader(lines[:ROWS_ABOVE], delimiter=delimiter))

    delimiter = max(
        ",;\t", key=lambda candidate: (fields_stated(rows(candidate)), lines[0].count(candidate))
    )
    decimal = "."
    if delimiter != ",":
        edge = f'[{delimiter}"\\s]'
        below = "\n".join(lines[header_row(rows(delimiter)) + 1 :])
        points, commas = (
            re.search(f"(?:^|{edge})[+-]?\\d*[{mark}]\\d+(?:[eE][+-]?\\d+)?(?:{edge}|$)", below)
            for mark in ".,"
        )
        decimal = "." if points and not commas else ","
    return Dialect(delimiter, decimal, start.startswith(_BOM) or encoding == "utf-16", encoding)


def open_csv(origin: Path, stack: ExitStack, *, fast: bool) -> TableFile:
    """Return an open CSV file, which the stack closes.

    A table of commas is, if it shall be fast, read by pyarrow where that is installed, in a tenth
    of the time; from the first cell on that is not a number, it is read cell by cell as others are.
    """
    dialect = dialect_of(origin)
    file = stack.enter_context(origin.open(newline="", encoding=dialect.encoding))
    reader = csv.reader(file, delimiter=dialect.delimiter)
    names, line, rows, remarks = split_header(_rows(reader), "line")

    def read(numeric: Container[str]) -> Parts:
        rows_read: int | None = 0
        if fast and dialect.delimiter == "," and dialect.encoding != "utf-16":
            rows_read = yield from _by_arrow(origin, names, line, numeric)
        if rows_read is not None:
            decimal = "," if dialect.decimal == "," else ".,"
            yield from parts_of_rows(names, islice(rows, rows_read, None), decimal=decimal)

    return TableFile(names, read, remarks, "line", dialect)


def _rows(reader: Any) -> Rows:
    line = 0
    for row in reader:
        # blank lines are passed over, which spreadsheets write with all their delimiters
        if (row == [""] or "".join(row).strip()) and row[0] != NOTE:
            yield line + 1, row
        line = reader.line_num


def _by_arrow(
    origin: Path, names: Sequence[str], line: int, numeric: Container[str]
) -> Generator[TablePart, None, int | None]:
    """Yield parts as far as pyarrow can read them; return the number of rows read, None for all."""
    try:
        arrow, _ = pyarrow()
        from pyarrow import compute
        from pyarrow import csv as arrow_csv
    except MissingExtraError:
        return 0
    columns = keys(names)
    kinds = {name: arrow.float64() if name in numeric else arrow.string() for name in columns}
    above, rows_read = line + sum(name.count("\n") for name in names), 0
    try:
        batches = arrow_csv.open_csv(
            origin,
            read_options=arrow_csv.ReadOptions(
                column_names=columns, skip_rows=above, block_size=1 << 25, use_threads=False
            ),
            parse_options=arrow_csv.ParseOptions(newlines_in_values=True, ignore_empty_lines=False),
            convert_options=arrow_csv.ConvertOptions(
                column_types=kinds, strings_can_be_null=False, null_values=[""]
            ),
        )
        for batch in batches:
            # each row must be one line of the file, and none of them blank
            texts = [column for column in batch.columns if arrow.types.is_string(column.type)]
            if blank_rows(arrow, batch).any() or any(
                compute.any(compute.match_substring(column, "\n")).as_py() for column in texts
            ):
                return rows_read
            cells: dict[str, Any] = {
                name: np.array(column.to_numpy(zero_copy_only=False)) if name in numeric else column
                for name, column in zip(columns, batch.columns, strict=True)
            }
            first = above + rows_read + 1
            if batch.num_rows:
                yield TablePart(range(first, first + batch.num_rows), cells)
            rows_read += batch.num_rows
    except arrow.ArrowException:
        return rows_read
    return None


def csv_writer(
    partial: Path,
    header: Sequence[str],
    answers: Sequence[str],
    numeric: Container[str],
    stack: ExitStack,
    dialect: Dialect,
    *,
    fast: bool,
) -> Write:
    """Return a function that writes parts as CSV: NaN is an empty cell."""
    coding = "utf-8-sig" if dialect.marked else "utf-8"
    file = stack.enter_context(partial.open("w", newline="", encoding=coding))
    writer = csv.writer(file, lineterminator="\n", delimiter=dialect.delimiter)
    writer.writerow([*header, *answers])

    def write_cells(part: TablePart, answer: Mapping[str, NDArray[Any]]) -> None:
        columns = [cells_of(part.cells[name]) for name in header]
        columns += [cells_of(answer[name]) for name in answers]
        if dialect.decimal == ",":
            columns = [
                [str(cell).replace(".", ",") if isinstance(cell, float) else cell for cell in cells]
                for cells in columns
            ]
        writer.writerows(zip(*columns, strict=True))

    if not fast or dialect.delimiter != "," or dialect.marked:
        return write_cells
    try:
        arrow, _ = pyarrow()
        from pyarrow import csv as arrow_csv
    except MissingExtraError:
        return write_cells

    file.flush()
    options = arrow_csv.WriteOptions(include_header=False, batch_size=1 << 16)
    stream = stack.enter_context(partial.open("ab"))

    def write(part: TablePart, answer: Mapping[str, NDArray[Any]]) -> None:
        columns = arrow_columns(arrow, columns_to_write(part, header, numeric), bare=True)
        columns |= {name: arrow_array(arrow, answer[name], bare=True) for name in answers}
        arrow_csv.write_csv(arrow.table(columns), stream, options)

    return write
