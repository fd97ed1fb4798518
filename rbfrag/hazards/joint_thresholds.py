"""At which shaking the first, second, … block of a site fails, at points of low discrepancy.

Given Z every block fails from one level of the shaking on, x_i = P_i⁻¹(Φ(Z_i)). The rate of
earthquakes with k failures or more therefore is the mean over Z of λ at the k-th smallest x_i: one
set of points answers for all curves and all k, and no level of the shaking needs points of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_points import REPLICATES, LatentPoints
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.model_blocks import ProbabilityTable
from rbfrag.solver.results import FloatArray

_VALUES, _OF_DRAWS = 2**19, 2**23
_MOST_POINTS, _FEWEST_POINTS = 2**14, 2**10
_FEWEST_OF_A_DRAW = 2**8

_STEPS, _REACH = 128, 8.0
"""Steps of Z to one standard deviation, and how far they reach, where thresholds are tabled."""

_MOST_KEPT = 100
"""Blocks up to which the thresholds of all are kept, whose rates are known, to correct by them."""

_SURE = 38.0


@dataclass(frozen=True, eq=False)
class JointThresholds:
    """Levels at which the k-th block fails.

    Args:
        counts: the numbers of failures k, rising.
        log_level: ln x at which the k-th block fails, counts x draws of the blocks' parameters x
            bands of P x scrambles x points; beyond the table where it does not.
        every: the same of each single block, by the first draw and band, scrambles x points x
            blocks; None for many blocks or draws.
    """

    counts: tuple[int, ...]
    log_level: FloatArray
    every: FloatArray | None

    @classmethod
    def of(
        cls,
        table: ProbabilityTable,
        blocks: Placement,
        dependence: Dependence,
        counts: Sequence[int] = (1,),
        *,
        seed: int = 0,
    ) -> JointThresholds:
        """Return the levels by a model's copula.

        Args:
            table: P by draws x bands x blocks.
            counts: numbers of failures, from 1 to the number of blocks.
        """
        draws, bands, n, _ = table.values.shape
        values, fewest = (
            (_VALUES, _FEWEST_POINTS) if draws == 1 else (_OF_DRAWS // draws, _FEWEST_OF_A_DRAW)
        )
        points = LatentPoints(
            dependence, blocks, int(np.clip(values // n, fewest, _MOST_POINTS)), seed
        )
        ordered = sorted(set(counts))
        at = [count - 1 for count in ordered]
        inverse = _inverse(table)
        first = np.arange(n) * inverse.shape[-1]
        result, every = [], []
        for z, generator in zip(
            points.replicates(), np.random.default_rng(seed).spawn(REPLICATES), strict=True
        ):
            place = np.clip(np.rint((z + _REACH) * _STEPS), 0, inverse.shape[-1] - 1)
            place = place.astype(np.intp) + first
            sides = place.shape[0]
            turn = generator.integers(sides, size=place.shape[1:])
            replicate = np.empty((len(at), draws, bands, place.shape[0] * place.shape[1]))
            own = []
            for side in range(sides):  # each block faces each of its sides once
                chosen = np.take_along_axis(place, (turn + side)[None] % sides, axis=0)[0]
                some = slice(side * chosen.shape[0], (side + 1) * chosen.shape[0])
                for draw, band in np.ndindex(draws, bands):
                    levels = inverse[draw, band].ravel()[chosen]
                    if n <= _MOST_KEPT and draws == 1 and band == 0:
                        own.append(levels.copy())
                    if at == [0]:
                        replicate[0, draw, band, some] = levels.min(axis=1)
                    else:
                        levels.partition(at, axis=1)
                        replicate[:, draw, band, some] = levels[:, at].T
            result.append(replicate)
            every.extend([np.concatenate(own)] if own else [])
        return cls(tuple(ordered), np.stack(result, axis=3), np.stack(every) if every else None)

    def rates(
        self, curve: HazardCurve, block_rates: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Return annual rates of k failures or more, and their standard errors as quadratures.

        Where every block's levels are kept, the rates are corrected by how far the sum over the
        blocks is from that of the known rates, in the proportion in which both go together (a
        control variate, Hammersley and Handscomb 1964).

        Args:
            block_rates: rates of the single blocks [1/a], shape (n,); None for no correction.

        Returns:
            Rates [1/a], counts x draws x bands; errors [1/a] of the first draw and band, (counts,).
        """
        rate = curve.rate_from(self.log_level)
        means = rate.mean(axis=-1)
        first = means[:, 0, 0].copy()
        if self.every is not None and block_rates is not None:
            total = curve.rate_from(self.every).sum(axis=-1)
            spread = total - total.mean()
            variance = float(np.mean(spread**2))
            for k in range(first.shape[0]):
                slope = float(np.mean(rate[k, 0, 0] * spread)) / variance if variance > 0.0 else 0.0
                first[k] -= slope * (total.mean(axis=-1) - float(block_rates.sum()))
        error = first.std(axis=-1, ddof=1) / np.sqrt(first.shape[-1])
        mean = means.mean(axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.where(mean[:, 0, 0] > 0.0, first.mean(axis=-1) / mean[:, 0, 0], 1.0)
        return np.asarray(mean * np.maximum(factor, 0.0)[:, None, None]), np.asarray(error)

    def probability(self, level: float) -> FloatArray:
        """Return P of k failures or more at a level of the shaking, shape (counts,)."""
        fails = self.log_level[:, 0, 0] <= np.log(level)
        return np.asarray(fails.mean(axis=(-1, -2)))


def _inverse(table: ProbabilityTable) -> FloatArray:
    """Return ln x at which blocks fail, draws x bands x blocks x steps of Z."""
    values, nodes = table.values, table.nodes
    z = np.arange(-_REACH * _STEPS, _REACH * _STEPS + 1) / _STEPS
    bound = np.clip(ndtri(np.maximum.accumulate(values, axis=-1)), -_SURE, _SURE)
    inverse = np.empty((*values.shape[:-1], z.size))
    for row in np.ndindex(values.shape[:-1]):
        inverse[row] = np.interp(z, bound[row], nodes, right=nodes[-1] + 1.0)
    return inverse
