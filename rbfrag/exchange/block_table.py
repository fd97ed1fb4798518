"""The block table that commands pass to each other, as CSV or Parquet."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.points import SUFFIXES as GEOJSON
from rbfrag.exchange.points import read_points

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


def waiting_blocks(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """Return the blocks of a table (.csv, .parquet) or of GeoJSON points as columns.

    Args:
        path: file with ``p2_1_s2`` [1/s²] and ``kr``, and ``block_id``, ``weight``, ``lon`` and
            ``lat`` [deg] if it has them.

    Returns:
        Columns of one length; ``block_id`` are texts, numbers from 1 on where there are none.

    Raises:
        InputError: the file cannot be read, is empty, or a block is none that waits: p² or k_r
            not above zero, a place off the map, a weight below zero; the message names it.
        MissingExtraError: a Parquet file without pyarrow.
    """
    found = _points(path) if str(path).lower().endswith(GEOJSON) else _rows(path)
    if found["kr"].size == 0:
        raise InputError(f"{path}: there is no block in the file")
    for i in range(found["kr"].size):
        a, b = float(found["p2_1_s2"][i]), float(found["kr"][i])
        if not (a > 0.0 and b > 0.0 and math.isfinite(a) and math.isfinite(b)):
            raise InputError(
                f"{path}: block {found['block_id'][i]} has p2_1_s2 = {a:g} and kr = {b:g}: a "
                "block that waits for an earthquake has both above zero (an unstable one has "
                "already failed)"
            )
        if "lon" in found and not (abs(found["lon"][i]) <= 180.0 and abs(found["lat"][i]) <= 90.0):
            raise InputError(
                f"{path}: block {found['block_id'][i]} at lon = {found['lon'][i]:g}, lat = "
                f"{found['lat'][i]:g} lies off the map"
            )
        if "weight" in found and not (found["weight"][i] >= 0.0):
            raise InputError(f"{path}: block {found['block_id'][i]} has a weight below zero")
    if "weight" in found and not found["weight"].sum() > 0.0:
        raise InputError(f"{path}: the weights of the blocks sum to zero")
    return found


def _points(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    points = read_points(path)
    found: dict[str, NDArray[Any]] = {
        "lon": np.array([lon for lon, _, _ in points]),
        "lat": np.array([lat for _, lat, _ in points]),
        "block_id": np.array(
            [str(p.get("block_id", i + 1)) for i, (_, _, p) in enumerate(points)], dtype=object
        ),
    }
    for name in ("p2_1_s2", "kr"):
        values = [p.get(name) for _, _, p in points]
        for i, value in enumerate(values):
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{path}, features[{i}]: {name} = {value!r} is not a number")
        found[name] = np.array(values, dtype=np.float64)
    return found


def _rows(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    names = read_names(path)
    wanted = ["p2_1_s2", "kr", *(x for x in ("lon", "lat", "weight") if x in names)]
    found: dict[str, NDArray[Any]] = dict(read_columns(path, wanted))
    if ("lon" in found) != ("lat" in found):
        raise InputError(f"{path}: lon and lat go together: give both columns, or neither")
    size = found["kr"].size
    found["block_id"] = (
        read_texts(path, "block_id")
        if "block_id" in names
        else np.array([str(i + 1) for i in range(size)], dtype=object)
    )
    return found
