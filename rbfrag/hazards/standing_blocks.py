"""Blocks of one site, and how often any of them fails, by each law of joint failure.

Blocks may be uncertain: draws of their parameters, with weights, each make a set of blocks. P of a
model comes with both ends of its interval, which go through the law as P does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.hazards.annual_rate import FailureRate, Fragility, failure_rate
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.joint_thresholds import JointThresholds
from rbfrag.hazards.model_blocks import ModelBlocks, ProbabilityTable
from rbfrag.hazards.shaking import ends_in_words
from rbfrag.solver.results import FloatArray

ONE_BLOCK = "one block"
COPULA = "the model's copula"
INDEPENDENT = "independent"
DEPENDENT = "fully dependent"

Normals = Callable[[int, np.random.Generator], FloatArray]
"""Draws standard normals of some blocks, shape (draws, n)."""


def normals_by_law(law: Dependence | None, where: Placement | None, n: int) -> dict[str, Normals]:
    """Return how the normals of n blocks of one earthquake are drawn, by the name of the law.

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
class StandingBlocks:
    """The blocks of one site.

    Args:
        count: number of blocks m.
        weight: weights of the k draws of their parameters, which sum to 1, shape (k,).
        laws: names of the laws by which they fail together; the first answers.
        any_fails: from levels, shape (n,), to the probability that any fails, laws but the copula x
            draws x bands in rows; the bands are P and the two ends of its interval, or P alone.
        coarse: the same from a table of twice the step; None where P is known at every level.
        thresholds: levels at which they fail by the model's copula; None where that is not known.
        each: P of every block, where their parameters are known and that law has to be corrected.
        of_model: the blocks as the model knows them; None for a fragility of the caller's.
    """

    count: int
    weight: FloatArray
    laws: tuple[str, ...]
    any_fails: Fragility
    coarse: Fragility | None = None
    thresholds: JointThresholds | None = None
    each: ProbabilityTable | None = None
    of_model: ModelBlocks | None = None

    @classmethod
    def of_fragility(cls, fragility: Fragility, levels: FloatArray) -> StandingBlocks:
        """Return blocks of which the caller gives P at each level, a row for each block."""
        count = np.atleast_2d(fragility(levels)).shape[0]

        def any_fails(x: FloatArray) -> FloatArray:
            return _rows(bounds(np.atleast_2d(fragility(x))[None, None]))

        return cls(count, np.ones(1), _laws(count), any_fails)

    @classmethod
    def of_blocks(cls, blocks: ModelBlocks, curves: list[HazardCurve]) -> StandingBlocks:
        """Return blocks that a model answers for, over the levels of some curves."""
        table, count, law = blocks.tabled(curves), blocks.count, blocks.model.dependence
        any_of = ProbabilityTable(table.low, table.step, _rows(bounds(table.values)))
        thresholds = each = None
        placement = blocks.placement()
        if count > 1 and law is not None and placement is not None:
            thresholds = JointThresholds.of(table, placement, law)
            if thresholds.every is not None:
                each = ProbabilityTable(table.low, table.step, table.values[0, 0])
        laws = (*((COPULA,) if thresholds is not None else ()), *_laws(count))
        return cls(count, blocks.weight, laws, any_of.fine, any_of.coarse, thresholds, each, blocks)

    def rate(self, curve: HazardCurve) -> AnyRate:
        """Return how often any of them fails under a curve."""
        failures = failure_rate(curve, self.any_fails, self.coarse)
        k, several = self.weight.size, len(self.laws) - (self.thresholds is not None)
        rates = failures.annual_rate.reshape(several, k, -1)
        if self.thresholds is not None:
            each = None
            if self.each is not None:
                each = failure_rate(curve, self.each.fine, self.each.coarse).annual_rate
            rates = np.concatenate([self.thresholds.rates(curve, each)[0], rates])
        part = self._mean(failures, "contribution", several)
        outside = 0.0
        if self.of_model is not None:
            share = self.of_model.share_outside(np.sqrt(failures.edges[1:] * failures.edges[:-1]))
            outside = float(part @ share) / max(float(part.sum()), np.finfo(np.float64).tiny)
        names = ("annual_rate", "above", "above_at_most", "below")
        warnings = ends_in_words(
            [curve], np.zeros(1, dtype=np.intp),
            *(self._mean(failures, name, several)[None] for name in names),
        )  # fmt: skip
        mean = float(self.weight @ rates[0, :, 0])
        return AnyRate(rates, mean, outside, tuple(warnings))

    def _mean(self, failures: FailureRate, name: str, laws: int) -> FloatArray:
        """Return the mean over the draws of P of the first law that is integrated, shape (...)."""
        values = getattr(failures, name)
        rows = values.reshape(laws, self.weight.size, -1, *values.shape[1:])
        return np.asarray(np.tensordot(self.weight, rows[0, :, 0], axes=1))


@dataclass(frozen=True, eq=False)
class AnyRate:
    """How often any of some blocks fails under one hazard curve.

    Args:
        annual_rate: rates [1/a], laws x draws x bands.
        mean: the mean over the draws of the first of each [1/a].
        outside: part of it from outside the ranges that the model was fitted on.
        warnings: what the ends of the curve leave open.
    """

    annual_rate: FloatArray
    mean: float
    outside: float
    warnings: tuple[str, ...]


def _laws(count: int) -> tuple[str, ...]:
    return (ONE_BLOCK,) if count == 1 else (DEPENDENT, INDEPENDENT)


def bounds(p: FloatArray) -> Mapping[str, FloatArray]:
    """Return P that any of n blocks fails by the laws that need no estimate, best known first.

    Args:
        p: P, shape (k, bands, n, levels).

    Returns:
        Of one block its own P; of several that of the greatest P, if all fail or none, and that of
        independent ones; each of shape (k, bands, levels).
    """
    if p.shape[2] == 1:
        return {ONE_BLOCK: p[:, :, 0]}
    return {DEPENDENT: p.max(axis=2), INDEPENDENT: 1.0 - (1.0 - p).prod(axis=2)}


def _rows(laws: Mapping[str, FloatArray]) -> FloatArray:
    values = list(laws.values())
    return np.stack(values).reshape(-1, values[0].shape[-1])
