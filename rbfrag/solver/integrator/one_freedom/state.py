"""Inputs and results of the kernels for motion with one degree of freedom.

The kernels are functions of a few of these tuples: the record, the rules of a phase, where in the
record the motion is, in what state the block is there, and what has been seen of it so far.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import within
from rbfrag.solver.integrator.state import Peak, Place
from rbfrag.solver.results import FloatArray

AT_REST, UPPER, LOWER, REVERSE, VIOLATED, JUMPED, ENDLESS = range(7)
"""Why a phase ended: for good at rest; at its upper or lower limit; where motion in reverse sets
in; where a condition of the equation fails; where the ground throws the block; not at all."""

NO_REVERSE, REVERSE_MOVES, REVERSE_LEAVES = range(3)
"""What the onset of motion in reverse means."""

LEAVES, COMES_TO_REST = range(2)
"""What an impact at the lowest position does: end the phase, or stop the block (inelastic)."""


class PhaseRules(NamedTuple):
    """Settings of a phase of motion.

    Args:
        forward: table of the equation of forward motion, or of all motion if not `sticks`.
        reverse: table of the equation of motion in reverse.
        sticks: whether friction holds the block at a standstill.
        in_reverse: `NO_REVERSE`, `REVERSE_MOVES` or `REVERSE_LEAVES`.
        lowest: least x.
        highest: greatest x.
        impact: at `lowest`, `LEAVES` or `COMES_TO_REST`.
        uniform: whether the equation is the same everywhere; a step is then exact.
        order: degree of a step. Short steps, that need no more, take a lower one.
        turn_max: greatest step in units of the block's own time.
    """

    forward: FloatArray
    reverse: FloatArray
    sticks: bool
    in_reverse: int
    lowest: float
    highest: float
    impact: int
    uniform: bool
    order: int
    turn_max: float


class PhaseState(NamedTuple):
    """The state of the block.

    Args:
        x: position.
        rate: its rate [1/s].
        cos: cos x; 1 where the equation is the same everywhere, which x then does not enter.
        sin: sin x; 0 there.
        error_x: bound on the error of the position.
        error_rate: bound on the error of the rate.
        sense: of its motion, 1 or -1: which equation holds.
        smooth: whether it starts where the acceleration is zero.
    """

    x: float
    rate: float
    cos: float
    sin: float
    error_x: float
    error_rate: float
    sense: int
    smooth: bool


class Entry(NamedTuple):
    """Where and how a phase is entered, or was left: the end of one is the entry of the next.

    Args:
        place: where in the record.
        free_s: time after the record [s].
        x: position.
        rate: its rate [1/s].
        error_x: bound on the error of the position.
        error_rate: bound on the error of the rate.
    """

    place: Place
    free_s: float
    x: float
    rate: float
    error_x: float
    error_rate: float


class PhaseWork(NamedTuple):
    """Work arrays of the kernels, which allocate none.

    Args:
        series: Taylor coefficients of a step, shape (8, order + 1).
        conditions_forward: conditions of a uniform equation, shape (conditions, 3); (0, 3) where
            the equation depends on x, whose conditions are taken at each step.
        conditions_reverse: the same in reverse.
    """

    series: FloatArray
    conditions_forward: FloatArray
    conditions_reverse: FloatArray


class PhaseRun(NamedTuple):
    """Result of a phase; times are NaN for events that did not occur.

    Args:
        stop: why it ended.
        condition: which condition failed: 0 for the inertia, or the number of the contact from 1.
        time_s: when it ended [s].
        peak: greatest position.
        started_s: first motion [s].
        stopped_s: last standstill [s].
        certain_s: time from which nothing in the rest of the record turns the motion back [s].
        steps: integration steps.
        samples_moved: sample intervals in which the block moved.
        impacts: impacts at the lowest position that stopped the block.
        history_length: columns of the history that are filled.
    """

    stop: int
    condition: int
    time_s: float
    end: Entry
    peak: Peak
    started_s: float
    stopped_s: float
    certain_s: float
    steps: int
    samples_moved: int
    impacts: int
    history_length: int


@within
def resting(state: PhaseState, error_x: float, sense: int, smooth: bool) -> PhaseState:
    """Return a state with a rate of zero, which is exact: the error of the rate is zero too."""
    # x does not change, nor do its cosine and sine
    return PhaseState(state.x, 0.0, state.cos, state.sin, error_x, 0.0, sense, smooth)


@within
def certain_since(
    since_s: float, now_s: float, rate: float, driving: float, resistance: float, least_q: float
) -> float:
    """Return the time from which the motion can no longer turn back; NaN while it may.

    It is (4.19) for an equation of this form: the block moves forward, and the least excitation
    of all that is to come exceeds the resistance where it is.

    Args:
        since_s: the time so far, or NaN.
        now_s: the present.
        rate: rate of the block.
        driving: factor of k_h in the equation of forward motion.
        resistance: factor of 1 + k_v in it.
        least_q: least k_h/(1 + k_v) from now on.
    """
    # with braking (q > 0) this is a criterion and no proof: docs/theory/slumping.md says so
    if not (rate > 0.0 and driving > 0.0 and driving * least_q > resistance):
        return math.nan
    # the first of the nodes from which on it has held without a break
    return now_s if math.isnan(since_s) else since_s
