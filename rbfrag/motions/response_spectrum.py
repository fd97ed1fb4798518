"""Spectral accelerations of an accelerogram that is linear between its samples.

A linear oscillator, u'' + 2 ζ ω u' + ω² u = −a(t), started from rest, is solved exactly for such a
record (Nigam & Jennings 1969, Bull. Seism. Soc. Am. 59(2), 909-922), here in complex form: with
λ = ω (−ζ + i √(1 − ζ²)), z = u' − λ̄ u obeys z' = λ z − a, one equation of first order, which is as
well conditioned for long periods as for short ones, and u = Im z / Im λ.

The answer is the pseudo-spectral acceleration ω² max|u|. The maximum is that of the continuous
motion, between samples and in the free vibration after the record as well: at a time step of a
seventh of the period its samples alone are up to a tenth too low.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.polarity import FloatArray
from rbfrag.vocabulary.quantities import MEASURES

ComplexArray = NDArray[np.complex128]

DAMPING = 0.05
"""Damping ratio ζ of the spectral accelerations."""

_STORED = {
    measure.period_s: name for name, measure in MEASURES.items() if measure.period_s is not None
}
PERIODS_S: Mapping[str, float] = {_STORED[period_s]: period_s for period_s in sorted(_STORED)}
"""Period [s] of each spectral acceleration that is stored, by its name."""

_SERIES_BELOW = 0.5
_SERIES = tuple(1.0 / math.factorial(n + 2) for n in range(16))
_CONVERGED = 1e-13
_HALVINGS = 500


class _Steps(NamedTuple):
    """Intervals: accelerations at their ends, lengths [s], and z at their ends."""

    start: FloatArray
    end: FloatArray
    length: FloatArray
    first: ComplexArray
    last: ComplexArray


def spectral_accelerations(acceleration_g: FloatArray, interval_s: FloatArray) -> dict[str, float]:
    """Return the stored spectral accelerations [g], by the names of `PERIODS_S`.

    Args:
        acceleration_g: samples [g], shape (n,), n >= 1; the ground is at rest after the last.
        interval_s: lengths of the intervals between them [s], shape (n - 1,), >= 0, equal or not.
    """
    return {
        name: spectral_acceleration(acceleration_g, interval_s, period_s)
        for name, period_s in PERIODS_S.items()
    }


def spectral_acceleration(
    acceleration_g: FloatArray, interval_s: FloatArray, period_s: float
) -> float:
    """Return the pseudo-spectral acceleration ω² max|u| [g] of one oscillator, 5 % damped.

    Args:
        acceleration_g: samples [g], shape (n,), n >= 1.
        interval_s: lengths of the intervals between them [s], shape (n - 1,), >= 0.
        period_s: natural period of the undamped oscillator [s].
    """
    omega = 2.0 * math.pi / period_s
    root = omega * complex(-DAMPING, math.sqrt(1.0 - DAMPING * DAMPING))
    scale = float(np.max(np.abs(acceleration_g)))
    if scale == 0.0:
        return 0.0
    a = acceleration_g / scale
    z = _states(a, interval_s, root)
    moving = interval_s > 0.0
    steps = _Steps(a[:-1][moving], a[1:][moving], interval_s[moving], z[:-1][moving], z[1:][moving])
    greatest = max(_free_vibration(complex(z[-1]), root), float(np.max(np.abs(z.imag))))
    return scale * omega * omega / root.imag * _within(steps, root, greatest)


def _states(a: FloatArray, h: FloatArray, root: complex) -> ComplexArray:
    """Return z [g·s] at every node, by z_{i+1} = exp(λ h) z_i − the contribution of the interval.

    The equations of a matrix with two diagonals, solved from the first row downwards.
    """
    states = np.zeros(a.size, dtype=np.complex128)
    if not h.size:
        return states
    # here, because importing it takes longer than a scalar answer may
    from scipy.linalg.lapack import ztbtrs

    equal = bool((h == h[0]).all())
    decay, near, far = _weights(h[:1] if equal else h, root)
    diagonals = np.ones((2, h.size), dtype=np.complex128, order="F")
    diagonals[1, :-1] = -(decay if equal else decay[1:])
    states[1:] = -(near * a[:-1] + far * a[1:])
    states[1:] = ztbtrs(diagonals, states[1:], uplo="L", trans="N", diag="U")[0]
    return states


def _weights(h: FloatArray, root: complex) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return exp(λ h), and h ∫_0^1 (1 − s) e(s) ds and h ∫_0^1 s e(s) ds, e(s) = exp(λ h (1 − s)).

    These are the weights that a at the start and at the end of an interval has in z at its end [s].
    """
    x = root * h
    small = np.abs(x) < _SERIES_BELOW
    series: Any = np.polynomial.polynomial.polyval(np.where(small, x, 0.0), _SERIES)
    safe = np.where(small, 1.0, x)
    mean = np.where(small, 1.0 + x * series, np.expm1(safe) / safe)
    far: ComplexArray = np.where(small, series, (mean - 1.0) / safe)
    decay: ComplexArray = np.exp(x)
    near: ComplexArray = h * (mean - far)
    return decay, near, far * h


def _free_vibration(z: complex, root: complex) -> float:
    """Return the first maximum of |Im z| with the ground at rest; later ones are smaller."""
    # u' = Re z + Im z Re λ / Im λ is zero where arg z equals that of −λ̄
    turning = math.atan2(root.imag, -root.real)
    phase = (turning - math.atan2(z.imag, z.real)) % math.pi
    return abs(z) * math.exp(root.real / root.imag * phase) * math.sin(turning)


def _within(steps: _Steps, root: complex, greatest: float) -> float:
    """Return the maximum |Im z| within the steps, by bisecting those that may contain a larger one.

    Within a step z is a linear function and C exp(λ t), so that the chord of its ends is
    exceeded by at most h²/8 |λ²| |C|, which falls by four or more with each halving.

    Args:
        steps: all steps of the record.
        root: λ [1/s].
        greatest: the greatest |Im z| at their ends [g·s].
    """
    for _ in range(_HALVINGS):
        x = root * steps.length
        bend = x * x * (steps.first - steps.start / root) - steps.length * (steps.end - steps.start)
        chord = np.maximum(np.abs(steps.first.imag), np.abs(steps.last.imag))
        # the chord of C exp(λ t) itself is never further off than 2 |C|
        excess = np.abs(bend) * np.minimum(0.125, 2.0 / np.abs(x) ** 2)
        may_exceed = chord + excess > greatest * (1.0 + _CONVERGED)
        start, end, length, first, last = (column[may_exceed] for column in steps)
        if not start.size:
            break
        half, middle = 0.5 * length, 0.5 * (start + end)
        decay, near, far = _weights(half, root)
        inside = decay * first - near * start - far * middle
        greatest = max(greatest, float(np.max(np.abs(inside.imag))))
        steps = _Steps(
            np.concatenate([start, middle]),
            np.concatenate([middle, end]),
            np.concatenate([half, half]),
            np.concatenate([first, inside]),
            np.concatenate([inside, last]),
        )
    return greatest
