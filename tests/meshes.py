"""Closed surfaces whose volume, inertia and contacts have closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Surface = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices, shape (n, 3) [m], and triangles that run counter-clockwise seen from outside."""


def prism(outline: NDArray[np.float64], depth: float) -> Surface:
    """A convex outline in x and z, counter-clockwise seen from -y, drawn out along y."""
    count = len(outline)
    front, back = (
        np.column_stack([outline[:, 0], np.full(count, y), outline[:, 1]])
        for y in (-0.5 * depth, 0.5 * depth)
    )
    faces = []
    for i in range(count):
        j = (i + 1) % count
        faces += [(i, i + count, j + count), (i, j + count, j)]
        if 0 < i < count - 1:
            faces += [(0, i, i + 1), (count, count + i + 1, count + i)]
    return np.vstack([front, back]), np.array(faces)


def box(width: float, depth: float, height: float) -> Surface:
    """A box on z = 0, width along x and depth along y."""
    x = 0.5 * width
    return prism(np.array([(-x, 0.0), (x, 0.0), (x, height), (-x, height)]), depth)


def turned(surface: Surface, axis: str, angle_deg: float) -> Surface:
    """The surface turned about an axis through the origin, by the right-hand rule."""
    vertices, faces = surface
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    k = "xyz".index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    result = vertices.copy()
    result[:, i] = c * vertices[:, i] - s * vertices[:, j]
    result[:, j] = s * vertices[:, i] + c * vertices[:, j]
    return result, faces


def cut_ellipsoid(semi_axes: tuple[float, float, float], cut: float, rings: int) -> Surface:
    """An ellipsoid without what lies below -cut times its third semi-axis, by rings of facets."""
    around = 4 * rings
    turn = 2.0 * np.pi * np.arange(around) / around
    vertices = [(0.0, 0.0, -cut)]
    for polar in np.linspace(np.arccos(-cut), 0.0, rings + 1)[:-1]:
        sine, cosine = np.sin(polar), np.cos(polar)
        vertices += [(sine * np.cos(t), sine * np.sin(t), cosine) for t in turn]
    vertices.append((0.0, 0.0, 1.0))
    faces = []
    for i in range(around):
        j = (i + 1) % around
        faces.append((0, 1 + j, 1 + i))
        for ring in range(rings - 1):
            low, high = 1 + ring * around, 1 + (ring + 1) * around
            faces += [(low + i, low + j, high + j), (low + i, high + j, high + i)]
        top = 1 + (rings - 1) * around
        faces.append((top + i, top + j, len(vertices) - 1))
    return np.array(vertices) * semi_axes, np.array(faces)


def write_obj(path: Path, surface: Surface) -> Path:
    """Write a surface to the last digit, and return the path."""
    vertices, faces = surface
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {i} {j} {k}" for i, j, k in (faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path
