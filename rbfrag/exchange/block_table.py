"""The block table that commands pass to each other, as CSV, Parquet or GeoJSON points."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.excel_text import as_text, as_written, changed_texts
from rbfrag.exchange.points import SUFFIXES as GEOJSON
from rbfrag.exchange.points import read_points
from rbfrag.exchange.tables.files import table_parts, table_path, table_source, table_writer
from rbfrag.exchange.tables.parts import Part, cells_of
from rbfrag.files import is_number, reading, written_whole
from rbfrag.solver.block.formulas import array_elementwise
from rbfrag.solver.described import rectangle_numbers
from rbfrag.solver.kinds import model_of_kind

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
        path: file to write, ``.csv``, ``.xlsx`` or ``.parquet``; an existing file is replaced.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).
    """
    target = table_path(path)
    if excel_text and target.suffix.lower() == ".csv":
        columns = changed_texts(columns, as_text)
    length = len(next(iter(columns.values())))
    with written_whole(target, "table") as partial, ExitStack() as stack:
        write = table_writer(partial, [*columns], stack=stack)
        write(Part(range(length), dict(columns)), {})
    return target


def read_columns(
    path: str | os.PathLike[str],
    names: Sequence[str],
    *,
    optional: Sequence[str] = (),
    texts: Sequence[str] = (),
    faults: dict[int, str] | None = None,
) -> dict[str, NDArray[Any]]:
    """Return columns of a block table by name; an empty number is NaN.

    Args:
        path: file ending in ``.csv``, ``.xlsx`` or ``.parquet``.
        names: columns of numbers that must be there.
        optional: further columns of numbers, where the table has them.
        texts: columns of texts, where the table has them.
        faults: takes what is wrong with rows, by their index; their numbers are NaN. None refuses
            a table that has such rows.

    Raises:
        InputError: the file cannot be read, lacks a column, or a cell holds no number; the
            message names the line.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    source = table_source(path)
    try:
        with reading(source, "a block table"), ExitStack() as stack:
            wanted = (*names, *optional)
            header, parts, _ = table_parts(source, wanted, stack)
            for name in names:
                if name not in header:
                    have = ", ".join(header) or "none"
                    raise InputError(f"{source}: there is no column {name}; the columns are {have}")
            collected: dict[str, list[NDArray[Any]]] = {
                name: [np.empty(0, dtype=object if name in texts else np.float64)]
                for name in (*wanted, *texts)
                if name in header
            }
            done = 0
            for part in parts:
                wrong = dict(part.faults)
                for name, arrays in collected.items():
                    if name in texts:
                        cells = [
                            checked_name(
                                as_written(str(cell).strip()), f"{source}: a cell of {name}"
                            )
                            for cell in cells_of(part.cells[name])
                        ]
                        arrays.append(np.array(cells, dtype=object))
                    else:
                        values, others = part.numbers(name)
                        wrong = others | wrong
                        arrays.append(values)
                if wrong and faults is None:
                    i = min(wrong)
                    raise InputError(f"{source}, line {part.lines[i]}: {wrong[i]}")
                if faults is not None:
                    faults.update({done + i: fault for i, fault in wrong.items()})
                done += len(part.lines)
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
    """Return the blocks of a table (.csv, .xlsx, .parquet) or of GeoJSON points as columns.

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
    columns = _points(path, kind) if _is_points(path) else _rows(path, kind, None)
    reasons = _reasons(columns)
    bad = np.flatnonzero(reasons != "")
    if bad.size:
        others = f"; so it is with {bad.size - 1:,} more rows" if bad.size > 1 else ""
        block = columns["block_id"][bad[0]]
        raise InputError(f"{path}: block {block} {reasons[bad[0]]}{others}")
    return _weighed(columns, path)


def blocks_and_refused(
    path: str | os.PathLike[str], kind: str | None = None
) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """Return the blocks of a table, and its rows that are none, with their reasons.

    Args:
        path: as for :func:`waiting_blocks`.
        kind: likewise.

    Returns:
        Columns of the blocks, and of the other rows with ``reason``; both with ``row``, the index
        in the table.

    Raises:
        InputError: the file cannot be read, or no row of it is a block.
    """
    faults: dict[int, str] = {}
    columns = _points(path, kind) if _is_points(path) else _rows(path, kind, faults)
    reasons = _reasons(columns)
    for i, fault in faults.items():
        reasons[i] = fault
    columns |= {"row": np.arange(reasons.size), "reason": reasons}
    sound = np.asarray(reasons == "", dtype=bool)
    if not sound.any():
        waiting_blocks(path, kind)  # refuses the first
    blocks = {name: column[sound] for name, column in columns.items() if name != "reason"}
    return _weighed(blocks, path), {name: column[~sound] for name, column in columns.items()}


def _is_points(path: str | os.PathLike[str]) -> bool:
    return str(path).lower().endswith(GEOJSON)


def _weighed(
    columns: dict[str, NDArray[Any]], path: str | os.PathLike[str]
) -> dict[str, NDArray[Any]]:
    if columns["kr"].size == 0:
        raise InputError(f"{path}: there is no block in the file")
    if "weight" in columns and not columns["weight"].sum() > 0.0:
        raise InputError(f"{path}: the weights of the blocks sum to zero")
    return columns


def _reasons(columns: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Return why rows are no blocks that wait for an earthquake; empty texts for those that are."""
    p2, kr = columns["p2_1_s2"], columns["kr"]
    reasons = np.full(kr.size, "", dtype=object)

    def say(good: NDArray[np.bool_], text: Callable[[int], str]) -> None:
        for i in np.flatnonzero(~good & (reasons == "")).tolist():
            reasons[i] = text(i)

    with np.errstate(invalid="ignore"):
        say(
            (p2 > 0.0) & (kr > 0.0) & np.isfinite(p2) & np.isfinite(kr),
            lambda i: (
                f"has p2_1_s2 = {p2[i]:g} and kr = {kr[i]:g}: a block that waits for an "
                "earthquake has both above zero (an unstable one has already failed)"
            ),
        )
        if "lon" in columns:
            lon, lat = columns["lon"], columns["lat"]
            say(
                (np.abs(lon) <= 180.0) & (np.abs(lat) <= 90.0),
                lambda i: f"at lon = {lon[i]:g}, lat = {lat[i]:g} lies off the map",
            )
        for name in {*SIGMAS} & {*columns}:
            sigma = columns[name]
            say(
                (sigma >= 0.0) & (sigma < math.inf),
                partial(_negative, name, sigma),
            )
        if "weight" in columns:
            say(columns["weight"] >= 0.0, lambda _: "has a weight below zero")
    return reasons


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


def _negative(name: str, sigma: NDArray[np.float64], i: int) -> str:
    return f"has {name} = {sigma[i]:g}: give 0 or more"


def _rows(
    path: str | os.PathLike[str], kind: str | None, faults: dict[int, str] | None
) -> dict[str, NDArray[Any]]:
    columns = read_columns(
        path,
        (),
        optional=(*NUMBERS, *SIGMAS, *RECTANGLE, *PORTFOLIO, "lon", "lat", "weight", "restitution"),
        texts=("block_id", "site_id", "kind"),
        faults=faults,
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
