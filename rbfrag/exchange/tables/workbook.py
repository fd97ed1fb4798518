"""A table of blocks as a sheet of an Excel workbook (.xlsx), or of a spreadsheet (.ods)."""

from __future__ import annotations

import datetime
import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Container, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.tables.parts import (
    Parts,
    TableFile,
    TablePart,
    Write,
    cells_of,
    columns_to_write,
    parts_of_rows,
    split_header,
)
from rbfrag.results.diagnostic import as_documents

MOST_ROWS = 1 << 20
"""Rows of a sheet, its first with the names."""

MOST_BYTES = 1 << 30
"""Workbooks that unpack to more are rejected: a sheet of a million rows is smaller."""

DAMAGED = (
    zipfile.BadZipFile, zlib.error, struct.error, ParseError, EOFError, LookupError, ValueError,
    TypeError, AttributeError, RuntimeError, ArithmeticError,
)  # fmt: skip
"""What openpyxl raises on a damaged workbook."""

_NOT_COMPUTED = re.compile(
    rb'<c r="([A-Z]{1,3}\d{1,7})"[^>]*>\s*'
    rb"<f(?:[^>]*/>|[^>]*>[^<]*</f>)\s*(?:<v\s*/>|<v></v>)?\s*</c>"
)


def openpyxl() -> Any:
    """Return openpyxl, or name the extra that installs it."""
    try:
        import openpyxl as library
    except ImportError:
        raise MissingExtraError("Excel workbooks (.xlsx) require openpyxl", "excel") from None
    return library


def _open_document_rows(origin: Path) -> dict[str, Iterable[Sequence[Any]]]:
    """Return the rows of each sheet of an OpenDocument spreadsheet (.ods)."""
    import pandas as pd

    try:
        frames = pd.read_excel(origin, engine="odf", sheet_name=None, header=None, dtype=object)
    except ImportError:
        raise MissingExtraError("OpenDocument spreadsheets (.ods) require odfpy", "excel") from None
    return {
        str(title): [[None if cell != cell else cell for cell in row] for row in frame.to_numpy()]
        for title, frame in frames.items()
    }


def open_workbook(origin: Path, stack: ExitStack, sheet: str | None) -> TableFile:
    """Return an open sheet, whose workbook the stack closes.

    Formulas are read as the values that Excel has computed and stored; rows without any cell are
    passed over.

    Args:
        origin: the workbook.
        stack: see there.
        sheet: name of the sheet; None for the first.

    Raises:
        InputError: no workbook, one without that sheet, or with a formula that was never computed.
    """
    library = None if origin.suffix.lower() == ".ods" else openpyxl()
    with _damage(origin):
        _check(origin)
        if library is None:
            sheets = _open_document_rows(origin)
        else:
            book = library.load_workbook(origin, read_only=True, data_only=True, keep_links=False)
            stack.callback(book.close)
            for worksheet in book.worksheets:
                worksheet.reset_dimensions()  # what programs state there is not always so
            sheets = {
                worksheet.title: worksheet.iter_rows(values_only=True)
                for worksheet in book.worksheets
            }
        if not sheets:
            raise InputError(f"{origin}: the workbook has no sheet")
        if sheet is not None and sheet not in sheets:
            raise InputError(
                f"{origin}: there is no sheet {sheet!r}; the sheets are {', '.join(sheets)}"
            )
        filled = _rows(origin, sheets[next(iter(sheets)) if sheet is None else sheet])
        stack.callback(filled.close)
        names, _, rows, remarks = split_header(filled, "row")

    def read(numeric: Container[str]) -> Parts:
        for part in parts_of_rows(names, rows, empty=None):
            texts = {n: [*map(_text, c)] for n, c in part.cells.items() if n not in numeric}
            part.cells.update(texts)
            yield part

    return TableFile(names, read, remarks, sheets=() if sheet else [*sheets])


def _rows(
    origin: Path, rows: Iterable[Sequence[Any]]
) -> Generator[tuple[int, Sequence[Any]], None, None]:
    with _damage(origin):
        for number, row in enumerate(rows, 1):
            if any(cell is not None and str(cell).strip() for cell in row):
                yield number, row


@contextmanager
def _damage(origin: Path) -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of styles and validations, which are no concern here
        try:
            yield
        except InputError:
            raise
        except DAMAGED as error:
            raise InputError(
                f"{origin}: not an Excel workbook or spreadsheet ({origin.suffix}), or a damaged "
                f"one: {error}; save it again"
            ) from None


def _check(origin: Path) -> None:
    """Reject a workbook that is too large, or that has formulas without values."""
    with zipfile.ZipFile(origin) as archive:
        members = archive.infolist()
        if sum(member.file_size for member in members) > MOST_BYTES:
            raise InputError(f"{origin}: its uncompressed size is too large for a table of blocks")
        for member in members:
            if not member.filename.startswith("xl/worksheets/sheet"):
                continue
            with archive.open(member) as file:
                before = b""
                while more := file.read(1 << 20):
                    match = _NOT_COMPUTED.search(before + more)
                    if match is not None:
                        raise InputError(
                            f"{origin}: the formula in cell {match[1].decode()} was never "
                            "computed: open the workbook in Excel and save it"
                        )
                    before = more[-4096:]


def _text(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "true" if cell else "false"
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15:
        return str(int(cell))
    if isinstance(cell, datetime.datetime) and cell.time() == datetime.time():
        cell = cell.date()
    return str(cell)


def workbook_writer(
    partial: Path,
    header: Sequence[str],
    answers: Sequence[str],
    numeric: Container[str],
    stack: ExitStack,
    notes: Sequence[str] = (),
) -> Write:
    """Return a function that writes parts into a sheet of a workbook, and notes into another.

    Texts stay texts, also those that begin with =, unless they are numbers as Excel itself would
    write them; NaN is an empty cell. Numbers are written with 16 digits.
    """
    library = openpyxl()
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

    book = library.Workbook(write_only=True)
    sheet = book.create_sheet("blocks")
    sheet.freeze_panes = "A2"
    written = [1]

    def cell_of(value: Any) -> Any:
        if isinstance(value, float):
            return value if abs(value) < 1e308 else str(value)  # Excel knows no infinity
        if not isinstance(value, str):
            return value
        if not value:
            return None
        if (number := _own_number(value)) is not None:
            return number
        text = ILLEGAL_CHARACTERS_RE.sub("", value)
        if text[:1] != "=":
            return text
        cell = WriteOnlyCell(sheet, text)
        cell.data_type = "s"
        return cell

    def write(part: TablePart, answer: Mapping[str, NDArray[Any]]) -> None:
        arrays = [column for _, column in columns_to_write(part, header, numeric)]
        arrays += [answer[name] for name in answers]
        columns = [
            column.tolist() if getattr(column, "dtype", None) == np.bool_ else cells_of(column)
            for column in arrays
        ]
        written[0] += len(columns[0]) if columns else 0
        if written[0] > MOST_ROWS:
            raise InputError(
                f"a sheet of Excel has {MOST_ROWS - 1:,} rows below its names, fewer than the "
                "table: use .csv or .parquet"
            )
        for row in zip(*columns, strict=True):
            sheet.append([cell_of(value) for value in row])

    def add_notes() -> None:
        if not notes:
            return
        other = book.create_sheet("notes")
        other.append(["code", "note", "rows"])
        for document in as_documents(notes):
            rows = ", ".join(str(row + 1) for row in document["rows"]) or "all"
            other.append([document["code"], cell_of(document["text"]), rows])

    def close(kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            add_notes()
            book.save(partial)
        else:
            sheet.close()  # it holds a file open

    sheet.append([*header, *answers])
    stack.push(close)
    return write


def _own_number(text: str) -> int | float | None:
    """Return the number that a text represents exactly, or None: 007 and 1.50 remain texts."""
    if not text[-1].isdigit() or len(text) > 24:
        return None
    try:
        number: int | float = int(text) if text.lstrip("-").isdigit() else float(text)
    except ValueError:
        return None
    return number if str(number) == text and abs(number) < 1e15 else None
