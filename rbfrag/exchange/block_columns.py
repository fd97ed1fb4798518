"""Columns of numbers out of a block table, CSV or Parquet."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import SUFFIXES, pyarrow

T = TypeVar("T")


def read_names(path: str | os.PathLike[str]) -> list[str]:
    """Return the names of the columns of a block table.

    Raises:
        InputError: the file cannot be read.
        MissingExtraError: a Parquet file without pyarrow.
    """
    return _opened(path, _names_of)


def read_texts(path: str | os.PathLike[str], name: str) -> NDArray[np.object_]:
    """Return one column of a block table as texts.

    Raises:
        InputError: the file cannot be read or lacks the column.
        MissingExtraError: a Parquet file without pyarrow.
    """
    return _opened(path, lambda source: _texts(source, name))


def read_columns(
    path: str | os.PathLike[str], names: Sequence[str]
) -> dict[str, NDArray[np.float64]]:
    """Return columns of numbers by name; an empty cell is NaN, other columns are ignored.

    Args:
        path: file ending in ``.csv`` or ``.parquet``.
        names: the columns wanted.

    Raises:
        InputError: the file cannot be read, lacks a column, or a cell holds no number; the
            message names the line.
        MissingExtraError: a Parquet file without pyarrow.
    """
    return _opened(
        path,
        lambda source: (_from_csv if _is_csv(source) else _from_parquet)(source, names),
    )


def _is_csv(source: Path) -> bool:
    return source.suffix.lower() == ".csv"


def _opened(path: str | os.PathLike[str], read: Callable[[Path], T]) -> T:
    source = Path(path)
    if source.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"{source}: a block table ends in {' or '.join(SUFFIXES)}, not {source.suffix!r}"
        )
    try:
        if source.is_dir():
            raise InputError(f"{source} is a folder: name a block table in it")
        return read(source)
    except FileNotFoundError:
        raise InputError(f"{source}: no such file; name a .csv or .parquet block table") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: not a text file (UTF-8)") from None
    except csv.Error as error:
        raise InputError(f"{source}: not a CSV file: {error}") from None
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror or error}") from None


def _names_of(source: Path) -> list[str]:
    if _is_csv(source):
        with source.open(newline="", encoding="utf-8-sig") as file:
            return [cell.strip() for cell in next(csv.reader(file), [])]
    arrow, parquet = pyarrow()
    try:
        return list(parquet.ParquetFile(source).schema_arrow.names)
    except arrow.ArrowException as error:
        raise InputError(f"{source}: not a Parquet file: {error}") from None


def _texts(source: Path, name: str) -> NDArray[np.object_]:
    names = _names_of(source)
    _missing(source, names, [name])
    if _is_csv(source):
        with source.open(newline="", encoding="utf-8-sig") as file:
            rows = csv.reader(file)
            next(rows, None)
            place = names.index(name)
            cells = [row[place].strip() if place < len(row) else "" for row in rows if row]
    else:
        _, parquet = pyarrow()
        column = parquet.ParquetFile(source).read(columns=[name])[name]
        cells = ["" if cell is None else str(cell) for cell in column.to_pylist()]
    found = np.empty(len(cells), dtype=object)
    found[:] = cells
    return found


def _missing(source: Path, have: Sequence[str], names: Sequence[str]) -> None:
    for name in names:
        if name not in have:
            raise InputError(
                f"{source}: there is no column {name}; the columns are {', '.join(have) or 'none'}"
            )


def _from_csv(source: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    with source.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        header = [cell.strip() for cell in next(reader, [])]
        _missing(source, header, names)
        places = [header.index(name) for name in names]
        columns: list[list[float]] = [[] for _ in names]
        for row in reader:
            if not row:
                continue
            if len(row) != len(header):
                raise InputError(
                    f"{source}, line {reader.line_num}: {len(row)} cells under "
                    f"{len(header)} columns"
                )
            for column, place, name in zip(columns, places, names, strict=True):
                text = row[place].strip()
                try:
                    column.append(float(text) if text else np.nan)
                except ValueError:
                    raise InputError(
                        f"{source}, line {reader.line_num}: {name} = {text!r} is not a number"
                    ) from None
    return {name: np.array(column) for name, column in zip(names, columns, strict=True)}


def _from_parquet(source: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    arrow, parquet = pyarrow()
    try:
        file = parquet.ParquetFile(source)
        _missing(source, file.schema_arrow.names, names)
        table: Any = file.read(columns=list(names))
        return {
            name: table[name].cast(arrow.float64()).to_numpy(zero_copy_only=False) for name in names
        }
    except arrow.ArrowException as error:
        raise InputError(f"{source}: not a Parquet file of numbers: {error}") from None
