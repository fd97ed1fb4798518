"""What became of a mechanism, as the answer that every response model gives."""

from __future__ import annotations

import math

import numpy as np

from rbfrag.motions.quality import quality_flags
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.integrator.one_freedom.follow import Course, Travel, follow
from rbfrag.solver.kind import Shaking
from rbfrag.solver.results import ModeChange, Outcome, Response, ResponseHistory


def mechanism_response(kind: str, mechanism: Mechanism, shaking: Shaking) -> Response:
    """Run a mechanism under a motion.

    Args:
        kind: name of the model, for the answer.
        mechanism: the block.
        shaking: the motion.
    """
    drive = excitation(shaking.motion, shaking.vertical, shaking.polarity)
    course = follow(mechanism, drive, travel=shaking.history)
    failed = course.outcome is Outcome.TOPPLED
    turned = mechanism.rotates and not failed
    critical = mechanism.critical
    start = mechanism.first.pose(0.0).centroid_m
    at_end = None if failed else course.pose
    return Response(
        kind=kind,
        outcome=course.outcome,
        peak_theta_n=course.peak / critical if turned and critical else None,
        peak_theta_rad=course.peak if turned else None,
        critical_angle_deg=None if critical is None else math.degrees(critical),
        started_s=course.started_s,
        toppled_s=(course.certain_s or course.ended_s) if failed else None,
        error_estimate=course.error,
        steps=course.steps,
        samples_moved=course.samples_moved,
        samples_total=int(np.count_nonzero(drive.interval_s)),
        warnings=_warnings(shaking, drive, course),
        history=_history(mechanism, drive, course.travel) if course.travel else None,
        final_theta_rad=abs(at_end.turned_rad) if turned and at_end else None,
        displacement_m=at_end.displacement_m if at_end else None,
        peak_displacement_m=None if failed else course.peak_displacement_m,
        centroid_displacement_m=math.dist(at_end.centroid_m, start) if at_end else None,
        stopped_s=course.ended_s,
        mode_changes=tuple(ModeChange(change.time_s, change.name) for change in course.changes),
    )


def _warnings(shaking: Shaking, drive: Excitation, course: Course) -> tuple[str, ...]:
    motion, vertical = shaking.motion, shaking.vertical
    said = [*motion.remarks, *(flag.sentence for flag in quality_flags(motion)), *drive.warnings]
    if vertical is not None:
        said += [f"vertical: {flag.sentence}" for flag in quality_flags(vertical)]
    return (*shaking.remarks, *said, *course.sentences)


def _history(mechanism: Mechanism, drive: Excitation, travel: Travel) -> ResponseHistory:
    """Put the nodes of rest, which the kernel skips, back between those of motion."""
    time_s, rate = travel.time_s, travel.rate
    displacement = np.array([pose.displacement_m for pose in travel.poses])
    centroid = np.array([pose.centroid_m for pose in travel.poses])
    turned = np.array([pose.turned_rad for pose in travel.poses])
    if drive.time_s[-1] > time_s[-1] and rate[-1] == 0.0:
        rest = drive.time_s
    else:
        rest = drive.time_s[drive.time_s < time_s[-1]]
    rest = rest[~np.isin(rest, time_s)]
    last = np.searchsorted(time_s, rest, side="right") - 1
    known = last >= 0
    start = mechanism.first.pose(0.0)

    def merged(moving: np.ndarray, before: float | tuple[float, float]) -> np.ndarray:
        resting = np.where(
            known if moving.ndim == 1 else known[:, None], moving[np.maximum(last, 0)], before
        )
        together: np.ndarray = np.concatenate([moving, resting])[order]
        return together

    order = np.argsort(np.concatenate([time_s, rest]), kind="stable")
    at_s = np.concatenate([time_s, rest])[order]
    speed = np.concatenate([rate, np.zeros(rest.size)])[order]
    nothing = np.zeros_like(speed)
    k_h = np.interp(at_s, drive.time_s, drive.k_h, right=0.0)
    k_v = np.interp(at_s, drive.time_s, drive.w - 1.0, right=0.0)
    # of a jump, the first entry at its time shows what was before
    for jump in np.flatnonzero(drive.interval_s == 0.0):
        first = int(np.searchsorted(at_s, drive.time_s[jump]))
        if first + 1 < at_s.size and at_s[first] == at_s[first + 1] == drive.time_s[jump]:
            k_h[first], k_v[first] = drive.k_h[jump], drive.w[jump] - 1.0
    return ResponseHistory(
        time_s=at_s,
        theta_rad=merged(np.abs(turned), 0.0),
        theta_dot_rad_s=speed if mechanism.rotates else nothing,
        k_h=k_h,
        k_v=k_v,
        displacement_m=merged(displacement, 0.0),
        velocity_m_s=None if mechanism.rotates else speed,
        centroid_m=merged(centroid, start.centroid_m),
        turned_rad=merged(turned, 0.0),
        strength_g=merged(travel.strength_g, mechanism.first.forward.threshold(0.0)),
    )
