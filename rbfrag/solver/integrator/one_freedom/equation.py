"""Equation of motion of a model with one degree of freedom, and the conditions of its validity.

With x the coordinate (a rotation [rad], or a displacement [m] on which nothing depends):

    inertia(x) x'' = driving(x) k_h - resistance(x) (1 + k_v) - braking(x) x'^2

Every length, direction and moment of a rigid block on planes is a sum of a constant, cos θ and
sin θ. Products of up to three of them are all that an equation of motion needs, so that a model
can be written as in a book, and handed to the engine as numbers (:class:`Harmonics`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from rbfrag.solver.results import FloatArray, Outcome
from rbfrag.solver.results import Pose as Pose

DEGREE = 3
"""Highest harmonic."""

Half = tuple[complex, complex, complex, complex]
"""Complex Fourier coefficients of the harmonics 0 to 3; those of -1 to -3 are their conjugates."""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A sum of harmonics of θ, which can be added, multiplied and evaluated.

    Args:
        half: complex Fourier coefficients of the harmonics 0 to 3, the first one real.
    """

    half: Half

    # Plain numbers: on four of them, the call of an array function takes longer than the work.

    def __add__(self, other: Harmonics | float) -> Harmonics:
        a0, a1, a2, a3 = self.half
        if not isinstance(other, Harmonics):
            return Harmonics((a0 + other, a1, a2, a3))
        b0, b1, b2, b3 = other.half
        return Harmonics((a0 + b0, a1 + b1, a2 + b2, a3 + b3))

    def __sub__(self, other: Harmonics | float) -> Harmonics:
        a0, a1, a2, a3 = self.half
        if not isinstance(other, Harmonics):
            return Harmonics((a0 - other, a1, a2, a3))
        b0, b1, b2, b3 = other.half
        return Harmonics((a0 - b0, a1 - b1, a2 - b2, a3 - b3))

    def __mul__(self, other: Harmonics | float) -> Harmonics:
        if not isinstance(other, Harmonics):
            a0, a1, a2, a3 = self.half
            return Harmonics((a0 * other, a1 * other, a2 * other, a3 * other))
        a0, a1, a2, a3 = self.half
        b0, b1, b2, b3 = other.half
        # such a product means that a model is wrong: no equation of motion here has one
        if (a3 and (b1 or b2 or b3)) or (a2 and (b2 or b3)) or (a1 and b3):
            raise ValueError(f"the product holds harmonics above {DEGREE}")
        # the convolution of both series, without the terms that are zero by the above
        return Harmonics(
            (
                a0 * b0 + 2.0 * (a1 * b1.conjugate()).real,
                a0 * b1 + a1 * b0 + a2 * b1.conjugate() + a1.conjugate() * b2,
                a0 * b2 + a1 * b1 + a2 * b0,
                a0 * b3 + a1 * b2 + a2 * b1 + a3 * b0,
            )
        )

    def __call__(self, theta: float) -> float:
        """Return the value at a rotation [rad]."""
        numbers = self.coefficients
        # harmonics that are zero are left out, which most are
        value = numbers[0]
        for n in range(1, self.degree + 1):
            value += numbers[2 * n - 1] * math.cos(n * theta)
            value += numbers[2 * n] * math.sin(n * theta)
        return value

    def at(self, theta: FloatArray) -> FloatArray:
        """Return the values at several rotations [rad]."""
        numbers = self.coefficients
        value = np.full_like(theta, numbers[0])
        for n in range(1, self.degree + 1):
            value += numbers[2 * n - 1] * np.cos(n * theta)
            value += numbers[2 * n] * np.sin(n * theta)
        return value

    def derivative(self) -> Harmonics:
        """Return the derivative by θ."""
        # of e^{inθ} it is in e^{inθ}; that of the constant is zero
        _, a1, a2, a3 = self.half
        return Harmonics((0j, 1j * a1, 2j * a2, 3j * a3))

    @cached_property
    def degree(self) -> int:
        """Highest harmonic whose coefficient is not zero; 0 for a constant."""
        return max((n for n in range(1, DEGREE + 1) if self.half[n]), default=0)

    @cached_property
    def coefficients(self) -> tuple[float, ...]:
        """Factors of 1, cos θ, sin θ, cos 2θ, sin 2θ, cos 3θ and sin 3θ."""
        # a e^{inθ} + its conjugate = 2 Re a cos nθ - 2 Im a sin nθ
        a0, a1, a2, a3 = self.half
        return (
            a0.real, 2.0 * a1.real, -2.0 * a1.imag, 2.0 * a2.real, -2.0 * a2.imag, 2.0 * a3.real,
            -2.0 * a3.imag,
        )  # fmt: skip

    @property
    def constant(self) -> bool:
        """True if the function does not depend on θ."""
        return not any(self.half[1:])


def cosine(phase_rad: float = 0.0, sense: int = 1) -> Harmonics:
    """Return cos(phase + θ), or cos(phase - θ) where sense is -1."""
    return _wave(math.cos(phase_rad), -sense * math.sin(phase_rad))


def sine(phase_rad: float = 0.0, sense: int = 1) -> Harmonics:
    """Return sin(phase + θ), or sin(phase - θ) where sense is -1."""
    return _wave(math.sin(phase_rad), sense * math.cos(phase_rad))


def constant(value: float) -> Harmonics:
    """Return the function of constant value."""
    return Harmonics((complex(value), 0j, 0j, 0j))


NOTHING = constant(0.0)
"""The function that is zero."""


@dataclass(frozen=True, eq=False)
class Vector:
    """A plane vector whose components are functions of θ."""

    x: Harmonics
    y: Harmonics

    def __add__(self, other: Vector) -> Vector:
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y)

    def __mul__(self, factor: Harmonics | float) -> Vector:
        return Vector(self.x * factor, self.y * factor)

    def derivative(self) -> Vector:
        """Return the derivative by θ."""
        return Vector(self.x.derivative(), self.y.derivative())

    def cross(self, other: Vector) -> Harmonics:
        """Return the component of the vector product that stands on the plane."""
        # of arm and force: the moment of the force, counter-clockwise positive
        return self.x * other.y - self.y * other.x


def constant_vector(components: tuple[float, float]) -> Vector:
    """Return a vector that does not depend on θ."""
    return Vector(constant(components[0]), constant(components[1]))


def turning(arm: tuple[float, float], sense: int = 1) -> Vector:
    """Return an arm of the block rotated by θ, counter-clockwise where sense is 1."""
    # (x cos θ - y sin θ, y cos θ + x sin θ), with θ reversed where sense is -1
    x, y = arm
    return Vector(_wave(x, -sense * y), _wave(y, sense * x))


def _wave(cosine_part: float, sine_part: float) -> Harmonics:
    """Return the function with these factors of cos θ and sin θ."""
    # the inverse of the above: half of each, the sine with the other sign
    return Harmonics((0j, complex(0.5 * cosine_part, -0.5 * sine_part), 0j, 0j))


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
    braking: Harmonics = NOTHING
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
        return all(row.constant for row in everywhere) and not self.braking.half[0]

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
