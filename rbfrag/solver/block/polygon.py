"""Area, centroid and second moment of a polygon, and its validity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rbfrag.errors import InputError

Point = tuple[float, float]


@dataclass(frozen=True)
class PolygonProperties:
    """Area, centroid and inertia of an outline.

    Args:
        area_m2: area [m²].
        centroid: centroid in the coordinates of the vertices [m].
        inertia_m2: second moment about the centroid per mass [m²].
    """

    area_m2: float
    centroid: Point
    inertia_m2: float


def polygon_properties(vertices: Sequence[Point]) -> PolygonProperties:
    """Return area, centroid and inertia of a simple polygon (corrected eq. 4.26).

    The cross products are signed, so that the polygon need not be convex.

    Args:
        vertices: corners in counter-clockwise order [m].
    """
    # From its own middle, a small block far from the origin loses no digits.
    mid_x = math.fsum(x for x, _ in vertices) / len(vertices)
    mid_y = math.fsum(y for _, y in vertices) / len(vertices)
    local = [(x - mid_x, y - mid_y) for x, y in vertices]
    crosses = [cross(a, b) for a, b in _edges(local)]
    doubled = math.fsum(crosses)
    edges = list(zip(crosses, _edges(local), strict=True))
    cx = math.fsum(c * (a[0] + b[0]) for c, (a, b) in edges) / (3.0 * doubled)
    cy = math.fsum(c * (a[1] + b[1]) for c, (a, b) in edges) / (3.0 * doubled)
    about_middle = math.fsum(c * (_dot(a, a) + _dot(a, b) + _dot(b, b)) for c, (a, b) in edges) / (
        6.0 * doubled
    )
    return PolygonProperties(
        area_m2=0.5 * doubled,
        centroid=(mid_x + cx, mid_y + cy),
        inertia_m2=about_middle - cx * cx - cy * cy,
    )


def extent_m(vertices: Sequence[Point]) -> float:
    """Return the diagonal of the rectangle around the vertices [m]."""
    xs, ys = zip(*vertices, strict=True)
    return math.hypot(max(xs) - min(xs), max(ys) - min(ys))


def checked_polygon(vertices: object) -> tuple[Point, ...]:
    """Return the corners of a simple counter-clockwise polygon as floats.

    Raises:
        InputError: fewer than three corners, a corner that is no pair of finite numbers or
            repeats the one before it, edges that cross or touch, clockwise order.
    """
    points = _points(vertices)
    count = len(points)
    if count < 3:
        raise InputError(f"a polygon block has at least 3 vertices, not {count}")
    size = extent_m(points)
    if not 1e-60 < size < 1e60 or any(abs(number) > 1e60 for point in points for number in point):
        raise InputError(f"vertices that span {size:g} m are out of range: give metres")
    for i, (a, b) in enumerate(_edges(points)):
        if math.dist(a, b) <= 1e-9 * size:
            j = (i + 1) % count
            hint = ": leave out the closing vertex" if j == 0 else ""
            raise InputError(f"vertices {i} and {j} are the same point {a}{hint}")
    for i in range(count):
        for j in range(i + 1, count):
            if _edges_meet(points, i, j):
                raise InputError(
                    f"the polygon crosses or touches itself: edge {i}-{(i + 1) % count} meets "
                    f"edge {j}-{(j + 1) % count}; give the vertices in order along the outline"
                )
    if math.fsum(cross(a, b) for a, b in _edges(_shifted(points))) <= 0.0:
        raise InputError(
            "the vertices run clockwise: give them counter-clockwise, seen with the base frame's "
            "x axis to the right (down the base) and y axis up (out of the base plane)"
        )
    return points


def cross(a: Point, b: Point) -> float:
    """Return the z component of the cross product of two vectors."""
    return a[0] * b[1] - a[1] * b[0]


def _points(vertices: object) -> tuple[Point, ...]:
    try:
        rows = list(vertices)  # type: ignore[call-overload]
    except TypeError:
        raise InputError(f"vertices must be pairs (x, y) in metres, not {vertices!r}") from None
    points = []
    for i, row in enumerate(rows):
        try:
            x, y = row
            if isinstance(x, bool | str) or isinstance(y, bool | str):
                raise TypeError
            point = (float(x), float(y))
        except (TypeError, ValueError):
            raise InputError(f"vertex {i} must be a pair (x, y) in metres, not {row!r}") from None
        if not (math.isfinite(point[0]) and math.isfinite(point[1])):
            raise InputError(f"vertex {i} = {point} is not finite: give metres")
        points.append(point)
    return tuple(points)


def _shifted(points: Sequence[Point]) -> list[Point]:
    x0, y0 = points[0]
    return [(x - x0, y - y0) for x, y in points]


def _edges(points: Sequence[Point]) -> list[tuple[Point, Point]]:
    return list(zip(points, [*points[1:], points[0]], strict=True))


def _dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _turn(a: Point, b: Point, c: Point) -> float:
    return cross((b[0] - a[0], b[1] - a[1]), (c[0] - a[0], c[1] - a[1]))


def _within(a: Point, b: Point, c: Point) -> bool:
    """Return whether c, collinear with a and b, lies between them."""
    return min(a[0], b[0]) <= c[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= c[1] <= max(a[1], b[1])


def _edges_meet(points: Sequence[Point], i: int, j: int) -> bool:
    count = len(points)
    a, b = points[i], points[(i + 1) % count]
    c, d = points[j], points[(j + 1) % count]
    if (i + 1) % count == j or (j + 1) % count == i:
        # Neighbours share a corner; they may only not run back over each other.
        corner, before, after = (b, a, d) if (i + 1) % count == j else (a, b, c)
        along = _dot(
            (before[0] - corner[0], before[1] - corner[1]),
            (after[0] - corner[0], after[1] - corner[1]),
        )
        return _turn(corner, before, after) == 0.0 and along > 0.0
    turns = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    if turns[0] * turns[1] < 0.0 and turns[2] * turns[3] < 0.0:
        return True
    touching = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(t == 0.0 and _within(*three) for t, three in zip(turns, touching, strict=True))
