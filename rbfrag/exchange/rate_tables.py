"""Annual rates of blocks as tables: as `hazard` writes them, and for rockfall propagation tools.

A row for such a tool is a block at its place, with its size and how often per year it comes loose.
The tools read places, masses or sizes, and none a rate: what they answer is joined by
``release_id``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import PLACE, BlockRows, Blocks, read_blocks
from rbfrag.exchange.tables.files import write_block_table
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.question.classify import numbers_in
from rbfrag.question.sections import in_sections
from rbfrag.question.shape_validation import SHAPES
from rbfrag.results.diagnostic import codes_by_row
from rbfrag.solver.block.arrays import BlockArray
from rbfrag.solver.kinds import KINDS
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import SPACE, column_of


def rate_columns(
    answer: HazardAnswer, columns: Mapping[str, Any], rows: BlockRows | None = None
) -> dict[str, NDArray[Any]]:
    """Return the columns of the table of annual rates, one row a block.

    Args:
        columns: ``block_id`` and numbers of the blocks.
        rows: the table of blocks; what cannot be used of it has its ``reason``.
    """
    size, curves, nothing = answer.annual_rate.size, answer.curves, float("nan")
    # p² and k_r, and the parameters of other kinds; a class of blocks has none of its own
    numbers = numbers_in(columns)
    parameters = [name for facts in KINDS.values() for name in facts.parameters if name in numbers]
    is_class = len(columns["kind"]) != size
    place = np.array([curve.place for curve in curves], dtype=object)[answer.site]
    lon, lat = (
        np.array([nothing if value is None else value for value in values])[answer.site]
        for values in ([curve.lon for curve in curves], [curve.lat for curve in curves])
    )
    number_columns: dict[str, Any] = {
        "lon": lon,
        "lat": lat,
        **{
            column_of(name): nothing if is_class else numbers.get(name, nothing)
            for name in dict.fromkeys((*TOPPLING_BLOCK.names, *parameters))
        },
        **answer.rate_columns,
        "years": answer.years,
    }
    result: dict[str, NDArray[Any]] = {
        "site": place,
        "block_id": np.array(
            ["" if name is None else str(name) for name in columns["block_id"]][:size], dtype=object
        ),
    }
    for name, values in number_columns.items():
        result[name] = np.broadcast_to(np.asarray(values, dtype=np.float64), (size,))
    if rows is not None:
        if "count" in columns:
            result["count"] = np.asarray(columns["count"])
        codes = codes_by_row(rows.remarks, rows.reasons.size)
        result["warnings"] = codes[np.asarray(columns["row"])]
    result["reason"] = np.full(size, "", dtype=object)
    if rows is None:
        return result
    nowhere = np.full(rows.reasons.size, "", dtype=object)
    columns_of_rows = {**rows.columns, "site": rows.columns.get("site_id", nowhere)}
    return replace(rows, columns=columns_of_rows).with_rejected(result, columns["row"])


SIDES = (*dict.fromkeys(name for names in SHAPES for name in names), *SPACE, "density_kg_m3")
"""Fields that the size and the mass of a block follow from."""

RELEASE = (*PLACE, "x", "y", "z", "strike_length_m", *SIDES)
"""Columns of blocks that the table is made of, in addition to their names and ``crs``."""

LON_LAT = "EPSG:4326"
"""Coordinate reference system of lon and lat."""


def write_release_rates(answer: HazardAnswer, blocks: Blocks, path: str | os.PathLike[str]) -> Path:
    """Write annual rates of blocks as a release table for rockfall propagation tools.

    The columns are ``release_id, x, y, z, crs, volume_m3, mass_kg, density_kg_m3, annual_rate,
    rate_low, rate_high, kind, d1_m, d2_m, d3_m``: the dimensions are those normal to the base,
    along it and along the slope. What is not stated of a block stays empty: it has a volume only
    with ``strike_length_m``, its length along the slope. Blocks without a rate are left out.

    Args:
        answer: of :func:`rbfrag.hazard`, for all of the blocks in their order.
        blocks: the blocks as a table, its file or columns by name: what their shape is, and, if
            there are, ``block_id``, places by ``lon`` and ``lat`` [deg] or by ``x``, ``y``, ``z``
            [m] and ``crs``, ``strike_length_m`` [m] and ``density_kg_m3`` [kg/m³].
        path: file to write, ``.csv``, ``.xlsx`` or ``.parquet``; an existing file is replaced.

    Raises:
        InputError: the blocks are not those of the answer, or x and y stand without crs.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    columns = read_blocks(blocks, reads=RELEASE).columns
    return write_block_table(release_columns(answer, columns), path, notes=answer.warnings)


def release_columns(answer: HazardAnswer, columns: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the columns of the release table.

    Args:
        columns: what there is of :data:`RELEASE`, ``block_id`` and ``crs``, each of the blocks of
            the answer.

    Raises:
        InputError: as of :func:`write_release_rates`.
    """
    size = answer.annual_rate.size
    if len(columns["block_id"]) != size or len(answer.kinds) != size:
        raise InputError(
            f"the answer has {size:,} rates and the table {len(columns['block_id']):,} blocks: "
            "give the blocks that were asked about, each with a rate of its own"
        )

    def of(name: str) -> FloatArray:
        return np.asarray(columns.get(name, np.full(size, np.nan)), dtype=np.float64)

    names = [str(name or i + 1) for i, name in enumerate(columns["block_id"])]
    if len({*names}) < size:  # a row is one place of a block
        names = [f"{name}-{i + 1}" for i, name in enumerate(names)]
    # x and y in a system of their own, or else lon and lat
    x, y, lon, lat = (of(name) for name in ("x", "y", *PLACE))
    crs = np.asarray(columns.get("crs", [""] * size), dtype=object)
    is_projected = ~np.isnan(x) & ~np.isnan(y)
    if (is_projected & (crs == "")).any():
        raise InputError("x and y require crs, such as EPSG:2056")
    on_map = ~is_projected & ~np.isnan(lon) & ~np.isnan(lat)
    x, y = (
        np.where(is_projected, projected, np.where(on_map, other, np.nan))
        for projected, other in ((x, lon), (y, lat))
    )
    crs = np.where(is_projected, crs, np.where(on_map, LON_LAT, ""))
    height, base = _sides(columns, size)
    length, density = of("strike_length_m"), of("density_kg_m3")
    for name, values in (("strike_length_m", length), ("density_kg_m3", density)):
        if (values <= 0.0).any():
            raise InputError(f"{name} = {values[values <= 0.0][0]:g}: give a number above 0")
    volume = height * base * length
    table = {
        "release_id": np.array(names, dtype=object), "x": x, "y": y, "z": of("z"), "crs": crs,
        "volume_m3": volume, "mass_kg": density * volume, "density_kg_m3": density,
        "annual_rate": answer.annual_rate, "rate_low": answer.ci_low, "rate_high": answer.ci_high,
        "kind": answer.kinds, "d1_m": height, "d2_m": base, "d3_m": length,
    }  # fmt: skip
    has_rate = ~np.isnan(answer.annual_rate)
    return {name: values[has_rate] for name, values in table.items()}


def _sides(columns: Mapping[str, Any], size: int) -> tuple[FloatArray, FloatArray]:
    """Return block thickness normal to the base, and base length [m]; NaN where unknown."""
    sides = {name: np.asarray(columns[name]) for name in SIDES if name in columns}
    if sides.keys() & {*SPACE}:
        sides, _, _ = in_sections(sides, size)
    height, base = np.full((2, size), np.nan)
    for names, way in SHAPES.items():
        if not sides.keys() >= {*names}:
            continue
        block = getattr(BlockArray, way)(*(sides[name] for name in names))
        height = np.where(np.isnan(height), 2.0 * block.half_s1_m, height)
        base_length = block.half_s1_m * (block.tan_alpha3 - block.tan_alpha1)
        base = np.where(np.isnan(base), base_length, base)
    return height, base
