"""Geometry and size of a rock block on its base and back planes, and derived quantities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import (
    SCALAR,
    corner_distance,
    cot_gamma,
    frequency_parameter,
    parallelogram_inertia,
    shape_factor,
    tan_deg,
    tangents_from_spacings,
)
from rbfrag.solver.block.polygon import Point
from rbfrag.solver.block.polygon_contacts import polygon_contacts
from rbfrag.solver.quantity import angle, positive


class Contacts(NamedTuple):
    """Contact points of a block from its centroid, in the base frame.

    Args:
        heel: contact 1.
        back: contact 2.
        toe: contact 3.
        lowest_on_back: the lowest point that touches the back plane.
    """

    heel: Point
    back: Point
    toe: Point
    lowest_on_back: Point


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
        :data:`rbfrag.solver.block.polygon_contacts.CONTACT_TOLERANCE` times the size of the block.

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
        contacts = polygon_contacts(vertices_m, heel, back, toe, gamma_deg)
        t1 = contacts.heel[0] / -contacts.heel[1]
        t3 = contacts.toe[0] / -contacts.toe[1]
        return cls(
            alpha1_deg=math.degrees(math.atan(t1)),
            alpha3_deg=math.degrees(math.atan(t3)),
            gamma_deg=contacts.gamma_deg,
            tan_alpha1=t1,
            tan_alpha3=t3,
            cot_gamma=contacts.cot_gamma,
            heel=contacts.heel,
            back=contacts.back,
            toe=contacts.toe,
            lowest_on_back=contacts.lowest_on_back,
            area_m2=contacts.properties.area_m2,
            inertia_m2=contacts.properties.inertia_m2,
            outline=contacts.outline,
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
    def arms(self) -> Contacts:
        """Contacts from the centroid; of a parallelogram in units of S1/2, else in metres."""
        if self.is_parallelogram:
            t1, t3 = self.tan_alpha1, self.tan_alpha3
            return Contacts((t1, -1.0), (-t3, 1.0), (t3, -1.0), (t1, -1.0))
        return Contacts(self.heel, self.back, self.toe, self.lowest_on_back)

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
        return self.inertia_m2 + _squared(self.toe)

    @property
    def shape_factor(self) -> float:
        """F_s = m r3²/I_toe (eq. 4.27); 3/4 for a rectangle."""
        if self.is_parallelogram:
            return shape_factor(self.tan_alpha1, self.tan_alpha3)
        return _squared(self.toe) / self.inertia_toe_m2

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


def _squared(arm: Point) -> float:
    return arm[0] * arm[0] + arm[1] * arm[1]


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
