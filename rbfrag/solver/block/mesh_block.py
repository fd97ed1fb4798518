"""Free-standing three-dimensional block: its rocking about its contacts in each direction.

A body that shaking rocks in one vertical plane turns about an axis normal to that plane through
the outermost contact on either side. Along each azimuth it is then a block of two corners: their
distances from the centre of mass and the inertia about a horizontal axis say the rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import rounded
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.quantity import positive

Array = NDArray[np.float64]

LINES_DEG = np.arange(0.0, 180.0, 5.0)
"""Azimuths along which a mesh block is described; each stands for its opposite too."""

CONTACT_MM = 10.0
"""Height above the lowest point up to which a vertex counts as a contact, unless stated."""

OTHER_CONTACTS_MM = (5.0, 10.0, 20.0, 30.0)
"""Heights that every answer is repeated with."""

PLAN_AXES = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}
"""By the axis that points up: the file's axes in the order of plan x, plan y, up."""

USUAL_SIZE_M = (0.05, 50.0)
"""Greatest extents of a free-standing block that are not suspected of another unit."""


class TwoCorneredBlocks(NamedTuple):
    """Two-cornered blocks, one for each azimuth.

    Forward means over the contact on the side of the azimuth, backward over the other one.

    Args:
        azimuth_deg: azimuths, counter-clockwise from plan x seen from above [deg].
        kr_forward: tan of the critical angle forward.
        kr_backward: the same backward.
        p2_forward: p² about the forward contact [1/s²].
        p2_backward: p² about the backward contact [1/s²].
        restitution_forward: ratio of the angular speeds after and before the pivot changes from
            the forward contact to the backward one; zero or less: the block comes to rest.
        restitution_backward: the same from the backward contact to the forward one.
    """

    azimuth_deg: Array
    kr_forward: Array
    kr_backward: Array
    p2_forward: Array
    p2_backward: Array
    restitution_forward: Array
    restitution_backward: Array

    @property
    def kr(self) -> Array:
        """k_r of the weaker sense."""
        return np.minimum(self.kr_forward, self.kr_backward)

    @property
    def p2(self) -> Array:
        """p² of the weaker sense [1/s²]."""
        is_forward = self.kr_forward <= self.kr_backward
        return np.asarray(np.where(is_forward, self.p2_forward, self.p2_backward), np.float64)

    @property
    def restitution(self) -> Array:
        """Restitution of the symmetric block with the same loss per cycle: √(e31 e13), or 0."""
        forward, backward = self.restitution_forward, self.restitution_backward
        return np.asarray(np.sqrt(np.maximum(forward, 0.0) * np.maximum(backward, 0.0)))


class Weakest(NamedTuple):
    """Direction in which the smallest acceleration uplifts the block.

    Args:
        azimuth_deg: towards which it lifts off, counter-clockwise from plan x [deg].
        kr: tan of the critical angle.
        p2: p² [1/s²].
        restitution: as in :class:`TwoCorneredBlocks`.
    """

    azimuth_deg: float
    kr: float
    p2: float
    restitution: float


@dataclass(frozen=True)
class ContactHull:
    """The contacts of a block on level ground and their convex hull in plan.

    Args:
        contact_mm: height above the lowest point up to which vertices count as contacts [mm].
        points_m: contacts in plan from the centre of mass, shape (n, 2) [m].
        corners_m: their hull, counter-clockwise, shape (k, 2) [m]; empty where it has no area.
        height_m: height of the centre of mass above the lowest point [m].
        inertia_m2: inertia tensor about the centre of mass per mass, along plan x, plan y and
            up, shape (3, 3) [m²].
    """

    contact_mm: float
    points_m: Array
    corners_m: Array
    height_m: float
    inertia_m2: Array

    @property
    def stands(self) -> bool:
        """True if the centre of mass lies above the interior of the hull."""
        return self.corners_m.size > 0 and bool(self._edges()[1].min() > 0.0)

    def rocking(self, azimuth_deg: Array) -> TwoCorneredBlocks:
        """Return the two-cornered block along each azimuth.

        p² = g R/(I + R²), e = (I + r1·r3)/(I + R²): angular momentum about the new contact is
        kept at the impact (Housner 1963 for a symmetric block). Products of inertia, which turn
        the block out of its plane, are left out.

        Args:
            azimuth_deg: azimuths, shape (m,) [deg].
        """
        turn = np.radians(azimuth_deg)
        along = np.column_stack([np.cos(turn), np.sin(turn)])
        across = np.column_stack([-along[:, 1], along[:, 0]])
        inertia = np.einsum("mi,ij,mj->m", across, self.inertia_m2[:2, :2], across)
        offsets = along @ self.corners_m.T
        forward, backward = offsets.max(axis=1), -offsets.min(axis=1)
        h = self.height_m
        about_forward = inertia + forward**2 + h * h
        about_backward = inertia + backward**2 + h * h
        momentum = inertia + h * h - forward * backward
        return TwoCorneredBlocks(
            azimuth_deg=np.asarray(azimuth_deg, dtype=np.float64),
            kr_forward=forward / h,
            kr_backward=backward / h,
            p2_forward=STANDARD_GRAVITY_M_S2 * np.hypot(forward, h) / about_forward,
            p2_backward=STANDARD_GRAVITY_M_S2 * np.hypot(backward, h) / about_backward,
            restitution_forward=momentum / about_backward,
            restitution_backward=momentum / about_forward,
        )

    def weakest(self) -> Weakest:
        """Return the direction of the minimum k_r over all azimuths.

        The hull reaches least far along the normal of its nearest edge, so that no grid of
        azimuths is searched. Of equal ones it is the first counter-clockwise from plan x.
        """
        normals, distances = self._edges()
        towards = np.degrees(np.arctan2(normals[:, 1], normals[:, 0]))
        azimuths = np.round(towards, 9) % 360.0  # -1e-15 is 0, not 360
        equal = distances <= distances.min() * (1.0 + 1e-9)
        first = int(np.where(equal, azimuths, np.inf).argmin())
        there = self.rocking(towards[[first]])
        return Weakest(
            float(azimuths[first]),
            float(there.kr_forward[0]),
            float(there.p2_forward[0]),
            float(there.restitution[0]),
        )

    def nearest_edge(self) -> tuple[float, float]:
        """Return the azimuth of the edge nearest to, or furthest beyond, the centre of mass [deg].

        With it its distance from there [m], below zero where the centre of mass lies outside.
        """
        if self.corners_m.size == 0:
            points = self.points_m
            middle = points.mean(axis=0)
            return math.degrees(math.atan2(-middle[1], -middle[0])), -float(np.hypot(*middle))
        normals, distances = self._edges()
        nearest = int(distances.argmin())
        x, y = normals[nearest]
        return math.degrees(math.atan2(y, x)), float(distances[nearest])

    def _edges(self) -> tuple[Array, Array]:
        """Return the outward normals of the hull's edges, and their distances from the centre."""
        steps = np.roll(self.corners_m, -1, axis=0) - self.corners_m
        normals = np.column_stack([steps[:, 1], -steps[:, 0]])
        normals /= np.hypot(steps[:, 0], steps[:, 1])[:, None]
        return normals, np.einsum("ki,ki->k", normals, self.corners_m)


@dataclass(frozen=True, repr=False)
class MeshBlock(Result):
    """A free-standing block measured as a closed mesh; make one with `rbfrag.block_from_mesh`.

    Args:
        name: what its rows in a table of blocks begin with.
        up: the file's axis that points up; plan x and plan y are the two after it in cyclic
            order (x and y for z).
        volume_m3: volume [m³].
        density_kg_m3: density [kg/m³]; None where it is not known.
        centre_m: centre of mass in the axes of the file, shape (3,) [m].
        inertia_m2: inertia tensor about it per mass in the axes of the file, shape (3, 3) [m²].
        hull: the contacts, and how the block rocks about them.
        hulls: the same for each height of contact of the sensitivity, in rising order.
        outline_m: hull of the whole block in plan from the centre of mass, shape (k, 2) [m].
        warnings: what was mended, and what the answer takes for granted.
    """

    name: str
    up: str
    volume_m3: float
    density_kg_m3: float | None
    centre_m: Array
    inertia_m2: Array
    hull: ContactHull
    hulls: tuple[ContactHull, ...]
    outline_m: Array
    warnings: tuple[str, ...] = field(default=())

    @property
    def mass_kg(self) -> float | None:
        """Mass [kg]; None without a density."""
        return None if self.density_kg_m3 is None else self.density_kg_m3 * self.volume_m3

    def rocking(self) -> TwoCorneredBlocks:
        """Return the two-cornered blocks along :data:`LINES_DEG`."""
        return self.hull.rocking(LINES_DEG)

    def sensitivity(self) -> list[dict[str, Any]]:
        """Return k_r and p² of the weaker sense for each contact height.

        Numbers are None where the centre of mass lies outside the contacts.
        """
        rows = []
        for hull in self.hulls:
            row: dict[str, Any] = {"contact_mm": hull.contact_mm, "contacts": len(hull.points_m)}
            extremes: Sequence[Any] = (None,) * 5
            if hull.stands:
                rocking, weakest = hull.rocking(LINES_DEG), hull.weakest()
                kr, p2 = rocking.kr, np.append(rocking.p2, weakest.p2)
                values = weakest.kr, np.median(kr), kr.max(), p2.min(), p2.max()
                extremes = [float(value) for value in values]
            names = ("kr_least", "kr_median", "kr_greatest", "p2_least", "p2_greatest")
            rows.append({**row, **dict(zip(names, extremes, strict=True))})
        return rows

    def table_columns(self) -> dict[str, NDArray[Any]]:
        """Return a table of blocks, one row for each of :data:`LINES_DEG`.

        ``p2_1_s2``, ``kr`` and ``restitution`` are those of the weaker sense.
        """
        rocking = self.rocking()
        ids = [f"{self.name}-{azimuth:03.0f}" for azimuth in rocking.azimuth_deg]
        return {
            "block_id": np.array(ids, dtype=object),
            "azimuth_deg": rocking.azimuth_deg,
            "p2_1_s2": rocking.p2,
            "kr": rocking.kr,
            "restitution": rocking.restitution,
            "kr_forward": rocking.kr_forward,
            "kr_backward": rocking.kr_backward,
            "p2_forward_1_s2": rocking.p2_forward,
            "p2_backward_1_s2": rocking.p2_backward,
            "restitution_forward": rocking.restitution_forward,
            "restitution_backward": rocking.restitution_backward,
        }

    def sentences(self) -> Iterator[str]:
        """Yield the uplift acceleration of the weakest azimuth."""
        weakest = self.hull.weakest()
        yield (
            f"Uplift acceleration {rounded(weakest.kr)} g, towards azimuth "
            f"{weakest.azimuth_deg:.0f}°: above it the block lifts off, and it overturns only if "
            "the pulse lasts long enough"
        )

    def lines(self) -> Iterator[TextLine]:
        """Yield the numbers of the weakest azimuth and the size of the block."""
        weakest = self.hull.weakest()
        yield TextLine(
            "Block",
            f"p² = {rounded(weakest.p2)} s⁻², k_r = {rounded(weakest.kr)}, coefficient of "
            f"restitution {rounded(weakest.restitution)}",
        )
        mass = "" if self.mass_kg is None else f", mass {rounded(self.mass_kg)} kg"
        yield TextLine("Mesh", f"{self.name}, volume {rounded(self.volume_m3)} m³{mass}")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value, if verbose, and the effect of the contact height."""
        values = self.as_dict()
        rows = values.pop("sensitivity")
        if verbose:
            apart = ("azimuths", "inertia_m2", "warnings")
            yield TextTable(
                (), [(name, value) for name, value in values.items() if name not in apart]
            )
        yield TextTable(tuple(rows[0]), [tuple(row.values()) for row in rows])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer of `rbfrag block --mesh --json`; k_r and p² of the weakest azimuth."""
        weakest = self.hull.weakest()
        columns = {name: column.tolist() for name, column in self.table_columns().items()}
        return {
            "name": self.name,
            "volume_m3": self.volume_m3,
            "mass_kg": self.mass_kg,
            "centre_m": self.centre_m.tolist(),
            "inertia_m2": self.inertia_m2.tolist(),
            "centre_height_m": self.hull.height_m,
            "contact_mm": self.hull.contact_mm,
            "contacts": len(self.hull.points_m),
            "azimuth_deg": weakest.azimuth_deg,
            "alpha_deg": math.degrees(math.atan(weakest.kr)),
            "kr": weakest.kr,
            "p2": weakest.p2,
            "restitution": weakest.restitution,
            "azimuths": [
                dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
            ],
            "sensitivity": self.sensitivity(),
            "warnings": list(self.warnings),
        }


def mesh_block(
    name: str,
    vertices_m: Array,
    *,
    volume_m3: float,
    centre_m: Array,
    inertia_m2: Array,
    up: str = "z",
    contact_mm: float = CONTACT_MM,
    density_kg_m3: float | None = None,
    warnings: Sequence[str] = (),
) -> MeshBlock:
    """Return the block defined by the vertices of a closed surface and what it encloses.

    Args:
        name: what messages and rows of tables call it.
        vertices_m: vertices in the measured resting pose, shape (n, 3) [m].
        volume_m3: volume inside the surface [m³].
        centre_m: its centre of mass, shape (3,) [m].
        inertia_m2: inertia tensor about it per mass in the same axes, shape (3, 3) [m²].
        up: the axis that points up.
        contact_mm: height above the lowest vertex up to which vertices are contacts [mm].
        density_kg_m3: density [kg/m³]; only the mass needs it.
        warnings: those of the mesh.

    Raises:
        InputError: a value outside its range; or the centre of mass does not lie above the
            inside of the contacts' hull, so that the block would not rest like this.
    """
    if up not in PLAN_AXES:
        raise InputError(f"up = {up!r}: it must be x, y or z, the axis of the mesh that points up")
    contact_mm = positive(contact_mm, "contact_mm", "mm")
    if density_kg_m3 is not None:
        density_kg_m3 = positive(density_kg_m3, "density_kg_m3", "kg/m³")
    axes = list(PLAN_AXES[up])
    positions = (vertices_m - centre_m)[:, axes]
    inertia = inertia_m2[np.ix_(axes, axes)]
    lowest = positions[:, 2].min()
    hulls = {}
    for height in sorted({contact_mm, *OTHER_CONTACTS_MM}):
        points = positions[positions[:, 2] <= lowest + 1e-3 * height, :2]
        hulls[height] = ContactHull(height, points, _convex(points), -float(lowest), inertia)
    hull = hulls[contact_mm]
    if not hull.stands:
        azimuth, distance = hull.nearest_edge()
        rests = [f"{height:g}" for height, other in hulls.items() if other.stands]
        within = f" (it stands within {', '.join(rests)} mm)" if rests else ""
        raise InputError(
            f"{name}: not its resting pose: the centre of mass lies {-distance:.3g} m outside its "
            f"contacts (vertices within {contact_mm:g} mm of the lowest: {len(hull.points_m)}), "
            f"towards azimuth {azimuth % 360.0:.0f} deg. Turn the mesh into the pose measured on "
            "level ground, name the axis that points up, or raise the height of "
            f"contact{within}"
        )
    extent_m = float(np.ptp(vertices_m, axis=0).max())
    return MeshBlock(
        name=name,
        up=up,
        volume_m3=volume_m3,
        density_kg_m3=density_kg_m3,
        centre_m=centre_m,
        inertia_m2=inertia_m2,
        hull=hull,
        hulls=tuple(hulls.values()),
        outline_m=_convex(positions[:, :2]),
        warnings=(*warnings, *_doubts(extent_m, hull, tuple(hulls.values()))),
    )


def _convex(points: Array) -> Array:
    """Return the corners of the convex hull, counter-clockwise; none where it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 3:
        return np.empty((0, 2))
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:  # all on one line
        return np.empty((0, 2))


def _doubts(extent_m: float, hull: ContactHull, hulls: tuple[ContactHull, ...]) -> list[Diagnostic]:
    """Return the reasons to doubt an answer."""
    doubts = []
    least, most = USUAL_SIZE_M
    if not least <= extent_m <= most:
        doubts.append(
            Diagnostic(
                f"the mesh is {extent_m:.4g} m across, which no free-standing block is "
                f"({least:g} to {most:g} m): coordinates are assumed to be in metres; scale the "
                "mesh if they are not",
                "check_unit",
            )
        )
    if 1e-3 * hull.contact_mm > 0.1 * hull.height_m:
        doubts.append(
            Diagnostic(
                f"contacts within {hull.contact_mm:g} mm reach above a tenth of the height of the "
                f"centre of mass ({hull.height_m:.3g} m): the sides of the block count as its base",
                "contact_height",
            )
        )
    fallen = [f"{other.contact_mm:g}" for other in hulls if not other.stands]
    if fallen:
        doubts.append(
            Diagnostic(
                f"with contacts within {' or '.join(fallen)} mm the centre of mass lies outside "
                "them: the pose, or the surface near the ground, is too uncertain",
                "contact_height",
            )
        )
    krs = [other.weakest().kr for other in hulls if other.stands]
    if max(krs) > 1.25 * min(krs):
        doubts.append(
            Diagnostic(
                f"k_r of the weakest azimuth is {min(krs):.3g} to {max(krs):.3g} for contacts "
                f"within {hulls[0].contact_mm:g} to {hulls[-1].contact_mm:g} mm: "
                "measure where the block touches the ground",
                "contact_height",
            )
        )
    if float(hull.rocking(LINES_DEG).restitution.min()) == 0.0:
        doubts.append(
            Diagnostic(
                "so stocky a block comes to rest at its first impact along some azimuths "
                "(restitution 0)",
                "model_limits",
            )
        )
    return doubts
