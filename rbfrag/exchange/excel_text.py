"""Text cells of CSV files that a spreadsheet would interpret as formulas.

Excel, and others like it, compute a cell that begins with = + - or @, whatever program wrote the
file; a leading apostrophe tells them that it is text. Readers here take such an apostrophe off.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from rbfrag.exchange.tables.parts import cells_of
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
