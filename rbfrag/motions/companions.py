"""A horizontal motion with the vertical one of the same recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime

from rbfrag.errors import InputError
from rbfrag.motions.direction import is_downward_name
from rbfrag.motions.ground_motion import GroundMotion

SAME_START = 0.5
"""Starts apart by no more than this share of a sampling interval are the same."""


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
            f"{lead_in_samples[1]} before the vertical: process both alike, or none (--raw)"
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
    found = applied.get("padding_samples", 0) if isinstance(applied, Mapping) else 0
    return found if isinstance(found, int) else 0
