"""The block table that commands pass to each other, as CSV, Parquet or GeoJSON points."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.batch_table import (
    arrow_array,
    cells_of,
    csv_rows,
    numbers,
    parquet_parts,
    pyarrow,
)
from rbfrag.exchange.excel_text import as_text, as_written, changed_texts
from rbfrag.exchange.points import SUFFIXES as GEOJSON
from rbfrag.exchange.points import read_points
from rbfrag.files import is_number, output_path, reading, written_whole
from rbfrag.solver.block.formulas import array_elementwise
from rbfrag.solver.described import rectangle_numbers
from rbfrag.solver.kinds import model_of_kind

SUFFIXES = (".csv", ".parquet")
"""File types of a block table."""

NUMBERS = ("p2_1_s2", "kr")
"""Columns of a block that topples."""

BLOCK_COLUMNS = {
    "p2_1_s2": "p2",
    "kr": "kr",
    "ky": "ky",
    "displacement_m": "displacement_m",
    "beta_deg": "beta_deg",
    "ks": "ks",
    "ps2_1_s2": "ps2",
    "leaves_g": "leaves_g",
    "restitution": "restitution",
}
"""Columns that describe blocks of any kind, with the names that `predict` has for them."""

SIGMAS = ("p2_sigma", "kr_sigma")
"""Columns of the standard deviations of ln p² and ln k_r of such a block; an empty cell is 0."""

RECTANGLE = ("height_m", "width_m", "dip_deg")
"""Columns of a rectangle, which are read where those are not all there; the dip may be missing."""

PORTFOLIO = ("count", "loss", "loss_sigma")
"""Columns of how many like blocks a row is, what a failure costs, and how that scatters."""

_ROWS = 1 << 14


def table_path(path: str | os.PathLike[str]) -> Path:
    """Return the path if a table can be written there; ask before long work."""
    target = output_path(path, SUFFIXES, "table")
    if target.suffix.lower() == ".parquet":
        pyarrow()
    return target


def write_block_table(
    columns: Mapping[str, NDArray[Any]],
    path: str | os.PathLike[str],
    *,
    excel_text: bool = False,
) -> Path:
    """Write a table of blocks, whole or not at all, and return its path.

    Numbers keep all their digits. NaN is an empty cell in CSV and null in Parquet.

    Args:
        columns: arrays of one length by column name, units in the names.
        path: file to write, ``.csv`` or ``.parquet``; an existing file is replaced.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).
    """
    target = table_path(path)
    if excel_text and target.suffix.lower() == ".csv":
        columns = changed_texts(columns, as_text)
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
            collected: dict[str, list[NDArray[Any]]] = {
                name: [np.empty(0, dtype=object if name in texts else np.float64)]
                for name in (*wanted, *texts)
                if name in header
            }
            for first, part in parts:
                for name, arrays in collected.items():
                    if name in texts:
                        cells = [
                            checked_name(
                                as_written(str(cell).strip()), f"{source}: a cell of {name}"
                            )
                            for cell in cells_of(part[name])
                        ]
                        arrays.append(np.array(cells, dtype=object))
                    else:
                        arrays.append(numbers(source, name, part[name], first))
            return {name: np.concatenate(arrays) for name, arrays in collected.items()}
    except csv.Error as error:
        raise InputError(f"{source}: not a CSV file: {error}") from None


def is_of_rectangles(names: Collection[str]) -> bool:
    """Return whether columns of these names describe blocks by height and width."""
    return not {*NUMBERS} <= {*names} and {"height_m", "width_m"} <= {*names}


def rectangle_columns(
    columns: Mapping[str, Any], *, free_standing: bool = False
) -> dict[str, NDArray[Any]]:
    """Return ``p2_1_s2`` and ``kr`` of rectangles, NaN where there is none.

    Args:
        columns: ``height_m``, ``width_m`` and, unless the bases are level, ``dip_deg``.
        free_standing: whether nothing backs them: k_r is then that of the weaker sense, and
            ``restitution`` is returned too, 1 - 1.5 sin² α (Housner 1963), 0 where that is less.
    """
    height, width, dip = (
        np.asarray(columns.get(name, 0.0), dtype=np.float64) for name in RECTANGLE
    )
    with np.errstate(all="ignore"):
        leans = np.abs(dip) if free_standing else dip
        p2_and_kr = rectangle_numbers(height, width, leans, array_elementwise())
        columns_of_kind = dict(zip(NUMBERS, p2_and_kr, strict=True))
        if free_standing:
            sine2 = width * width / (width * width + height * height)
            columns_of_kind["restitution"] = np.maximum(1.0 - 1.5 * sine2, 0.0)
        is_block = (height > 0.0) & (width > 0.0) & (np.abs(dip) < 90.0)
        return {
            name: np.where(is_block & np.isfinite(values), values, np.nan)
            for name, values in columns_of_kind.items()
        }


def waiting_blocks(
    path: str | os.PathLike[str], kind: str | None = None
) -> dict[str, NDArray[Any]]:
    """Return the blocks of a table (.csv, .parquet) or of GeoJSON points as columns.

    Args:
        path: file with ``p2_1_s2`` [1/s²] and ``kr``, or ``height_m`` and ``width_m`` (and
            ``dip_deg``), and ``block_id``, ``p2_sigma``, ``kr_sigma``, ``weight``, ``lon`` and
            ``lat`` [deg] if it has them; a table also ``restitution``, ``site_id``, ``kind``,
            ``count``, ``loss`` and ``loss_sigma``.
        kind: kind of the rows of a table that state none; of a free-standing kind rectangles are
            not backed by a slope.

    Returns:
        Columns of one length; ``block_id`` are texts, numbers from 1 on where there are none.

    Raises:
        InputError: the file cannot be read, is empty, or a block is none that waits for an
            earthquake: p² or k_r not above zero, a place off the map, a weight below zero; the
            message names it.
        MissingExtraError: a Parquet file without pyarrow.
    """
    read = _points if str(path).lower().endswith(GEOJSON) else _rows
    columns = read(path, kind)
    if columns["kr"].size == 0:
        raise InputError(f"{path}: there is no block in the file")
    for i in range(columns["kr"].size):
        row = {name: column[i] for name, column in columns.items()}
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
        for name in SIGMAS:
            if name in row and not 0.0 <= row[name] < math.inf:
                raise InputError(f"{block} has {name} = {row[name]:g}: give 0 or more")
        if "weight" in row and not row["weight"] >= 0.0:
            raise InputError(f"{block} has a weight below zero")
    if "weight" in columns and not columns["weight"].sum() > 0.0:
        raise InputError(f"{path}: the weights of the blocks sum to zero")
    return columns


def _points(path: str | os.PathLike[str], kind: str | None) -> dict[str, NDArray[Any]]:
    points = read_points(path)
    columns: dict[str, NDArray[Any]] = {
        "lon": np.array([lon for lon, _, _ in points]),
        "lat": np.array([lat for _, lat, _ in points]),
        "block_id": np.array(
            [
                checked_name(str(p.get("block_id", i + 1)), f"{path}: a block")
                for i, (_, _, p) in enumerate(points)
            ],
            dtype=object,
        ),
    }
    properties = [p for _, _, p in points]
    rectangles = any(is_of_rectangles(p) for p in properties)
    for name in ("height_m", "width_m") if rectangles else NUMBERS:
        columns[name] = _numbers(path, name, [p.get(name) for p in properties])
    if rectangles:
        columns["dip_deg"] = _numbers(path, "dip_deg", [p.get("dip_deg", 0.0) for p in properties])
        columns |= _rectangles(columns, kind)
    return columns


def _numbers(path: str | os.PathLike[str], name: str, values: list[Any]) -> NDArray[np.float64]:
    for i, value in enumerate(values):
        if not is_number(value):
            raise InputError(f"{path}, features[{i}]: {name} = {value!r} is not a number")
    return np.array(values, dtype=np.float64)


def _rows(path: str | os.PathLike[str], kind: str | None) -> dict[str, NDArray[Any]]:
    columns = read_columns(
        path,
        (),
        optional=(*NUMBERS, *SIGMAS, *RECTANGLE, *PORTFOLIO, "lon", "lat", "weight", "restitution"),
        texts=("block_id", "site_id", "kind"),
    )
    if is_of_rectangles(columns):
        columns |= _rectangles(columns, kind)
    for name in NUMBERS:
        if name not in columns:
            raise InputError(
                f"{path}: there is no column {name}: a table of blocks has p2_1_s2 and kr, or "
                "height_m and width_m"
            )
    for name in {*SIGMAS} & {*columns}:
        columns[name] = np.nan_to_num(columns[name], nan=0.0, posinf=math.inf)
    if ("lon" in columns) != ("lat" in columns):
        raise InputError(f"{path}: lon and lat go together: give both columns, or neither")
    if "block_id" not in columns:
        columns["block_id"] = np.array(
            [str(i + 1) for i in range(columns["kr"].size)], dtype=object
        )
    return columns


def _rectangles(columns: Mapping[str, NDArray[Any]], kind: str | None) -> dict[str, NDArray[Any]]:
    """Return the numbers of rectangles, each by its kind: those of free-standing ones differ."""
    backed = rectangle_columns(columns)
    kinds = columns.get("kind", [""] * backed["kr"].size)
    known = [str(one) or kind for one in kinds]
    free = np.array([one is not None and model_of_kind(one).free_standing for one in known])
    if not free.any():
        return backed
    free_standing = rectangle_columns(columns, free_standing=True)
    numbers_of = {name: np.where(free, free_standing[name], backed[name]) for name in NUMBERS}
    stated = columns.get("restitution", np.full(free.size, np.nan))
    own = np.where(free & np.isnan(stated), free_standing["restitution"], stated)
    return {**numbers_of, "restitution": own}
