"""Points with properties: GeoJSON (RFC 7946: WGS 84, longitude first) and GeoPackage layers."""

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
            lists = [_finite_or_null(columns[name][rows]) for name in names]
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


def _finite_or_null(column: NDArray[Any]) -> list[Any]:
    values: list[Any] = column.tolist()
    if column.dtype.kind == "f":
        return [value if np.isfinite(value) else None for value in values]
    return values


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
