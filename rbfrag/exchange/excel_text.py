"""Text cells of CSV that a spreadsheet takes for formulas.

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
    """Return whether a spreadsheet would compute a cell; a number it reads as what it is."""
    return text[:1] in ("=", "+", "-", "@") and not _NUMBER.fullmatch(text)


def as_text(text: str) -> str:
    """Return a cell as spreadsheets take it for text."""
    return f"'{text}" if is_formula(text) else text


def as_written(text: str) -> str:
    """Return what :func:`as_text` was given."""
    return text[1:] if text[:1] == "'" and is_formula(text[1:]) else text


def changed_texts(columns: Mapping[str, Any], change: Callable[[str], str]) -> dict[str, Any]:
    """Return columns with their texts changed; those without a suspect cell stay as they are.

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
    """Return a warning that names the first cell that spreadsheets compute, or nothing."""
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
    """Whether a column is of texts, and one of them may be, or may have been, a formula."""
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
