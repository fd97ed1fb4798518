"""The block table that commands pass to each other, as CSV or Parquet."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError

SUFFIXES = (".csv", ".parquet")
"""File types of a block table."""

_ROWS = 1 << 14


def table_path(path: str | os.PathLike[str]) -> Path:
    """Return the path if a table can be written there; ask before long work.

    Raises:
        InputError: the suffix is neither csv nor parquet, or the folder cannot be written.
        MissingExtraError: a Parquet file without pyarrow.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"table {target}: the suffix {target.suffix!r} is none of {', '.join(SUFFIXES)}: "
            "name the file with one of them"
        )
    if target.is_dir():
        raise InputError(f"table {target} is a folder: name a file in it")
    if not target.parent.is_dir():
        raise InputError(f"table {target}: there is no folder {target.parent}: make it first")
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"table {target}: the folder cannot be written: choose another")
    if suffix == ".parquet":
        pyarrow()
    return target


def write_block_table(columns: Mapping[str, NDArray[Any]], path: str | os.PathLike[str]) -> Path:
    """Write a table of blocks, whole or not at all.

    Numbers keep all their digits. NaN is an empty cell in CSV and null in Parquet.

    Args:
        columns: arrays of one length by column name, units in the names.
        path: file to write, ``.csv`` or ``.parquet``; an existing file is replaced.

    Returns:
        The path.

    Raises:
        InputError: as for :func:`table_path`, or the disk refuses.
        MissingExtraError: a Parquet file without pyarrow.
    """
    target = table_path(path)
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        if target.suffix.lower() == ".parquet":
            _write_parquet(columns, partial)
        else:
            _write_csv(columns, partial)
        partial.replace(target)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"table {target} cannot be written: {reason}") from None
    finally:
        partial.unlink(missing_ok=True)
    return target


def _write_csv(columns: Mapping[str, NDArray[Any]], place: Path) -> None:
    length = len(next(iter(columns.values())))
    with place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for start in range(0, length, _ROWS):
            cells = (_cells(column[start : start + _ROWS]) for column in columns.values())
            writer.writerows(zip(*cells, strict=True))


def _cells(column: NDArray[Any]) -> list[Any]:
    values: list[Any] = column.tolist()
    if column.dtype.kind == "f":
        return ["" if value != value else value for value in values]
    if column.dtype.kind == "b":
        return ["true" if value else "false" for value in values]
    return values


def _write_parquet(columns: Mapping[str, NDArray[Any]], place: Path) -> None:
    arrow, parquet = pyarrow()
    arrays = {
        name: arrow.array(
            column,
            type=arrow.string() if column.dtype.kind in "OU" else None,
            mask=np.isnan(column) if column.dtype.kind == "f" else None,
        )
        for name, column in columns.items()
    }
    parquet.write_table(arrow.table(arrays), place)


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and pyarrow.parquet, or say which extra brings them."""
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise MissingExtraError("Parquet files need pyarrow", "parquet") from None
    return arrow, parquet
