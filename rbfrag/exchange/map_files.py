"""Maps as files: points as GeoJSON (RFC 7946: WGS 84, longitude first), GeoPackage, GeoTIFF."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.tables.parts import TablePart
from rbfrag.files import is_number, json_document, source_text, written_whole
from rbfrag.results.diagnostic import as_documents
from rbfrag.solver.quantity import json_value

SUFFIXES = (".geojson", ".json")
"""File types of GeoJSON."""

_ROWS = 1 << 13


def read_points(path: str | os.PathLike[str]) -> TablePart:
    """Return the features of a FeatureCollection as rows of a table: lon, lat [deg], properties.

    A feature that is no point has no place: its lon and lat are NaN.
    """
    text = source_text(path, "GeoJSON")
    try:
        document = json_document(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    features = document.get("features") if isinstance(document, dict) else None
    if not isinstance(features, list) or document.get("type") != "FeatureCollection":
        raise InputError(f"{path}: not a GeoJSON FeatureCollection")
    lon, lat = coordinates = np.full((2, len(features)), np.nan)
    rows: list[Mapping[str, Any]] = []
    for i, feature in enumerate(features):
        members = _object(feature)
        geometry = _object(members.get("geometry"))
        place = geometry.get("coordinates") if geometry.get("type") == "Point" else None
        if isinstance(place, list) and len(place) >= 2 and all(map(is_number, place[:2])):
            coordinates[:, i] = place[:2]
        rows.append(_object(members.get("properties")))
    names = dict.fromkeys(name for row in rows for name in row)
    cells: dict[str, Any] = {name: [row.get(name) for row in rows] for name in names}
    return TablePart(range(1, len(rows) + 1), {**cells, "lon": lon, "lat": lat})


def _object(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def write_points(
    columns: Mapping[str, NDArray[Any]], about: Mapping[str, Any], target: Path
) -> None:
    """Write rows with lon and lat as points; the other columns are their properties.

    A row without a place on the map has no geometry.

    Args:
        columns: arrays of one length by name, ``lon`` and ``lat`` [deg] among them.
        about: members of the collection itself, such as the model that answered.
        target: file to write, whole or not at all.
    """
    names = [name for name in columns if name not in ("lon", "lat")]
    size = len(columns["lon"])
    head = json.dumps({"type": "FeatureCollection", **about}, ensure_ascii=False)[:-1]
    with (
        written_whole(target) as partial,
        partial.open("w", encoding="utf-8", newline="\n") as file,
    ):
        file.write(head + ', "features": [\n')
        for start in range(0, size, _ROWS):
            rows = slice(start, start + _ROWS)
            lists = [[*map(json_value, columns[name][rows].tolist())] for name in names]
            coordinates = _lon_lat(columns, rows)
            lines = [
                json.dumps(
                    {
                        "type": "Feature",
                        "geometry": place and {"type": "Point", "coordinates": place},
                        "properties": dict(zip(names, row, strict=True)),
                    },
                    ensure_ascii=False,
                    allow_nan=False,
                )
                for place, row in zip(coordinates, zip(*lists, strict=True), strict=True)
            ]
            file.write((",\n" if start else "") + ",\n".join(lines))
        file.write("\n]}\n")


def _lon_lat(columns: Mapping[str, NDArray[Any]], rows: slice) -> list[list[float] | None]:
    """Return longitude and latitude of rows; None where they are outside the map."""
    pairs = np.column_stack([columns["lon"][rows], columns["lat"][rows]])
    on_map = (np.abs(pairs) <= (180.0, 90.0)).all(axis=1)
    return [p if valid else None for p, valid in zip(pairs.tolist(), on_map, strict=True)]


def pyogrio() -> Any:
    """Return pyogrio's array interface, or name the extra that installs it."""
    try:
        from pyogrio import raw
    except ImportError:
        raise MissingExtraError("GeoPackage files require pyogrio", "gis") from None
    return raw


def write_geopackage(
    columns: Mapping[str, NDArray[Any]], layer: str, target: Path, notes: Sequence[str] = ()
) -> None:
    """Write rows with lon and lat as points of one layer in WGS 84, and notes as a table.

    Args:
        columns: arrays of one length by name, ``lon`` and ``lat`` [deg] among them.
        layer: name of the layer.
        target: file to write; an existing file is replaced at the end, not before.
        notes: warnings: the table ``notes``.
    """
    raw = pyogrio()
    names = [name for name in columns if name not in ("lon", "lat")]
    # well-known binary: little-endian, type 1 (point), x, y
    points = np.array(
        [
            None if place is None else struct.pack("<BIdd", 1, 1, *place)
            for place in _lon_lat(columns, slice(None))
        ],
        dtype=object,
    )
    data = [
        np.asarray(columns[name], dtype=object)
        if columns[name].dtype.kind in "OU"
        else columns[name]
        for name in names
    ]
    with written_whole(target) as partial:
        try:
            raw.write(
                str(partial), points, data, fields=names, layer=layer, driver="GPKG",
                geometry_type="Point", crs="EPSG:4326",
            )  # fmt: skip
            if notes:
                documents = as_documents(notes)
                texts = [
                    np.array([document[name] for document in documents], dtype=object)
                    for name in ("code", "text")
                ]
                raw.write(
                    str(partial), None, texts, fields=["code", "note"], layer="notes",
                    driver="GPKG", geometry_type=None, crs=None, append=True,
                )  # fmt: skip
        except RuntimeError as error:
            raise OSError(str(error)) from None


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
