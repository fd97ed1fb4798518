"""The block table that commands pass to each other, as CSV, Parquet or GeoJSON points."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.batch_table import (
    arrow_array,
    cells_of,
    csv_rows,
    numbers,
    parquet_parts,
    pyarrow,
)
from rbfrag.exchange.points import SUFFIXES as GEOJSON
from rbfrag.exchange.points import read_points
from rbfrag.files import output_path, reading, written_whole

SUFFIXES = (".csv", ".parquet")
"""File types of a block table."""

_ROWS = 1 << 14


def table_path(path: str | os.PathLike[str]) -> Path:
    """Return the path if a table can be written there; ask before long work."""
    target = output_path(path, SUFFIXES, "table")
    if target.suffix.lower() == ".parquet":
        pyarrow()
    return target


def write_block_table(columns: Mapping[str, NDArray[Any]], path: str | os.PathLike[str]) -> Path:
    """Write a table of blocks, whole or not at all, and return its path.

    Numbers keep all their digits. NaN is an empty cell in CSV and null in Parquet.

    Args:
        columns: arrays of one length by column name, units in the names.
        path: file to write, ``.csv`` or ``.parquet``; an existing file is replaced.
    """
    target = table_path(path)
    with written_whole(target, "table") as partial:
        if target.suffix.lower() == ".parquet":
            _write_parquet(columns, partial)
        else:
            _write_csv(columns, partial)
    return target


def _write_csv(columns: Mapping[str, NDArray[Any]], place: Path) -> None:
    length = len(next(iter(columns.values())))
    with place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for start in range(0, length, _ROWS):
            cells = (cells_of(column[start : start + _ROWS]) for column in columns.values())
            writer.writerows(zip(*cells, strict=True))


def _write_parquet(columns: Mapping[str, NDArray[Any]], place: Path) -> None:
    arrow, parquet = pyarrow()
    arrays = {name: arrow_array(arrow, column) for name, column in columns.items()}
    parquet.write_table(arrow.table(arrays), place)


def read_columns(
    path: str | os.PathLike[str],
    names: Sequence[str],
    *,
    optional: Sequence[str] = (),
    texts: Sequence[str] = (),
) -> dict[str, NDArray[Any]]:
    """Return columns of a block table by name; an empty number is NaN.

    Args:
        path: file ending in ``.csv`` or ``.parquet``.
        names: columns of numbers that must be there.
        optional: further columns of numbers, where the table has them.
        texts: columns of texts, where the table has them.

    Raises:
        InputError: the file cannot be read, lacks a column, or a cell holds no number; the
            message names the line.
        MissingExtraError: a Parquet file without pyarrow.
    """
    source = Path(path)
    suffix = source.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{source}: a block table ends in {' or '.join(SUFFIXES)}, not {source.suffix!r}"
        )
    try:
        with reading(source, "a block table"), ExitStack() as stack:
            wanted = (*names, *optional)
            opened = csv_rows if suffix == ".csv" else parquet_parts
            header, parts = opened(source, wanted, stack)
            for name in names:
                if name not in header:
                    have = ", ".join(header) or "none"
                    raise InputError(f"{source}: there is no column {name}; the columns are {have}")
            found: dict[str, list[NDArray[Any]]] = {
                name: [np.empty(0, dtype=object if name in texts else np.float64)]
                for name in (*wanted, *texts)
                if name in header
            }
            for first, part in parts:
                for name, arrays in found.items():
                    if name in texts:
                        cells = [str(cell).strip() for cell in cells_of(part[name])]
                        arrays.append(np.array(cells, dtype=object))
                    else:
                        arrays.append(numbers(source, name, part[name], first))
            return {name: np.concatenate(arrays) for name, arrays in found.items()}
    except csv.Error as error:
        raise InputError(f"{source}: not a CSV file: {error}") from None


def waiting_blocks(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """Return the blocks of a table (.csv, .parquet) or of GeoJSON points as columns.

    Args:
        path: file with ``p2_1_s2`` [1/s²] and ``kr``, and ``block_id``, ``weight``, ``lon`` and
            ``lat`` [deg] if it has them.

    Returns:
        Columns of one length; ``block_id`` are texts, numbers from 1 on where there are none.

    Raises:
        InputError: the file cannot be read, is empty, or a block is none that waits for an
            earthquake: p² or k_r not above zero, a place off the map, a weight below zero; the
            message names it.
        MissingExtraError: a Parquet file without pyarrow.
    """
    found = _points(path) if str(path).lower().endswith(GEOJSON) else _rows(path)
    if found["kr"].size == 0:
        raise InputError(f"{path}: there is no block in the file")
    for i in range(found["kr"].size):
        row = {name: column[i] for name, column in found.items()}
        block = f"{path}: block {row['block_id']}"
        a, b = float(row["p2_1_s2"]), float(row["kr"])
        if not (0.0 < a < math.inf and 0.0 < b < math.inf):
            raise InputError(
                f"{block} has p2_1_s2 = {a:g} and kr = {b:g}: a block that waits for an "
                "earthquake has both above zero (an unstable one has already failed)"
            )
        if "lon" in row and not (abs(row["lon"]) <= 180.0 and abs(row["lat"]) <= 90.0):
            raise InputError(
                f"{block} at lon = {row['lon']:g}, lat = {row['lat']:g} lies off the map"
            )
        if "weight" in row and not row["weight"] >= 0.0:
            raise InputError(f"{block} has a weight below zero")
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
    found = read_columns(
        path, ("p2_1_s2", "kr"), optional=("lon", "lat", "weight"), texts=("block_id",)
    )
    if ("lon" in found) != ("lat" in found):
        raise InputError(f"{path}: lon and lat go together: give both columns, or neither")
    if "block_id" not in found:
        found["block_id"] = np.array([str(i + 1) for i in range(found["kr"].size)], dtype=object)
    return found
