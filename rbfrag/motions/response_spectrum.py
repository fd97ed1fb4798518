"""Response spectra of records that are linear between their samples, 5 % damped.

A linear oscillator, u'' + 2 ζ ω u' + ω² u = −a(t), started from rest, is solved exactly for a
piecewise-linear record (Nigam & Jennings 1969, Bull. Seism. Soc. Am. 59(2), 909-922), here in
complex form: with λ = ω (−ζ + i √(1 − ζ²)), z = u' − λ̄ u obeys z' = λ z − a, one equation of
first order, which is as well conditioned for long periods as for short ones, and
u = Im z / Im λ.

The answer is the pseudo-spectral acceleration ω² max|u|. The maximum is that of the continuous
motion, between samples and in the free vibration after the record as well: at a time step of a
seventh of the period its samples alone are up to a tenth too low.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.polarity import FloatArray
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.vocabulary.quantities import MEASURES
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

ComplexArray = NDArray[np.complex128]
Samples = FloatArray | ComplexArray

DAMPING = 0.05
"""Damping ratio ζ of the spectral accelerations."""

_STORED = {
    measure.period_s: name for name, measure in MEASURES.items() if measure.period_s is not None
}
PERIODS_S: Mapping[str, float] = {_STORED[period_s]: period_s for period_s in sorted(_STORED)}
"""Period [s] of each spectral acceleration that is a measure of its own, by its name."""

HOUSNER_PERIODS_S = tuple(n / 20.0 for n in range(2, 51))
"""Periods [s] of the Housner intensity, 0.1 to 2.5 s in steps of 0.05 s."""

DIRECTIONS = 180
"""Number of directions of RotD50 and RotD100, 1° apart (Boore 2010)."""

_SERIES_BELOW = 0.5
_SERIES = tuple(1.0 / math.factorial(n + 2) for n in range(16))
_CONVERGED = 1e-13
_HALVINGS = 500
_FEW = 20
_ONE_DIRECTION = np.ones((1, 1))


class _Steps(NamedTuple):
    """Intervals: accelerations at their ends, lengths [s], and z at their ends, shape (n,) each.

    The history that each is of is the response of one oscillator in one direction.
    """

    history: NDArray[np.intp]
    start: Samples
    end: Samples
    first: ComplexArray
    last: ComplexArray
    length: FloatArray


class DirectionalPeaks(NamedTuple):
    """A percentile, over all horizontal directions, of the peaks of a recording.

    Args:
        percentile: 50 (RotD50) or 100 (RotD100).
        pga_g: peak ground acceleration [g].
        pgv_m_s: peak ground velocity [m/s].
        sa_g: spectral accelerations [g] at :data:`SPECTRUM_PERIODS_S`.
    """

    percentile: int
    pga_g: float
    pgv_m_s: float
    sa_g: tuple[float, ...]


def spectral_accelerations(
    acceleration_g: FloatArray, interval_s: FloatArray, periods_s: Sequence[float]
) -> list[float]:
    """Return the pseudo-spectral accelerations ω² max|u| [g] of oscillators, 5 % damped.

    Args:
        acceleration_g: samples [g], shape (n,), n >= 1; the ground is at rest after the last.
        interval_s: lengths of the intervals between them [s], shape (n - 1,), >= 0, equal or not.
        periods_s: natural periods of the undamped oscillators [s].
    """
    peaks = _spectral(acceleration_g[None], interval_s, periods_s, _ONE_DIRECTION)
    ordinates: list[float] = peaks[:, 0].tolist()
    return ordinates


def housner_intensity(spectrum_g: Sequence[float]) -> float:
    """Return the Housner intensity [m], the integral of PSV from 0.1 to 2.5 s, 5 % damped.

    PSV = SA T/2π, by the trapezoidal rule at :data:`HOUSNER_PERIODS_S` (Housner 1952, Proc. Symp.
    Earthquake and Blast Effects on Structures, 20-36).

    Args:
        spectrum_g: spectral accelerations [g] at these periods.
    """
    periods_s = np.array(HOUSNER_PERIODS_S)
    psv_m_s = np.array(spectrum_g) * periods_s * (STANDARD_GRAVITY_M_S2 / (2.0 * math.pi))
    return float(np.sum(0.5 * np.diff(periods_s) * (psv_m_s[1:] + psv_m_s[:-1])))


def directional_peaks(
    components_g: FloatArray, interval_s: FloatArray
) -> tuple[DirectionalPeaks, DirectionalPeaks]:
    """Return RotD50 and RotD100 of PGA, PGV and the response spectrum.

    The peak of each direction is that of the rotated component (Boore 2010, Bull. Seism. Soc. Am.
    100(4), 1830-1835); the histories of the two components are computed once and rotated.

    Args:
        components_g: samples of two perpendicular horizontal components [g], shape (2, n).
        interval_s: lengths of the intervals between them [s], shape (n - 1,).
    """
    angles = np.arange(DIRECTIONS) * (math.pi / DIRECTIONS)
    axes = np.column_stack([np.cos(angles), np.sin(angles)])
    # with λ = 0 and an imaginary acceleration, Im z is the velocity
    turned: ComplexArray = np.multiply(1j, components_g, dtype=np.complex128)
    (velocity,) = STANDARD_GRAVITY_M_S2 * _peaks(turned, interval_s, np.zeros(1, complex), axes)
    spectra = _spectral(components_g, interval_s, SPECTRUM_PERIODS_S, axes)
    peaks = np.array([_sampled_peaks(components_g, axes), velocity, *spectra])
    medians, maxima = np.median(peaks, axis=1).tolist(), np.max(peaks, axis=1).tolist()
    return (
        DirectionalPeaks(50, medians[0], medians[1], tuple(medians[2:])),
        DirectionalPeaks(100, maxima[0], maxima[1], tuple(maxima[2:])),
    )


def _spectral(
    a: FloatArray, h: FloatArray, periods_s: Sequence[float], axes: FloatArray
) -> FloatArray:
    """Return the pseudo-spectral acceleration by period and direction, in the unit of a."""
    omega: FloatArray = 2.0 * math.pi / np.array(periods_s, dtype=np.float64)
    unit = complex(-DAMPING, math.sqrt(1.0 - DAMPING * DAMPING))
    roots: ComplexArray = np.multiply(omega, unit, dtype=np.complex128)
    scale = float(np.max(np.abs(a)))
    if scale == 0.0:
        return np.zeros((len(omega), len(axes)))
    factors = scale * omega * omega / roots.imag
    peaks: FloatArray = factors[:, None] * _peaks(a / scale, h, roots, axes)
    return peaks


def _peaks(a: Samples, h: FloatArray, roots: ComplexArray, axes: FloatArray) -> FloatArray:
    """Return the maximum |Im z| by oscillator and direction, shape (oscillators, directions).

    Args:
        a: accelerations of the components, shape (components, n).
        h: lengths of the intervals [s], shape (n - 1,).
        roots: λ of the oscillators [1/s]; zero for plain integration.
        axes: unit vectors of the directions, shape (directions, components).
    """
    longest = float(np.max(h, initial=0.0))
    change = float(np.max(np.abs(np.diff(a)), initial=0.0))
    strongest = float(np.max(np.abs(a)))
    peaks = np.empty((len(roots), len(axes)))
    candidates = []
    for i, root in enumerate(roots.tolist()):
        z = _states(a, h, root)
        peaks[i] = _sampled_peaks(z.imag, axes)
        if root:
            later = [_free_vibration(complex(end), root) for end in axes @ z[:, -1]]
            peaks[i] = np.maximum(peaks[i], later)
        # no step is above the chord of its ends by more than this: most are left out at once
        x = abs(root) * longest
        bend = x * x * float(np.max(np.abs(z))) + (change + x * strongest) * longest
        near = _may_exceed(z.imag, axes, peaks[i], 0.125 * bend)
        at = np.flatnonzero((near[1:] | near[:-1]) & (h > 0.0))
        start, end, first, last = a[:, at], a[:, at + 1], z[:, at], z[:, at + 1]
        chord = np.maximum(np.abs(axes @ first.imag), np.abs(axes @ last.imag))
        bulge = np.abs(axes @ _bulge(root, start, end, first, h[at]))
        direction, step = np.nonzero(chord + bulge > peaks[i][:, None])
        parts = (
            np.sum(axes[direction].T * values[:, step], axis=0)
            for values in (start, end, first, last)
        )
        candidates.append((i * len(axes) + direction, *parts, h[at][step]))
    steps = _Steps(*(np.concatenate(parts) for parts in zip(*candidates, strict=True)))
    return _within(steps, np.repeat(roots, len(axes)), peaks)


def _bulge(
    root: complex | ComplexArray,
    start: Samples,
    end: Samples,
    first: ComplexArray,
    length: FloatArray,
) -> ComplexArray:
    """Return a bound on the distance between Im z within steps and the chord of its ends.

    Within a step z is a linear function and C exp(λ t), so that the chord of its ends is
    exceeded by at most h²/8 |λ²| |C|, which falls by four or more with each halving. The chord of
    C exp(λ t) itself is never further off than 2 |C|. The bound is the absolute value.
    """
    x = root * length
    bend = x * (x * first - length * start) - length * (end - start)
    bound: ComplexArray = bend * (2.0 / np.maximum(np.abs(x) ** 2, 16.0))
    return bound


def _sampled_peaks(u: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the maximum of u in each direction at its samples.

    Args:
        u: components, shape (components, n).
        axes: unit vectors of the directions, shape (directions, components).
    """
    strongest = np.argmax(np.abs(axes[::_FEW] @ u), axis=1)
    peaks: FloatArray = np.max(np.abs(axes @ u[:, strongest]), axis=1)
    if len(axes) > 1:
        peaks = np.max(np.abs(axes @ u[:, _may_exceed(u, axes, peaks, 0.0)]), axis=1)
    return peaks


def _may_exceed(
    u: FloatArray, axes: FloatArray, peaks: FloatArray, excess: float
) -> NDArray[np.bool_]:
    """Return which samples may exceed the peaks less an excess in any direction, shape (n,).

    A vector of length |u| that is φ off a direction reaches |u| cos φ there.

    Args:
        u: components, shape (components, n).
        axes: unit vectors of the directions, shape (directions, components).
        peaks: maxima so far in each direction, shape (directions,).
        excess: how much may come on top of u.
    """
    size = np.abs(u[0]) if len(u) == 1 else np.hypot(u[0], u[1])
    needed = np.maximum(peaks - excess, 0.0) * (1.0 - 1e-12)
    may: NDArray[np.bool_] = size >= np.min(needed)
    if len(axes) > 1:
        at = np.flatnonzero(may)
        sector = np.rint(np.arctan2(u[1, at], u[0, at]) * (DIRECTIONS / math.pi)).astype(np.intp)
        may[at] = size[at] >= np.min(needed / _cosines(), axis=1)[sector % DIRECTIONS]
    return may


@cache
def _cosines() -> FloatArray:
    """Return the largest cosine between a vector of each sector and each direction."""
    apart = np.abs(np.subtract.outer(np.arange(DIRECTIONS), np.arange(DIRECTIONS)))
    apart = np.maximum(np.minimum(apart, DIRECTIONS - apart) - 0.5, 0.0)
    cosines: FloatArray = np.cos(apart * (math.pi / DIRECTIONS))
    return cosines


def _states(a: Samples, h: FloatArray, root: complex) -> ComplexArray:
    """Return z at every node, by z_{i+1} = exp(λ h) z_i − the contribution of the interval.

    The equations of a matrix with two diagonals, solved from the first row downwards.
    """
    states = np.zeros(a.shape, dtype=np.complex128)
    if not h.size:
        return states
    # here, because importing it takes longer than a scalar answer may
    from scipy.linalg.lapack import ztbtrs

    equal = bool((h == h[0]).all())
    decay, near, far = _weights(h[:1] if equal else h, root)
    diagonals = np.ones((2, h.size), dtype=np.complex128, order="F")
    diagonals[1, :-1] = -(decay if equal else decay[1:])
    added = -(near * a[:, :-1] + far * a[:, 1:])
    states[:, 1:] = ztbtrs(diagonals, added.T, uplo="L", trans="N", diag="U")[0].T
    return states


def _weights(
    h: FloatArray, root: complex | ComplexArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
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


def _within(steps: _Steps, roots: ComplexArray, peaks: FloatArray) -> FloatArray:
    """Return the maximum |Im z| of each history, bisecting the steps that may exceed it.

    Args:
        steps: steps that may have a maximum, in the order of the histories.
        roots: λ of each history [1/s].
        peaks: maximum |Im z| at samples, shape (oscillators, directions).
    """
    # not relative to each peak: across a polarised recording it is zero
    tolerance = np.broadcast_to(_CONVERGED * np.max(peaks, axis=1, keepdims=True), peaks.shape)
    largest, tolerance = peaks.ravel(), tolerance.ravel()
    for _ in range(_HALVINGS):
        chord = np.maximum(np.abs(steps.first.imag), np.abs(steps.last.imag))
        _, start, end, first, _, length = steps
        bound = chord + np.abs(_bulge(roots[steps.history], start, end, first, length))
        may_exceed = bound > (largest + tolerance)[steps.history]
        history, start, end, first, last, length = (column[may_exceed] for column in steps)
        if not length.size:
            break
        half, middle = 0.5 * length, 0.5 * (start + end)
        decay, near, far = _weights(half, roots[history])
        inside = decay * first - near * start - far * middle
        borders = np.flatnonzero(np.diff(history, prepend=-1))
        present = history[borders]
        reached = np.maximum.reduceat(np.abs(inside.imag), borders)
        largest[present] = np.maximum(largest[present], reached)
        # the halves in turn, so that they stay in the order of the histories
        pairs = (start, middle), (middle, end), (first, inside), (inside, last), (half, half)
        steps = _Steps(np.repeat(history, 2), *(np.stack(pair, axis=1).ravel() for pair in pairs))
    return largest.reshape(peaks.shape)
