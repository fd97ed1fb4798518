"""Columns of tables that are written, as tests look at them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import opened_table
from rbfrag.vocabulary.quantities import COLUMNS, column_of

FIELD_OF = {column_of(name): name for name in COLUMNS}


def read_columns(
    path: Path | str, names: Sequence[str], *, texts: Sequence[str] = ()
) -> dict[str, NDArray[Any]]:
    """Return columns of numbers, and of texts, by what they are called."""
    fields = {FIELD_OF.get(name, name): name for name in (*names, *texts)}
    of_text = [field for field, name in fields.items() if name in texts]
    with opened_table(path, [*fields], of_text) as table:
        table.need([field for field, name in fields.items() if name in names])
        columns, faults, lines = table.read_all()
    if faults:
        i = min(faults)
        raise InputError(f"{path}, {table.file.word} {lines[i]}: {faults[i]}")
    return {fields[field]: values for field, values in columns.items()}
