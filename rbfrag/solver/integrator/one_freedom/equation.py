"""Equation of motion of a model with one degree of freedom, and the conditions of its validity.

With x the coordinate (a rotation [rad], or a displacement [m] on which nothing depends):

    inertia(x) x'' = driving(x) k_h - resistance(x) (1 + k_v) - braking(x) x'^2
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from rbfrag.solver.integrator.one_freedom.harmonics import Harmonics, constant
from rbfrag.solver.results import FloatArray, Outcome
from rbfrag.solver.results import Pose as Pose

_LOOKS = 256
"""Points at which the strength of a block is looked at, over the range of its motion."""


@dataclass(frozen=True, eq=False)
class Condition:
    """A contact that holds while per_k_h k_h + per_w (1 + k_v) + per_rate2 x'^2 is above zero.

    x'' is eliminated by the equation of motion; a factor that is positive may be left out.

    Args:
        per_k_h: factor of the driving acceleration.
        per_w: factor of the effective gravity 1 + k_v.
        per_rate2: factor of x'^2; like `per_w` it may hold a third harmonic.
        outcome: how the run ends where the condition fails.
        sentence: what has happened then.
    """

    per_k_h: Harmonics
    per_w: Harmonics
    per_rate2: Harmonics
    outcome: Outcome
    sentence: str


@dataclass(frozen=True, eq=False)
class Equation:
    """An equation of motion in one sense of motion, with the conditions of its validity.

    Where `inertia` is not above zero, rigid bodies with friction have no unique motion
    (Painlevé): the run ends as indeterminate.

    Args:
        inertia: factor of x''.
        driving: factor of k_h, above zero: k_h drives forward.
        resistance: factor of 1 + k_v, counted against the motion.
        braking: factor of x'^2, counted against the motion.
        conditions: what must hold besides.
    """

    inertia: Harmonics
    driving: Harmonics
    resistance: Harmonics
    braking: Harmonics = field(default_factory=lambda: constant(0.0))
    conditions: tuple[Condition, ...] = ()

    @cached_property
    def table(self) -> FloatArray:
        """The coefficients as the kernel reads them, shape (4 + 3 conditions, 7)."""
        # the order that step.py names: INERTIA, DRIVING, RESISTANCE, BRAKING, CONDITIONS
        rows = [self.inertia, self.driving, self.resistance, self.braking]
        for condition in self.conditions:
            # three rows each, after the four of the equation: CONDITIONS + 3 n
            rows += [condition.per_k_h, condition.per_w, condition.per_rate2]
        return np.array([row.coefficients for row in rows])

    @cached_property
    def uniform(self) -> bool:
        """True if the coefficients do not depend on x, which is then a cubic in each interval."""
        everywhere = (self.inertia, self.driving, self.resistance, self.braking)
        # braking by x'^2 would make U a series without end, even with constant factors
        return all(row.constant for row in everywhere) and not self.braking.coefficients[0]

    @cached_property
    def frequency_at_rest(self) -> float:
        """Frequency parameter at x = 0 [1/s], which sets the length of steps."""
        # (N + M)/D as in step.local_frequency; D = 0 must not divide by zero
        frequency2 = abs(self.driving(0.0)) + abs(self.resistance(0.0))
        return math.sqrt(frequency2 / max(abs(self.inertia(0.0)), 1e-300))

    def first_without_strength(self, limit: float) -> float:
        """Return the smallest x at which a block at rest starts to move under gravity alone, or
        `limit`.
        """
        # a strength of three harmonics has few zeros: a scan of the range does not miss the first
        points = limit * np.arange(_LOOKS + 1) / _LOOKS
        weak = np.flatnonzero(self.resistance.at(points[1:]) <= 0.0)
        # with strength everywhere the model ends at its limit first
        if not weak.size:
            return limit
        lower, upper = float(points[weak[0]]), float(points[weak[0] + 1])
        # bisection to rounding: the result is a critical rotation that answers are divided by
        while upper - lower > 1e-15 * limit:
            middle = 0.5 * (lower + upper)
            # neighbouring numbers: nothing is left to halve
            if not lower < middle < upper:
                break
            lower, upper = (lower, middle) if self.resistance(middle) <= 0.0 else (middle, upper)
        return upper

    def threshold(self, x: float) -> float:
        """Return the k_h that starts the motion at a position where 1 + k_v = 1."""
        return self.resistance(x) / self.driving(x)


@dataclass(frozen=True)
class Ending:
    """The end of a run.

    Args:
        sentence: what happened and what was not followed; empty where there is nothing to say.
    """

    outcome: Outcome
    sentence: str = ""


ExitReason = Literal["upper", "lower", "reverse"]
"""Why a phase was left: its upper or lower limit was met, or motion in reverse sets in."""


@dataclass(frozen=True)
class Exit:
    """The state in which a phase was left.

    Args:
        reason: why.
        time_s: when [s].
        x: position.
        rate: its rate.
    """

    reason: ExitReason
    time_s: float
    x: float
    rate: float


Impact = Literal["comes to rest", "leaves"]


@dataclass(frozen=True, eq=False)
class Phase:
    """A stretch of motion that one equation (for each sense) governs.

    Args:
        name: what the block does, for people.
        forward: the equation of growing x; of all motion where friction plays no part.
        pose: where the block is at a position.
        after: what follows where the phase is left.
        reverse: the equation of falling x; None where the block does not move in reverse.
        sticks: whether friction holds the block at a standstill. Where it does not, x turns
            freely, and `forward` governs both senses.
        leaves_in_reverse: whether the onset of motion in reverse ends the phase.
        lowest: least x.
        highest: greatest x.
        impact: what the impact at `lowest` does: the block comes to rest, without rebound, or
            leaves the phase.
    """

    name: str
    forward: Equation
    pose: Callable[[float], Pose]
    after: Callable[[Exit], Phase | Ending]
    reverse: Equation | None = None
    sticks: bool = True
    leaves_in_reverse: bool = False
    lowest: float = 0.0
    highest: float = np.inf
    impact: Impact = "comes to rest"


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A block that moves with one degree of freedom.

    Args:
        first: the phase that starts at rest with x = 0.
        rotates: whether x is a rotation [rad] rather than a displacement [m].
        critical: x at which the block stands without any strength; None where there is none.
        warnings: what the reader of the answer should know.
        if_impact: the same where the block has come back to its lowest position in motion.
        least_q: least k_h/(1 + k_v) that the model covers.
        if_below: what the reader should know where the record goes below it.
        stepwise_below: k_h/(1 + k_v) below which the mechanism does not hold: a record that goes
            below it is followed step by step from its beginning.
        goes_on: whether the block is followed step by step where a contact is lost.
        at_toe: whether its displacement is that of the toe.
    """

    first: Phase
    rotates: bool
    critical: float | None
    warnings: tuple[str, ...] = ()
    if_impact: str = ""
    least_q: float = -np.inf
    if_below: str = ""
    stepwise_below: float = -np.inf
    goes_on: bool = False
    at_toe: bool = False
