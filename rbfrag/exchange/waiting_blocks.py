"""Blocks that wait for an earthquake: the tables that rates, maps and exports start from."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_columns import read_columns, read_names, read_texts
from rbfrag.exchange.geojson import SUFFIXES as GEOJSON
from rbfrag.exchange.geojson import read_points


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
