"""Blocks of one site, and how often any of them fails, by each law of joint failure.

Blocks may be uncertain: draws of their parameters, with weights, each make a set of blocks. P of a
model comes with both ends of its interval, which go through the law as P does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement, any_fails
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.hazards.annual_rate import FailureRate, Fragility, failure_rate
from rbfrag.hazards.curve import HazardCurve
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
        any_fails: from levels, shape (n,), to the probability that any fails, laws but the copula x
            draws x bands in rows; the bands are P and the two ends of its interval, or P alone.
        coarse: the same from a table of twice the step; None where P is known at every level.
        table: P of every block, draws x bands x blocks; None for a fragility of the caller's.
        known: how they stand and what they share; None where that is not known.
        of_model: the blocks as the model knows them; None for a fragility of the caller's.
    """

    count: int
    weight: FloatArray
    any_fails: Fragility
    coarse: Fragility | None = None
    table: ProbabilityTable | None = None
    known: tuple[Placement, Dependence] | None = None
    of_model: ModelBlocks | None = None

    @classmethod
    def of_fragility(cls, fragility: Fragility, levels: FloatArray) -> StandingBlocks:
        """Return blocks of which the caller gives P at each level, a row for each block."""
        count = np.atleast_2d(fragility(levels)).shape[0]
        return cls(count, np.ones(1), lambda x: _laws(np.atleast_2d(fragility(x))[None, None]))

    @classmethod
    def of_blocks(cls, blocks: ModelBlocks, curves: list[HazardCurve]) -> StandingBlocks:
        """Return blocks that a model answers for, over the levels of some curves."""
        table, count, law = blocks.tabled(curves), blocks.count, blocks.model.dependence
        any_of = ProbabilityTable(table.low, table.step, _laws(table.values))
        where = blocks.placement()
        known = None if count < 2 or law is None or where is None else (where, law)
        return cls(count, blocks.weight, any_of.fine, any_of.coarse, table, known, blocks)

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of the laws by which they fail together; the first answers."""
        if self.count == 1:
            return (ONE_BLOCK,)
        return (*((COPULA,) if self.known is not None else ()), DEPENDENT, INDEPENDENT)

    def rate(self, curve: HazardCurve) -> AnyRate:
        """Return how often any of them fails under a curve."""
        failures = failure_rate(curve, self.any_fails, self.coarse)
        k, several = self.weight.size, len(self.laws) - (self.known is not None)
        rates = failures.annual_rate.reshape(several, k, -1)
        if self.known is not None and self.table is not None:
            from rbfrag.hazards.joint_thresholds import joint_rates

            each = self.table.values.reshape(-1, *self.table.values.shape[2:])
            joint = joint_rates(each, self.table.mass(curve), *self.known).rate
            rates = np.concatenate([joint.reshape(1, k, -1), rates])
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


def _laws(p: FloatArray) -> FloatArray:
    """Return P that any block fails by the laws that need no estimate, in rows.

    Args:
        p: P, draws x bands x blocks x levels; of one block its own answers.
    """
    laws = p[:, :, 0] if p.shape[2] == 1 else np.stack(any_fails(p))
    return laws.reshape(-1, p.shape[-1])
