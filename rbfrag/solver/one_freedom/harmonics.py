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
from numpy.typing import NDArray

from rbfrag.solver.results import FloatArray

DEGREE = 3
"""Highest harmonic."""

SIZE = 2 * DEGREE + 1
"""Numbers that a function is made of: 1, cos θ, sin θ, cos 2θ, sin 2θ, cos 3θ, sin 3θ."""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A sum of harmonics of θ, which can be added, multiplied and evaluated.

    Args:
        spectrum: complex Fourier coefficients of the harmonics -3 to 3, shape (7,).
    """

    spectrum: NDArray[np.complex128]

    def __add__(self, other: Harmonics | float) -> Harmonics:
        return Harmonics(self.spectrum + _spectrum(other))

    def __sub__(self, other: Harmonics | float) -> Harmonics:
        return Harmonics(self.spectrum - _spectrum(other))

    def __neg__(self) -> Harmonics:
        return Harmonics(-self.spectrum)

    def __mul__(self, other: Harmonics | float) -> Harmonics:
        if not isinstance(other, Harmonics):
            return Harmonics(self.spectrum * other)
        product = np.convolve(self.spectrum, other.spectrum)
        beyond = np.concatenate([product[:DEGREE], product[-DEGREE:]])
        if np.any(beyond != 0.0):
            raise ValueError(f"the product holds harmonics above {DEGREE}")
        return Harmonics(product[DEGREE:-DEGREE])

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: float) -> Harmonics:
        return -self + other

    def __call__(self, theta: float) -> float:
        """Return the value at a rotation [rad]."""
        numbers = self._numbers
        value = numbers[0]
        for n in range(1, DEGREE + 1):
            if numbers[2 * n - 1] != 0.0 or numbers[2 * n] != 0.0:
                value += numbers[2 * n - 1] * math.cos(n * theta)
                value += numbers[2 * n] * math.sin(n * theta)
        return value

    def derivative(self) -> Harmonics:
        """Return the derivative by θ."""
        return Harmonics(self.spectrum * 1j * np.arange(-DEGREE, DEGREE + 1))

    @cached_property
    def _numbers(self) -> tuple[float, ...]:
        return tuple(self.coefficients.tolist())

    @cached_property
    def coefficients(self) -> FloatArray:
        """Factors of 1, cos θ, sin θ, cos 2θ, sin 2θ, cos 3θ and sin 3θ, shape (7,)."""
        numbers = np.zeros(SIZE)
        numbers[0] = self.spectrum[DEGREE].real
        for n in range(1, DEGREE + 1):
            numbers[2 * n - 1] = 2.0 * self.spectrum[DEGREE + n].real
            numbers[2 * n] = -2.0 * self.spectrum[DEGREE + n].imag
        return numbers

    @property
    def constant(self) -> bool:
        """Whether the function does not depend on θ."""
        return not np.any(self.coefficients[1:])


def cosine(phase_rad: float = 0.0, sense: int = 1) -> Harmonics:
    """Return cos(phase + θ), or cos(phase - θ) where sense is -1."""
    spectrum = np.zeros(SIZE, dtype=np.complex128)
    half = 0.5 * complex(math.cos(phase_rad), math.sin(phase_rad))
    spectrum[DEGREE + sense] = half
    spectrum[DEGREE - sense] = half.conjugate()
    return Harmonics(spectrum)


def sine(phase_rad: float = 0.0, sense: int = 1) -> Harmonics:
    """Return sin(phase + θ), or sin(phase - θ) where sense is -1."""
    spectrum = np.zeros(SIZE, dtype=np.complex128)
    half = 0.5 * complex(math.sin(phase_rad), -math.cos(phase_rad))
    spectrum[DEGREE + sense] = half
    spectrum[DEGREE - sense] = half.conjugate()
    return Harmonics(spectrum)


def constant(value: float) -> Harmonics:
    """Return the function that has one value everywhere."""
    return Harmonics(_spectrum(value))


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
        return self.x * other.y - self.y * other.x


def constant_vector(components: tuple[float, float]) -> Vector:
    """Return a vector that does not depend on θ."""
    return Vector(constant(components[0]), constant(components[1]))


def turning(arm: tuple[float, float], sense: int = 1) -> Vector:
    """Return an arm of the block that has turned by θ, counter-clockwise where sense is 1."""
    x, y = arm
    return Vector(
        cosine() * x - sine() * (sense * y),
        sine() * (sense * x) + cosine() * y,
    )


def _spectrum(value: Harmonics | float) -> NDArray[np.complex128]:
    if isinstance(value, Harmonics):
        return value.spectrum
    spectrum = np.zeros(SIZE, dtype=np.complex128)
    spectrum[DEGREE] = value
    return spectrum
