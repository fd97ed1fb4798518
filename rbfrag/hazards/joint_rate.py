"""Annual rate of earthquakes in which at least k of several blocks of one site fail.

Given Z every block fails from one level of the shaking on, that at which P_i = Φ(Z_i); this level
is exceeded λ_i(Z_i) times a year. The rate of earthquakes with k failures or more is the mean over
Z of the k-th greatest λ_i(Z_i): one set of points of low discrepancy answers for all k.

What is known without points is taken from there: one block; two, by Φ₂ at each node; independent
ones; ones that have one Z. Everything else is corrected by the sum of the λ_i, whose mean is the
sum of the blocks' own rates (a control variate, Hammersley and Handscomb 1964).

The ends of the interval of the rate of any failure are its rates where the model's parameters are
moved by their error in the direction that changes the sum of the blocks' rates most.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import (
    UNKNOWN,
    IntArray,
    Placement,
    any_fails,
    least_and_greatest,
    pair_excess,
)
from rbfrag.fragility.joint_sampling import REPLICATES, LatentPoints
from rbfrag.hazards.curve import probability_in
from rbfrag.hazards.rate_density import Indices, SiteMass
from rbfrag.hazards.rate_integration import KernelBlocks, Rates, error_step, probabilities
from rbfrag.results.diagnostic import Diagnostic
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


COPULA = "the model's copula"
INDEPENDENT = "independent"
DEPENDENT = "fully dependent"
NO_LAW = "bounds"
"""Joint law where only bounds are known."""

UNKNOWN_TO_MODEL = (
    "the model has no dependence between the blocks of one earthquake (fit it again with "
    "dependence)"
)
SEVERAL_MODELS = "the dependence between blocks of several models is unknown"
BOUNDS_GIVEN = "bounds are given for full dependence and for independence"

MOST_JOINT = 4096
"""Most blocks that the dependence is taken for."""

MOST_REPEATED = 100_000
"""Most blocks of a site of which each is counted by itself for the bounds."""

USUAL_COUNTS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
"""Numbers of failures whose rates are given where none are asked for."""


@dataclass(frozen=True, eq=False)
class CountRate:
    """Annual rate of earthquakes in which at least k blocks fail.

    Args:
        count: number of failures.
        annual_rate: annual rate of earthquakes with as many or more [1/a].
        numerical_error: standard error of the rate as a quadrature, relative to it.
        probability: probability of at least one such earthquake in the period.
    """

    count: int
    annual_rate: float
    numerical_error: float
    probability: float


@dataclass(frozen=True, eq=False)
class JointRate:
    """Annual rates of earthquakes in which several blocks of one site fail.

    Args:
        at_least: how often earthquakes fail some numbers of blocks or more, the first any; empty
            where only bounds are known.
        annual_rate_any_ci: both ends of the interval of the first rate from the parameters of the
            fragility.
        joint_law: how the blocks of one earthquake fail together.
        bounds: the rate and the probability under full dependence, where the block of the greatest
            P fails first, and if blocks fail independently at each level of the shaking.
        warnings: what these numbers take for granted.
    """

    at_least: tuple[CountRate, ...]
    annual_rate_any_ci: tuple[float, float] | None
    joint_law: str
    bounds: Mapping[str, Mapping[str, float]]
    warnings: tuple[str, ...] = ()

    @property
    def annual_rate_any(self) -> float | None:
        """Annual rate of earthquakes with any failure [1/a]; None without a dependence model."""
        return self.at_least[0].annual_rate if self.at_least else None

    @property
    def probability_any(self) -> float | None:
        """Probability of any failure in the period; None without a dependence model."""
        return self.at_least[0].probability if self.at_least else None

    @classmethod
    def of(
        cls,
        any_bounds: Sequence[float],
        years: float,
        rates: JointRates | None = None,
        ends_of_any: tuple[float, float] | None = None,
    ) -> JointRate:
        """Return the rates of one site with their probabilities.

        Earthquakes are the Poisson process, not failures: the probability in T years is
        1 - exp(-λ_any T).

        Args:
            any_bounds: rates at which any fails under full dependence and if independent [1/a].
            years: the period [a].
            rates: what :func:`~rbfrag.hazards.joint_rate.joint_rates` gives, of any failure
                first; None where the law is not known.
            ends_of_any: both ends of the interval of the rate of any failure [1/a].
        """
        bounds = {
            name.replace(" ", "_"): {
                "annual_rate_any": float(rate),
                "probability_any": float(probability_in(years, np.asarray(rate))),
            }
            for name, rate in zip((DEPENDENT, INDEPENDENT), any_bounds, strict=True)
        }
        if rates is None:
            return cls((), None, NO_LAW, bounds)
        of_first = rates.rate[:, 0], rates.error, probability_in(years, rates.rate[:, 0])
        tiny = np.finfo(np.float64).tiny
        at_least = tuple(
            CountRate(count, rate, error / max(rate, tiny), probability)
            for count, rate, error, probability in zip(
                rates.counts, *(values.tolist() for values in of_first), strict=True
            )
        )
        return cls(at_least, ends_of_any, COPULA, bounds)

    @classmethod
    def mean(cls, parts: Sequence[JointRate], weights: FloatArray) -> JointRate:
        """Return the weighted mean over branches, of which all or none have a dependence model."""

        def meant(values: Iterable[Any]) -> float:
            return float(sum(w * value for w, value in zip(weights, values, strict=True)))

        bounds = {
            law: {name: meant(part.bounds[law][name] for part in parts) for name in numbers}
            for law, numbers in parts[0].bounds.items()
        }
        warnings = tuple(dict.fromkeys(text for part in parts for text in part.warnings))
        if parts[0].joint_law == NO_LAW:
            return cls((), None, NO_LAW, bounds, warnings)
        at_least = tuple(
            CountRate(
                first.count,
                *(
                    meant(getattr(part.at_least[i], name) for part in parts)
                    for name in ("annual_rate", "numerical_error", "probability")
                ),
            )
            for i, first in enumerate(parts[0].at_least)
        )
        low, high = (
            meant(part.annual_rate_any_ci[i] for part in parts if part.annual_rate_any_ci)
            for i in (0, 1)
        )
        return cls(at_least, (low, high), parts[0].joint_law, bounds, warnings)

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        ends = self.annual_rate_any_ci
        return {
            "annual_rate_any": self.annual_rate_any,
            "annual_rate_any_ci": None if ends is None else list(ends),
            "probability_any": self.probability_any,
            "annual_rate_at_least": [dict(vars(rate)) for rate in self.at_least] or None,
            "joint_law": self.joint_law,
            "bounds": {name: dict(values) for name, values in self.bounds.items()},
        }


def joint_at_sites(
    group_rates: Sequence[tuple[Indices, KernelBlocks, Rates]],
    mass: SiteMass,
    at_least: Sequence[int] | None,
    years: float,
    level: float,
    count: FloatArray,
) -> tuple[tuple[JointRate | None, ...], tuple[str, ...]]:
    """Return the annual rates of joint failure of the blocks of each site, and the warnings.

    Args:
        group_rates: blocks of each model with their rates.
        at_least: numbers of failures whose rates are wanted; None for usual ones. What the blocks
            of a site do not reach is left out, unless those of no site do.
        years: period of the probabilities [a].
        level: confidence level of the interval.
        count: number of identical blocks of each row, shape (m,).

    Raises:
        InputError: a number of failures that the blocks of no site reach.
    """
    # At least k failures in one earthquake: λ_k = Σ P(N >= k | u) (-dν(u)), N by the dependence
    # model that is stored with the fragility model.
    sites = mass.mass.shape[0]
    number = np.zeros(sites, dtype=np.intp)
    for indices, blocks, _ in group_rates:
        number += np.bincount(blocks.site, count[indices], sites).astype(np.intp)
    most = int(np.max(number))
    for least in at_least or ():
        if isinstance(least, bool) or not 1 <= least <= most:
            text = f"at least {least} failures of {most} blocks: give numbers from 1 to {most}"
            raise InputError(text)
    result: list[JointRate | None] = [None] * sites
    why: dict[str, None] = {}
    for site in np.flatnonzero(number > 1).tolist():
        site_blocks = []
        for indices, blocks, rates in group_rates:
            rows = np.flatnonzero(blocks.site == site)
            if rows.size:  # identical blocks of a row have azimuths of their own
                repeats = count[indices[rows]].astype(np.intp)
                if number[site] <= MOST_REPEATED:
                    rows = np.repeat(rows, repeats)
                site_blocks.append((blocks.only(rows), rates.gradient[:, rows].sum(axis=1)))
        counts = [k for k in ((1, *at_least) if at_least else USUAL_COUNTS) if k <= number[site]]
        models = {blocks.model.name: blocks.model for blocks, _ in site_blocks}.values()
        unknown = ""  # why their dependence is not known
        if any(model.dependence is None or model.method.block.size is None for model in models):
            unknown = UNKNOWN_TO_MODEL
        elif len(models) > 1:
            unknown = SEVERAL_MODELS
        elif number[site] > MOST_JOINT:
            unknown = f"the dependence of more than {MOST_JOINT:,} blocks is not computed"
        result[site] = _of_site(
            site_blocks, mass, site, counts, years, level, has_dependence=not unknown
        )
        if unknown:
            why[unknown] = None
    if not any(result):
        return tuple(result), ()
    counted = int(number[number > 1].max())
    number_text = f"{counted:,}" if sites == 1 else f"up to {counted:,}"
    return tuple(result), (
        Diagnostic(
            f"at least one failure: {number_text} blocks are assumed to be at one site, with "
            "unknown azimuths",
            "unknown_azimuths",
        ),
        *(Diagnostic(f"{text}: {BOUNDS_GIVEN}", "unknown_dependence") for text in why),
    )


def _of_site(
    site_blocks: Sequence[tuple[KernelBlocks, FloatArray]],
    mass: SiteMass,
    site: int,
    counts: Sequence[int],
    years: float,
    level: float,
    *,
    has_dependence: bool,
) -> JointRate:
    model, blocks = site_blocks[0][0].model, [group for group, _ in site_blocks]
    # The interval is that of the direction in parameter space along which the sum of the rates
    # changes most: one step down and one up, applied to all blocks together.
    steps: list[FloatArray | None] = [None]
    law = model.dependence if has_dependence else None
    if law is not None:
        step = error_step(model, np.sum([gradient for _, gradient in site_blocks], axis=0), level)
        steps = [None, -step, step]
    tables = np.stack(
        [
            np.concatenate([probabilities(group, mass.grid, step) for group in blocks])
            for step in steps
        ]
    )
    site_mass = mass.mass[site]
    branches = mass.branches[:, site][mass.weight > 0.0] if mass.branches.size else site_mass[None]
    weights = mass.weight[mass.weight > 0.0]
    parts, ends, where = [], None, None
    if law is not None:
        # the placement of the blocks, with unknown azimuths, by their medians
        medians = {
            name: np.concatenate([group.numbers[name][group.weight.size // 2] for group in blocks])
            for name in model.method.block.names
        }
        where = Placement.of_blocks(model, medians, polarity=UNKNOWN)
        assert where is not None
        rate = joint_rates(tables, site_mass, where, law).rate[0]
        ends = float(rate[1:].min()), float(rate[1:].max())
    for branch in branches:
        bounds = [float(p @ branch) for p in any_fails(tables[0])]
        rates = None
        if law is not None and where is not None:
            rates = joint_rates(tables[:1], branch, where, law, counts)
        parts.append(JointRate.of(bounds, years, rates, ends))
    return JointRate.mean(parts, weights) if len(parts) > 1 else parts[0]
