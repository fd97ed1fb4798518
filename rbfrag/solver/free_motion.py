"""Motion of a block on its planes after its mechanism has ended: `free_motion`.

Which corners touch is found step by step (`rbfrag.solver.integrator.free_body`). Impacts take the
speed towards the plane and leave the rest: rigid bodies without rebound. Rigid contact does not
decide what an impact does, and a block that slides for millimetres goes by its impacts: the error
is what other laws of impact and friction make of the same motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.free_body import (
    AT_REST,
    BACKWARD,
    FORWARD,
    HEEL,
    JUMPED,
    ON_BACK,
    ON_BASE,
    ROWS,
    TOE,
    Frame,
    FreeRun,
    Motion,
    run_free,
)
from rbfrag.solver.integrator.impulses import Corners, work_of
from rbfrag.solver.integrator.one_freedom.equation import Pose
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import FloatArray, ModeChange, Outcome
from rbfrag.solver.stability.modes import ModeName

TOUCHES = 1e-6
"""Distance from a plane, over the size of the block, at which a corner touches it: steps leave
a few times 1e-9 of it."""


def corner_at(
    centroid: tuple[float, float], turned_rad: float, arm: tuple[float, float]
) -> tuple[float, float]:
    """Return the position [m] of a corner from its arm about the centroid before rotation."""
    c, s = math.cos(turned_rad), math.sin(turned_rad)
    return centroid[0] + arm[0] * c - arm[1] * s, centroid[1] + arm[0] * s + arm[1] * c


def corners_of(supported_block: SupportedBlock, block: Block) -> Corners:
    """Return the pairs of corner and plane: those with the base first."""
    arms = np.array(block.outline)
    gamma = math.radians(block.gamma_deg)
    # of base and back plane, into the block; each plane touches its nearest corner at rest
    normals = [(0.0, 1.0), (math.sin(gamma), math.cos(gamma))]
    from_heel = arms - np.array(block.heel)
    planes = 2 if supported_block.back_fracture else 1
    offs = [float((from_heel @ np.array(normal)).min()) for normal in normals]
    n = len(arms)
    friction = (math.tan(supported_block.phi_rad), math.tan(supported_block.phi_back_rad))
    named = {block.heel: HEEL, block.toe: TOE}
    bits = [named.get(arm, ON_BASE) for arm in block.outline] + [ON_BACK] * (planes - 1) * n

    def both(values: list[float] | tuple[float, ...]) -> FloatArray:
        return np.repeat(np.array(values[:planes], dtype=np.float64), n)

    return Corners(
        np.tile(arms[:, 0], planes),
        np.tile(arms[:, 1], planes),
        both([x for x, _ in normals]),
        both([y for _, y in normals]),
        both(offs),
        both(friction),
        np.array(bits, dtype=np.float64),
    )


def gap_m(block: Block, pose: Pose) -> float:
    """Return the gap between the heel and its back plane, along the base [m]."""
    # normal distance of the heel from its plane, less that which a missing corner leaves at rest
    gamma = math.radians(block.gamma_deg)
    normal = (math.sin(gamma), math.cos(gamma))
    low = [a - b for a, b in zip(block.lowest_on_back, block.heel, strict=True)]
    off = low[0] * normal[0] + low[1] * normal[1]
    x, y = corner_at(pose.centroid_m, pose.turned_rad, block.heel)
    gap = (x * normal[0] + y * normal[1] - off) / normal[0]
    return gap if gap > 1e-12 * block.r3_m else 0.0


def touching(supported_block: SupportedBlock, pose: Pose) -> tuple[str, ...]:
    """Return the corners of a block that touch each plane."""
    block = supported_block.block
    assert block is not None
    corners = corners_of(supported_block, block)
    n = len(block.outline)
    names = {block.heel: "heel", block.toe: "toe", block.back: "upper back corner"}
    contacts = []
    for i in range(corners.arm_x.size):
        arm = block.outline[i % n]
        x, y = corner_at(pose.centroid_m, pose.turned_rad, arm)
        away = x * corners.normal_x[i] + y * corners.normal_y[i] - corners.off_m[i]
        if away <= TOUCHES * block.r3_m:
            plane = "base" if i < n else "back plane"
            contacts.append(f"{names.get(arm, 'another corner')} on the {plane}")
    return tuple(contacts)


STEP_S = 2e-4
"""Step [s]; a second run of twice the step gives the error of the steps."""

RIGID = (0.0, 1.0)
"""Restitution and friction of impacts, as `rbfrag.solver.integrator.free_body.Frame` has them: they
take all of the speed towards the plane, and rub by Coulomb's law."""

OTHER_LAWS = ((0.2, 1.0), (0.0, 0.0))
"""The same of laws that rigid contact permits, too: with rebound; without friction in impacts."""

SHORTEST_S = 0.02
"""Time for which a block must do something for it to count as a change of what it does [s]."""

ON_ITS_BACK_EDGE = (
    "the back edge of the block lies on the base plane: it slides on from there, past recovery"
)
ON_ITS_FACE = "the block lies on its front face"
NEVER_ENDS = "a minute after the record the block neither stops nor falls"


@dataclass(frozen=True)
class Release:
    """Position and velocity of a block when its mechanism ends.

    Args:
        time_s: when [s].
        velocity_m_s: velocity of the centroid in the base frame [m/s].
        spin_rad_s: rate of its rotation, counter-clockwise [rad/s].
    """

    time_s: float
    pose: Pose
    velocity_m_s: tuple[float, float] = (0.0, 0.0)
    spin_rad_s: float = 0.0


class Kinematics(NamedTuple):
    """A motion in time; arrays of shape (n,) but for the centroid (n, 2).

    Args:
        time_s: times [s].
        turned_rad: rotation, counter-clockwise [rad].
        rate_rad_s: rate of its size [rad/s].
        centroid_m: position of the centroid [m].
        slip_m: displacement of the contact along the base [m].
        slip_m_s: its velocity [m/s].
        strength_g: driving acceleration that neither speeds the block up nor slows it down [g]; NaN
            without a mechanism, which alone has one.
    """

    time_s: FloatArray
    turned_rad: FloatArray
    rate_rad_s: FloatArray
    centroid_m: FloatArray
    slip_m: FloatArray
    slip_m_s: FloatArray
    strength_g: FloatArray


class FreeError(NamedTuple):
    """Error of the rotation [rad] and of the displacement [m], of their extremes and at the end."""

    rotation_rad: float
    displacement_m: float


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Motion of a block after its mechanism has ended.

    Args:
        outcome: how it ended.
        sentence: what happened at the end; empty where it came to rest.
        time_s: when it came to rest, or ended [s].
        pose: where it is then.
        started_s: first motion [s]; None for none.
        landed_s: first time at which its whole base fell on the base plane [s], or None.
        backward_rad: greatest rotation backward (counter-clockwise) [rad].
        forward_rad: greatest rotation forward [rad].
        slip_m: greatest displacement of the contact along the base [m].
        step_error: difference from a run of twice the step.
        steps: steps of both runs.
        contact: the contact whose displacement is given, from the centroid [m].
        rows: what the kernel kept of the motion.
        coarse: the run of twice the step.
        by_other_laws: runs the block by the laws of `OTHER_LAWS`.
    """

    outcome: Outcome
    sentence: str
    time_s: float
    pose: Pose
    started_s: float | None
    landed_s: float | None
    backward_rad: float
    forward_rad: float
    slip_m: float
    step_error: FreeError
    steps: int
    block: Block
    contact: tuple[float, float]
    rows: FloatArray
    coarse: _Path
    by_other_laws: Callable[[], tuple[_Path, ...]]

    @cached_property
    def _alternatives(self) -> tuple[_Path, ...]:
        """Runs with alternative laws of impact and friction, which take as long as the motion
        itself.
        """
        return self.by_other_laws()

    @cached_property
    def error(self) -> FreeError | None:
        """Error of the steps plus the spread of the laws of impact; None where they disagree on
        whether the block fails."""
        if any(other.fails != self.coarse.fails for other in self._alternatives):
            return None
        # compared with the coarse run: what laws differ by needs no finer steps
        of_laws = map(max, *(self.coarse.differences_from(other) for other in self._alternatives))
        return FreeError(*(a + b for a, b in zip(self.step_error, of_laws, strict=True)))

    @cached_property
    def by_law(self) -> tuple[Pose, ...]:
        """Resting places of the coarse run and of the alternative laws; () unless all runs rest."""
        paths = (self.coarse, *self._alternatives)
        if any(path.run.stop != AT_REST for path in paths):
            return ()
        return tuple(_pose(self.block, path.run.motion, self.contact) for path in paths)

    @cached_property
    def history(self) -> Kinematics:
        """The motion in time."""
        time_s, x, y, turned, vx, _, spin, _ = self.rows
        arm_x, arm_y = self.contact
        return Kinematics(
            time_s.copy(),
            turned.copy(),
            np.where(turned < 0.0, -spin, spin),
            np.stack([x, y], axis=1),
            _slips(self.block, self.rows, self.contact),
            vx - spin * (arm_x * np.sin(turned) + arm_y * np.cos(turned)),
            np.full_like(time_s, np.nan),
        )

    @cached_property
    def changes(self) -> tuple[ModeChange, ...]:
        """Modes of the motion, one entry for each change."""
        time_s, _, _, _, *velocities, touch = self.rows
        moving = np.any(velocities, axis=0)  # rest changes nothing of what it does
        time_s, touch, backward = time_s[moving], touch[moving], velocities[2][moving] > 0.0
        does = 2 * touch.astype(np.int64) + backward
        first = np.flatnonzero(np.diff(does, prepend=-1))
        last = np.append(first, does.size)[1:] - 1
        changes: list[ModeChange] = []
        doing, since = "", 0.0
        for i, j in zip(first.tolist(), last.tolist(), strict=True):
            name = _named(int(touch[i]), backward=bool(backward[i]))
            doing, since = name, since if name == doing else float(time_s[i])
            new = not changes or changes[-1].motion != name
            if new and time_s[j] - since >= SHORTEST_S:
                changes.append(ModeChange(since, name))
        return tuple(changes)


class _Path(NamedTuple):
    """One run: its history, and minimum, maximum and final rotation [rad] and displacement [m]."""

    run: FreeRun
    rows: FloatArray
    rotations: tuple[float, float, float]
    slips: tuple[float, float, float]

    @property
    def fails(self) -> bool:
        return self.run.stop in (BACKWARD, FORWARD)

    def differences_from(self, other: _Path) -> FreeError:
        """Return the differences between two runs."""
        rotations = zip(self.rotations, other.rotations, strict=True)
        slips = zip(self.slips, other.slips, strict=True)
        return FreeError(*(max(abs(a - b) for a, b in pairs) for pairs in (rotations, slips)))


def free_motion(
    supported_block: SupportedBlock,
    excited: Excitation,
    release: Release,
    *,
    at_toe: bool = False,
    by_law: tuple[Pose, ...] = (),
) -> FreeMotion:
    """Return the motion of a block from the end of its mechanism.

    Args:
        release: where and how fast it is.
        at_toe: whether displacements along the base are those of the toe, else of the heel.
        by_law: where the coarse run and those by other laws begin, at rest; () for all where the
            block is released.
    """
    block = supported_block.block
    assert block is not None
    contact = block.toe if at_toe else block.heel

    def path(step_s: float, law: tuple[float, float], start: Release) -> _Path:
        run, rows = _run(supported_block, excited, start, step_s, law)
        begin, end = start.pose, _pose(block, run.motion, contact)
        return _Path(
            run,
            rows,
            _extremes_and_end(begin.turned_rad, rows[3], end.turned_rad),
            _extremes_and_end(
                begin.displacement_m, _slips(block, rows, contact), end.displacement_m
            ),
        )

    # the method is of first order: the difference of both is the error of the finer one
    starts = [Release(release.time_s, pose) for pose in by_law]
    starts = starts or [release] * (1 + len(OTHER_LAWS))
    fine = path(STEP_S, RIGID, release)
    coarse = path(2.0 * STEP_S, RIGID, starts[0])

    def by_other_laws() -> tuple[_Path, ...]:
        laws = zip(OTHER_LAWS, starts[1:], strict=True)
        return tuple(path(2.0 * STEP_S, law, start) for law, start in laws)

    after_s = f"at {fine.run.time_s:.3f} s"
    outcome, sentence = {
        AT_REST: (Outcome.STABLE, ""),
        BACKWARD: (Outcome.TOPPLED, f"{after_s} {ON_ITS_BACK_EDGE}"),
        FORWARD: (Outcome.TOPPLED, f"{after_s} {ON_ITS_FACE}"),
        JUMPED: (Outcome.JUMP, f"{after_s}: {Outcome.JUMP.advice}"),
    }.get(fine.run.stop, (Outcome.UNDETERMINED, NEVER_ENDS))
    least_rad, most_rad, _ = fine.rotations
    step_error = fine.differences_from(coarse)
    # whether it fails hangs on the step: closer to critical than the error
    if fine.fails != coarse.fails or any(map(math.isnan, step_error)):
        outcome, sentence = Outcome.UNDETERMINED, Outcome.UNDETERMINED.advice
    return FreeMotion(
        outcome=outcome,
        sentence=sentence,
        time_s=fine.run.time_s,
        pose=_pose(block, fine.run.motion, contact),
        started_s=finite_or_none(fine.run.moved_s),
        landed_s=finite_or_none(fine.run.landed_s),
        backward_rad=max(0.0, most_rad),
        forward_rad=max(0.0, -least_rad),
        slip_m=fine.slips[1],
        step_error=step_error,
        steps=fine.run.steps + coarse.run.steps,
        block=block,
        contact=contact,
        rows=fine.rows,
        coarse=coarse,
        by_other_laws=by_other_laws,
    )


def _run(
    supported_block: SupportedBlock,
    excited: Excitation,
    release: Release,
    step_s: float,
    law: tuple[float, float],
) -> tuple[FreeRun, FloatArray]:
    block = supported_block.block
    assert block is not None
    corners = corners_of(supported_block, block)
    frame = Frame(
        block.inertia_m2,
        math.sin(supported_block.beta_rad),
        math.cos(supported_block.beta_rad),
        block.on_back_edge_rad,
        block.on_front_face_rad,
        *law,
        *supported_block.push,
    )
    (x, y), (vx, vy) = release.pose.centroid_m, release.velocity_m_s
    start = Motion(x, y, release.pose.turned_rad, vx, vy, release.spin_rad_s)
    record = excited.nodes
    size = 4 * excited.time_s.size + 200_000
    while True:
        # what is kept at one time lies together: a run touches little of the memory
        rows = np.empty((size, ROWS)).T
        run = run_free(
            record, corners, frame, release.time_s, start, step_s, work_of(corners), rows
        )
        if run.filled < size:
            return run, rows[:, : run.filled]
        size *= 4
        if size > 1e8:
            raise InputError("the record is too long: shorten it")


def _pose(block: Block, at: Motion, contact: tuple[float, float]) -> Pose:
    contact_now = corner_at((at.x, at.y), at.turned, contact)
    start = contact[0] - block.heel[0]
    return Pose(at.turned, (at.x, at.y), contact_now[0] - start)


def _extremes_and_end(begin: float, values: FloatArray, end: float) -> tuple[float, float, float]:
    return (float(values.min(initial=begin)), float(values.max(initial=begin)), end)


def _slips(block: Block, rows: FloatArray, contact: tuple[float, float]) -> FloatArray:
    """Return the slip of a contact along the base [m]."""
    x, turned = rows[1], rows[3]
    start = contact[0] - block.heel[0]
    slips: FloatArray = x + contact[0] * np.cos(turned) - contact[1] * np.sin(turned) - start
    return slips


SLIDES = "slides on its base"
SLUMPS = "slumps against its back plane"
ON_HEEL = "tips about its heel"
CLIMBS = "is driven back against its back plane"
ROCKS = "rocks about its toe"
FALLS_BACK = "falls back about its toe"
CONFINED = "topples against its back plane"
ALONG_BACK = "slides on its back plane"
OFF = "is off both planes"

MODES_OF: Mapping[str, ModeName] = {
    SLIDES: "slide", SLUMPS: "slump", ROCKS: "topple", CONFINED: "confined_topple",
    "slides": "slide", "slumps": "slump", "topples freely about its toe": "topple",
}  # fmt: skip
"""Failure mode by what a block does, also by the phases of mechanisms; others lead from one to
another."""


def _named(touch: int, *, backward: bool) -> str:
    """Return the mode of a moving block, by its contacts with its planes."""
    if touch & HEEL and touch & TOE:
        return SLIDES
    if touch & HEEL:
        if touch & ON_BACK:
            return SLUMPS if backward else CLIMBS
        return ON_HEEL
    if touch & (TOE | ON_BASE):
        return CONFINED if touch & ON_BACK else FALLS_BACK if backward else ROCKS
    return ALONG_BACK if touch & ON_BACK else OFF


_MOMENT_S = 1e-6
"""Time over which the velocity of a mechanism is taken from its poses [s]."""


def released(time_s: float, pose: Callable[[float], Pose], position: float, rate: float) -> Release:
    """Return position and velocity of a block at the end of its mechanism.

    Args:
        time_s: when [s].
        pose: where the block is at a position of the mechanism.
    """
    at_release = pose(position)
    if rate == 0.0:
        return Release(time_s, at_release)
    # by central differences of the poses, whose error is of second order in the time between
    half = 0.5 * _MOMENT_S * rate
    before, after = pose(position - half), pose(position + half)
    vx, vy = ((b - a) / _MOMENT_S for a, b in zip(before.centroid_m, after.centroid_m, strict=True))
    return Release(time_s, at_release, (vx, vy), (after.turned_rad - before.turned_rad) / _MOMENT_S)
