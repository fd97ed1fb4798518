"""Blocks of one site, and the annual rate of any failure by dependence model.

Blocks may be uncertain: draws of their parameters, with weights, each make a set of blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.invalid_rows import reject_elements
from rbfrag.fragility.joint import UNKNOWN, Placement, any_fails
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.uncertain import normal_product, normal_steps
from rbfrag.hazards.annual_rate import Fragility, failure_rate
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.group_by_model import parts_by_model
from rbfrag.hazards.joint_thresholds import joint_rates
from rbfrag.hazards.rate_density import SiteMass, curve_mass
from rbfrag.hazards.rate_integration import (
    KernelBlocks,
    Rates,
    error_step,
    interval_end,
    probabilities,
    rates,
)
from rbfrag.hazards.shaking import HazardLevel, describe_ends
from rbfrag.question.fields import AnsweringFields
from rbfrag.question.keywords import LEVEL
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal
from rbfrag.vocabulary.quantities import BLOCK, NUMBERS

ALL_STAND = "that all of them stand is the question"
"""Why blocks of which one cannot be used are rejected."""

_SIGMA_POINTS, _SIGMA_REACH = 15, 5.0
_ALWAYS = 2
"""Size and strength have their points even where certain: what else scatters does not move them."""

ONE_BLOCK = "one block"
COPULA = "the model's copula"
INDEPENDENT = "independent"
DEPENDENT = "fully dependent"

Normals = Callable[[int, np.random.Generator], FloatArray]
"""Draws standard normals of some blocks, shape (draws, n)."""


def normals_by_law(law: Dependence | None, where: Placement | None, n: int) -> dict[str, Normals]:
    """Return samplers of the standard normals of n blocks in one earthquake, by dependence model.

    Args:
        law: the copula; None where it is not known, which leaves the bounds.
        where: the blocks; None where they have no size.
        n: their number.
    """
    if law is not None and where is not None:
        return {COPULA: JointSampler(law, where).normals}
    return {
        DEPENDENT: lambda draws, generator: np.broadcast_to(
            generator.standard_normal((draws, 1)), (draws, n)
        ),
        INDEPENDENT: lambda draws, generator: generator.standard_normal((draws, n)),
    }


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
        return Placement.of_numbers(self.model.method.block, self.medians, polarity=UNKNOWN)

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
        moved = [probabilities(blocks, mass.grid, part) for part in (0.0, -step, step)]
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
