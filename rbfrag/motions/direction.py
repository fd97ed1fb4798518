"""What a component's name says: its azimuth, and whether it is vertical."""

from __future__ import annotations

import re

VERTICAL_NAMES = frozenset(
    {"UP", "DOWN", "DWN", "DN", "VER", "VRT", "VERT", "VERTICAL", "V", "Z", "U", "UD", "U-D"}
)

_DOWNWARD_NAMES = frozenset({"DOWN", "DWN", "DN"})

_COMPASS = {
    "N": 0.0, "NORTH": 0.0, "NS": 0.0, "N-S": 0.0,
    "E": 90.0, "EAST": 90.0, "EW": 90.0, "E-W": 90.0,
    "S": 180.0, "SOUTH": 180.0,
    "W": 270.0, "WEST": 270.0,
}  # fmt: skip

HORIZONTAL_NAMES = frozenset(
    {"H1", "H2", "L", "T", "LONG", "TRAN", "TRANS", "LONGITUDINAL", "TRANSVERSE"}
)
"""Axes of an instrument, whose azimuth the name does not tell."""

_BEARING = re.compile(r"([NS])\s*(\d{1,2}(?:\.\d+)?)\s*([EW])")
# SEED channel names of seismometers and accelerometers: band, instrument, orientation
_SEED = re.compile(r"[A-Z][HLNG]([ZNE12])")
_AZIMUTH = re.compile(r"(\d{1,3}(?:\.\d+)?)(?:\s*DEG\.?)?", re.ASCII)


def is_vertical_name(component: str) -> bool | None:
    """Return whether a component is vertical; None when its name does not say.

    Args:
        component: as the file names it: ``UP``, ``-UP``, ``HNZ``, ``360``, ``N10E``.
    """
    # file names join station and component by a dash, which some headers keep
    name = component.strip().upper().lstrip("-")
    seed = _SEED.fullmatch(name)
    if name in VERTICAL_NAMES or (seed and seed[1] == "Z"):
        return True
    if seed or name in HORIZONTAL_NAMES or azimuth_deg(component) is not None:
        return False
    return None


def is_downward_name(component: str) -> bool:
    """Return whether a component's name says that its positive samples are downward.

    Args:
        component: as the file names it: ``DOWN``, ``DWN``, ``DN``.
    """
    return component.strip().upper().lstrip("-") in _DOWNWARD_NAMES


def azimuth_deg(component: str) -> float | None:
    """Return the azimuth of a component [deg], clockwise from north; None if not stated.

    Args:
        component: as the file names it: ``360``, ``90 Deg``, ``N10E``, ``S62W``, ``EAST``, or a
            SEED channel such as ``HNE``.
    """
    name = component.strip().upper()
    if (seed := _SEED.fullmatch(name)) and seed[1] in "NE":
        return _COMPASS[seed[1]]
    if name in _COMPASS:
        return _COMPASS[name]
    if bearing := _BEARING.fullmatch(name):
        angle = float(bearing[2])
        if angle > 90.0:
            return None
        turned = angle if bearing[3] == "E" else -angle
        return (turned if bearing[1] == "N" else 180.0 - turned) % 360.0
    if (azimuth := _AZIMUTH.fullmatch(name)) and float(azimuth[1]) <= 360.0:
        return float(azimuth[1]) % 360.0
    return None
