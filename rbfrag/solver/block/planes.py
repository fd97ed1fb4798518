"""Planes in space, their traces in the section across the face, and the limits of a section.

A plane is its dip and dip direction; the section is vertical and runs down the dip of the face.
No numpy is loaded. Formulas: apparent dips, spacings and the line of two planes of structural
geology (Priest 1993); the strike rule is that of the dissertation, 3.6.1.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic

STRIKE_DEG = 20.0
"""Planes that strike further off the face are no planes of the section [deg]."""

FLAT_DEG, TILT_DEG = 10.0, 5.0
"""Dip and cross-tilt up to which a plane may strike as it likes [deg]."""

_APART_DEG, _PLUNGE_DEG = 5.0, 10.0

Vector = tuple[float, float, float]
"""Components to the east, to the north and up."""


class Plane(NamedTuple):
    """A plane in space.

    Args:
        dip_deg: its dip, from 0 to 90 [deg].
        direction_deg: azimuth down its dip, from north by east [deg].
    """

    dip_deg: float
    direction_deg: float

    def __str__(self) -> str:
        """Return dip and dip direction in geological notation."""
        return f"{self.dip_deg:.4g}/{self.direction_deg:03.4g}"

    @property
    def pole(self) -> Vector:
        """The upward unit normal."""
        dip, azimuth = math.radians(self.dip_deg), math.radians(self.direction_deg)
        across = math.sin(dip)
        return across * math.sin(azimuth), across * math.cos(azimuth), math.cos(dip)

    def trace_deg(self, azimuth_deg: float) -> float:
        """Return its apparent dip in a section, positive towards an azimuth [deg]."""
        off = math.radians(self.direction_deg - azimuth_deg)
        return _along(self.dip_deg, math.cos(off))

    def cross_tilt_deg(self, azimuth_deg: float) -> float:
        """Return its apparent dip across a section [deg]."""
        off = math.radians(self.direction_deg - azimuth_deg)
        return _along(self.dip_deg, math.sin(off))

    def spacing_factor(self, azimuth_deg: float) -> float:
        """Return the spacing of such planes in a section over their true spacing."""
        across = math.sin(math.radians(self.dip_deg)) * math.sin(
            math.radians(self.direction_deg - azimuth_deg)
        )
        return 1.0 / math.sqrt(1.0 - across * across) if abs(across) < 1.0 else math.inf

    def strikes_off_deg(self, other: Plane) -> float:
        """Return the angle between its strike and that of another plane, 0 to 90 [deg]."""
        off = (self.direction_deg - other.direction_deg) % 180.0
        return min(off, 180.0 - off)

    def is_exempt(self, azimuth_deg: float) -> bool:
        """Return whether it is so flat that its strike does not matter in a section."""
        flat = self.dip_deg <= FLAT_DEG
        return flat and abs(self.cross_tilt_deg(azimuth_deg)) <= TILT_DEG


def _along(dip_deg: float, cosine: float) -> float:
    if dip_deg == 90.0:
        return 90.0 if cosine > 1e-12 else -90.0 if cosine < -1e-12 else 0.0
    # what a cosine of 1 leaves of the dip is the dip, to the last bit that is stated
    return round(math.degrees(math.atan(math.tan(math.radians(dip_deg)) * cosine)), 10)


_WRITTEN = re.compile(r"\s*(\d+(?:\.\d*)?)\s*°?\s*/\s*(\d+(?:\.\d*)?)\s*°?\s*")


def plane_of(text: object, name: str) -> Plane:
    """Return the plane written as dip/dip direction: 25/102.

    Raises:
        InputError: it is not written so, or no dip or no azimuth.
    """
    read = _WRITTEN.fullmatch(str(text))
    if read is None:
        raise InputError(
            f"{name} = {str(text)[:40]!r} is not dip/dip direction in degrees, such as 25/102",
            fields=(name,),
        )
    plane = Plane(float(read[1]), float(read[2]))
    if plane.dip_deg > 90.0 or plane.direction_deg > 360.0:
        raise InputError(
            f"{name} = {text}: a dip is at most 90 and a dip direction at most 360 deg; the dip "
            "comes first",
            fields=(name,),
        )
    return plane


def line_of(first: Plane, second: Plane) -> tuple[float, float]:
    """Return plunge and trend of the line of intersection of two planes that are not parallel
    [deg].
    """
    (a, b, c), (d, e, f) = first.pole, second.pole
    x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
    if z > 0.0:
        x, y, z = -x, -y, -z
    return (
        math.degrees(math.atan2(-z, math.hypot(x, y))),
        math.degrees(math.atan2(x, y)) % 360.0,
    )


def _between_deg(first: Plane, second: Plane) -> float:
    cosine = abs(sum(a * b for a, b in zip(first.pole, second.pole, strict=True)))
    return math.degrees(math.acos(min(cosine, 1.0)))


class Section(NamedTuple):
    """Angles and spacing factors of a block's planes in a section across the face.

    Args:
        beta_deg: dip of the base, out of the slope positive [deg].
        gamma_deg: dip of the back less that of the base [deg]; None without a back.
        base_factor: spacing of the base fractures in the section over that along their normal.
        back_factor: likewise of the back fractures.
        remarks: what the section leaves out.
    """

    beta_deg: float
    gamma_deg: float | None
    base_factor: float
    back_factor: float
    remarks: tuple[Diagnostic, ...]


def section_of(face: Plane, base: Plane, back: Plane | None = None) -> Section:
    """Return the section across a face.

    Raises:
        InputError: the planes are none of a section: they strike off the face, make a wedge, are
            all but parallel, or the back lies before the base.
    """
    azimuth = face.direction_deg
    remarks: list[Diagnostic] = []
    named = {"base": base} | ({} if back is None else {"back": back})
    line = None if back is None or _between_deg(base, back) < 1e-6 else line_of(base, back)
    for name, plane in named.items():
        off = plane.strikes_off_deg(face)
        if off <= STRIKE_DEG:
            continue
        tilt = plane.cross_tilt_deg(azimuth)
        if plane.is_exempt(azimuth):
            text = (
                f"the {name} {plane} strikes {off:.0f} deg off the face and is flat: its "
                f"cross-tilt of {abs(tilt):.1f} deg is neglected"
            )
            remarks.append(Diagnostic(text, "cross_tilt_neglected"))
            continue
        wedge = ""
        if line is not None:
            plunge, trend = line
            daylights = " and daylights" if 0.0 < plunge < face.trace_deg(trend) else ""
            wedge = (
                f": base and back make a wedge, whose line plunges {plunge:.1f} deg toward "
                f"{trend:03.0f}{daylights}; analyse it as a wedge"
            )
        raise InputError(
            f"the {name} {plane} strikes {off:.0f} deg off the face {face}, more than the "
            f"{STRIKE_DEG:g} deg allowed for a section{wedge}",
            fields=(name, "face"),
        )
    beta = base.trace_deg(azimuth)
    if abs(beta) >= 90.0:
        raise InputError(f"the base {base} is upright in the section", fields=("base",))
    if 0.0 < face.trace_deg(azimuth) < beta:
        text = (
            f"the base dips by {beta:.1f} deg, steeper than the face {face}: it does not come out "
            "of the slope"
        )
        remarks.append(Diagnostic(text, "steep_base"))
    if back is None:
        return Section(beta, None, base.spacing_factor(azimuth), 1.0, tuple(remarks))
    if (between := _between_deg(base, back)) < _APART_DEG:
        raise InputError(
            f"base {base} and back {back} are {between:.1f} deg apart: at least {_APART_DEG:g} "
            "deg are required",
            fields=("base", "back"),
        )
    gamma = round(back.trace_deg(azimuth) % 180.0 - beta, 10)
    if not 0.0 < gamma < 180.0:
        raise InputError(
            f"base {base} and back {back} enclose gamma = {gamma:.4g} deg in the section, which is "
            "not between 0 and 180",
            fields=("base", "back"),
        )
    assert line is not None
    apart, flat = base.strikes_off_deg(back), base.is_exempt(azimuth)
    if line[0] > _PLUNGE_DEG or (apart > STRIKE_DEG and not flat):
        text = (
            f"base and back strike {apart:.0f} deg apart, and their line plunges {line[0]:.1f} deg "
            f"toward {line[1]:03.0f}: the block may leave the section sideways"
        )
        remarks.append(Diagnostic(text, "oblique_planes"))
    return Section(
        beta, gamma, base.spacing_factor(azimuth), back.spacing_factor(azimuth), tuple(remarks)
    )
