"""How many of some blocks fail in one earthquake, and whether any does: the law of their number.

The law is the normal copula of :mod:`rbfrag.fragility.dependence`. What has a closed form is exact:
one block, blocks that share all or nothing, pairs. The rest is a quadrature on the points of
:mod:`rbfrag.fragility.joint_points`, whose error is part of the answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from benchmarks.joint_orthant import none_fails
from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement, checked, count_moments
from rbfrag.fragility.joint_points import REPLICATES, LatentPoints

FloatArray = NDArray[np.float64]
Indices = NDArray[np.intp]

MOST_VALUES = 2**20
"""Z of all blocks that are evaluated: 2^15 points of 32 blocks."""

MOST_POINTS, _FEWEST_POINTS = 2**15, 2**10

MOST_KNOWN, MOST_UNKNOWN = 1000, 128
"""Blocks up to which Genz's integrand is evaluated, of known and of unknown azimuths."""

_GENZ_VALUES = 2**20

STEPS = 2**14
"""Steps of the total that weights which are no whole numbers are rounded to."""

_NOTHING = 1e-9
_MOST_APART = 2000
_MOST_SUMMED = 64
_LEAST_TAIL = 1e-12


@dataclass(frozen=True, eq=False)
class JointFailures:
    """Law of the weighted number of failures among the blocks of one earthquake.

    Args:
        mean: expectation of the weighted number, exact.
        variance: its variance, exact.
        unit: step of the values that the number may have.
        probability: probabilities of 0, 1, 2, … steps by each scramble of the points,
            shape (scrambles, steps + 1); one row where they are exact.
        none: probability that no block fails, by each scramble.
    """

    mean: float
    variance: float
    unit: float
    probability: FloatArray
    none: FloatArray

    @classmethod
    def of(
        cls,
        probability: ArrayLike,
        blocks: Placement,
        dependence: Dependence,
        weights: ArrayLike | None = None,
        *,
        seed: int = 0,
    ) -> JointFailures:
        """Return the law of blocks whose dependence is known.

        Args:
            probability: P of each block, shape (n,).
            blocks: where they stand.
            dependence: the copula.
            weights: weight or loss of each block, not below 0, shape (n,); None for 1. Weights that
                are no whole numbers are rounded to `STEPS` steps of their sum.
            seed: seed of the scrambles of the points.

        Raises:
            InputError: numbers of probabilities or weights are not that of the blocks, or a value
                makes no sense.
        """
        p, w = _checked(probability, blocks, weights)
        parts = []
        for own in _apart(blocks, dependence):
            some = blocks.only(own)
            exact = _exact(p[own], w[own], some, dependence)
            parts.append(exact or _by_points(p[own], w[own], some, dependence, seed))
        return cls._joined(parts, w, *count_moments(p, blocks, dependence, w))

    @classmethod
    def independent(cls, probability: ArrayLike, weights: ArrayLike | None = None) -> JointFailures:
        """Return the law of blocks that share nothing, one bound of an unknown dependence."""
        p, w = _checked(probability, None, weights)
        parts = [_together(p[i : i + 1], w[i : i + 1]) for i in range(p.size)]
        return cls._joined(parts, w, float(p @ w), float((w * w * p * (1.0 - p)).sum()))

    @classmethod
    def fully_dependent(
        cls, probability: ArrayLike, weights: ArrayLike | None = None
    ) -> JointFailures:
        """Return the law of blocks of one Z, that of greatest P failing first: the other bound."""
        p, w = _checked(probability, None, weights)
        order = np.argsort(-p, kind="stable")
        total = np.cumsum(w[order])
        mean = float(p @ w)
        # E[N²] sums the steps of N² where each block joins those that fail more easily
        square = float(p[order] @ np.diff(total**2, prepend=0.0))
        return cls._joined([_together(p, w)], w, mean, square - mean * mean)

    @classmethod
    def _joined(
        cls, parts: list[_Counted], weights: FloatArray, mean: float, variance: float
    ) -> JointFailures:
        total = float(weights.sum())
        whole = bool((weights == np.rint(weights)).all()) and total <= STEPS
        unit = 1.0 if whole or total == 0.0 else total / STEPS
        size = int(np.rint(total / unit)) + 1
        probability, none = np.eye(1, size), np.ones(1)
        for part in parts:
            own = part.on_steps(unit, size)
            probability = _convolved(probability, own)
            none = none * part.none
        probability = np.maximum(probability, 0.0)
        return cls(mean, max(variance, 0.0), unit, probability, none)

    @property
    def probability_any(self) -> float:
        """Probability that at least one block fails."""
        return float(1.0 - self.none.mean())

    @property
    def numerical_error(self) -> float:
        """Standard error of `probability_any` as a quadrature; 0 where it is exact."""
        return _error(self.none)

    def at_least(self, number: float) -> float:
        """Return the probability that the weighted number is this or more."""
        return float(self._tail(number).mean())

    def error_at_least(self, number: float) -> float:
        """Return the standard error of `at_least` as a quadrature."""
        return _error(self._tail(number))

    def _tail(self, number: float) -> FloatArray:
        first = int(np.ceil(number / self.unit - 0.5 * (self.unit != 1.0) - 1e-9))
        return np.asarray(self.probability[:, max(first, 0) :].sum(axis=1))

    def quantile(self, q: ArrayLike) -> FloatArray:
        """Return the smallest weighted number not exceeded with probability q, same shape as q."""
        below = np.cumsum(self.probability.mean(axis=0))
        levels = np.asarray(q, dtype=np.float64)
        step = np.searchsorted(below, levels * below[-1] - _LEAST_TAIL)
        return np.asarray(self.unit * np.minimum(step, below.size - 1))


@dataclass(frozen=True, eq=False)
class _Counted:
    """Weighted number of failures of blocks that share something.

    Args:
        value: values that it may have, shape (k,).
        probability: their probabilities by scramble, shape (scrambles, k).
        none: probability that none of them fails, by scramble.
    """

    value: FloatArray
    probability: FloatArray
    none: FloatArray

    def on_steps(self, unit: float, size: int) -> FloatArray:
        """Return probabilities of 0, 1, 2, … steps, no longer than they need, by scramble."""
        step = np.minimum(np.rint(self.value / unit).astype(np.intp), size - 1)
        table = np.zeros((self.probability.shape[0], int(step.max(initial=0)) + 1))
        np.add.at(table.T, step, self.probability.T)
        return table


def _together(p: FloatArray, w: FloatArray) -> _Counted:
    """Return the number of blocks of one Z: that of the greatest P fails first."""
    order = np.argsort(-p, kind="stable")
    at_least = np.concatenate([[1.0], p[order], [0.0]])
    value = np.concatenate([[0.0], np.cumsum(w[order])])
    return _Counted(value, -np.diff(at_least)[None], np.array([1.0 - p.max(initial=0.0)]))


def _exact(p: FloatArray, w: FloatArray, blocks: Placement, law: Dependence) -> _Counted | None:
    """Return the number of blocks of which a closed form is known, else None."""
    columns = np.column_stack([part.astype(np.float64) for part in vars(blocks).values()])
    if p.size == 1 or (not blocks.drawn.any() and (columns == columns[0]).all()):
        return _together(p, w)
    if p.size > 2:
        return None
    mean, variance = count_moments(p, blocks, law)
    both = 0.5 * (variance + mean * mean - mean)  # E[N(N-1)]/2
    both = float(np.clip(both, max(0.0, mean - 1.0), p.min()))
    chance = np.array([1.0 - mean + both, p[0] - both, p[1] - both, both])
    return _Counted(np.array([0.0, w[0], w[1], w.sum()]), chance[None], chance[:1])


def _by_points(
    p: FloatArray, w: FloatArray, blocks: Placement, law: Dependence, seed: int
) -> _Counted:
    """Return the number of failures by quadrature over what the blocks share.

    Whether any fails is Genz's integral or, of very many blocks, averaged over unknown azimuths in
    closed form; the number is averaged over four sides of each block.
    """
    a, generator = ndtri(p), np.random.default_rng(seed)
    number = min(max(MOST_VALUES // p.size, _FEWEST_POINTS), MOST_POINTS)
    totals, none = [], np.empty(REPLICATES)
    for r, z in enumerate(LatentPoints(law, blocks, number, seed).replicates()):
        fails = z <= a
        none[r] = np.prod(1.0 - fails.mean(axis=0), axis=1).mean()
        sides = fails.shape[0]
        first = generator.integers(sides, size=fails.shape[1:])
        totals.append(np.concatenate([
            np.take_along_axis(fails, (first + side)[None] % sides, axis=0)[0] @ w
            for side in range(sides)
        ]))  # fmt: skip
    if p.size <= (MOST_UNKNOWN if blocks.drawn.any() else MOST_KNOWN):
        power = int(np.log2(np.clip(_GENZ_VALUES // p.size, 2**9, 2**14) / REPLICATES))
        none = none_fails(p, blocks, law, power, seed)
    value, place = np.unique(np.round(np.stack(totals), 9), return_inverse=True)
    table = np.zeros((REPLICATES, value.size))
    for r, row in enumerate(place.reshape(REPLICATES, -1)):
        table[r] = np.bincount(row, minlength=value.size) / row.size
    return _Counted(value, _with_none(value, table, none) if (w > 0.0).all() else table, none)


def _with_none(value: FloatArray, table: FloatArray, none: FloatArray) -> FloatArray:
    """Return the probabilities with that of no failure as it is better known."""
    at_zero = value == 0.0
    if not at_zero.any():
        return table
    rest = table[:, ~at_zero].sum(axis=1)
    scale = np.divide(1.0 - none, rest, out=np.ones_like(rest), where=rest > 0.0)
    return np.asarray(np.where(at_zero, none[:, None], table * scale[:, None]))


def _apart(blocks: Placement, law: Dependence) -> Iterator[Indices]:
    """Yield the blocks in groups that share nothing with one another."""
    from scipy.sparse.csgraph import connected_components

    for earthquake in np.unique(blocks.earthquake):
        own = np.flatnonzero(blocks.earthquake == earthquake)
        if own.size > _MOST_APART:
            yield own
            continue
        some = blocks.only(own)
        site = some.site[:, None] == some.site[None]
        either = some.drawn[:, None] | some.drawn[None]
        component = site & (either | (some.component[:, None] == some.component[None]))
        shared = law.of_pairs(
            np.abs(some.l[:, None] - some.l[None]), np.abs(some.ln_y[:, None] - some.ln_y[None]),
            site, component, np.ones(site.shape),
        )  # fmt: skip
        count, label = connected_components(shared > _NOTHING, directed=False)
        yield from (own[label == number] for number in range(count))


def _convolved(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the probabilities of sums, row by row; a single row goes with each of many."""
    size = one.shape[1]
    rows = max(one.shape[0], other.shape[0])
    steps = np.flatnonzero(other.any(axis=0))
    if steps.size > _MOST_SUMMED:
        length = size + other.shape[1]
        wide = np.fft.rfft(one, length, axis=1) * np.fft.rfft(other, length, axis=1)
        return np.asarray(np.fft.irfft(wide, length, axis=1)[:, :size])
    total = np.zeros((rows, size))
    for step in steps:
        total[:, step:] += other[:, step : step + 1] * one[:, : size - step]
    return total


def _error(values: FloatArray) -> float:
    return float(values.std(ddof=1) / np.sqrt(values.size)) if values.size > 1 else 0.0


def _checked(
    probability: ArrayLike, blocks: Placement | None, weights: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    if blocks is None:
        blocks = Placement.of(np.zeros(np.size(probability)), 0.0)
    p, w = checked(probability, blocks, weights)
    if (w < 0.0).any():
        raise InputError(f"weight or loss {w[w < 0.0][0]:g} is below 0: give 0 or more")
    return p, w
