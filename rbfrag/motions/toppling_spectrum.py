"""The toppling spectrum X(p): the toppling velocity that a motion reaches by itself.

With a(t) in g, linear between nodes, and the ground at rest after the last one,

    H(t) = ∫_t^∞ a(s) exp(−p (s − t)) ds,        X(p) = g · max over t of H(t)   [m/s].

In the linear model without vertical motion a block that starts from rest at t topples if its
critical angle is below p·H(t), so that no block with k_r g/p above X(p) topples (physics and
derivation: docs/theory/toppling-spectrum.md). H comes from one pass backwards over the
record; where it is greatest inside an interval, p H = a there, which gives the instant in
closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity, driving_acceleration_g
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

SERIES_BELOW = 0.5
"""p·h below which the weights of an interval are summed as power series in it."""

_TERMS = 14
# ∫_0^1 (1 − u) exp(−z u) du = Σ (−z)^k / (k + 2)!,   ∫_0^1 u exp(−z u) du = Σ (−z)^k / (k! (k + 2))
_NEAR_SERIES = [(-1.0) ** k / math.factorial(k + 2) for k in range(_TERMS)]
_FAR_SERIES = [(-1.0) ** k / (math.factorial(k) * (k + 2)) for k in range(_TERMS)]


@overload
def toppling_spectrum(motion: GroundMotion, p2: float, polarity: Polarity = ...) -> float: ...
@overload
def toppling_spectrum(
    motion: GroundMotion,
    p2: Sequence[float] | Sequence[Sequence[float]] | NDArray[Any],
    polarity: Polarity = ...,
) -> FloatArray: ...
def toppling_spectrum(
    motion: GroundMotion, p2: ArrayLike, polarity: Polarity = "forward"
) -> FloatArray | float:
    """Return the toppling spectrum X(p) of a motion [m/s], for blocks of any size.

    The largest toppling velocity k_r g/p that any fresh excursion topples, in the linear
    model without vertical motion; within 1 % that of the non-linear model. Towards p² = 0 it
    is the largest difference between the ground's final velocity and an earlier one, for
    small blocks g·max(a)/p; it is never above 2 PGV.

    Args:
        motion: horizontal motion, piecewise linear; at rest after its last sample.
        p2: frequency parameters p² [1/s²], > 0; a number or an array of any shape.
        polarity: ``forward`` (positive samples drive forward rotation) or ``reverse``.

    Returns:
        X [m/s], a float or an array of the shape of `p2`; 0 where nothing drives the block.

    Raises:
        InputError: a p2 that is not a positive finite number, an unknown polarity, a motion
            too large to compute.
    """
    sizes = _positive(p2)
    driving = driving_acceleration_g(motion.acceleration_g, polarity)
    a, h = _without_rest(driving, motion.interval_s)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        peaks = [_greatest_velocity(a, h, math.sqrt(each)) for each in sizes.ravel().tolist()]
    spectrum = STANDARD_GRAVITY_M_S2 * np.array(peaks, dtype=np.float64).reshape(sizes.shape)
    if not np.isfinite(spectrum).all():
        raise InputError(
            f"the toppling spectrum of a motion with PGA {float(np.abs(a).max()):g} g lasting "
            f"{motion.duration_s:g} s is too large to compute: check units and time step"
        )
    return spectrum if sizes.ndim else float(spectrum)


def _positive(p2: ArrayLike) -> FloatArray:
    try:
        sizes = np.asarray(p2, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"cannot read p2 as numbers: {error}") from None
    bad = np.flatnonzero(~(np.isfinite(sizes) & (sizes > 0.0)))
    if bad.size:
        which = f" number {int(bad[0]) + 1}" if sizes.ndim else ""
        raise InputError(
            f"p2{which} is {sizes.ravel()[bad[0]]:g}: give positive finite numbers [1/s²]"
        )
    return sizes


def _without_rest(a: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    # H is zero in the rest after the motion, and in the rest before it below its value at its end.
    moving = np.flatnonzero(a)
    if not moving.size:
        return a[:1], h[:0]
    first, last = max(int(moving[0]) - 1, 0), min(int(moving[-1]) + 1, a.size - 1)
    return a[first : last + 1], h[first:last]


def _greatest_velocity(a: FloatArray, h: FloatArray, p: float) -> float:
    """Return the greatest H [g·s] of one p [1/s]; H is zero after the record."""
    if not h.size:
        return 0.0
    still = _still_to_come(a, h, p)
    greatest = max(float(still.max()), 0.0)
    excess = p * still - a  # H' = p H − a
    # where a does not rise, the signs can only differ by rounding
    turning = np.flatnonzero((excess[:-1] > 0.0) & (excess[1:] < 0.0) & (a[:-1] < a[1:]))
    # H bends down where it has a maximum: it stays below both tangents
    reach = np.minimum(
        still[turning] + excess[turning] * h[turning],
        still[turning + 1] - excess[turning + 1] * h[turning],
    )
    turning = turning[reach > greatest]
    if not turning.size:
        return greatest
    inside = _turning_values(
        a[turning], a[turning + 1], h[turning], still[turning + 1], excess[turning + 1], p
    )
    return max(greatest, float(inside.max()))


def _still_to_come(a: FloatArray, h: FloatArray, p: float) -> FloatArray:
    """Return H [g·s] at every node, by H_i = exp(−p h) H_{i+1} + what the interval adds.

    These are the equations of a matrix with two diagonals, solved from the last row upwards.
    """
    # here, because importing it takes longer than a scalar answer may
    from scipy.linalg.lapack import dtbtrs

    equal = bool((h == h[0]).all())
    decay, near, far = _weights(h[:1] if equal else h, p)
    added = near * a[:-1] + far * a[1:]
    diagonals = np.ones((2, h.size), order="F")
    diagonals[0, 1:] = -decay if equal else -decay[:-1]
    solved, _ = dtbtrs(diagonals, added, uplo="U", trans="N", diag="U")
    still: FloatArray = np.append(solved, 0.0)
    return still


def _turning_values(
    a0: FloatArray, a1: FloatArray, h: FloatArray, end: FloatArray, excess: FloatArray, p: float
) -> FloatArray:
    """Return H [g·s] where p H = a inside intervals.

    Args:
        a0: a at the start of each interval [g].
        a1: a at its end, above a0.
        h: its length [s].
        end: H at its end [g·s].
        excess: p H − a at its end [g], below zero.
        p: [1/s].
    """
    # s/p + (excess − s/p) exp(−p r) = 0 at the time r before the end, s the slope of a
    share = -excess / (a1 - a0)
    x = np.minimum(p * h * share, 1e300)
    ratio = np.divide(np.log1p(x), x, out=np.ones_like(x), where=x > 0.0)
    fraction = np.minimum(share * ratio, 1.0)
    decay, near, far = _weights(h * fraction, p)
    return decay * end + near * (a1 - fraction * (a1 - a0)) + far * a1


def _weights(h: FloatArray, p: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return, for intervals of length h [s], what H takes over from their ends.

    Returns:
        exp(−p h); and h ∫_0^1 (1 − u) exp(−p h u) du and h ∫_0^1 u exp(−p h u) du [s], the
        weights of a at the start and at the end.
    """
    z = np.minimum(p * h, 1e300)
    decay = np.exp(-z)
    small = np.minimum(z, SERIES_BELOW)
    near = np.polynomial.polynomial.polyval(small, _NEAR_SERIES)
    far = np.polynomial.polynomial.polyval(small, _FAR_SERIES)
    if (z > SERIES_BELOW).any():
        large = np.maximum(z, SERIES_BELOW)
        mean = -np.expm1(-large) / large
        near = np.where(z > SERIES_BELOW, (1.0 - mean) / large, near)
        far = np.where(z > SERIES_BELOW, (mean - np.exp(-large)) / large, far)
    return decay, h * near, h * far
