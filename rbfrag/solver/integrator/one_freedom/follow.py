"""A mechanism under one excitation: its phases, one after another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.one_freedom.equation import (
    Ending,
    Exit,
    ExitReason,
    Mechanism,
    Phase,
    Pose,
)
from rbfrag.solver.integrator.one_freedom.run import (
    AT_REST,
    ENDLESS,
    JUMPED,
    LOWER,
    NO_REVERSE,
    REVERSE,
    REVERSE_LEAVES,
    REVERSE_MOVES,
    UPPER,
    VIOLATED,
    PhaseRun,
    run_phase,
)
from rbfrag.solver.integrator.one_freedom.step import ORDER, TURN_MAX, UNIFORM_ORDER
from rbfrag.solver.results import FloatArray, Outcome

PHASES_MAX = 1000
"""Changes of phase in one run beyond which the model must be wrong."""

MOST_STEPS = 1e8
"""Steps of one run beyond which the size of the block cannot be meant."""

_NO_ROOM = np.empty((4, 0))


class Change(NamedTuple):
    """A change of phase.

    Args:
        time_s: when [s].
        name: what the block does from then on.
    """

    time_s: float
    name: str


@dataclass(frozen=True, eq=False)
class Travel:
    """The motion in time at nodes and events.

    Args:
        time_s: times [s], shape (n,).
        x: positions, shape (n,).
        rate: their rates [1/s], shape (n,).
        strength_g: k_h at which forward motion neither speeds up nor slows down, shape (n,).
        poses: where the block is, length n.
    """

    time_s: FloatArray
    x: FloatArray
    rate: FloatArray
    strength_g: FloatArray
    poses: tuple[Pose, ...]


@dataclass(frozen=True, eq=False)
class Course:
    """What became of a mechanism under one excitation.

    Args:
        outcome: how it ended.
        peak: greatest position.
        x: position at the end.
        rate: rate at the end; not zero where the model ended in motion.
        peak_displacement_m: greatest displacement along the base [m].
        pose: where the block is at the end; None where that is not known.
        started_s: first motion [s], or None.
        ended_s: time of the last standstill, or at which the model ended [s]; None if the
            block never moved.
        certain_s: time from which nothing in the rest of the record turns the motion back,
            as far as k_h against the strength left says [s]; None unless it went on to the end.
        error: estimated bound on the error of the peak position.
        steps: integration steps.
        samples_moved: sample intervals that had to be integrated.
        changes: changes of phase.
        sentences: what the answer takes for granted, and where it ends.
        travel: the motion in time, if asked for.
    """

    outcome: Outcome
    peak: float
    x: float
    rate: float
    peak_displacement_m: float
    pose: Pose | None
    started_s: float | None
    ended_s: float | None
    certain_s: float | None
    error: float
    steps: int
    samples_moved: int
    changes: tuple[Change, ...]
    sentences: tuple[str, ...]
    travel: Travel | None = None


def follow(
    mechanism: Mechanism,
    drive: Excitation,
    *,
    travel: bool = False,
    turn_max: float = TURN_MAX,
    order: int = ORDER,
) -> Course:
    """Run a mechanism from rest under one excitation until nothing moves any more.

    Args:
        mechanism: the block.
        drive: accelerations at nodes.
        travel: keep the motion in time.
        turn_max: greatest step, in units of the block's own time; for convergence studies.
        order: order of the method; for convergence studies.

    Raises:
        InputError: a block so small that the run would not end in reasonable time.
    """
    _refuse_endless(mechanism, drive, turn_max)
    state = PhaseRun(
        code=-1, condition=0, node=0, tau=0.0, free_s=0.0, time_s=float(drive.time_s[0]),
        x=0.0, rate=0.0,
        peak=0.0, started_s=math.nan, stopped_s=math.nan, certain_s=math.nan, error_x=0.0,
        error_rate=0.0, peak_error=0.0, steps=0, samples_moved=0, seatings=0, history_length=0,
    )  # fmt: skip
    phase = mechanism.first
    changes: list[Change] = []
    pieces: list[Travel] = []
    steps = samples_moved = seatings = 0
    started = ended = math.nan
    peak, peak_error, slipped = 0.0, 0.0, 0.0
    while True:
        store = _room(drive) if travel else _NO_ROOM
        found = _run(phase, drive, state, store, turn_max, order)
        steps += found.steps
        samples_moved += found.samples_moved
        seatings += found.seatings
        started = found.started_s if math.isnan(started) else started
        ended = found.stopped_s if not math.isnan(found.stopped_s) else ended
        if found.peak > peak:
            peak, peak_error = found.peak, found.peak_error
        slipped = max(slipped, *(phase.pose(x).displacement_m for x in (found.peak, found.x)))
        if travel:
            pieces.append(_travel(phase, store[:, : found.history_length], found))
        if found.code in (UPPER, LOWER, REVERSE):
            following = phase.after(_exit(found, drive))
            ended = found.time_s
        else:
            following, ended = _end(phase, found, ended)
        if isinstance(following, Ending):
            following = _doubted(following, phase, found)
            break
        if len(changes) >= PHASES_MAX:
            following = Ending(Outcome.UNDETERMINED, "the motion changes without end")
            break
        changes.append(Change(found.time_s, following.name))
        phase = following
        state = found
    said = list(mechanism.warnings)
    if seatings:
        said.append(mechanism.if_seated)
    if mechanism.least_q > -math.inf and drive.min_q < mechanism.least_q:
        said.append(mechanism.if_below)
    if following.sentence:
        said.append(following.sentence)
    return Course(
        outcome=following.outcome,
        peak=peak,
        x=found.x,
        rate=found.rate,
        peak_displacement_m=slipped,
        pose=phase.pose(found.x) if following.in_place else None,
        started_s=_or_none(started),
        ended_s=_or_none(ended) if not math.isnan(started) or found.code == JUMPED else None,
        certain_s=_or_none(found.certain_s),
        error=peak_error,
        steps=steps,
        samples_moved=samples_moved,
        changes=tuple(changes),
        sentences=tuple(said),
        travel=_joined(pieces) if travel else None,
    )


def _run(
    phase: Phase,
    drive: Excitation,
    state: PhaseRun,
    store: FloatArray,
    turn_max: float,
    order: int,
) -> PhaseRun:
    in_reverse = NO_REVERSE
    if phase.reverse is not None:
        in_reverse = REVERSE_LEAVES if phase.leaves_in_reverse else REVERSE_MOVES
    backward = phase.forward if phase.reverse is None else phase.reverse
    uniform = phase.forward.uniform and backward.uniform
    return PhaseRun(
        *run_phase(
            drive.time_s,
            drive.interval_s,
            drive.k_h,
            drive.w,
            drive.tail_min_q,
            drive.block_max_q,
            drive.block_min_q,
            drive.jump_node,
            phase.forward.table,
            backward.table,
            phase.sticks,
            in_reverse,
            phase.lowest,
            phase.highest,
            phase.seats,
            state.node,
            state.tau,
            state.free_s,
            state.x,
            state.rate,
            state.error_x,
            state.error_rate,
            UNIFORM_ORDER if uniform else order,
            turn_max,
            store,
        )
    )


def _doubted(ending: Ending, phase: Phase, found: PhaseRun) -> Ending:
    """Return the ending, or that it is open, where the limit is nearer than the error."""
    falls_short = found.code == AT_REST and phase.highest - found.peak <= found.peak_error
    just_arrives = False
    if found.code == UPPER:
        # how far it would have gone on, against what the position may be wrong by
        strength = phase.forward.resistance(found.x) / phase.forward.inertia(found.x)
        just_arrives = found.rate <= found.error_rate + math.sqrt(
            2.0 * abs(strength) * found.error_x
        )
    if not (falls_short or just_arrives):
        return ending
    return Ending(Outcome.UNDETERMINED, Outcome.UNDETERMINED.advice)


def _end(phase: Phase, found: PhaseRun, ended: float) -> tuple[Ending, float]:
    """Return how a run ends that leaves no phase behind it, and when."""
    if found.code == AT_REST:
        return Ending(Outcome.STABLE), ended
    if found.code == JUMPED:
        at = f"at {found.time_s:.3f} s: {Outcome.JUMP.advice}"
        return Ending(Outcome.JUMP, at), found.time_s
    if found.code == VIOLATED:
        equation = phase.forward if found.rate >= 0.0 or not phase.sticks else phase.reverse
        assert equation is not None
        if found.condition == 0:
            return (
                Ending(
                    Outcome.INDETERMINATE,
                    f"at {found.time_s:.3f} s: rigid bodies with this friction have no unique "
                    "motion here (Painlevé's paradox); nothing is said about the time after",
                ),
                found.time_s,
            )
        broken = equation.conditions[found.condition - 1]
        return Ending(broken.outcome, f"at {found.time_s:.3f} s: {broken.sentence}"), found.time_s
    assert found.code == ENDLESS
    return (
        Ending(Outcome.UNDETERMINED, "after the record the block neither stops nor falls"),
        found.time_s,
    )


def _exit(found: PhaseRun, drive: Excitation) -> Exit:
    reason: ExitReason = "upper"
    if found.code == LOWER:
        reason = "lower"
    elif found.code == REVERSE:
        reason = "reverse"
    rest = np.append(drive.q[min(found.node + 1, drive.q.size) :], 0.0)
    if found.node < drive.q.size - 1:
        k_h = drive.k_h[found.node] + found.tau * (
            drive.k_h[found.node + 1] - drive.k_h[found.node]
        )
        w = drive.w[found.node] + found.tau * (drive.w[found.node + 1] - drive.w[found.node])
        rest = np.append(rest, k_h / w)
    thrown = drive.jump_node < drive.q.size
    return Exit(
        reason=reason,
        time_s=found.time_s,
        x=found.x,
        rate=found.rate,
        rest_max_q=math.inf if thrown else float(rest.max()),
        rest_min_q=-math.inf if thrown else float(rest.min()),
    )


def _room(drive: Excitation) -> FloatArray:
    # nodes, a start, a turn and a standstill in each interval, and the free motion after it
    return np.empty((4, 6 * drive.time_s.size + 20_000))


def _travel(phase: Phase, store: FloatArray, found: PhaseRun) -> Travel:
    """Return what the kernel kept of one phase, and the state in which it was left."""
    time_s = np.append(store[0], found.time_s)
    x = np.append(store[1], found.x)
    rate = np.append(store[2], found.rate)
    strength = np.array([phase.forward.threshold(float(value)) for value in x])
    return Travel(time_s, x, rate, strength, tuple(phase.pose(float(value)) for value in x))


def _joined(pieces: list[Travel]) -> Travel:
    return Travel(
        np.concatenate([piece.time_s for piece in pieces]),
        np.concatenate([piece.x for piece in pieces]),
        np.concatenate([piece.rate for piece in pieces]),
        np.concatenate([piece.strength_g for piece in pieces]),
        tuple(pose for piece in pieces for pose in piece.poses),
    )


def _refuse_endless(mechanism: Mechanism, drive: Excitation, turn_max: float) -> None:
    equation = mechanism.first.forward
    if equation.uniform:
        return
    own2 = abs(equation.drive(0.0)) + abs(equation.resistance(0.0))
    own2 /= max(abs(equation.inertia(0.0)), 1e-300)
    steps = math.sqrt(own2) * float(drive.time_s[-1] - drive.time_s[0]) / turn_max
    if steps > MOST_STEPS:
        raise InputError(
            f"the block is so small that one run would take {steps:.1g} steps over this record: "
            "check the unit of its size, which is in metres"
        )


def _or_none(time_s: float) -> float | None:
    return time_s if math.isfinite(time_s) else None
