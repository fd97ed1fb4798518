"""A table of blocks as CSV: with commas, or as spreadsheets of decimal commas write it."""

from __future__ import annotations

import csv
import re
from collections.abc import Container, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MissingExtraError
from rbfrag.exchange.tables import parts
from rbfrag.exchange.tables.parquet import arrow_array, arrow_columns
from rbfrag.exchange.tables.parts import (
    TEXTS,
    Part,
    Parts,
    Write,
    cells_of,
    columns_to_write,
    pyarrow,
)

_PEEK = 1 << 16
_BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class Dialect:
    """How a CSV file is written.

    Args:
        delimiter: what stands between cells: a comma, a semicolon or a tab.
        decimal: what stands before decimals: a point or a comma.
        marked: whether it begins with the mark of UTF-8 (BOM) that spreadsheets write.
    """

    delimiter: str = ","
    decimal: str = "."
    marked: bool = False

    @property
    def is_default(self) -> bool:
        """Whether it is the one with commas and points that we write by ourselves."""
        return self.delimiter == "," and not self.marked


def dialect_of(origin: Path) -> Dialect:
    """Return how a file is written, of its header and its first cells."""
    with origin.open("rb") as file:
        start = file.read(_PEEK)
    head, _, rest = start.removeprefix(_BOM).decode("utf-8", "replace").partition("\n")
    delimiter = max(",;\t", key=head.count)
    decimal = "."
    if delimiter != ",":
        edge = f'[{delimiter}"\\s]'
        points, commas = (
            re.search(f"(?:^|{edge})[+-]?\\d*[{mark}]\\d+(?:[eE][+-]?\\d+)?(?:{edge}|$)", rest)
            for mark in ".,"
        )
        decimal = "." if points and not commas else ","
    return Dialect(delimiter, decimal, start.startswith(_BOM))


def csv_parts(
    origin: Path, numeric: Container[str], stack: ExitStack, *, fast: bool
) -> tuple[list[str], Parts, Dialect]:
    """Return the names of the columns, the parts, and how the file is written.

    The stack closes the file at the end. A table of commas is, if it shall be fast, read by pyarrow
    where that is installed, in a tenth of the time; from the first cell on that is no number, it is
    read cell by cell as other tables are.
    """
    dialect = dialect_of(origin)
    file = stack.enter_context(origin.open(newline="", encoding="utf-8-sig"))
    reader = csv.reader(file, delimiter=dialect.delimiter)
    header = [cell.strip() for cell in next(reader, [])]
    while header and not header[-1]:  # spreadsheets write delimiters behind the last column
        header.pop()
    if fast and dialect.delimiter == ",":
        with suppress(MissingExtraError):
            arrow, _ = pyarrow()
            return header, _by_arrow(origin, header, numeric, reader, arrow), dialect
    return header, _cell_by_cell(header, reader, dialect), dialect


def _by_arrow(
    origin: Path, header: list[str], numeric: Container[str], reader: Any, arrow: Any
) -> Parts:
    from pyarrow import csv as arrow_csv

    kinds = {name: arrow.float64() if name in numeric else arrow.string() for name in header}
    first, done = 2, 0
    try:
        batches = arrow_csv.open_csv(
            origin,
            read_options=arrow_csv.ReadOptions(
                column_names=header, skip_rows=1, block_size=1 << 25, use_threads=False
            ),
            parse_options=arrow_csv.ParseOptions(newlines_in_values=True, ignore_empty_lines=False),
            convert_options=arrow_csv.ConvertOptions(
                column_types=kinds, strings_can_be_null=False, null_values=[""]
            ),
        )
        for batch in batches:
            if not _is_a_line_each(batch, arrow):
                break
            cells: dict[str, Any] = {}
            for name, column in zip(header, batch.columns, strict=True):
                if name in numeric:
                    cells[name] = np.array(column.to_numpy(zero_copy_only=False))
                else:
                    cells[name] = column.to_pylist() if name in TEXTS else column
            if batch.num_rows:
                yield Part(range(first, first + batch.num_rows), cells)
            first += batch.num_rows
            done += batch.num_rows
        else:
            return
    except arrow.ArrowException:
        pass
    # cell by cell from the first row that was not handed out
    yield from _cell_by_cell(header, reader, Dialect(), done)


def _is_a_line_each(batch: Any, arrow: Any) -> bool:
    """Whether each row is one line of the file, and none of them is blank."""
    from pyarrow import compute

    blank = np.ones(batch.num_rows, dtype=bool)
    for column in batch.columns:
        if not arrow.types.is_string(column.type):
            blank &= compute.is_null(column).to_numpy(zero_copy_only=False)
            continue
        if compute.any(compute.match_substring(column, "\n")).as_py():
            return False
        blank &= compute.equal(column, "").to_numpy(zero_copy_only=False)
    return not blank.any()


def _cell_by_cell(header: list[str], reader: Any, dialect: Dialect, done: int = 0) -> Parts:
    width = len(header)
    rows: list[list[str]] = []
    lines: list[int] = []
    faults: dict[int, str] = {}

    def part() -> Part:
        columns = map(list, zip(*rows, strict=True))
        return Part(lines, dict(zip(header, columns, strict=True)), faults, dialect.decimal)

    number, end = 0, reader.line_num
    for row in reader:
        line, end = end + 1, reader.line_num
        if not row or (width > 1 and not "".join(row).strip()):
            continue  # a blank line, which spreadsheets write with all its delimiters
        number += 1
        if number <= done:
            continue
        if len(row) != width:
            if len(row) < width or any(row[width:]):
                faults[len(rows)] = f"{len(row)} cells under {width} columns"
            row = [*row[:width], *[""] * (width - len(row))]
        rows.append(row)
        lines.append(line)
        if len(rows) == parts.ROWS:
            yield part()
            rows, lines, faults = [], [], {}
    if rows:
        yield part()


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

    def write_cells(part: Part, answer: Mapping[str, NDArray[Any]]) -> None:
        columns = [cells_of(part.cells[name]) for name in header]
        columns += [cells_of(answer[name]) for name in answers]
        if dialect.decimal == ",":
            columns = [
                [str(cell).replace(".", ",") if isinstance(cell, float) else cell for cell in cells]
                for cells in columns
            ]
        writer.writerows(zip(*columns, strict=True))

    if not fast or not dialect.is_default:
        return write_cells
    try:
        arrow, _ = pyarrow()
        from pyarrow import csv as arrow_csv
    except MissingExtraError:
        return write_cells

    file.flush()
    options = arrow_csv.WriteOptions(include_header=False, batch_size=1 << 16)
    stream = stack.enter_context(partial.open("ab"))

    def write(part: Part, answer: Mapping[str, NDArray[Any]]) -> None:
        columns = arrow_columns(arrow, columns_to_write(part, header, numeric), bare=True)
        columns |= {name: arrow_array(arrow, answer[name], bare=True) for name in answers}
        arrow_csv.write_csv(arrow.table(columns), stream, options)

    return write
