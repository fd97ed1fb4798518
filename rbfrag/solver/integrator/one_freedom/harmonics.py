"""Functions of a rotation that are sums of its first three harmonics.

Every length, direction and moment of a rigid block on planes is a sum of a constant, cos θ and
sin θ. Products of up to three of them are all that an equation of motion needs, so that a model
can be written as in a book, and handed to the engine as numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbfrag.solver.results import FloatArray

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

    def __neg__(self) -> Harmonics:
        a0, a1, a2, a3 = self.half
        return Harmonics((-a0, -a1, -a2, -a3))

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

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: float) -> Harmonics:
        return -self + other

    def __call__(self, theta: float) -> float:
        """Return the value at a rotation [rad]."""
        numbers = self._numbers
        # harmonics that are zero are left out, which most are
        value = numbers[0]
        for n in range(1, self.degree + 1):
            value += numbers[2 * n - 1] * math.cos(n * theta)
            value += numbers[2 * n] * math.sin(n * theta)
        return value

    def at(self, theta: FloatArray) -> FloatArray:
        """Return the values at several rotations [rad]."""
        numbers = self._numbers
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
    def _numbers(self) -> tuple[float, ...]:
        # a e^{inθ} + its conjugate = 2 Re a cos nθ - 2 Im a sin nθ
        a0, *higher = self.half
        return (a0.real, *(part for a in higher for part in (2.0 * a.real, -2.0 * a.imag)))

    @cached_property
    def coefficients(self) -> FloatArray:
        """Factors of 1, cos θ, sin θ, cos 2θ, sin 2θ, cos 3θ and sin 3θ, shape (7,)."""
        return np.array(self._numbers)

    @property
    def constant(self) -> bool:
        """True if the function does not depend on θ."""
        return self.degree == 0


def cosine(phase_rad: float = 0.0, sense: int = 1) -> Harmonics:
    """Return cos(phase + θ), or cos(phase - θ) where sense is -1."""
    return _wave(math.cos(phase_rad), -sense * math.sin(phase_rad))


def sine(phase_rad: float = 0.0, sense: int = 1) -> Harmonics:
    """Return sin(phase + θ), or sin(phase - θ) where sense is -1."""
    return _wave(math.sin(phase_rad), sense * math.cos(phase_rad))


def constant(value: float) -> Harmonics:
    """Return the function of constant value."""
    return Harmonics((complex(value), 0j, 0j, 0j))


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
