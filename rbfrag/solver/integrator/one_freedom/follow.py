"""Run of a mechanism under one excitation: its phases, one after another."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
from rbfrag.solver.integrator.one_freedom.run import run_phase
from rbfrag.solver.integrator.one_freedom.step import (
    AT_REST,
    COMES_TO_REST,
    CONDITIONS,
    ENDLESS,
    JUMPED,
    LEAVES,
    LOWER,
    NO_REVERSE,
    ORDER,
    REVERSE,
    REVERSE_LEAVES,
    REVERSE_MOVES,
    TURN_MAX,
    UNIFORM_ORDER,
    UPPER,
    VIOLATED,
    Entry,
    PhaseRules,
    PhaseRun,
    PhaseWork,
)
from rbfrag.solver.integrator.state import Peak, Place
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import FloatArray, ModeChange, Outcome

PHASES_MAX = 1000
"""Changes of phase in one run beyond which the model must be wrong."""

MOST_STEPS = 1e8
"""Steps of one run beyond which the size of the block cannot be meant."""

_NO_ROWS = np.empty((4, 0))

AT_BEGIN = Place(0, 0.0)
"""Where the record begins."""


@dataclass(frozen=True, eq=False)
class MotionHistory:
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
class MechanismRun:
    """Result of a mechanism's run under one excitation.

    Args:
        outcome: how it ended.
        peak: greatest position.
        x: position at the end.
        rate: rate at the end; not zero where the model ended in motion.
        peak_displacement_m: greatest displacement along the base [m].
        pose: where the block is at the end.
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
        phase: the phase in which it ended.
        ending: the last of the sentences, how it ended; empty for none.
        history: the motion in time, if it is kept.
    """

    outcome: Outcome
    peak: float
    x: float
    rate: float
    peak_displacement_m: float
    pose: Pose
    started_s: float | None
    ended_s: float | None
    certain_s: float | None
    error: float
    steps: int
    samples_moved: int
    changes: tuple[ModeChange, ...]
    sentences: tuple[str, ...]
    phase: Phase
    ending: str
    history: MotionHistory | None = None


def follow(
    mechanism: Mechanism,
    excitation: Excitation,
    *,
    history: bool = False,
    turn_max: float = TURN_MAX,
    start: tuple[float, float] = (0.0, 0.0),
) -> MechanismRun:
    """Run a mechanism from rest under one excitation until motion has ended.

    Args:
        excitation: accelerations at nodes.
        history: keep the motion in time.
        turn_max: greatest step, in units of the block's own time; for convergence studies.
        start: position in the first phase at which it rests, and the bound on its error.

    Raises:
        InputError: a block so small that the run would not end in reasonable time.
    """
    equation = mechanism.first.forward
    # an exact step needs no division, whatever the size of the block
    if not equation.uniform:
        expected = equation.frequency_at_rest * excitation.duration_s / turn_max
        if expected > MOST_STEPS:
            raise InputError(
                f"the block is so small that one run would take {expected:.1g} steps over this "
                "record: check the unit of its size, which is in metres"
            )
    # A run is a chain of phases. Each is one initial value problem of one coordinate x, from
    # `entry` (position, rate and their error bounds at a time of the record) to the event that ends
    # it; its end is the entry of the next phase, error bounds included
    record = excitation.nodes
    phase, entry = mechanism.first, Entry(AT_BEGIN, 0.0, start[0], 0.0, start[1], 0.0)
    changes: list[ModeChange] = []
    parts: list[tuple[Phase, FloatArray]] = []
    steps = samples_moved = impacts = 0
    started = ended = math.nan
    peak, slipped = Peak(0.0, 0.0), 0.0
    while True:
        # nodes, a start, a turn and a standstill in each interval, and the free motion after it
        rows = np.empty((4, 6 * excitation.time_s.size + 20_000)) if history else _NO_ROWS
        # each phase has equations and limits of its own; the record and the entry go on
        rules = _rules(phase, turn_max)
        # conditions that depend on x are taken at each step: they need no work array
        conditions = (
            np.empty(((len(table) - CONDITIONS) // 3 if rules.uniform else 0, 3))
            for table in (rules.forward, rules.reverse)
        )
        work = PhaseWork(np.empty((8, rules.order + 1)), *conditions)
        run = run_phase(record, rules, entry, work, rows)
        entry = run.end
        steps += run.steps
        samples_moved += run.samples_moved
        impacts += run.impacts
        started = run.started_s if math.isnan(started) else started
        ended = ended if math.isnan(run.stopped_s) else run.stopped_s
        # each phase has a peak of its own, which is not below where it began
        peak = run.peak if run.peak.x > peak.x else peak
        # the slip grows with x in every phase: its greatest is at the peak or at the end
        slipped = max(slipped, phase.pose(entry.x).displacement_m)
        if run.peak.x != entry.x:
            slipped = max(slipped, phase.pose(run.peak.x).displacement_m)
        if history:
            last = [[run.time_s], [run.end.x], [run.end.rate]]
            parts.append((phase, np.append(rows[:3, : run.history_length], last, axis=1)))
        # the model says what follows a limit; every other stop ends the run
        if run.stop in _REASONS:
            end = run.end
            following = phase.after(Exit(_REASONS[run.stop], run.time_s, end.x, end.rate))
            ended = run.time_s
        else:
            following = _ending(phase, run, record.last)
            ended = ended if run.stop == AT_REST else run.time_s
        if isinstance(following, Ending):
            following = _doubted(following, phase, run)
            if math.isnan(peak.error) and following.outcome is not Outcome.JUMP:
                following = Ending(Outcome.UNDETERMINED, Outcome.UNDETERMINED.advice)
            break
        # a model that hands the block to and fro at one instant would never end
        if len(changes) >= PHASES_MAX:
            following = Ending(Outcome.UNDETERMINED, "the motion changes without end")
            break
        changes.append(ModeChange(run.time_s, following.name))
        phase = following
    sentences = list(mechanism.warnings)
    # what was taken for granted is told only where the run made use of it
    if impacts:
        sentences.append(mechanism.if_impact)
    if mechanism.least_q > -math.inf and excitation.min_q < mechanism.least_q:
        sentences.append(mechanism.if_below)
    if following.sentence:
        sentences.append(following.sentence)
    return MechanismRun(
        outcome=following.outcome,
        peak=peak.x,
        x=entry.x,
        rate=entry.rate,
        peak_displacement_m=slipped,
        pose=phase.pose(entry.x),
        started_s=finite_or_none(started),
        ended_s=finite_or_none(ended) if not math.isnan(started) or run.stop == JUMPED else None,
        certain_s=finite_or_none(run.certain_s),
        error=peak.error,
        steps=steps,
        samples_moved=samples_moved,
        changes=tuple(changes),
        sentences=tuple(sentences),
        phase=phase,
        ending=following.sentence,
        history=_history(parts) if history else None,
    )


def _rules(phase: Phase, turn_max: float) -> PhaseRules:
    in_reverse = NO_REVERSE
    if phase.reverse is not None:
        in_reverse = REVERSE_LEAVES if phase.leaves_in_reverse else REVERSE_MOVES
    # the kernel takes two tables; the second is not looked at where nothing moves in reverse
    backward = phase.forward if phase.reverse is None else phase.reverse
    uniform = phase.forward.uniform and backward.uniform
    return PhaseRules(
        phase.forward.table,
        backward.table,
        phase.sticks,
        in_reverse,
        float(phase.lowest),
        float(phase.highest),
        COMES_TO_REST if phase.impact == "comes to rest" else LEAVES,
        uniform,
        UNIFORM_ORDER if uniform else ORDER,
        turn_max,
    )


def _doubted(ending: Ending, phase: Phase, run: PhaseRun) -> Ending:
    """Return the ending, or that it is undetermined where the limit is closer than the error."""
    # a peak that would have reached the limit, had its error been added
    falls_short = run.stop == AT_REST and phase.highest - run.peak.x <= run.peak.error
    just_arrives = False
    if run.stop == UPPER:
        # how far it would have gone on, against what the position may be wrong by
        x, rate, error_x, error_rate = run.end[2:]
        strength = phase.forward.resistance(x) / phase.forward.inertia(x)
        just_arrives = rate <= error_rate + math.sqrt(2.0 * abs(strength) * error_x)
    if not (falls_short or just_arrives):
        return ending
    return Ending(Outcome.UNDETERMINED, Outcome.UNDETERMINED.advice)


def _ending(phase: Phase, run: PhaseRun, last: int) -> Ending:
    """Return the ending of a run that no other phase follows.

    Args:
        last: last node of the record.
    """
    if run.stop == AT_REST:
        return Ending(Outcome.STABLE)
    if run.stop == ENDLESS and run.end.place.interval < last:
        sentence = f"at {run.time_s:.3f} s the block starts and stops without end"
        return Ending(Outcome.UNDETERMINED, sentence)
    if run.stop == ENDLESS:
        return Ending(Outcome.UNDETERMINED, "after the record the block neither stops nor falls")
    at = f"at {run.time_s:.3f} s: "
    if run.stop == JUMPED:
        return Ending(Outcome.JUMP, at + Outcome.JUMP.advice)
    assert run.stop == VIOLATED
    if run.condition == 0:
        return Ending(
            Outcome.INDETERMINATE,
            at + "rigid bodies with this friction have no unique motion here (Painlevé's "
            "paradox); nothing is said about the time after",
        )
    # the conditions are those of the equation that held, which the sense of motion tells
    equation = phase.forward if run.end.rate >= 0.0 or not phase.sticks else phase.reverse
    assert equation is not None
    broken = equation.conditions[run.condition - 1]
    return Ending(broken.outcome, at + broken.sentence)


_REASONS: dict[int, ExitReason] = {UPPER: "upper", LOWER: "lower", REVERSE: "reverse"}


def _history(parts: list[tuple[Phase, FloatArray]]) -> MotionHistory:
    """Return the recorded history of a run, from time, x and x' in each of its phases."""
    time_s, x, rate = np.concatenate([rows for _, rows in parts], axis=1)
    at = [(phase, value) for phase, rows in parts for value in rows[1].tolist()]
    # the remaining strength, drawn together with k_h: where it is below, the block speeds up
    strength = np.array([phase.forward.threshold(value) for phase, value in at])
    return MotionHistory(time_s, x, rate, strength, tuple(phase.pose(value) for phase, value in at))
