"""Rotation of the two horizontal components of a recording into another direction.

The components n₁, n₂ point to the azimuths α₁, α₂. The component toward the azimuth α is

    a(α) = [a₁ sin(α₂ − α) + a₂ sin(α − α₁)] / sin(α₂ − α₁),

which for perpendicular components is the usual rotation.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.direction import lead_in_samples, why_not_together
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import FloatArray
from rbfrag.motions.response_spectrum import DirectionalPeaks, directional_peaks

SMALLEST_ANGLE_DEG = 30.0
"""Smallest angle between two axes that are solved for: errors of the components double there."""

MOST_MISSING = 0.05
"""Largest fraction by which one component may be shorter: it is followed by rest."""

ROTATED = "rotated"
"""Key of `processing_applied` of a motion that was rotated."""


def rotate(first: GroundMotion, other: GroundMotion, azimuth_deg: float) -> GroundMotion:
    """Return the component of a recording toward an azimuth.

    Toward α + 180° it is that toward α with every sign changed, bit for bit.

    Args:
        first: a horizontal component with its orientation.
        other: the other horizontal component of the same recording.
        azimuth_deg: azimuth of the positive direction [deg], clockwise from north.

    Raises:
        InputError: the components do not belong together, or their orientations are unknown.
    """
    if not math.isfinite(azimuth_deg):
        raise InputError(f"azimuth {azimuth_deg} must be a number of degrees from north")
    reason = why_not_a_pair(first, other)
    angles = first.orientation_deg, other.orientation_deg
    if not reason and (angles[0] is None or angles[1] is None):
        missing = " and ".join(m.component for m in (first, other) if m.orientation_deg is None)
        reason = f"the azimuth of {missing} is unknown: give it as component in the metadata"
    if reason or angles[0] is None or angles[1] is None:
        pair = f"{first.component} and {other.component}"
        raise InputError(f"{first.station}: components {pair} cannot be rotated: {reason}")
    azimuth_deg = round(azimuth_deg % 360.0, 9) % 360.0
    across = _sine(angles[1] - angles[0])
    weights = _sine(angles[1] - azimuth_deg) / across, _sine(azimuth_deg - angles[0]) / across
    components_g = _of_one_length(first, other)
    # + 0.0 turns -0.0 into 0.0
    samples = weights[0] * components_g[0] + weights[1] * components_g[1] + 0.0
    sources = [motion.source_sha256 or motion.sha256 for motion in (first, other)]
    names = [motion.component for motion in (first, other)]
    origin = " and ".join(f"{n} ({a:g}°)" for n, a in zip(names, angles, strict=True))
    applied = {"azimuth_deg": azimuth_deg, "components": names, "orientations_deg": [*angles]}
    return replace(
        first,
        acceleration_g=samples,
        component=f"az{azimuth_deg:.10g}",
        orientation_deg=azimuth_deg,
        is_partial=first.is_partial or other.is_partial,
        processing_applied={**(first.processing_applied or {}), ROTATED: applied},
        source_sha256=hashlib.sha256("".join(sources).encode("ascii")).hexdigest(),
        remarks=(
            *dict.fromkeys((*first.remarks, *other.remarks)),
            f"rotated to azimuth {azimuth_deg:.10g}° from the components {origin}",
        ),
    )


def rotate_into_slope(
    first: GroundMotion, other: GroundMotion, slope_azimuth_deg: float
) -> GroundMotion:
    """Return the component whose positive samples drive a block out of a slope.

    The ground then accelerates into the slope, toward the dip direction + 180°: forward polarity.

    Args:
        first: a horizontal component with its orientation.
        other: the other horizontal component of the same recording.
        slope_azimuth_deg: dip direction of the slope [deg], clockwise from north.
    """
    motion = rotate(first, other, slope_azimuth_deg + 180.0)
    remark = f"{motion.remarks[-1]}, into the slope that dips toward {slope_azimuth_deg % 360.0:g}°"
    return replace(motion, remarks=(*motion.remarks[:-1], remark))


def rotd(
    first: GroundMotion, other: GroundMotion
) -> tuple[DirectionalPeaks, DirectionalPeaks] | None:
    """Return RotD50 and RotD100 of a recording; None where its components do not match.

    Components of unknown orientation are assumed to be perpendicular.
    """
    if why_not_a_pair(first, other):
        return None
    components_g = _of_one_length(first, other)
    if first.orientation_deg is not None and other.orientation_deg is not None:
        angle_deg = other.orientation_deg - first.orientation_deg
        components_g[1] -= components_g[0] * _sine(90.0 - angle_deg)
        components_g[1] /= _sine(angle_deg)
    longer = first if first.npts >= other.npts else other
    return directional_peaks(components_g, longer.interval_s)


def _of_one_length(first: GroundMotion, other: GroundMotion) -> FloatArray:
    """Return the samples of both components, the shorter followed by rest, shape (2, n)."""
    samples = np.zeros((2, max(first.npts, other.npts)))
    for row, motion in zip(samples, (first, other), strict=True):
        row[: motion.npts] = motion.acceleration_g
    return samples


def why_not_a_pair(first: GroundMotion, other: GroundMotion) -> str:
    """Return the reason why two components are no pair of horizontals; empty if they are."""
    upright = " and ".join(m.component for m in (first, other) if m.is_vertical)
    if upright:
        return f"{upright} is vertical: give a horizontal component"
    if first.dt_s is None or other.dt_s is None:
        return "equally spaced samples are required: resample the motions"
    if ROTATED in {**(first.processing_applied or {}), **(other.processing_applied or {})}:
        return "one of them was rotated before: give the recorded components"
    reason = why_not_together(
        dt_s=(first.dt_s, other.dt_s),
        start_time=(first.start_time, other.start_time),
        lead_in_samples=(lead_in_samples(first), lead_in_samples(other)),
        names=("the one component", "the other"),
    )
    if not reason and treatment(first.processing_applied) != treatment(other.processing_applied):
        reason = "they were processed differently: process both alike, or neither"
    if not reason and abs(first.npts - other.npts) > MOST_MISSING * max(first.npts, other.npts):
        reason = f"they have {first.npts} and {other.npts} samples: cut both to one length"
    angles = first.orientation_deg, other.orientation_deg
    if not reason and angles[0] is not None and angles[1] is not None:
        angle_deg = abs((angles[1] - angles[0] + 90.0) % 180.0 - 90.0)
        if angle_deg < SMALLEST_ANGLE_DEG:
            reason = (
                f"their axes {angles[0]:g}° and {angles[1]:g}° are {angle_deg:g}° apart: at least "
                f"{SMALLEST_ANGLE_DEG:g}° are required"
            )
    return reason


def treatment(applied: object) -> dict[str, object]:
    """Return the processing that components of one recording share, of `processing_applied`."""
    shared = {**applied} if isinstance(applied, Mapping) else {}
    for name in ("turned_upward", ROTATED):
        shared.pop(name, None)
    return shared


def _sine(angle_deg: float) -> float:
    """Return the sine of an angle [deg], of which sin(x + 180°) = −sin x exactly."""
    # rounded, so that 300.3° less 180° is 120.3°
    turned = round(angle_deg % 360.0, 9) % 360.0
    if turned >= 180.0:
        return -_sine(turned - 180.0)
    return math.sin(math.radians(min(turned, round(180.0 - turned, 9))))
