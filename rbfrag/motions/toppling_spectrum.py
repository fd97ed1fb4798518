"""Toppling spectrum X(p): the maximum toppling velocity of an excursion from rest.

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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import FloatArray, Polarity, driving_acceleration_g
from rbfrag.motions.quality import motion_warnings
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.numbers import exact_percent, rounded
from rbfrag.results.result import Result, TextLine, TextTable

SERIES_BELOW = 0.5
"""p·h below which the weights of an interval are summed as power series in it."""

# ∫_0^1 (1 − u) exp(−z u) du = Σ (−z)^k / (k + 2)!,   ∫_0^1 u exp(−z u) du = Σ (−z)^k / (k! (k + 2))
_SERIES = np.array(
    [
        ((-1.0) ** k / math.factorial(k + 2), (-1.0) ** k / (math.factorial(k) * (k + 2)))
        for k in range(14)
    ]
)

_LARGEST = 1e300

PRECISION = 0.02
"""No block whose toppling velocity is above X(p) by more than this fraction topples."""


@overload
def toppling_spectrum(motion: MotionLike, p2: float, polarity: Polarity = ...) -> float: ...
@overload
def toppling_spectrum(
    motion: MotionLike,
    p2: Sequence[float] | Sequence[Sequence[float]] | NDArray[Any],
    polarity: Polarity = ...,
) -> FloatArray: ...
def toppling_spectrum(
    motion: MotionLike, p2: ArrayLike, polarity: Polarity = "forward"
) -> FloatArray | float:
    """Return the toppling spectrum X(p) of a motion [m/s], for blocks of any size.

    The largest toppling velocity k_r g/p that any excursion from rest topples, in the linear
    model without vertical motion; within 1 % that of the non-linear model. Towards p² = 0 it
    is the largest difference between the ground's final velocity and an earlier one, for
    small blocks g·max(a)/p; it is never above 2 PGV.

    Args:
        motion: horizontal motion or its file, piecewise linear; at rest after its last sample.
        p2: frequency parameters p² [1/s²], > 0; a number or an array of any shape.
        polarity: ``forward`` (positive samples drive forward rotation) or ``reverse``.

    Returns:
        X [m/s], a float or an array of the shape of `p2`; 0 where nothing drives the block.

    Raises:
        InputError: a p2 that is not a positive finite number, an unknown polarity, a motion
            too large to compute.
    """
    sizes, motion = _positive(p2), as_motion(motion)
    driving = driving_acceleration_g(motion.acceleration_g, polarity)
    a, h = _without_rest(driving, motion.interval_s)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        greatest = _greatest_velocities(a, h, np.sqrt(sizes.ravel()))
        spectrum = STANDARD_GRAVITY_M_S2 * greatest.reshape(sizes.shape)
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
        raise InputError(f"p2 must be numbers: {error}") from None
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


def _greatest_velocities(a: FloatArray, h: FloatArray, p: FloatArray) -> FloatArray:
    """Return the maximum H [g·s] for each p [1/s], shape of p; H is zero after the record."""
    greatest = np.zeros(p.size)
    if not h.size:
        return greatest
    equal = bool((h == h[0]).all())
    remaining, excess = np.zeros(a.size), np.empty(a.size)
    diagonals = np.ones((2, h.size), order="F")
    # one row a value of p, and one column an interval unless all are of one length
    rows: Iterable[tuple[FloatArray, ...]] = (
        zip(*_weights(h[:1], p[:, None]), strict=True) if equal else (_weights(h, p_) for p_ in p)
    )
    for i, (frequency, weights) in enumerate(zip(p.tolist(), rows, strict=True)):
        _fill_remaining(remaining, a, weights, diagonals)
        np.multiply(remaining, frequency, out=excess)
        excess -= a  # H' = p H − a
        greatest[i] = _greatest(a, h, frequency, remaining, excess)
    return greatest


def _fill_remaining(
    remaining: FloatArray, a: FloatArray, weights: tuple[FloatArray, ...], diagonals: FloatArray
) -> None:
    """Fill H [g·s] at every node, by H_i = exp(−p h) H_{i+1} + the contribution of the interval.

    These are the equations of a matrix with two diagonals, solved from the last row upwards.

    Args:
        remaining: filled, shape (n,); its last value is zero and stays.
        a: acceleration [g], shape (n,).
        weights: of :func:`_weights`, shapes (n - 1,) or (1,).
        diagonals: the matrix in LAPACK's form, shape (2, n - 1); the second row is one.
    """
    # here, because importing it takes longer than a scalar answer may
    from scipy.linalg.lapack import dtbtrs

    decay, near, far = weights
    added = remaining[:-1]
    np.multiply(a[:-1], near, out=added)
    added += far * a[1:]
    np.negative(decay[:-1] if decay.size > 1 else decay, out=diagonals[0, 1:])
    added[:] = dtbtrs(diagonals, added, uplo="U", trans="N", diag="U", overwrite_b=1)[0]


def _greatest(
    a: FloatArray, h: FloatArray, p: float, remaining: FloatArray, excess: FloatArray
) -> float:
    greatest = max(float(remaining.max()), 0.0)
    # where a does not rise, the signs can only differ by rounding
    signs = excess > 0.0
    turning = np.flatnonzero(signs[:-1] > signs[1:])
    # H bends down where it has a maximum: it stays below both tangents
    reach = np.minimum(
        remaining[turning] + excess[turning] * h[turning],
        remaining[turning + 1] - excess[turning + 1] * h[turning],
    )
    turning = turning[(reach > greatest) & (a[turning] < a[turning + 1])]
    if not turning.size:
        return greatest
    inside = _turning_values(
        a[turning], a[turning + 1], h[turning], remaining[turning + 1], excess[turning + 1], p
    )
    return max(greatest, float(inside.max()))


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
    reach = -excess / (a1 - a0)
    x = np.minimum(p * h * reach, _LARGEST)
    ratio = np.divide(np.log1p(x), x, out=np.ones_like(x), where=x > 0.0)
    fraction = np.minimum(reach * ratio, 1.0)
    decay, near, far = _weights(h * fraction, p)
    return decay * end + near * (a1 - fraction * (a1 - a0)) + far * a1


def _weights(h: FloatArray, p: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return, for intervals of length h [s], the weights of their end values in H.

    Returns:
        exp(−p h); and h ∫_0^1 (1 − u) exp(−p h u) du and h ∫_0^1 u exp(−p h u) du [s], the
        weights of a at the start and at the end; of the common shape of p and h.
    """
    z = np.minimum(p * h, _LARGEST)
    decay = np.exp(-z)
    near, far = np.polynomial.polynomial.polyval(np.minimum(z, SERIES_BELOW), _SERIES)
    if (z > SERIES_BELOW).any():
        large = np.maximum(z, SERIES_BELOW)
        mean = -np.expm1(-large) / large
        near = np.where(z > SERIES_BELOW, (1.0 - mean) / large, near)
        far = np.where(z > SERIES_BELOW, (mean - np.exp(-large)) / large, far)
    return decay, h * near, h * far


@dataclass(frozen=True, eq=False, repr=False)
class TopplingSpectrum(Result):
    """Toppling spectrum of a motion in one polarity.

    Args:
        motion: the motion as the caller names it.
        name: label of the motion.
        polarity: forward or reverse.
        pgv_m_s: PGV of the motion [m/s].
        p2: frequency parameters [1/s²].
        x_m_s: toppling velocities X(p) [m/s].
        warnings: notes on the motion.
        kr: k_r of a block that is compared with the spectrum at the only p²; None for no block.
    """

    motion: str
    name: str
    polarity: str
    pgv_m_s: float
    p2: list[float]
    x_m_s: list[float]
    warnings: list[str]
    kr: float | None = None

    @classmethod
    def of(
        cls,
        motion: str,
        ground: GroundMotion,
        p2: Sequence[float],
        polarity: Polarity,
        kr: float | None = None,
    ) -> TopplingSpectrum:
        """Return the spectrum of a motion that the caller names `motion`.

        Raises:
            InputError: a block with several p², or a k_r that is not above zero.
        """
        if kr is not None and (len(p2) > 1 or not kr > 0.0):
            raise InputError("kr must be above zero and requires one p2", fields=("kr", "p2"))
        x_m_s = toppling_spectrum(ground, p2, polarity).tolist()
        warnings: list[str] = [*motion_warnings(ground)]
        return cls(motion, ground.label, polarity, ground.pgv_m_s, list(p2), x_m_s, warnings, kr)

    @property
    def may_topple(self) -> bool | None:
        """False where the spectrum excludes that the block topples; None without a block."""
        return None if self.kr is None else self.kr <= (1.0 + PRECISION) * self.critical_kr[0]

    @property
    def critical_kr(self) -> list[float]:
        """k_r of the block of each size whose toppling velocity k_r g/p is X(p)."""
        pairs = zip(self.p2, self.x_m_s, strict=True)
        return [x * p2**0.5 / STANDARD_GRAVITY_M_S2 for p2, x in pairs]

    def sentences(self) -> Iterator[str]:
        """Yield whether the block topples, or the k_r that topples from first to last size."""
        if self.kr is not None:
            verb = "may topple" if self.may_topple else "does not topple"
            yield (
                f"The block (k_r = {rounded(self.kr)}) {verb}: the critical value at p² = "
                f"{self.p2[0]:.3g} s⁻² is k_r = {rounded(self.critical_kr[0])}, to "
                f"{exact_percent(PRECISION)}"
            )
            return
        pairs = zip(self.critical_kr, self.p2, strict=True)
        sizes = [f"{rounded(kr)} at p² = {p2:g} s⁻²" for kr, p2 in pairs]
        ends = sizes[0] if len(sizes) == 1 else f"{sizes[0]} to {sizes[-1]}"
        yield f"Critical k_r, to {exact_percent(PRECISION)}: {ends}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the motion."""
        pgv = f"PGV {rounded(self.pgv_m_s)} m/s"
        yield TextLine("Record", f"{self.name}, {pgv}, {self.polarity} polarity")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield X and the critical k_r by size."""
        shown = repr if verbose else rounded
        columns = zip(self.p2, self.x_m_s, self.critical_kr, strict=True)
        rows = [(p2, shown(x), shown(kr)) for p2, x, kr in columns]
        yield TextTable(("p² [s⁻²]", "X [m/s]", "k_r"), rows)

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns by name, one row a size."""
        size = len(self.p2)
        texts = {name: getattr(self, name) for name in ("motion", "name", "polarity")}
        return {
            **{name: np.full(size, text, dtype=object) for name, text in texts.items()},
            "p2_1_s2": np.array(self.p2),
            "x_m_s": np.array(self.x_m_s),
        }

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {**vars(self), "may_topple": self.may_topple}
