"""Annual rates of at least k failures at a site: P at nodes of the shaking times its rate density.

Given Z every block fails from one level of the shaking on, that at which P_i = Φ(Z_i); this level
is exceeded λ_i(Z_i) times a year. The rate of earthquakes with k failures or more is the mean over
Z of the k-th greatest λ_i(Z_i): one set of points of low discrepancy answers for all k.

What is known without points is taken from there: one block; two, by Φ₂ at each node; independent
ones; ones that have one Z. Everything else is corrected by the sum of the λ_i, whose mean is the
sum of the blocks' own rates (a control variate, Hammersley and Handscomb 1964).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import IntArray, Placement, any_fails, least_and_greatest, pair_excess
from rbfrag.fragility.joint_points import REPLICATES, LatentPoints
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.results import FloatArray

MOST_POINTS, FEWEST_POINTS = 4096, 1024
"""Points of all replicates: the more, the fewer blocks."""

_STEPS, _REACH = 64, 8.0
"""Steps of Z to one standard deviation, and how far they reach, where λ of a block is tabled."""

_LEVELS = ndtr(np.arange(-_REACH * _STEPS, _REACH * _STEPS + 1) / _STEPS)
_VALUES, _SAME, _MOST_PAIRED = 1 << 19, 1e-9, 1000


class JointRates(NamedTuple):
    """Annual rates of earthquakes in which at least k blocks fail, for several tables of P.

    Args:
        counts: the numbers of failures k, rising.
        rate: annual rates [1/a], counts x tables.
        error: standard errors of the first table's as quadratures [1/a]; 0 of what is exact.
    """

    counts: tuple[int, ...]
    rate: FloatArray
    error: FloatArray


def joint_rates(
    probability: FloatArray,
    mass: FloatArray,
    blocks: Placement,
    law: Dependence,
    counts: Sequence[int] = (1,),
    *,
    seed: int = 0,
) -> JointRates:
    """Return the annual rates of earthquakes in which at least k blocks of one site fail.

    All tables answer by the same points, so that what they differ by is no scatter.

    Args:
        probability: P, tables x blocks x nodes of equal steps of ln(level), rising.
        mass: annual rate of shaking about each node [1/a], shape (nodes,).
        blocks: the n blocks.
        law: what they share.
        counts: numbers of failures, from 1 to n.
    """
    ks, n = sorted(set(counts)), blocks.size
    least, most = (-1.0, 1.0) if n > _MOST_PAIRED else least_and_greatest(blocks, law)
    block_rates = probability @ mass
    total = block_rates.sum(axis=1)
    error = np.zeros(len(ks))
    if n == 1:
        rate = block_rates.T
    elif most < _SAME and least > -_SAME:
        rate = np.stack([at_least(table, ks) @ mass for table in probability], axis=1)
    elif least > 1.0 - _SAME:
        rate = np.sort(probability, axis=1)[:, [n - k for k in ks]].swapaxes(0, 1) @ mass
    elif n == 2:
        both = np.stack([_both(table, blocks, law) for table in probability]) @ mass
        rate = np.stack([total - both if k == 1 else both for k in ks])
    else:
        rate, error = _by_points(probability, mass, blocks, law, ks, seed, total)
    # no law of these P goes beyond
    low, high = (p @ mass for p in any_fails(probability))
    high = high if least > -_SAME else total
    for i, k in enumerate(ks):
        rate[i] = np.clip(rate[i], low if k == 1 else 0.0, np.maximum(high, low))
        high = np.minimum(rate[i], total / (k + 1.0))
    return JointRates(tuple(ks), rate, error)


def at_least(probability: FloatArray, counts: Sequence[int]) -> FloatArray:
    """Return the probability that at least k independent blocks fail, counts x nodes.

    Args:
        probability: P, blocks x nodes.
    """
    number = np.zeros((max(counts), probability.shape[1]))
    number[0] = 1.0
    for p in probability:
        number[1:] += p * (number[:-1] - number[1:])
        number[0] *= 1.0 - p
    return np.asarray(1.0 - np.cumsum(number, axis=0)[[k - 1 for k in counts]])


def _both(probability: FloatArray, blocks: Placement, law: Dependence) -> FloatArray:
    """Return the probability that both of two blocks fail, shape (nodes,)."""
    p_first, p_second = probability
    nodes = np.flatnonzero(np.minimum(p_first, p_second) > 0.0)
    both, first = np.zeros(p_first.size), np.zeros_like(nodes)
    a, b = ndtri(p_first[nodes]), ndtri(p_second[nodes])
    both[nodes] = p_first[nodes] * p_second[nodes] + pair_excess(
        a, b, blocks, first, first + 1, law
    )
    return np.clip(both, 0.0, np.minimum(p_first, p_second))


def _by_points(
    probability: FloatArray,
    mass: FloatArray,
    blocks: Placement,
    law: Dependence,
    counts: Sequence[int],
    seed: int,
    total: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    points = int(np.clip(_VALUES // blocks.size, FEWEST_POINTS, MOST_POINTS))
    z, side = LatentPoints(law, blocks, points, seed).sides()
    above = mass[::-1].cumsum()[::-1]
    rate, error = np.empty((len(counts), probability.shape[0])), np.empty(len(counts))
    for number, table in enumerate(probability):
        levels = _rates_of_levels(np.ascontiguousarray(table), above, _LEVELS)
        mean, product, mean_sum, squares = _moments(levels, z, side, np.array(counts))
        spread = squares.mean() - mean_sum.mean() ** 2
        shared = product.mean(axis=0) - mean.mean(axis=0) * mean_sum.mean()
        slope = shared / spread if spread > 0.0 else np.zeros(len(counts))
        corrected = mean - slope * (mean_sum - total[number])[:, None]
        rate[:, number] = corrected.mean(axis=0)
        if number == 0:
            error = corrected.std(axis=0, ddof=1) / np.sqrt(corrected.shape[0])
    return rate, error


@kernel
def _rates_of_levels(probability: FloatArray, above: FloatArray, levels: FloatArray) -> FloatArray:
    """Return the annual rates at which P reaches increasing levels, blocks x levels."""
    n, nodes = probability.shape
    result = np.zeros((n, levels.size))
    for i in range(n):
        p = probability[i]
        k, low, high = 0, 0.0, p[0]
        for j in range(levels.size):
            level = levels[j]
            while k < nodes and high < level:
                k += 1
                if k < nodes:
                    low, high = high, max(high, p[k])
            if k == nodes:
                break
            # between the middles of two cells the rate is straight
            last = above[k + 1] if k + 1 < nodes else 0.0
            after = 0.5 * (above[k] + last)
            if k == 0:
                result[i, j] = above[0]
            else:
                before = 0.5 * (above[k - 1] + above[k])
                t = (level - low) / (high - low)
                result[i, j] = before + t * (after - before)
    return result


@kernel
def _moments(
    levels: FloatArray, z: FloatArray, side: NDArray[np.int8], counts: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return means over the points of each replicate.

    Args:
        levels: rates by steps of Z, blocks x steps.
        z: Z on each side that a block may face, sides x blocks x points.
        side: the first side of each, blocks x points.
        counts: numbers of failures k.

    Returns:
        Of the k-th greatest rate and its product with the sum, replicates x counts; of the sum and
        its square, (replicates,).
    """
    sides, n, points = z.shape
    most, end = counts.max(), levels.shape[1] - 1
    mean, product = np.zeros((REPLICATES, counts.size)), np.zeros((REPLICATES, counts.size))
    mean_sum, squares = np.zeros(REPLICATES), np.zeros(REPLICATES)
    block_rates, rates = np.empty((n, points)), np.empty(n)
    for turn in range(sides):  # each block faces each of its sides once
        for i in range(n):
            for point in range(points):
                x = (z[(side[i, point] + turn) % sides, i, point] + _REACH) * _STEPS
                x = min(max(x, 0.0), end - 1e-9)
                j = int(x)
                block_rates[i, point] = levels[i, j] + (x - j) * (levels[i, j + 1] - levels[i, j])
        for point in range(points):
            r = point * REPLICATES // points
            total, greatest = 0.0, 0.0
            for i in range(n):
                rates[i] = block_rates[i, point]
                total += rates[i]
                greatest = max(greatest, rates[i])
            if most > 1:
                rates.sort()
            for k in range(counts.size):
                rate = greatest if most == 1 else rates[n - counts[k]]
                mean[r, k] += rate
                product[r, k] += rate * total
            mean_sum[r] += total
            squares[r] += total * total
    number = points // REPLICATES * sides
    return mean / number, product / number, mean_sum / number, squares / number
