"""Single lobes of acceleration: the closed-form critical strength that records are compared with.

In the linear model a lobe of amplitude A and duration t_p topples blocks of critical angle up
to c·A, c a function of f = p t_p alone (docs/theory/toppling-spectrum.md, properties). Against
the records a lobe stands for half a mean period, t_p = T_m/2, so that f = π/(ω_m/p): the lines of
figure 4.20 of Gibson's dissertation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

_HALVINGS = 60


def rectangular_lobe(f: ArrayLike) -> FloatArray:
    """Return the critical angle over the amplitude of a rectangular lobe, f = p t_p > 0."""
    line: FloatArray = -np.expm1(-np.asarray(f, dtype=np.float64))
    return line


def triangular_lobe(f: ArrayLike) -> FloatArray:
    """Return the critical angle over the amplitude of a symmetric triangle, f = p t_p > 0."""
    of = np.asarray(f, dtype=np.float64)
    # ln(2 - e) as ln(1 + (1 - e)): no cancellation for short lobes; the rest of it by series
    half = 0.5 * of
    exact = 1.0 - np.log1p(-np.expm1(-half)) / half
    series = half * (1.0 - half + 13.0 / 12.0 * half * half)
    line: FloatArray = np.where(half < 1e-5, series, exact)
    return line


def half_sine_lobe(f: ArrayLike) -> FloatArray:
    """Return the critical angle over the amplitude of a half-sine, f = p t_p > 0.

    sin s with x sin s − cos s = exp(−(π − s)/x), x = π/f, by bisection in s.
    """
    x = np.pi / np.asarray(f, dtype=np.float64)
    low, high = np.zeros_like(x), np.full_like(x, 0.5 * np.pi)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = x * np.sin(middle) - np.cos(middle) < np.exp(-(np.pi - middle) / x)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    line: FloatArray = np.sin(0.5 * (low + high))
    return line


LOBES: Mapping[str, Callable[[ArrayLike], FloatArray]] = {
    "rectangular": rectangular_lobe,
    "half-sine": half_sine_lobe,
    "triangular": triangular_lobe,
}
"""The lobes by name, the one that topples most first."""


def lobe_line(name: str, frequency_ratio: ArrayLike) -> FloatArray:
    """Return the k_r/PGA of a lobe of half a mean period over ω_m/p, > 0.

    Args:
        name: one of :data:`LOBES`.
        frequency_ratio: ω_m/p = 2π/(T_m p).
    """
    return LOBES[name](np.pi / np.asarray(frequency_ratio, dtype=np.float64))
