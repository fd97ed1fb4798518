"""Points with properties: GeoJSON (RFC 7946: WGS 84, longitude first) and GeoPackage layers."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.files import is_number, json_document, source_text, written_whole

SUFFIXES = (".geojson", ".json")
"""File types of GeoJSON."""

_ROWS = 1 << 13


def read_points(path: str | os.PathLike[str]) -> list[tuple[float, float, dict[str, Any]]]:
    """Return longitude, latitude and properties of every point of a FeatureCollection."""
    text = source_text(path, "GeoJSON")
    try:
        document = json_document(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    features = document.get("features") if isinstance(document, dict) else None
    if not isinstance(features, list) or document.get("type") != "FeatureCollection":
        raise InputError(f"{path}: not a GeoJSON FeatureCollection")
    points = []
    for i, feature in enumerate(features):
        where = f"{path}, features[{i}]"
        geometry = feature.get("geometry") if isinstance(feature, dict) else None
        if not isinstance(geometry, dict) or geometry.get("type") != "Point":
            raise InputError(f"{where}: the geometry is no Point")
        place = geometry.get("coordinates")
        if not isinstance(place, list) or len(place) < 2 or not all(map(is_number, place[:2])):
            raise InputError(f"{where}: coordinates are no [longitude, latitude]")
        lon, lat = float(place[0]), float(place[1])
        if not (abs(lon) <= 180.0 and abs(lat) <= 90.0):
            raise InputError(f"{where}: lon = {lon:g}, lat = {lat:g} lies off the map")
        properties = feature.get("properties") or {}
        if not isinstance(properties, dict):
            raise InputError(f"{where}: properties are no object")
        points.append((lon, lat, properties))
    return points


def write_points(
    columns: Mapping[str, NDArray[Any]], about: Mapping[str, Any], target: Path
) -> None:
    """Write rows with lon and lat as points; the other columns are their properties.

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
            some = slice(start, start + _ROWS)
            lists = [_finite_or_null(columns[name][some]) for name in names]
            places = zip(columns["lon"][some].tolist(), columns["lat"][some].tolist())  # noqa: B905
            lines = [
                json.dumps(
                    {
                        "type": "Feature",
                        "geometry": {"type": "Point", "coordinates": list(place)},
                        "properties": dict(zip(names, row, strict=True)),
                    },
                    ensure_ascii=False,
                    allow_nan=False,
                )
                for place, row in zip(places, zip(*lists, strict=True), strict=True)
            ]
            file.write((",\n" if start else "") + ",\n".join(lines))
        file.write("\n]}\n")


def _finite_or_null(column: NDArray[Any]) -> list[Any]:
    values: list[Any] = column.tolist()
    if column.dtype.kind == "f":
        return [value if np.isfinite(value) else None for value in values]
    return values


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
    with written_whole(target) as partial:
        try:
            raw.write(
                str(partial), points, data, fields=names, layer=layer, driver="GPKG",
                geometry_type="Point", crs="EPSG:4326",
            )  # fmt: skip
        except RuntimeError as error:
            raise OSError(str(error)) from None
