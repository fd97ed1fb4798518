"""What a component's name says of its direction; a horizontal motion with its vertical one."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion

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
) -> str:
    """Return why a horizontal and a vertical motion do not fit together; empty when they do.

    Different lengths are no reason: the ground of the shorter one is at rest after its end.

    Args:
        dt_s: sampling intervals of the horizontal and the vertical [s].
        start_time: times of their first samples by the clock of their files, where known.
        lead_in_samples: zeros that processing put before the first sample of the file.
    """
    if dt_s[0] is None or dt_s[1] is None:
        # motions from nodes carry their times themselves; the solver compares those
        return ""
    if dt_s[0] != dt_s[1]:
        return (
            f"the vertical component has dt = {dt_s[1]:g} s, the horizontal {dt_s[0]:g} s: bring "
            "both to one sampling interval first"
        )
    if lead_in_samples[0] != lead_in_samples[1]:
        return (
            f"processing put {lead_in_samples[0]} samples before the horizontal component and "
            f"{lead_in_samples[1]} before the vertical: process both alike, or neither"
        )
    first, second = start_time
    if first is not None and second is not None:
        late_s = (second - first).total_seconds()
        if abs(late_s) > SAME_START * dt_s[0]:
            return (
                f"the vertical component starts {abs(late_s):g} s "
                f"{'after' if late_s > 0.0 else 'before'} the horizontal, as their headers say: "
                "cut both to a common start first"
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
        raise InputError(f"{vertical.label} cannot go with {horizontal.label}: {reason}")
    return upward(vertical)


def lead_in_samples(motion: GroundMotion) -> int:
    """Return how many zeros processing put before the first sample of the file."""
    return lead_in_of(motion.processing_applied)


def lead_in_of(applied: object) -> int:
    """Return the zeros before the first sample, as stored parameters of processing say.

    Args:
        applied: `processing_applied` of a motion or of a stored row, or None.
    """
    samples = applied.get("padding_samples", 0) if isinstance(applied, Mapping) else 0
    return samples if isinstance(samples, int) else 0
