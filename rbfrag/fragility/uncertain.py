"""Blocks and shaking that are not known exactly: the probability over all that they may be.

P = Σ w_i F(eta_i) over the product of what the block and what the shaking may be. The interval is that of the sum: the slope of the sum
by each parameter is Σ w_i F'(eta_i) x_i, one step of the parameters moves all blocks together, and
the ends are taken on eta as those of a certain block. For a lognormal fragility and a lognormal
strength all of it is exact: the variances add up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.checks import refusals
from rbfrag.fragility.intervals import Quantiles
from rbfrag.fragility.method import SINGLE, BlockParameters, Bound, Numbers, arrays
from rbfrag.fragility.model import Answer, FragilityModel
from rbfrag.fragility.shaking_points import ShakingPoints
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal

REACH = 5.5
"""The outermost point of each normal variable, in standard deviations."""

STRENGTH_POINTS, OTHER_POINTS = 65, 33
"""Points of the strength, in which P is steepest, and of what else is uncertain."""

_AT_ONCE = 1 << 16


def normal_steps(count: int, reach: float = 4.0) -> tuple[FloatArray, FloatArray]:
    """Return points of a standard normal variable in equal steps, and weights that sum to 1.

    For smooth integrands as good as Gauss-Hermite, and much better for a fragility that is steep
    beside the scatter.

    Args:
        count: number of points; 1 for the mean alone.
        reach: the outermost point, in standard deviations.
    """
    x = np.linspace(-reach, reach, count) if count > 1 else np.zeros(1)
    weight = np.exp(-0.5 * x * x)
    return x, weight / weight.sum()


class Possible(Protocol):
    """What blocks one may be."""

    @property
    def weight(self) -> FloatArray:
        """Weights that sum to 1, shape (k,)."""

    def blocks(self, given: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the values that change, shape (k, n), for what is given, shape (n,) each."""


@dataclass(frozen=True, eq=False)
class BlockScatter:
    """Strength and size lognormal about medians, fractions normal cut at 0 and 1; independent.

    Args:
        z: standard normal points by the name of the value, shape (k,) each.
        weight: their weights, shape (k,).
    """

    fractions: tuple[str, ...]
    z: Mapping[str, FloatArray]
    weight: FloatArray

    @classmethod
    def of(cls, block: BlockParameters, sigmas: Iterator[str]) -> BlockScatter:
        """Return the points for what is uncertain of a block, a product of steps.

        Args:
            block: what describes blocks.
            sigmas: names of the standard deviations that are given.
        """
        names = [block.sigmas[sigma] for sigma in sigmas]
        steps = [
            normal_steps(STRENGTH_POINTS if name == block.strength else OTHER_POINTS, REACH)
            for name in names
        ]
        points = np.meshgrid(*(x for x, _ in steps), indexing="ij")
        weight = np.ones(1)
        for _, of_one in steps:
            weight = np.outer(weight, of_one).ravel()
        z = {name: each.ravel() for name, each in zip(names, points, strict=True)}
        return cls(block.fractions, z, weight)

    def blocks(self, given: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the values that change, shape (k, n), for what is given, shape (n,) each."""
        result = {}
        for name, z in self.z.items():
            law = fraction if name in self.fractions else lognormal
            result[name] = law(z[:, None], given[name], given[f"{name}_sigma"])
        return result


@dataclass(frozen=True, eq=False)
class Draws:
    """What a block may be, one by one, so that its values go together as they do in the draws.

    Args:
        values: values by name, shape (k,) each.
        weight: weights that sum to 1, shape (k,).
    """

    values: Mapping[str, FloatArray]
    weight: FloatArray

    def blocks(self, given: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the values that change, shape (k, 1)."""
        del given
        return {name: drawn[:, None] for name, drawn in self.values.items()}

    def medians(self) -> dict[str, float]:
        """Return the weighted median of each value."""
        result = {}
        for name, drawn in self.values.items():
            order = np.argsort(drawn)
            place = np.searchsorted(np.cumsum(self.weight[order]), 0.5)
            result[name] = float(drawn[order[min(int(place), drawn.size - 1)]])
        return result


@dataclass(frozen=True, eq=False)
class _Certain:
    """One block, as it is given."""

    weight: FloatArray = field(default_factory=lambda: np.ones(1))

    def blocks(self, given: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return nothing: no value changes."""
        del given
        return {}


@dataclass(frozen=True)
class UncertainModel(FragilityModel):
    """A fitted model that answers for blocks and shaking that are not known exactly."""

    possible: Possible = field(kw_only=True)
    points: ShakingPoints | None = field(kw_only=True, default=None)

    @classmethod
    def over(
        cls,
        model: FragilityModel,
        possible: Possible | None = None,
        points: ShakingPoints | None = None,
    ) -> UncertainModel:
        """Return a model that answers for all that a block may be, and its shaking."""
        own = {each.name: getattr(model, each.name) for each in fields(FragilityModel)}
        return cls(**own, possible=_Certain() if possible is None else possible, points=points)

    @property
    def uncertain(self) -> bool:
        """Whether it answers for what is not known exactly."""
        return True

    def bounds(self, given: Any) -> tuple[Bound, ...]:
        """Return nothing: what mechanics forbids is asked of each block that it may be."""
        del given
        return ()

    def answer(
        self,
        values: Mapping[str, Any],
        quantiles: Quantiles | None,
        ns: Numbers,
        given: Mapping[str, Any],
    ) -> Answer:
        """Return the answer over all that the block may be; see :class:`FragilityModel`."""
        del values  # they are those of the medians
        columns = {n: np.atleast_1d(np.asarray(v, dtype=np.float64)) for n, v in given.items()}
        size = max(column.size for column in columns.values())
        each = self.possible.weight.size * (1 if self.points is None else self.points.weight.size)
        step = max(1, _AT_ONCE // each)
        parts = []
        with np.errstate(all="ignore"):
            for start in range(0, size, step):
                own = {n: c if c.size == 1 else c[start : start + step] for n, c in columns.items()}
                parts.append(self._part(own, quantiles, min(step, size - start)))
        rows = [None if row[0] is None else np.concatenate(row) for row in zip(*parts, strict=True)]
        if ns is SINGLE:
            return Answer(*(None if row is None else float(row[0]) for row in rows))
        return Answer(*rows)

    def _part(
        self,
        given: Mapping[str, FloatArray],
        quantiles: Quantiles | None,
        size: int,
    ) -> Answer:
        """Return the answer for so many questions at once."""
        ns, of_block, points = arrays(), self.possible.weight, self.points
        # blocks, shaking and questions are the three axes
        values: dict[str, Any] = {name: value[None, None] for name, value in given.items()}
        values |= {name: each[:, None] for name, each in self.possible.blocks(given).items()}
        weight = of_block[:, None]
        if points is not None:
            weight = weight * points.weight
            values |= {name: each[None] for name, each in points.measures(given).items()}
        values = self.method.block.completed(values, self.term, ns)
        unscaled, h = self.form.unscaled(self.parameters, values, ns)
        shape = (*weight.shape, size)
        eta = np.broadcast_to(unscaled.eta * h, shape)
        forbidden = np.zeros(shape, dtype=np.bool_)
        for bound in FragilityModel.bounds(self, values):
            forbidden |= bound.holds(values)
        link = self.method.link
        p = np.where(forbidden, 0.0, link.probability(eta, ns))

        def mean(of: FloatArray) -> FloatArray:
            return np.tensordot(weight, np.broadcast_to(of, shape), 2)

        middle = mean(p)
        outside = self.lies_outside(values, ns)
        if points is None:
            block_sd = np.sqrt(of_block @ np.square(p[:, 0] - middle))
            outside = mean(outside)
        else:  # of low shaking, which fails nothing, nothing is to be said
            outside = mean(p * outside) / np.where(middle > 0.0, middle, 1.0)
            each = np.einsum("s,bsn->bn", points.weight, p)
            block_sd = np.sqrt(of_block @ np.square(each - middle)) if of_block.size > 1 else None
        answer = Answer(middle, None, None, None, None, block_sd, outside)
        if quantiles is None:
            return answer
        # d(mean P) by each parameter over F' at the mean: slopes of the eta that has the mean P
        share = weight[..., None] * np.where(forbidden, 0.0, link.density(eta, ns) * h)
        decided = (middle <= 0.0) | (middle >= 1.0)
        at = link.quantile(np.where(decided, 0.5, middle), ns)
        per = np.where(decided, 0.0, 1.0 / link.density(at, ns))
        slopes = [np.nansum(share * slope, axis=(0, 1)) * per for slope in unscaled.slopes]
        reach = self.errors.half_width(slopes, quantiles, ns)
        low, high = (
            np.where(decided, middle, link.probability(at + end * reach, ns)) for end in (-1.0, 1.0)
        )
        return answer._replace(low=low, high=high)


def drawn_model(
    model: FragilityModel, given: Mapping[str, Any], weights: ArrayLike
) -> tuple[FragilityModel, dict[str, Any]]:
    """Return the model that answers for draws of one block, and the question for their medians.

    Args:
        model: the model of certain blocks.
        given: the question: arrays, shape (k,), are draws of the block.
        weights: their weights, shape (k,), or 1 where all weigh the same.

    Raises:
        InputError: a draw that is no block, weights that are none, or standard deviations beside.
    """
    block = model.method.block
    for name in given:
        if name in block.sigmas:
            raise InputError(f"{name} does not go with draws, which say how they scatter")
    try:
        named = {name: np.asarray(value, dtype=np.float64) for name, value in given.items()}
        drawn = {name: value for name, value in named.items() if value.ndim}
        *columns, weight = np.broadcast_arrays(
            *drawn.values(), np.asarray(weights, dtype=np.float64)
        )
    except (TypeError, ValueError) as error:
        raise InputError(f"the draws are not lists of numbers of one length: {error}") from None
    if any(name not in (*block.names, *block.options) for name in drawn) or weight.ndim != 1:
        raise InputError("with weights the arrays are draws of one block: the motion is one, too")
    if not ((weight >= 0.0) & (weight < math.inf)).all() or not weight.sum() > 0.0:
        raise InputError("the weights of draws are 0 or more, and not all of them 0")
    values = dict(zip(drawn, columns, strict=True))
    for finding in refusals(values, tuple(values), block.options):
        if np.any(finding.holds):
            first = int(np.flatnonzero(finding.holds)[0])
            raise InputError(f"draw {first + 1}: {finding.about(float(finding.value[first]))}")
    draws = Draws(values, weight / weight.sum())
    return UncertainModel.over(model, draws), {**given, **draws.medians()}


def uncertain_model(
    model: FragilityModel, given: Mapping[str, Any]
) -> tuple[FragilityModel, dict[str, Any]]:
    """Return the model that answers a question, and the question without sigmas that are 0.

    Args:
        model: the model of certain blocks.
        given: the question, with standard deviations among its values.

    Raises:
        InputError: a standard deviation is negative or no number, or of what is not given.
    """
    sigmas = model.method.block.sigmas
    rest = dict(given)
    for sigma, name in sigmas.items():
        if sigma not in rest:
            continue
        value = np.asarray(rest[sigma], dtype=np.float64)
        if value.ndim == 0 and not 0.0 <= float(value) < math.inf:
            raise InputError(f"{sigma} = {float(value):g}: give a standard deviation of 0 or more")
        if not (value != 0.0).any():
            del rest[sigma]
        elif name not in rest:
            raise InputError(f"{sigma} goes with {name}: give the value that it is about")
    own = [sigma for sigma in sigmas if sigma in rest]
    if not own:
        return model, rest
    return UncertainModel.over(model, BlockScatter.of(model.method.block, iter(own))), rest
