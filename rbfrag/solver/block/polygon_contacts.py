"""The contacts of a polygon block, which must lie on its planes."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import SCALAR, cot_deg
from rbfrag.solver.block.polygon import (
    Point,
    PolygonProperties,
    checked_polygon,
    extent_m,
    polygon_properties,
)
from rbfrag.solver.quantity import angle

CONTACT_TOLERANCE = 1e-3
"""How far a contact may lie off its plane, in parts of the block's size (1 mm on 1 m)."""


@dataclass(frozen=True)
class PolygonContacts:
    """A polygon whose contacts lie on the base and back planes.

    Args:
        outline: vertices from the centroid, counter-clockwise [m].
        heel: from the centroid to the heel [m].
        back: from the centroid to the back contact [m].
        toe: from the centroid to the toe [m].
        lowest_on_back: from the centroid to the lowest vertex on the back plane [m].
        gamma_deg: angle of the back plane [deg].
        properties: area, centroid and inertia.
    """

    outline: tuple[Point, ...]
    heel: Point
    back: Point
    toe: Point
    lowest_on_back: Point
    gamma_deg: float
    cot_gamma: float
    properties: PolygonProperties


def polygon_contacts(
    vertices_m: Sequence[Sequence[float]], heel: int, back: int, toe: int, gamma_deg: float
) -> PolygonContacts:
    """Return a polygon with its contacts, or reject it with the reason.

    The arguments and errors are those of :meth:`rbfrag.solver.block.geometry.Block.from_polygon`.
    """
    points = checked_polygon(vertices_m)
    gamma_deg = angle(gamma_deg, "gamma_deg", 0.0, 180.0)
    heel = _vertex(points, heel, "heel")
    back = _vertex(points, back, "back")
    toe = _vertex(points, toe, "toe")
    if len({heel, back, toe}) < 3:
        raise InputError(
            f"heel = {heel}, back = {back}, toe = {toe}: they must be three different vertices"
        )
    tolerance = CONTACT_TOLERANCE * extent_m(points)
    _check_base(points, heel, toe, tolerance)
    cot = cot_deg(gamma_deg, SCALAR)
    on_back = _on_back_plane(points, back, heel, cot, gamma_deg, tolerance)
    height_m = points[back][1] - points[heel][1]
    if height_m <= tolerance:
        raise InputError(
            f"back = {back}: vertex {back} lies {height_m:.4g} m above the base plane; the back "
            "contact is the upper end of the edge along the back plane"
        )
    properties = polygon_properties(points)
    cx, cy = properties.centroid
    outline = tuple((x - cx, y - cy) for x, y in points)
    lowest = heel if heel in on_back else min(on_back, key=lambda i: points[i][1])
    return PolygonContacts(
        outline=outline,
        heel=outline[heel],
        back=outline[back],
        toe=outline[toe],
        lowest_on_back=outline[lowest],
        gamma_deg=gamma_deg,
        cot_gamma=cot,
        properties=properties,
    )


def _vertex(points: tuple[Point, ...], number: int, name: str) -> int:
    try:
        index = operator.index(number)
    except TypeError:
        index = -1
    if isinstance(number, bool) or not 0 <= index < len(points):
        raise InputError(
            f"{name} = {number!r}: a contact is the number of a vertex, 0 to {len(points) - 1}"
        )
    return index


def _check_base(points: tuple[Point, ...], heel: int, toe: int, tolerance: float) -> None:
    if points[toe][0] - points[heel][0] <= tolerance:
        raise InputError(
            f"the toe (vertex {toe}, x = {points[toe][0]:g}) does not lie downslope of the heel "
            f"(vertex {heel}, x = {points[heel][0]:g}): x is down the base"
        )
    off = points[toe][1] - points[heel][1]
    if abs(off) > tolerance:
        raise InputError(
            f"heel (vertex {heel}) and toe (vertex {toe}) lie {abs(off):.4g} m apart normal to the "
            f"base, more than the tolerance of {tolerance:.4g} m ({CONTACT_TOLERANCE:g} of the "
            "block's size): contacts 1 and 3 lie on the base plane, which has one y"
        )
    base = max(points[heel][1], points[toe][1])
    low = min(range(len(points)), key=lambda i: points[i][1])
    if points[low][1] < base - tolerance:
        raise InputError(
            f"vertex {low} lies {base - points[low][1]:.4g} m below the base plane through heel "
            f"and toe; the tolerance is {tolerance:.4g} m"
        )


def _on_back_plane(
    points: tuple[Point, ...], back: int, heel: int, cot: float, gamma_deg: float, tolerance: float
) -> list[int]:
    """Return the vertices on the back plane, after proving that the block rests against it."""
    # distances from the plane through the back contact, into the block positive
    sine = 1.0 / math.sqrt(1.0 + cot * cot)
    x0, y0 = points[back]
    off = [sine * ((x - x0) + (y - y0) * cot) for x, y in points]
    furthest = min(range(len(points)), key=lambda i: off[i])
    if off[furthest] < -tolerance:
        raise InputError(
            f"the back contact (vertex {back}) does not lie on a back plane at gamma_deg = "
            f"{gamma_deg:.10g}: vertex {furthest} would stand {-off[furthest]:.4g} m inside the "
            "rock "
            f"behind that plane; the tolerance is {tolerance:.4g} m ({CONTACT_TOLERANCE:g} of the "
            "block's size)"
        )
    # the edge along the plane has two ends: a block with one contact leans on a corner
    on_back = [i for i in range(len(points)) if off[i] <= tolerance]
    if len(on_back) < 2:
        raise InputError(
            f"the back contact (vertex {back}) does not lie on a back plane at gamma_deg = "
            f"{gamma_deg:.10g} through the heel (vertex {heel}), which is {off[heel]:.4g} m off; "
            f"the tolerance is {tolerance:.4g} m ({CONTACT_TOLERANCE:g} of the block's size), and "
            "no edge of the block lies along that plane either"
        )
    return on_back
