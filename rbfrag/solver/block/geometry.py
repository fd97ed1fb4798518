"""Geometry and size of a rock block on its base and back planes, and derived quantities."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import (
    SCALAR,
    corner_distance,
    cot_deg,
    cot_gamma,
    frequency_parameter,
    parallelogram_inertia,
    shape_factor,
    tan_deg,
    tangents_from_spacings,
)
from rbfrag.solver.quantity import angle, positive

Point = tuple[float, float]

CONTACT_TOLERANCE = 1e-3
"""How far a contact may lie off its plane, in parts of the block's size (1 mm on 1 m)."""


@dataclass(frozen=True)
class Block:
    """A two-dimensional block of unit thickness that rests on a base and against a back plane.

    Make one with :meth:`rectangle`, :meth:`from_angles`, :meth:`from_fractures` or
    :meth:`from_polygon`, which reject what is no block. The base frame has x down the base and y
    out of it. Contact 1 is the heel, 2 the upper end of the back edge, 3 the toe.

    Args:
        alpha1_deg: angle of the heel, from the inward normal of the base through the centroid
            to the line centroid-heel, positive downslope [deg].
        alpha3_deg: the same angle of the toe [deg].
        gamma_deg: angle from the upslope extension of the base to the back plane [deg]; above
            90 the back plane overhangs the block.
        tan_alpha1: tan α1.
        tan_alpha3: tan α3.
        cot_gamma: cot γ.
        heel: from the centroid to contact 1 in the base frame [m].
        back: from the centroid to contact 2 [m].
        toe: from the centroid to contact 3 [m].
        lowest_on_back: from the centroid to the lowest point that touches the back plane [m];
            the heel, unless the heel's corner is missing.
        area_m2: area [m²].
        inertia_m2: moment of inertia about the centroid per mass [m²].
        outline: vertices from the centroid, counter-clockwise [m].
        is_parallelogram: whether the block is made of two pairs of parallel fractures.
    """

    alpha1_deg: float
    alpha3_deg: float
    gamma_deg: float
    tan_alpha1: float
    tan_alpha3: float
    cot_gamma: float
    heel: Point
    back: Point
    toe: Point
    lowest_on_back: Point
    area_m2: float
    inertia_m2: float
    outline: tuple[Point, ...]
    is_parallelogram: bool

    @classmethod
    def rectangle(cls, height_m: float, width_m: float) -> Block:
        """Return a rectangular block.

        Its critical angle on a level base is atan(width/height), and p² = 3g/(4 r3) with
        r3 = √(height² + width²)/2. Like every block it is backed by a slope: a free-standing one
        rocks on both corners and fails at weaker shaking.

        Args:
            height_m: height, perpendicular to the base plane [m], above 0.
            width_m: width along the base plane [m], above 0.

        Raises:
            InputError: a value that is not above zero.
        """
        height_m = positive(height_m, "height_m", "m")
        width_m = positive(width_m, "width_m", "m")
        t3 = width_m / height_m
        alpha3_deg = math.degrees(math.atan(t3))
        return _parallelogram(-alpha3_deg, alpha3_deg, -t3, t3, 0.5 * height_m, 90.0)

    @classmethod
    def from_angles(cls, alpha1_deg: float, alpha3_deg: float, r3_m: float) -> Block:
        """Return the parallelogram block of two block angles and its size.

        Args:
            alpha1_deg: angle of the heel [deg], above -90 and below alpha3_deg.
            alpha3_deg: angle of the toe [deg], below 90.
            r3_m: distance from centroid to toe [m], above 0.

        Raises:
            InputError: a value outside its range; the message names the range.
        """
        alpha1_deg = angle(alpha1_deg, "alpha1_deg", -90.0, 90.0)
        alpha3_deg = angle(alpha3_deg, "alpha3_deg", -90.0, 90.0)
        r3_m = positive(r3_m, "r3_m", "m")
        t1, t3 = tan_deg(alpha1_deg, SCALAR), tan_deg(alpha3_deg, SCALAR)
        if not t1 < t3:
            raise InputError(
                f"alpha1_deg = {alpha1_deg:.10g} is not below alpha3_deg = {alpha3_deg:.10g}: the "
                "heel lies upslope of the toe, -90 < alpha1_deg < alpha3_deg < 90"
            )
        return _parallelogram(alpha1_deg, alpha3_deg, t1, t3, r3_m / math.sqrt(1.0 + t3 * t3))

    @classmethod
    def from_fractures(cls, s1_m: float, s2_m: float, gamma_deg: float) -> Block:
        """Return the parallelogram block that two fracture sets cut out (eq. 3.15).

        Args:
            s1_m: spacing of the base fractures, the thickness of the block normal to its
                base [m], above 0.
            s2_m: spacing of the back fractures [m], above 0.
            gamma_deg: dip of the back plane less dip of the base plane [deg], between 0
                and 180.

        Raises:
            InputError: a value outside its range; the message names the range.
        """
        s1_m = positive(s1_m, "s1_m", "m")
        s2_m = positive(s2_m, "s2_m", "m")
        gamma_deg = angle(gamma_deg, "gamma_deg", 0.0, 180.0)
        t1, t3 = tangents_from_spacings(s1_m, s2_m, gamma_deg, SCALAR)
        if not (t1 < t3 and math.isfinite(t1) and math.isfinite(t3)):
            raise InputError(
                f"s1_m = {s1_m:g}, s2_m = {s2_m:g} and gamma_deg = {gamma_deg:.10g} give a block "
                "without thickness: use spacings of similar size and an angle further from 0 and "
                "180"
            )
        alpha1_deg, alpha3_deg = math.degrees(math.atan(t1)), math.degrees(math.atan(t3))
        return _parallelogram(alpha1_deg, alpha3_deg, t1, t3, 0.5 * s1_m, gamma_deg)

    @classmethod
    def from_polygon(
        cls, vertices_m: Sequence[Sequence[float]], heel: int, back: int, toe: int, gamma_deg: float
    ) -> Block:
        """Return a block of arbitrary outline.

        The base plane runs along x through heel and toe, the back plane through the back
        contact at gamma_deg. Heel and toe must lie on the base plane, at least one vertex besides
        the back contact on the back plane, and none behind either, within
        :data:`CONTACT_TOLERANCE` times the size of the block.

        Args:
            vertices_m: vertices (x, y) in the base frame, counter-clockwise [m].
            heel: number of the vertex that is contact 1, counted from 0.
            back: number of the vertex that is contact 2.
            toe: number of the vertex that is contact 3.
            gamma_deg: angle of the back plane [deg], between 0 and 180.

        Raises:
            InputError: the polygon is not simple or runs clockwise, or a contact does not lie
                on its plane; the message says which and by how much.
        """
        points = checked_polygon(vertices_m)
        gamma_deg = angle(gamma_deg, "gamma_deg", 0.0, 180.0)
        cot = cot_deg(gamma_deg, SCALAR)
        lowest = lowest_on_back_plane(points, heel, back, toe, gamma_deg, cot)
        area_m2, (cx, cy), inertia_m2 = polygon_properties(points)
        outline = tuple((x - cx, y - cy) for x, y in points)
        t1, t3 = (outline[corner][0] / -outline[corner][1] for corner in (heel, toe))
        return cls(
            alpha1_deg=math.degrees(math.atan(t1)),
            alpha3_deg=math.degrees(math.atan(t3)),
            gamma_deg=gamma_deg,
            tan_alpha1=t1,
            tan_alpha3=t3,
            cot_gamma=cot,
            heel=outline[heel],
            back=outline[back],
            toe=outline[toe],
            lowest_on_back=outline[lowest],
            area_m2=area_m2,
            inertia_m2=inertia_m2,
            outline=outline,
            is_parallelogram=False,
        )

    @property
    def half_s1_m(self) -> float:
        """Height of the centroid above the base, normal to it [m]; of a parallelogram S1/2."""
        return -self.toe[1]

    @property
    def r1_m(self) -> float:
        """Distance from the centroid to the heel [m]."""
        return corner_distance(-self.heel[1], self.tan_alpha1, SCALAR)

    @property
    def r2_m(self) -> float:
        """Distance from the centroid to the back contact [m]."""
        return math.hypot(*self.back)

    @property
    def r3_m(self) -> float:
        """Distance from the centroid to the toe [m]."""
        return corner_distance(-self.toe[1], self.tan_alpha3, SCALAR)

    @property
    def alpha2_deg(self) -> float:
        """Angle of the back contact, measured like alpha1_deg, between -180 and 180 [deg]."""
        return math.degrees(math.atan2(self.back[0], -self.back[1]))

    @property
    def on_back_edge_rad(self) -> float:
        """Backward rotation that lays the back edge on the base [rad]."""
        edge_x, edge_y = (b - h for b, h in zip(self.back, self.heel, strict=True))
        return math.pi - math.atan2(edge_y, edge_x)

    @property
    def on_front_face_rad(self) -> float:
        """Forward rotation about the toe that lays the front face on the base [rad]."""
        toe_x, toe_y = self.toe
        return min(
            math.atan2(y - toe_y, x - toe_x)
            for x, y in self.outline
            if y - toe_y > 1e-9 * self.r3_m
        )

    @property
    def base_m(self) -> float:
        """Distance from heel to toe [m]."""
        return self.toe[0] - self.heel[0]

    @property
    def s1_m(self) -> float:
        """Thickness normal to the base [m]; for a parallelogram the base fractures' spacing."""
        if self.is_parallelogram:
            return -2.0 * self.toe[1]
        ys = [y for _, y in self.outline]
        return max(ys) - min(ys)

    @property
    def s2_m(self) -> float:
        """Thickness normal to the back [m]; for a parallelogram the back fractures' spacing."""
        sine = 1.0 / math.sqrt(1.0 + self.cot_gamma * self.cot_gamma)
        if self.is_parallelogram:
            return self.base_m * sine
        off = [sine * (x + y * self.cot_gamma) for x, y in self.outline]
        return max(off) - min(off)

    @property
    def centroid(self) -> Point:
        """Centroid in the base frame with the heel as origin [m]."""
        return (-self.heel[0], -self.heel[1])

    @property
    def vertices_m(self) -> tuple[Point, ...]:
        """Vertices in the base frame with the heel as origin, counter-clockwise [m]."""
        return tuple((x - self.heel[0], y - self.heel[1]) for x, y in self.outline)

    @property
    def arms(self) -> tuple[Point, Point, Point, Point]:
        """Heel, back contact, toe and lowest point on the back plane from the centroid.

        Of a parallelogram in units of S1/2, else in metres.
        """
        if self.is_parallelogram:
            t1, t3 = self.tan_alpha1, self.tan_alpha3
            return (t1, -1.0), (-t3, 1.0), (t3, -1.0), (t1, -1.0)
        return self.heel, self.back, self.toe, self.lowest_on_back

    @property
    def confines(self) -> bool:
        """True if the back plane hinders a rotation about the toe (for an uncut heel, γ > 90°)."""
        if self.lowest_on_back == self.heel:
            return self.cot_gamma < 0.0
        # without a corner at the heel: whether the lowest contact would turn into its plane
        rise_m = self.lowest_on_back[1] - self.toe[1]
        return rise_m + self.cot_gamma * (self.toe[0] - self.lowest_on_back[0]) < 0.0

    @property
    def inertia_toe_m2(self) -> float:
        """Moment of inertia about the toe per mass, I_toe/m [m²]."""
        return self.inertia_m2 + (self.toe[0] * self.toe[0] + self.toe[1] * self.toe[1])

    @property
    def shape_factor(self) -> float:
        """F_s = m r3²/I_toe (eq. 4.27); 3/4 for a rectangle."""
        if self.is_parallelogram:
            return shape_factor(self.tan_alpha1, self.tan_alpha3)
        toe_x, toe_y = self.toe
        return (toe_x * toe_x + toe_y * toe_y) / self.inertia_toe_m2

    @property
    def p2(self) -> float:
        """Frequency parameter p² = m g r3/I_toe [1/s²] at standard gravity (eq. 4.27)."""
        return frequency_parameter(self.shape_factor, self.r3_m)

    def mirror(self) -> Block:
        """Return the block seen from behind the page: heel and toe change places.

        Its angles are (-α3, -α1, 180° - γ); under -β and -k_h it answers as this one does.

        Raises:
            InputError: the block is a polygon, whose mirror image has another back plane.
        """
        if not self.is_parallelogram:
            raise InputError(
                "a polygon's mirror image rests against another plane: mirror the vertices, "
                "reverse their order, and call from_polygon with the back contact and gamma_deg "
                "of that plane"
            )
        return _parallelogram(
            -self.alpha3_deg,
            -self.alpha1_deg,
            -self.tan_alpha3,
            -self.tan_alpha1,
            -self.toe[1],
            180.0 - self.gamma_deg,
        )


def _parallelogram(
    alpha1_deg: float,
    alpha3_deg: float,
    t1: float,
    t3: float,
    half_s1_m: float,
    gamma_deg: float | None = None,
) -> Block:
    cot = cot_gamma(t1, t3)
    h = half_s1_m
    # (3.6), (3.7): r1 cos α1 = r3 cos α3 = S1/2; (3.3): r2 = -r3, and the fourth corner is -r1
    heel, toe = (h * t1, -h), (h * t3, -h)
    back = (-toe[0], h)
    front = (-heel[0], h)
    base_m = toe[0] - heel[0]
    block = Block(
        alpha1_deg=alpha1_deg,
        alpha3_deg=alpha3_deg,
        gamma_deg=math.degrees(math.atan2(1.0, cot)) if gamma_deg is None else gamma_deg,
        tan_alpha1=t1,
        tan_alpha3=t3,
        cot_gamma=cot,
        heel=heel,
        back=back,
        toe=toe,
        lowest_on_back=heel,
        area_m2=base_m * 2.0 * h,
        inertia_m2=parallelogram_inertia(t1, t3, h),
        outline=(heel, toe, front, back),
        is_parallelogram=True,
    )
    extremes = (block.area_m2, block.inertia_m2, block.p2, block.r1_m) if h > 0.0 else (h,)
    if not all(math.isfinite(number) and number > 0.0 for number in extremes):
        raise InputError(
            f"a block with r3 = {block.r3_m:g} m and S1 = {2.0 * h:g} m is out of range: give "
            "metres"
        )
    return block


def polygon_properties(vertices: Sequence[Point]) -> tuple[float, Point, float]:
    """Return area, centroid and inertia of a simple polygon (corrected eq. 4.26).

    The cross products are signed, so that the polygon need not be convex.

    Args:
        vertices: corners in counter-clockwise order [m].

    Returns:
        The area [m²], the centroid in the coordinates of the vertices [m], and the second moment
        about it per mass [m²].
    """
    # From its own middle, a small block far from the origin loses no digits.
    mid_x = math.fsum(x for x, _ in vertices) / len(vertices)
    mid_y = math.fsum(y for _, y in vertices) / len(vertices)
    edges = [(cross(a, b), a, b) for a, b in _edges([(x - mid_x, y - mid_y) for x, y in vertices])]
    doubled = math.fsum(c for c, _, _ in edges)
    cx = math.fsum(c * (a[0] + b[0]) for c, a, b in edges) / (3.0 * doubled)
    cy = math.fsum(c * (a[1] + b[1]) for c, a, b in edges) / (3.0 * doubled)
    about_middle = math.fsum(c * (_dot(a, a) + _dot(a, b) + _dot(b, b)) for c, a, b in edges) / (
        6.0 * doubled
    )
    return 0.5 * doubled, (mid_x + cx, mid_y + cy), about_middle - cx * cx - cy * cy


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
    try:
        rows = list(vertices)  # type: ignore[call-overload]
    except TypeError:
        raise InputError(f"vertices must be pairs (x, y) in metres, not {vertices!r}") from None
    points: list[Point] = []
    for i, row in enumerate(rows):
        try:
            x, y = row
            if isinstance(x, bool | str) or isinstance(y, bool | str):
                raise TypeError
            points.append((float(x), float(y)))
        except (TypeError, ValueError):
            raise InputError(f"vertex {i} must be a pair (x, y) in metres, not {row!r}") from None
        if not all(map(math.isfinite, points[i])):
            raise InputError(f"vertex {i} = {points[i]} is not finite: give metres")
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
    x0, y0 = points[0]
    if math.fsum(cross(a, b) for a, b in _edges([(x - x0, y - y0) for x, y in points])) <= 0.0:
        raise InputError(
            "the vertices run clockwise: give them counter-clockwise, seen with the base frame's "
            "x axis to the right (down the base) and y axis up (out of the base plane)"
        )
    return tuple(points)


def cross(a: Point, b: Point) -> float:
    """Return the z component of the cross product of two vectors."""
    return a[0] * b[1] - a[1] * b[0]


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


def lowest_on_back_plane(
    points: Sequence[Point], heel: int, back: int, toe: int, gamma_deg: float, cot: float
) -> int:
    """Return the vertex that touches the back plane lowest: the heel, unless its corner is missing.

    Args:
        points: vertices of a simple polygon, counter-clockwise [m].
        heel: number of the vertex that is contact 1, counted from 0.
        back: number of the vertex that is contact 2.
        toe: number of the vertex that is contact 3.
        gamma_deg: angle of the back plane [deg].
        cot: cot γ.

    Raises:
        InputError: a contact is no vertex of its own, or does not lie on its plane.
    """
    contacts = {"heel": heel, "back": back, "toe": toe}
    for name, number in contacts.items():
        try:
            is_vertex = 0 <= operator.index(number) < len(points) and not isinstance(number, bool)
        except TypeError:
            is_vertex = False
        if not is_vertex:
            raise InputError(
                f"{name} = {number!r}: a contact is the number of a vertex, 0 to {len(points) - 1}"
            )
    if len({heel, back, toe}) < 3:
        raise InputError(
            f"heel = {heel}, back = {back}, toe = {toe}: they must be three different vertices"
        )
    tolerance = CONTACT_TOLERANCE * extent_m(points)
    _check_base(points, heel, toe, tolerance)
    on_back = _on_back_plane(points, back, heel, cot, gamma_deg, tolerance)
    height_m = points[back][1] - points[heel][1]
    if height_m <= tolerance:
        raise InputError(
            f"back = {back}: vertex {back} lies {height_m:.4g} m above the base plane; the back "
            "contact is the upper end of the edge along the back plane"
        )
    return heel if heel in on_back else min(on_back, key=lambda i: points[i][1])


def _check_base(points: Sequence[Point], heel: int, toe: int, tolerance: float) -> None:
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
    points: Sequence[Point], back: int, heel: int, cot: float, gamma_deg: float, tolerance: float
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
