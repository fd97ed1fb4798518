"""Make the coast and the borders that maps are drawn on from Natural Earth's 1:10m land.

    npm pack world-atlas@2.0.2 && tar xf world-atlas-2.0.2.tgz
    python -m benchmarks.coastline package rbfrag/plots/world

The npm package `world-atlas` has Natural Earth 4.1.0, which is in the public domain, as TopoJSON:
arcs of whole numbers on a grid of 0.0036° x 0.0017°. Arcs that one country alone has are coasts,
arcs that two share are borders. They are simplified (Douglas and Peucker 1973) and kept as they
are on that grid, as differences.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

TOLERANCE_DEG = 0.004
"""Greatest distance of a point that is left out from the line: 450 m, the step of the grid."""

SOUTHERNMOST_DEG = -60.0
"""Antarctica is left out."""


def arcs_of(geometry: dict[str, Any]) -> Iterator[int]:
    """Yield the numbers of the arcs of a geometry, whichever way they run."""
    for part in geometry.get("geometries", ()):
        yield from arcs_of(part)
    stack = list(geometry.get("arcs", ()))
    while stack:
        span = stack.pop()
        if isinstance(span, list):
            stack += span
        else:
            yield ~span if span < 0 else span


def simplified(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return which points of a line to keep, so that no other is farther from it (n,)."""
    is_retained = np.zeros(len(points), dtype=bool)
    is_retained[[0, -1]] = True
    open_parts = [(0, len(points) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        if last - first < 2:
            continue
        inside = points[first + 1 : last] - points[first]
        chord = points[last] - points[first]
        length = float(np.hypot(*chord))
        if length == 0.0:
            off = np.hypot(*inside.T)
        else:
            along = np.clip(inside @ chord / length**2, 0.0, 1.0)
            off = np.hypot(*(inside - along[:, None] * chord).T)
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = first + 1 + worst
            is_retained[middle] = True
            open_parts += [(first, middle), (middle, last)]
    return is_retained


def parts_off_the_seam(lon: np.ndarray) -> list[slice]:
    """Return the parts of a line that neither run along the meridian of 180° nor jump over it."""
    seam = np.abs(lon) > 179.99
    along = (seam[1:] & seam[:-1]) | (np.abs(np.diff(lon)) > 180.0)
    edges = [0, *(np.flatnonzero(along) + 1), lon.size]
    return [slice(a, b) for a, b in pairwise(edges) if b - a > 1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("package", type=Path, help="the unpacked npm package world-atlas")
    parser.add_argument("out", type=Path, help="folder of coast.npz")
    options = parser.parse_args()
    atlas = json.loads((options.package / "countries-10m.json").read_text(encoding="utf-8"))
    scale = np.array(atlas["transform"]["scale"])
    translate = np.array(atlas["transform"]["translate"])
    countries = atlas["objects"]["countries"]["geometries"]
    uses = Counter(arc for country in countries for arc in set(arcs_of(country)))
    lines, is_border = [], []
    for number, count in sorted(uses.items()):
        grid = np.cumsum(np.array(atlas["arcs"][number]), axis=0)
        lonlat = grid * scale + translate
        if lonlat[:, 1].mean() < SOUTHERNMOST_DEG:
            continue
        # degrees of longitude count as far as they are at this latitude
        flat = lonlat * [np.cos(np.radians(lonlat[:, 1].mean())), 1.0]
        for part in parts_off_the_seam(lonlat[:, 0]):
            lines.append(grid[part][simplified(flat[part], TOLERANCE_DEG)])
            is_border.append(count > 1)
    steps = np.concatenate([np.diff(line, axis=0, prepend=0) for line in lines])
    np.savez_compressed(
        options.out / "coast.npz",
        steps=steps.T.astype(np.int32),
        lengths=np.array([len(line) for line in lines], dtype=np.int32),
        is_border=np.array(is_border),
        scale=scale,
        translate=translate,
    )
    size = (options.out / "coast.npz").stat().st_size
    print(f"{len(lines)} lines, {len(steps)} points, {size:,} bytes")


if __name__ == "__main__":
    main()
