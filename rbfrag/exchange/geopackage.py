"""Points with attributes as a GeoPackage layer, for QGIS and others."""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError


def pyogrio() -> Any:
    """Return pyogrio's array interface, or say which extra brings it."""
    try:
        from pyogrio import raw
    except ImportError:
        raise MissingExtraError("GeoPackage files need pyogrio", "gis") from None
    return raw


def write_geopackage(columns: Mapping[str, NDArray[Any]], layer: str, target: Path) -> None:
    """Write rows with lon and lat as points of one layer in WGS 84.

    Args:
        columns: arrays of one length by name, ``lon`` and ``lat`` [deg] among them.
        layer: name of the layer.
        target: file to write; an existing file is replaced at the end, not before.

    Raises:
        InputError: the disk refuses.
        MissingExtraError: pyogrio is not installed.
    """
    raw = pyogrio()
    names = [name for name in columns if name not in ("lon", "lat")]
    # well-known binary: little-endian, type 1 (point), x, y
    points = np.array(
        [
            struct.pack("<BIdd", 1, 1, x, y)
            for x, y in zip(columns["lon"].tolist(), columns["lat"].tolist(), strict=True)
        ],
        dtype=object,
    )
    data = [
        np.asarray(columns[name], dtype=object)
        if columns[name].dtype.kind in "OU"
        else columns[name]
        for name in names
    ]
    partial = target.with_name(f".{target.stem}.{os.getpid()}.part.gpkg")
    try:
        raw.write(
            str(partial), points, data, fields=names, layer=layer, driver="GPKG",
            geometry_type="Point", crs="EPSG:4326",
        )  # fmt: skip
        partial.replace(target)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{target} cannot be written: {error}") from None
    finally:
        partial.unlink(missing_ok=True)
