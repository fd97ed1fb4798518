"""Blocks of one site, the annual rate of any failure by dependence model, and their survival.

Blocks may be uncertain: draws of their parameters, with weights, each make a set of blocks. The
probability of survival is

    S(f) = E[exp(-f λ T)]

with λ the rate at which any of the blocks fails, T the age and f a factor on all hazard rates.
Everything is done on ln S, which stays finite where S itself is 0 for a computer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import logsumexp

from rbfrag.errors import InputError
from rbfrag.fragility.joint import UNKNOWN, Placement, any_fails
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.uncertain import normal_product, normal_steps
from rbfrag.fragility.validation import reject_elements
from rbfrag.hazards.curve import HazardCurve, describe_ends
from rbfrag.hazards.joint_rate import COPULA, DEPENDENT, INDEPENDENT, joint_rates
from rbfrag.hazards.rate_density import Grid, SiteMass, curve_mass, under
from rbfrag.hazards.rate_integration import (
    KernelBlocks,
    Rates,
    error_step,
    interval_end,
    probabilities,
    rates,
)
from rbfrag.hazards.shaking import HazardLevel, parts_by_model
from rbfrag.question.fields import AnsweringFields
from rbfrag.question.keywords import LEVEL
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal
from rbfrag.vocabulary.quantities import BLOCK, NUMBERS

Fragility = Callable[[FloatArray], FloatArray]
"""From levels of the curve's measure, shape (n,), to probabilities of failure, shape (m, n)."""

STEP = 5e-4
"""Step of ln(level): where a fragility jumps, its rate is right to half of it times the slope of
the curve."""


@dataclass(frozen=True, eq=False)
class FailureRate:
    """Annual failure rates of m fragility functions, and what lies beyond the ends of the curve.

    Args:
        annual_rate: rates [1/a], shape (m,).
        above: rate that shaking beyond the last level of the curve adds at least [1/a],
            shape (m,); part of `annual_rate`.
        above_at_most: the same at most; the difference is not in `annual_rate`.
        below: probability of failure at the lowest level of the curve, shape (m,).
    """

    annual_rate: FloatArray
    above: FloatArray
    above_at_most: FloatArray
    below: FloatArray


def failure_rate(curve: HazardCurve, fragility: Fragility) -> FailureRate:
    """Return the annual rate of failure, the integral of P(failure | x) over -dλ(x).

    Shaking beyond the last level counts with the probability at that level, the least it can be;
    below the first level nothing is counted.

    Args:
        fragility: probabilities of failure at levels of its measure; rows are blocks.

    Raises:
        InputError: a probability is not a number.
    """
    first, last = curve.levels[[0, -1]].tolist()
    grid = Grid.over(STEP, np.log(first), np.log(last))
    p = _checked(fragility, np.clip(np.exp(grid.u), first, last))
    ends = _checked(fragility, np.array([first, last]))
    rate = float(curve.annual_rate[-1])
    beyond = np.ones(ends.shape[0])
    if curve.end_level is not None:
        beyond = _checked(fragility, np.array([curve.end_level]))[:, 0]
    return FailureRate(p @ under([curve], grid)[0], rate * ends[:, 1], rate * beyond, ends[:, 0])


def _checked(fragility: Fragility, levels: FloatArray) -> FloatArray:
    probabilities = np.atleast_2d(np.asarray(fragility(levels), dtype=np.float64))
    if np.isnan(probabilities).any():
        level = float(levels[np.argwhere(np.isnan(probabilities))[0][1]])
        raise InputError(f"the probability of failure at the level {level:g} is not a number")
    return probabilities


_AGES = 401
_REACH = 10.0
"""Points of the law of the age, and how far they reach in standard deviations of ln T: survival
of a high rate is decided in the far lower tail."""

_DOUBLINGS = 1000


@dataclass(frozen=True, eq=False)
class Age:
    """Age of standing blocks: a lognormal distribution with given mean and standard deviation.

    Lognormal rather than normal and cut at zero: an exposure age is a concentration over a
    production rate, whose errors multiply; and a normal law gives weight to rocks that have stood
    for no time at all, which is all that would be left of the survival of a high rate.

    Args:
        years: ages [a], shape (q,).
        weight: their weights, which sum to 1, shape (q,).
    """

    years: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, mean: float, sd: float = 0.0) -> Age:
        """Return the lognormal distribution of an age.

        Args:
            mean: mean age [a], above 0.
            sd: its standard deviation [a], 0 for an age that is known.

        Raises:
            InputError: the age is not above 0, or its standard deviation is below 0.
        """
        if not (math.isfinite(mean) and mean > 0.0):
            raise InputError(f"age = {mean:g} years: give the age of the blocks, above 0")
        if not (math.isfinite(sd) and sd >= 0.0):
            raise InputError(f"standard deviation of the age = {sd:g} years: give 0 or more")
        if sd == 0.0:
            return cls(np.array([mean]), np.ones(1))
        variance = math.log1p((sd / mean) ** 2)
        z, weight = normal_steps(_AGES, _REACH)
        return cls(mean * np.exp(math.sqrt(variance) * z - 0.5 * variance), weight)


@dataclass(frozen=True, eq=False)
class Standing:
    """Survival as a mixture over rates and ages.

    Args:
        failures: expected number of failures λT at the hazard as given, shape (n,).
        log_weight: logarithms of the weights, which sum to 1, shape (n,).
    """

    failures: FloatArray
    log_weight: FloatArray

    @classmethod
    def of(cls, annual_rate: ArrayLike, weight: ArrayLike, age: Age) -> Standing:
        """Return the survival for a discrete distribution of rates.

        Args:
            annual_rate: rates at which any block fails [1/a], shape (k,).
            weight: their probabilities, shape (k,).
        """
        failures = np.multiply.outer(np.asarray(annual_rate, dtype=np.float64), age.years)
        with np.errstate(divide="ignore"):
            log_weight = np.log(np.multiply.outer(np.asarray(weight), age.weight))
        return cls(failures.ravel(), log_weight.ravel())

    @classmethod
    def mixed(cls, parts: list[Standing], weight: ArrayLike) -> Standing:
        """Return the survival as a mixture over several hazards with given probabilities."""
        with np.errstate(divide="ignore"):
            logs = np.log(np.asarray(weight, dtype=np.float64))
        return cls(
            np.concatenate([part.failures for part in parts]),
            np.concatenate([part.log_weight + w for part, w in zip(parts, logs, strict=True)]),
        )

    def log_probability(self, factor: float = 1.0) -> float:
        """Return ln of the survival probability for all hazard rates times a factor."""
        return float(logsumexp(self.log_weight - factor * self.failures))

    @property
    def probability(self) -> float:
        """Probability that all blocks stand after the age."""
        return min(math.exp(self.log_probability()), 1.0)

    def factor(self, probability: float) -> float | None:
        """Return the factor on the hazard rates that gives a survival probability.

        None where no factor makes survival so improbable: nothing fails, or may fail, ever.
        """
        target = math.log(probability)
        never = self.log_weight[self.failures == 0.0]
        if never.size and logsumexp(never) >= target:
            return None
        # S(f) >= exp(-f E[λT]) by Jensen: the factor is at least -ln(probability)/E[λT]
        low = -target / float(np.exp(self.log_weight) @ self.failures)
        high = low
        for _ in range(_DOUBLINGS):
            if self.log_probability(high) <= target:
                break
            low, high = high, 2.0 * high
        if high == low:
            return high
        return float(
            brentq(lambda f: self.log_probability(f) - target, low, high, rtol=1e-12, xtol=1e-300)
        )


def weights_given_standing(parts: list[Standing], weight: ArrayLike) -> FloatArray:
    """Return the posterior weights of hazards given that all blocks stand (Bayes): w S/Σ w S.

    Args:
        weight: their weights before, which sum to 1, shape (n,).
    """
    with np.errstate(divide="ignore"):
        logs = np.log(np.asarray(weight, dtype=np.float64))
    logs = logs + np.array([part.log_probability() for part in parts])
    return np.asarray(np.exp(logs - logsumexp(logs)))


ALL_STAND = "that all of them stand is the question"
"""Why blocks of which one cannot be used are rejected."""

_SIGMA_POINTS, _SIGMA_REACH = 15, 5.0
_ALWAYS = 2
"""Size and strength have their points even where certain: what else scatters does not move them."""

ONE_BLOCK = "one block"


@dataclass(frozen=True, eq=False)
class AnyRate:
    """Annual rate of any failure among blocks under one hazard curve.

    Args:
        annual_rate: rates [1/a], laws x draws x bands; the bands are the rate and the two ends of
            its interval, or the rate alone.
        mean: the mean over the draws of the first of each [1/a].
        outside: part of it from outside the ranges that the model was fitted on.
        beyond: the most that shaking above the last level of the curve may add to the rate [1/a].
        below: probability of failure at the first level of the curve, the maximum of the blocks.
        warnings: what the ends of the curve leave open.
    """

    annual_rate: FloatArray
    mean: float
    outside: float
    beyond: float
    below: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FragilityBlocks:
    """Blocks with a user-supplied fragility function, one row of P per block."""

    fragility: Fragility
    count: int
    weight = np.ones(1)
    warnings: tuple[str, ...] = ()

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of the dependence models; the first one gives the answer."""
        return _laws(self.count)

    def rate(self, curve: HazardCurve) -> AnyRate:
        """Return the annual rate of any failure under a curve."""
        result = failure_rate(curve, lambda x: _by_law(np.atleast_2d(self.fragility(x))))
        ends = result.annual_rate, result.above, result.above_at_most, result.below
        texts = describe_ends([curve], _FIRST_SITE, *(values[:1] for values in ends))
        rates = result.annual_rate[:, None, None]
        beyond = float((result.above_at_most - result.above)[0])
        below = float(result.below[0])
        return AnyRate(rates, float(rates[0, 0, 0]), 0.0, beyond, below, tuple(texts))


@dataclass(frozen=True, eq=False)
class ModelBlocks:
    """Blocks of one kind, with or without parameter uncertainty, and their fragility model.

    Args:
        numbers: what the model reads of them, by field, draws x blocks each.
        weight: weights of the draws, which sum to 1, shape (k,).
        medians: the same of the medians, shape (m,) each.
        shaking: what the curve's levels are to the model.
        remarks: warnings about the blocks.
    """

    numbers: Mapping[str, FloatArray]
    weight: FloatArray
    medians: Mapping[str, FloatArray]
    shaking: HazardLevel
    model: FragilityModel
    level: float
    remarks: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        inputs: Mapping[str, Any],
        shaking: HazardLevel,
        *,
        draws: int,
        seed: int,
        answering: AnsweringFields,
    ) -> ModelBlocks:
        """Return blocks with given medians and standard deviations."""
        fields = dict(inputs)
        for sigma in [name for name in fields if name.endswith("_sigma")]:
            of = sigma.removesuffix("_sigma")
            # what a block has of itself is not known before its model is
            if of not in (*NUMBERS, *fields) and np.any(fields.pop(sigma)):
                raise InputError(f"{sigma} requires {of}: give its mean")
        if all(name == "kind" or name.endswith("_sigma") for name in fields):
            raise InputError("give p2 and kr of the blocks, or a fragility of the curve's measure")
        # All blocks that survive together must be of one model: their parameters are shared by all
        # earthquakes of their age.
        parts, remarks, reason = parts_by_model(fields, shaking, answering)
        reject_elements(reason, ALL_STAND, BLOCK)
        if len(parts) > 1:
            kinds = " and ".join(part.model.row.kind for part in parts)
            raise InputError(
                f"the blocks are of kinds {kinds}: give the blocks of each kind separately"
            )
        (part,) = parts
        size, block = reason.size, part.model.method.block
        order = np.argsort(part.indices)
        values = {name: array[order] for name, array in part.numbers.items()}
        for name in fields:
            if name.endswith("_sigma") and name not in block.sigmas and np.any(fields[name]):
                kind = part.model.row.kind
                raise InputError(f"{name} cannot be combined with kind {kind}: omit it")
        numbers = {name: value for name, value in values.items() if not name.endswith("_sigma")}
        medians = {name: np.asarray(array) for name, array in block.filled(numbers).items()}
        scatters = {name: f"{name}_sigma" for name in block.sigmas.values() if name in medians}
        # A block's own parameters are the same in all earthquakes, so survival is averaged over
        # them after the Poisson term: E[exp(-λ T)], not exp(-E[λ] T).
        z, weight = _standard_draws(
            [values.get(sigma, np.zeros(size)) for sigma in scatters.values()], draws, seed
        )
        drawn = {name: array[None] for name, array in medians.items()}
        for (name, sigma), points in zip(scatters.items(), z, strict=True):
            law = fraction if name in block.fractions else lognormal
            drawn[name] = law(points, medians[name], values.get(sigma, np.zeros(size)))
        shape = (weight.size, size)
        drawn = {name: np.broadcast_to(array, shape) for name, array in drawn.items()}
        level = answering.get("level", LEVEL)
        return cls(drawn, weight, medians, shaking, part.model, level, remarks)

    @property
    def count(self) -> int:
        """Number of blocks."""
        return next(iter(self.medians.values())).size

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of the dependence models; the first one gives the answer."""
        has_dependence = self.count > 1 and None not in (self.model.dependence, self.placement())
        return (COPULA, *_laws(self.count)) if has_dependence else _laws(self.count)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Assumptions of the model and of the interpretation of the curve."""
        block = self.model.method.block
        assumed = block.support if self.model.kind == block.kind else ""
        notes = (Diagnostic(assumed, "support_assumed"),) if assumed else ()
        return (*self.remarks, *self.shaking.warnings, *notes, *self.model.notes)

    def placement(self) -> Placement | None:
        """Return the placement of the blocks, with unknown azimuths; None without a size."""
        return Placement.of_blocks(self.model, self.medians, polarity=UNKNOWN)

    def rate(self, curve: HazardCurve) -> AnyRate:
        """Return the annual rate of any failure under a curve."""
        mass = curve_mass([[curve]], np.ones(1), self.shaking)
        k, m = self.weight.size, self.count
        numbers = {name: values.reshape(1, -1) for name, values in self.numbers.items()}
        site = np.zeros(k * m, dtype=np.intp)
        blocks = KernelBlocks(self.model, self.shaking.median, numbers, np.ones(1), site)
        draw_rates = rates(blocks, mass, self.level)
        rate, outside = (self._mean(values) for values in (draw_rates.rate, draw_rates.outside))
        first, last, end = (self._mean(values) for values in draw_rates.ends)
        beyond = float(curve.annual_rate[-1])
        most = beyond * (np.ones(m) if curve.end_level is None else end)
        sites = np.zeros(m, dtype=np.intp)
        warnings = describe_ends([curve], sites, rate, beyond * last, most, first)
        if m == 1:
            ends = (interval_end(draw_rates.rate, draw_rates.half, side) for side in (-1.0, 1.0))
            by_law = np.stack([draw_rates.rate, *ends], axis=1)[None]
        else:
            by_law = self._together(blocks, mass, draw_rates)
        share = outside.sum() / max(float(rate.sum()), np.finfo(np.float64).tiny)
        mean = float(self.weight @ by_law[0, :, 0])
        above = min(float((most - beyond * last).sum()), beyond)
        below = float(first.max())
        return AnyRate(by_law, mean, float(share), above, below, tuple(warnings))

    def _mean(self, values: FloatArray) -> FloatArray:
        """Return the mean over the draws, shape (m,)."""
        return np.asarray(self.weight @ values.reshape(self.weight.size, -1))

    def _together(self, blocks: KernelBlocks, mass: SiteMass, draw_rates: Rates) -> FloatArray:
        """Return the annual rate of any failure among several blocks, laws x draws x bands."""
        k, m, site_mass = self.weight.size, self.count, mass.mass[0]
        gradient = draw_rates.gradient @ np.repeat(self.weight, m)
        step = error_step(self.model, gradient, self.level)
        moved = [probabilities(blocks, mass.grid, part) for part in (None, -step, step)]
        p = np.stack([part.reshape(k, m, -1) for part in moved], axis=1)
        laws = [_by_law(table) @ site_mass for table in p.reshape(k * 3, m, -1)]
        by_law = np.stack(laws, axis=1).reshape(-1, k, 3)
        law, where = self.model.dependence, self.placement()
        if law is None or where is None:
            return by_law
        joint = joint_rates(p.reshape(k * 3, m, -1), site_mass, where, law).rate
        return np.concatenate([joint.reshape(1, k, 3), by_law])


StandingBlocks = FragilityBlocks | ModelBlocks
"""The blocks of one site: their number, the weights of the draws of their parameters, which sum to
1, names of the laws by which they fail together, of which the first answers, and what is taken for
granted; `rate` says how often any of them fails."""

_FIRST_SITE = np.zeros(1, dtype=np.intp)


def _laws(count: int) -> tuple[str, ...]:
    return (ONE_BLOCK,) if count == 1 else (DEPENDENT, INDEPENDENT)


def _by_law(p: FloatArray) -> FloatArray:
    """Return P of any failure by the bounding dependence models, in rows; rows of p are blocks."""
    return p if p.shape[0] == 1 else np.stack(any_fails(p))


def _standard_draws(
    sigmas: Sequence[FloatArray], draws: int, seed: int
) -> tuple[list[FloatArray], FloatArray]:
    """Return standard normal values of each parameter, draws x blocks each, and weights.

    One block: a product of steps, exact for smooth integrands. Several: scrambled Sobol points
    (Owen 1998), normal by their quantiles.
    """
    m = sigmas[0].size
    if not any(sigma.any() for sigma in sigmas):
        return [np.zeros((1, m)) for _ in sigmas], np.ones(1)
    if m == 1:
        steps = [normal_steps(_SIGMA_POINTS if s.any() else 1, _SIGMA_REACH) for s in sigmas]
        normals, weight = normal_product(steps)
        return [z[:, None] for z in normals], weight
    if isinstance(draws, bool) or not 1 <= draws <= 2**16:
        raise InputError(f"draws = {draws}: give a number from 1 to 65536")
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    uncertain = [i for i, sigma in enumerate(sigmas) if sigma.any() or i < _ALWAYS]
    points = Sobol(len(uncertain) * m, rng=np.random.default_rng(seed)).random(
        1 << (draws - 1).bit_length()
    )
    z = ndtri(points[:draws])
    place = {i: slice(k * m, (k + 1) * m) for k, i in enumerate(uncertain)}
    normals = [z[:, place[i]] if i in place else np.zeros((draws, m)) for i in range(len(sigmas))]
    return normals, np.full(draws, 1.0 / draws)
