"""Maps on a regular grid as GeoTIFF files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.files import written_whole

_OFF = 0.1
"""How far a node may lie off its cell's centre, in cells: coordinates in files are rounded."""


def write_geotiff(
    columns: Mapping[str, NDArray[Any]], about: Mapping[str, Any], target: Path
) -> None:
    """Write columns at the nodes of a regular grid as bands of their names, in WGS 84.

    A cell has its node in the middle; a cell without a node, and a value that is not known, is NaN,
    which is the nodata value of the file.

    Args:
        columns: arrays of one length by name, ``lon`` and ``lat`` [deg] among them; texts, and
            what is NaN throughout, are left out.
        about: tags of the file, such as the model that answered.
        target: file to write; an existing file is replaced at the end, not before.

    Raises:
        InputError: the nodes are not those of a regular grid.
        MissingExtraError: rasterio is not installed.
    """
    try:
        import rasterio
    except ImportError:
        raise MissingExtraError("GeoTIFF files require rasterio", "gis") from None
    column, width, west, dx = _cells(columns["lon"])
    row, height, north, dy = _cells(-columns["lat"])
    if np.unique(row * width + column).size != row.size:
        raise InputError("two nodes of the map have the same coordinates: use .gpkg or .csv")
    bands = {
        name: values
        for name, values in columns.items()
        if name not in ("lon", "lat") and values.dtype.kind in "fb" and not np.isnan(values).all()
    }
    raster = np.full((len(bands), height, width), np.nan, dtype=np.float32)
    raster[:, row, column] = [*bands.values()]
    tags = {name: str(value) for name, value in about.items() if value not in (None, "")}
    with (
        written_whole(target) as partial,
        rasterio.open(
            partial, "w", driver="GTiff", dtype="float32", nodata=np.nan, crs="EPSG:4326",
            count=len(bands), height=height, width=width, compress="deflate",
            transform=rasterio.Affine(dx, 0.0, west - dx / 2, 0.0, -dy, dy / 2 - north),
        ) as file,
    ):  # fmt: skip
        file.write(raster)
        file.update_tags(**tags)
        for i, name in enumerate(bands, start=1):
            file.set_band_description(i, name)


def _cells(at: NDArray[np.float64]) -> tuple[NDArray[np.intp], int, float, float]:
    """Return cell of each node along one axis, number of cells, first centre and step [deg]."""
    steps = np.diff(np.unique(at))
    # nodes of one row that differ in their last digits are not a step
    steps = steps[steps > 0.5 * steps.max(initial=0.0)]
    if steps.size:
        first, last = float(at.min()), float(at.max())
        number = round((last - first) / float(np.median(steps)))
        step = (last - first) / number
        cell = np.rint((at - first) / step)
        if (np.abs(at - first - cell * step) <= _OFF * step).all():
            return cell.astype(np.intp), number + 1, first, step
    raise InputError("GeoTIFF requires a regular grid of at least 2 x 2 nodes: use .gpkg or .csv")
