"""Number of failures among very many blocks in one earthquake, without simulating each block.

Given what an earthquake shares, E(l), failures of different sites are independent: their number has
the mean Σ Φ((a - √ρ E)/√(1-ρ)) and a variance to which pairs of one site add. Drawn is E, and then
a number of this mean and variance: negative binomial, or binomial where pairs add nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import IntArray, Placement, joint_excess, pair_correlations
from rbfrag.solver.results import FloatArray

NODES = 25
"""Nodes of E over ln p."""

_CELL, _WIDEST = 0.2, 40
"""Width of Φ⁻¹(P) of blocks that are taken together, and how many of it there are to both sides."""

_PAIRS, _LEVELS = 256, np.array([-1.7, 0.0, 1.7])
"""Pairs of one site that stand for all, and the values of E at which they are taken."""

_LEAST, _LITTLE = 1e-12, 1e-7


class LatentEvent(NamedTuple):
    """Latent variables shared by all blocks of an earthquake.

    Args:
        value: E at the nodes, draws x nodes.
        seed: of what else is random.
    """

    value: FloatArray
    seed: int


class LargeCounts:
    """Random generator of the number of failures among many blocks in one earthquake.

    Args:
        blocks: rows of like blocks of unknown azimuths, those of one site together.
        count: blocks of each row, shape (m,).
    """

    def __init__(self, law: Dependence, blocks: Placement, count: IntArray) -> None:
        self._law, self._blocks, self._count = law, blocks, count
        nodes = np.linspace(blocks.l.min(), blocks.l.max(), NODES)
        step = max(float(nodes[1] - nodes[0]), 1e-9)
        self._node = np.rint((blocks.l - nodes[0]) / step).astype(np.intp)
        away = np.abs(nodes[:, None] - nodes) / law.l_e
        self._factor = np.linalg.cholesky(np.exp(-away) + 1e-9 * np.eye(NODES))
        self._last = np.cumsum(count)
        starts = np.flatnonzero(np.diff(blocks.site, prepend=blocks.site[0] - 1))
        number = np.diff(np.append(starts, count.size))
        self._from = np.repeat(self._last[starts] - count[starts], number)
        self._of_site = np.repeat(np.add.reduceat(count, starts), number)

    def latent(self, draws: int, generator: np.random.Generator) -> LatentEvent:
        """Return the shared latent variables of the samples of one earthquake."""
        value = generator.standard_normal((draws, NODES)) @ self._factor.T
        return LatentEvent(value, int(generator.integers(1 << 62)))

    def sums(
        self,
        bound: FloatArray,
        common: float,
        latent: LatentEvent,
        marks: Sequence[tuple[FloatArray, FloatArray]],
    ) -> tuple[FloatArray, float]:
        """Return sums of marks over the failed blocks of each sample, and P that any fails.

        Args:
            bound: Φ⁻¹ of P of a block of each row, shape (m,).
            common: share of the variance of what fails a block that its site has in common beside
                Z, as by scatter of the shaking.
            marks: mean and mean square of what a failure of each row adds, shape (m,) each.

        Returns:
            Marks x draws; the probability.
        """
        p, rho = ndtr(bound), self._law.rho_e * (1.0 - common)
        number = self._count * p
        cells = np.clip(np.rint(bound / _CELL), -_WIDEST, _WIDEST).astype(np.intp) + _WIDEST
        cells = cells * NODES + self._node

        def summed(values: FloatArray | IntArray) -> FloatArray:
            total = np.bincount(cells, values, minlength=NODES * (2 * _WIDEST + 1))
            return total.astype(np.float64)

        mean = summed(number)
        used = np.flatnonzero(mean > _LITTLE * mean.sum())
        many, mean, node = summed(self._count)[used], mean[used], used % NODES
        a = ndtri(mean / many)

        def conditional_p(value: FloatArray) -> FloatArray:
            return np.asarray(ndtr((a - np.sqrt(rho) * value) / np.sqrt(1.0 - rho)))

        at_levels = conditional_p(_LEVELS[:, None])
        alone = (at_levels * (1.0 - at_levels)) @ many
        more = self._of_pairs(bound, number, common, rho) / np.maximum(alone, _LEAST)
        q = conditional_p(latent.value[:, node])
        mean_of = q @ many
        order = np.argsort(at_levels @ many)
        shared = np.interp(mean_of, (at_levels @ many)[order], more[order])
        variance = (q * (1.0 - q)) @ many * (1.0 + np.maximum(shared, 0.0))
        generator = np.random.default_rng(latent.seed)
        failures, none = _number(mean_of, variance, generator)
        result = np.empty((len(marks), failures.size))
        for row, (mark, square) in zip(result, marks, strict=True):
            mean_mark, squares = (
                q @ (many * summed(number * moment)[used] / mean) / mean_of
                for moment in (mark, square)
            )
            row[:] = failures * mean_mark
            scatter = np.maximum(squares - mean_mark * mean_mark, 0.0)
            is_random = (failures > 0) & (scatter > _LEAST * mean_mark * mean_mark)
            shape = failures[is_random] * mean_mark[is_random] ** 2 / scatter[is_random]
            row[is_random] *= generator.standard_gamma(shape) / shape
        return result, float(1.0 - none.mean())

    def _of_pairs(
        self, bound: FloatArray, number: FloatArray, common: float, rho: float
    ) -> FloatArray:
        """Return the variance from pairs at one site at the levels of E, shape (levels,).

        Each of some blocks, the more likely the more it fails, stands for all, with one other of
        its site for all others.
        """
        law, blocks, generator = self._law, self._blocks, np.random.default_rng(0)
        below = np.cumsum(number)
        i = np.searchsorted(below, below[-1] * (np.arange(_PAIRS) + 0.5) / _PAIRS)
        other_blocks = self._of_site[i] - 1
        position = self._last[i] - 1 - self._from[i]
        other = np.floor((generator.permutation(_PAIRS) + 0.5) / _PAIRS * other_blocks).astype(
            np.int64
        )
        other += other >= position
        j = np.searchsorted(
            self._last, self._from[i] + np.minimum(other, other_blocks), side="right"
        )
        apart, _, (opposite, same) = pair_correlations(blocks, i, j, law)
        event = law.rho_e * np.exp(-np.abs(blocks.l[i] - blocks.l[j]) / law.l_e)
        total = np.zeros(_LEVELS.size)
        for weight, r in ((0.5, apart), (0.25, opposite), (0.25, same)):
            within = ((1.0 - common) * (r - event) + common) / (1.0 - rho)
            a, b = (
                (bound[k] - np.sqrt(rho) * _LEVELS[:, None]) / np.sqrt(1.0 - rho) for k in (i, j)
            )
            excess = joint_excess(a, b, np.clip(within, -1.0, 1.0))
            total += weight * (excess * other_blocks / ndtr(bound[i])).sum(axis=1)
        return np.asarray(total * below[-1] / _PAIRS)


def _number(
    mean: FloatArray, variance: FloatArray, generator: np.random.Generator
) -> tuple[IntArray, FloatArray]:
    """Return random counts with these means and variances, and the probability of zero."""
    wide = variance > mean * (1.0 + 1e-9)
    mean = np.maximum(mean, _LEAST)
    size = np.where(wide, mean * mean / np.where(wide, variance - mean, 1.0), 1.0)
    p = np.clip(np.where(wide, mean / np.maximum(variance, _LEAST), 0.5), _LEAST, 1.0 - 1e-15)
    trials = np.ceil(mean / np.maximum(1.0 - np.minimum(variance / mean, 1.0), _LEAST))
    trials = np.minimum(trials, 1e15)
    chance = np.minimum(mean / trials, 1.0)
    number = np.where(
        wide,
        generator.negative_binomial(size, p),
        generator.binomial(trials.astype(np.int64), chance),
    )
    with np.errstate(divide="ignore"):
        none = np.where(wide, size * np.log(p), trials * np.log1p(-chance))
    return number, np.exp(none)
