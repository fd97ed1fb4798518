"""Direction of a component by its name; pairing of a horizontal motion with its vertical one."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion

VERTICAL_NAMES = frozenset(
    {"UP", "DOWN", "DWN", "DN", "VER", "VR", "VRT", "VERT", "VERTICAL", "VERTICALE", "VERTIKAL",
     "V", "Z", "U", "UD", "DU", "UPDO", "UPDN", "UPDOWN", "UPWARD", "DOWNWARD", "ARRIBA", "ABAJO",
     "DUSEY", "上下", "鉛直", "垂直"}
)  # fmt: skip
"""Names of vertical components without separators and accents, upper case."""

_DOWNWARD_NAMES = frozenset({"DOWN", "DOWNWARD", "DWN", "DN", "ABAJO"})

# English, Spanish, Portuguese, Italian, French, German, Turkish
_COMPASS = {
    **dict.fromkeys(("N", "NORTH", "NORTE", "NORD", "KUZEY", "南北"), 0.0),
    **dict.fromkeys(("NS", "SN", "KG", "GK", "NORTHSOUTH", "NORTESUR", "NORTESUL"), 0.0),
    **dict.fromkeys(("NORDSUD", "KUZEYGUNEY"), 0.0),
    **dict.fromkeys(("E", "EAST", "ESTE", "LESTE", "EST", "OST", "DOGU", "東西", "东西"), 90.0),
    **dict.fromkeys(("EW", "WE", "EO", "OE", "DB", "BD", "EASTWEST", "ESTEOESTE"), 90.0),
    **dict.fromkeys(("LESTEOESTE", "ESTOVEST", "ESTOUEST", "OSTWEST", "DOGUBATI"), 90.0),
    **dict.fromkeys(("S", "SOUTH", "SUR", "SUL", "SUD", "GUNEY"), 180.0),
    **dict.fromkeys(("W", "WEST", "OESTE", "OVEST", "OUEST", "BATI"), 270.0),
}
"""Azimuth [deg] of words, and of axes, whose positive end is assumed to be north or east."""

HORIZONTAL_NAMES = frozenset(
    {"H1", "H2", "L", "T", "X", "Y", "LN", "TR", "LONG", "LONGITUDINAL", "TRAN", "TRANS",
     "TRANSV", "TRANSVERSE", "TRANSVERSAL", "TRASVERSALE", "LONGITUDINALE", "RADIAL",
     "HORIZONTAL", "HORIZONTAL1", "HORIZONTAL2", "HOR1", "HOR2"}
)  # fmt: skip
"""Axes of an instrument, whose azimuth the name does not tell."""

_SIGNS = "+-\u2212\u2013"
_PARENTHESIS = re.compile(r"\s*\([^()]*\)?\s*$")
_COMPONENT = re.compile(r"^COMP(?:ONENTE?)?\b[\s.:]*|[\s.:]*\bCOMP(?:ONENTE?)?\.?$")
_SEPARATORS = re.compile(r"[\s/_.\-]+")
_BEARING = re.compile(r"([NS])\s*(\d{1,2}(?:\.\d+)?)\s*([EWO])")
# SEED channel names of seismometers and accelerometers: band, instrument, orientation
_SEED = re.compile(r"[A-Z][HLNG]([ZNE12])")
# a single digit may as well be the number of a channel
_AZIMUTH = re.compile(
    r"((?:0|[1-9]\d|\d{3}|\d{1,3}(?=\s*D|\.\d))(?:\.\d+)?)(?:\s*DEG(?:REES?)?\.?)?", re.ASCII
)
# L1, V2, T3, UD2: the digit counts the channels or the sensors of a borehole
_NUMBERED = re.compile(r"(NS|EW|UD|UP|L|T|V|Z)\d")
# what follows a station: CHY101-E, CI.PAS..HNZ, HMCDWN, AMBCN86E, NIGH01EW
_AFTER_STATION = re.compile(
    r"[\w.:-]{3,}?(DWN|[NS]\d\d[EW])|[A-Z]\w*\d(NS|EW|UD)|.*[-.:_](?=[^\d.])(.+)", re.ASCII
)


def bare_name(component: str) -> str:
    """Return a component's name without sign and trailing parenthesis.

    Args:
        component: as a file has it: ``+V``, ``UP       (STA CHN:  1)``.
    """
    name = _PARENTHESIS.sub("", component).strip().strip(_SIGNS).strip()
    return name or component.strip(" ()")


def is_vertical_name(component: str) -> bool | None:
    """Return whether a component is vertical; None if its name does not show it.

    Args:
        component: as the file names it: ``UP``, ``+V``, ``HNZ``, ``360``, ``N10E``, ``NORTE``.
    """
    return _direction(_spelling(component))[0]


def is_downward_name(component: str) -> bool:
    """Return whether positive samples are downward by the component's name.

    Args:
        component: as the file names it: ``DOWN``, ``DWN``, ``DN``.
    """
    name = _spelling(component)
    return name in _DOWNWARD_NAMES or _after_station(name) in _DOWNWARD_NAMES


def azimuth_deg(component: str) -> float | None:
    """Return the azimuth of a component [deg], clockwise from north; None if unknown.

    Args:
        component: as the file names it: ``360``, ``90°``, ``N10E``, ``S62W``, ``EAST``, ``E-O``,
            or a SEED channel such as ``HNE``.
    """
    return _direction(_spelling(component))[1]


def _spelling(component: str) -> str:
    """Return a name in upper case without sign, parenthesis, accents and degree signs."""
    # a degree sign, and the ordinal sign that keyboards have in its place
    name = re.sub(r"\s*[°º˚]", " DEG", bare_name(component)).upper()
    letters = unicodedata.normalize("NFKD", name)
    name = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return _COMPONENT.sub("", name).strip(" .")


def _direction(name: str) -> tuple[bool | None, float | None]:
    """Return whether a name is that of a vertical component, and its azimuth [deg]."""
    if azimuth := _AZIMUTH.fullmatch(name):
        degrees = float(azimuth[1])
        return (False, degrees % 360.0) if degrees <= 360.0 else (None, None)
    if bearing := _BEARING.fullmatch(name.replace("DEG", "").strip()):
        angle = float(bearing[2])
        if angle > 90.0:
            return None, None
        turned = angle if bearing[3] == "E" else -angle
        return False, (turned if bearing[1] == "N" else 180.0 - turned) % 360.0
    word = _SEPARATORS.sub("", name)
    if numbered := _NUMBERED.fullmatch(word):
        word = numbered[1]
    if seed := _SEED.fullmatch(word):
        word = seed[1] if seed[1] in "ZNE" else "H1"
    if word in VERTICAL_NAMES:
        return True, None
    if word in _COMPASS or word in HORIZONTAL_NAMES:
        return False, _COMPASS.get(word)
    after = _after_station(name)
    return _direction(after) if after else (None, None)


def _after_station(name: str) -> str:
    """Return the part of a name after the station code; empty if there is none."""
    after = _AFTER_STATION.fullmatch(name)
    return next(filter(None, after.groups())) if after else ""


SAME_START = 0.5
"""Starts apart by no more than this part of a sampling interval are the same."""


def upward(vertical: GroundMotion) -> GroundMotion:
    """Return a vertical motion whose positive samples are upward.

    Args:
        vertical: as its file has it; a component called ``DOWN``, ``DWN`` or ``DN`` is turned
            and then called ``UP``, with a remark. Any other comes back as it is.
    """
    if not is_downward_name(vertical.component):
        return vertical
    applied = dict(vertical.processing_applied or {})
    return replace(
        vertical,
        # + 0.0 turns -0.0 into 0.0
        acceleration_g=0.0 - vertical.acceleration_g,
        component="UP",
        source_sha256=vertical.source_sha256 or vertical.sha256,
        processing_applied={**applied, "turned_upward": True},
        remarks=(
            *vertical.remarks,
            f"the component {vertical.component} was turned: positive is upward here",
        ),
    )


def why_not_together(
    *,
    dt_s: tuple[float | None, float | None],
    start_time: tuple[datetime | None, datetime | None],
    lead_in_samples: tuple[int, int],
    names: tuple[str, str] = ("the horizontal", "the vertical component"),
) -> str:
    """Return the reason why two components of a recording do not match; empty if they do.

    Different lengths are no reason: the ground of the shorter one is at rest after its end.

    Args:
        dt_s: sampling intervals of the two components [s].
        start_time: times of their first samples by the clock of their files, where known.
        lead_in_samples: zeros that processing put before the first sample of the file.
        names: the two components in the reason.
    """
    if dt_s[0] is None or dt_s[1] is None:
        # motions from nodes carry their times themselves; the solver compares those
        return ""
    if dt_s[0] != dt_s[1]:
        return (
            f"{names[1]} has dt = {dt_s[1]:g} s, {names[0]} {dt_s[0]:g} s: bring both to one "
            "sampling interval first"
        )
    if lead_in_samples[0] != lead_in_samples[1]:
        return (
            f"processing put {lead_in_samples[0]} samples before {names[0]} and "
            f"{lead_in_samples[1]} before {names[1]}: process both alike, or neither"
        )
    first, second = start_time
    if first is not None and second is not None:
        late_s = (second - first).total_seconds()
        if abs(late_s) > SAME_START * dt_s[0]:
            return (
                f"{names[1]} starts {abs(late_s):g} s {'after' if late_s > 0.0 else 'before'} "
                f"{names[0]}, as their headers say: cut both to a common start first"
            )
    return ""


def companion(horizontal: GroundMotion, vertical: GroundMotion) -> GroundMotion:
    """Return the solver's `vertical` for a horizontal motion: upward, and at the same times.

    Args:
        horizontal: the motion that drives the block.
        vertical: the vertical component of the same recording.

    Raises:
        InputError: they do not fit together; the message says why.
    """
    reason = why_not_together(
        dt_s=(horizontal.dt_s, vertical.dt_s),
        start_time=(horizontal.start_time, vertical.start_time),
        lead_in_samples=(lead_in_samples(horizontal), lead_in_samples(vertical)),
    )
    if reason:
        raise InputError(f"{vertical.label} cannot be combined with {horizontal.label}: {reason}")
    return upward(vertical)


def lead_in_samples(motion: GroundMotion) -> int:
    """Return the number of zeros that processing added before the first sample of the file."""
    return lead_in_of(motion.processing_applied)


def lead_in_of(applied: object) -> int:
    """Return the number of zeros before the first sample, from stored processing parameters.

    Args:
        applied: `processing_applied` of a motion or of a stored row, or None.
    """
    samples = applied.get("padding_samples", 0) if isinstance(applied, Mapping) else 0
    return samples if isinstance(samples, int) else 0
