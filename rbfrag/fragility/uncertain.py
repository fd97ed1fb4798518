"""Blocks and shaking that are not known exactly: the probability over all that they may be.

P = Σ w_i F(eta_i) over the product of what the block and what the shaking may be. The interval is
that of the sum: the slope of the sum by each parameter is Σ w_i F'(eta_i) x_i, one step of the
parameters moves all together, and the ends are taken on eta as those of a certain block. For a
lognormal fragility and a lognormal strength all of it is exact: the variances add up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.fragility.checks import refusals
from rbfrag.fragility.intervals import Quantiles
from rbfrag.fragility.method import SINGLE, BlockParameters, Eta, Numbers, arrays
from rbfrag.fragility.model import Answer, FragilityModel
from rbfrag.fragility.shaking import MeanModel
from rbfrag.fragility.shaking_points import ShakingPoints
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal

REACH = 5.5
"""The outermost point of each normal variable, in standard deviations."""

STRENGTH_POINTS, OTHER_POINTS = 65, 33
"""Points of the strength, in which P is steepest, and of what else is uncertain."""

_AT_ONCE, _STEP = 1 << 15, 0.1


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


def scatter_steps(
    sigma: float, reach: float = 5.0, fewest: int = 9
) -> tuple[FloatArray, FloatArray]:
    """Return :func:`normal_steps` of .1 of a logarithm or less; of no scatter the mean alone.

    Args:
        sigma: standard deviation of the logarithm.
        fewest: number of points that there are at least.
    """
    count = max(fewest, 2 * math.ceil(reach * sigma / _STEP) + 1)
    return normal_steps(count if sigma else 1, reach)


def normal_product(
    axes: Sequence[tuple[FloatArray, FloatArray]],
) -> tuple[list[FloatArray], FloatArray]:
    """Return points of independent variables together, shape (k,) each, and their weights."""
    weight = np.ones(1)
    for _, of_one in axes:
        weight = np.outer(weight, of_one).ravel()
    points = np.meshgrid(*(x for x, _ in axes), indexing="ij")
    return [each.ravel() for each in points], weight


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
        points, weight = normal_product(steps)
        return cls(block.fractions, dict(zip(names, points, strict=True)), weight)

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


Possible = BlockScatter | Draws | _Certain
"""What blocks one may be, with weights that sum to 1, shape (k,)."""


@dataclass(frozen=True)
class UncertainModel(MeanModel):
    """A fitted model that answers for blocks and shaking that are not known exactly.

    Args:
        possible: what the block may be.
        points: what the shaking may be; None where it is certain.
        judged: whether it is asked how much lies outside the ranges that were fitted.
    """

    possible: Possible = field(kw_only=True, default_factory=_Certain)
    points: ShakingPoints | None = field(kw_only=True, default=None)
    judged: bool = field(kw_only=True, default=True)

    @property
    def scattered(self) -> bool:
        """Whether the shaking is uncertain."""
        return self.points is not None

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
        each, points, factors = self.possible.weight.size, self.points, np.empty(0)
        parts = []
        with np.errstate(all="ignore"):
            if points is not None:
                each *= points.weight.size
                factors = points.factors(columns)
            step = max(1, _AT_ONCE // each)
            for start in range(0, size, step):
                own = {n: c if c.size == 1 else c[start : start + step] for n, c in columns.items()}
                of_these = factors if len(factors) <= 1 else factors[start : start + step]
                parts.append(self._part(own, of_these, quantiles, min(step, size - start)))
        rows = [None if row[0] is None else np.concatenate(row) for row in zip(*parts, strict=True)]
        if ns is SINGLE:
            return Answer(*(None if row is None else float(row[0]) for row in rows))
        return Answer(*rows)

    def along(self, given: Mapping[str, Any]) -> tuple[FloatArray, float]:
        """Return P of one question at each point of the first measure, and its deviation.

        Args:
            given: the question, single numbers.
        """
        assert self.points is not None
        columns = {name: np.array([float(value)]) for name, value in given.items()}
        weight = self.points.weight
        with np.errstate(all="ignore"):
            values = self._values(columns, self.points.factors(columns))
            p = self._certain(values, (self.possible.weight.size, *weight.shape, 1))[0]
        over = tuple(range(1, weight.ndim))
        each = np.tensordot(self.possible.weight, p, 1)[..., 0]
        share = weight / weight.sum(axis=over, keepdims=True)
        return (each * share).sum(axis=over), float(self.points.deviation(columns)[0])

    def _part(
        self,
        given: Mapping[str, FloatArray],
        factors: FloatArray,
        quantiles: Quantiles | None,
        size: int,
    ) -> Answer:
        """Return the answer for so many questions at once."""
        ns, of_block, points = arrays(), self.possible.weight, self.points
        # blocks, each variable of the shaking, and questions are the axes
        of_shaking = np.ones(()) if points is None else points.weight
        weight = np.multiply.outer(of_block, of_shaking)
        shape, axes = (*weight.shape, size), tuple(range(weight.ndim))
        values = self._values(given, factors)
        p, forbidden, eta, unscaled, h = self._certain(values, shape)
        link = self.method.link
        middle = np.tensordot(weight, p, len(axes))
        block_sd = None
        if points is None or of_block.size > 1:
            each = np.tensordot(of_shaking, np.moveaxis(p, 0, -2), of_shaking.ndim)
            block_sd = np.sqrt(of_block @ np.square(each - middle))
        outside = self._outside(values, p, weight) if self.judged else None
        answer = Answer(middle, None, None, None, None, block_sd, outside)
        if quantiles is None:
            return answer
        # d(mean P) by each parameter over F' at the mean: slopes of the eta that has the mean P
        share = weight[..., None] * np.where(forbidden, 0.0, link.density(eta, ns) * h)
        decided = (middle <= 0.0) | (middle >= 1.0)
        at = link.quantile(np.where(decided, 0.5, middle), ns)
        per = np.where(decided, 0.0, 1.0 / link.density(at, ns))
        sums: dict[tuple[int, ...], FloatArray] = {}

        def total(slope: Any) -> FloatArray:
            """Return Σ share · slope; along the axes that a slope does not have, share adds up."""
            long = np.reshape(slope, (1,) * (len(shape) - np.ndim(slope)) + np.shape(slope))
            same = tuple(axis for axis in axes if long.shape[axis] == 1)
            if same not in sums:
                sums[same] = share.sum(axis=same, keepdims=True)
            return np.asarray(np.nansum(sums[same] * long, axis=axes))

        slopes = [total(slope) * per for slope in unscaled.slopes]
        reach = self.errors.half_width(slopes, quantiles, ns)
        low, high = (
            np.where(decided, middle, link.probability(at + end * reach, ns)) for end in (-1.0, 1.0)
        )
        return answer._replace(low=low, high=high)

    def _values(self, given: Mapping[str, FloatArray], factors: FloatArray) -> dict[str, Any]:
        """Return completed values of all that block and shaking may be."""
        ndim = 0 if self.points is None else self.points.weight.ndim
        apart = (slice(None), *[None] * ndim)
        blocks = {name: each[apart] for name, each in self.possible.blocks(given).items()}
        values: dict[str, Any] = {**given, **blocks}
        if self.points is not None:
            measures = self.points.measures(given, factors)
            values |= {name: each[None] for name, each in measures.items()}
        return self.method.block.completed(values, self.term, arrays())

    def _certain(
        self, values: Mapping[str, Any], shape: tuple[int, ...]
    ) -> tuple[FloatArray, Any, FloatArray, Eta, Any]:
        """Return P of each, where mechanics forbids failure, eta, and what that is made of."""
        ns = arrays()
        unscaled, h = self.form.unscaled(self.parameters, values, ns)
        eta = np.broadcast_to(unscaled.eta * h, shape)
        forbidden: Any = False
        for bound in FragilityModel.bounds(self, values):
            forbidden = forbidden | bound.holds(values)
        p = np.where(forbidden, 0.0, self.method.link.probability(eta, ns))
        return p, forbidden, eta, unscaled, h

    def _outside(self, values: dict[str, Any], p: FloatArray, weight: FloatArray) -> Any:
        """Return the share of the block, or of P where the shaking scatters, outside the ranges."""
        outside = np.broadcast_to(self.lies_outside(values, arrays()), p.shape)
        if self.points is None:
            return np.tensordot(weight, outside, weight.ndim)
        # of low shaking, which fails nothing, nothing is to be said
        share = np.tensordot(weight, p * outside, weight.ndim)
        whole = np.tensordot(weight, p, weight.ndim)
        return np.divide(share, whole, out=np.zeros(share.shape), where=whole > 0.0)


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
            raise InputError(f"{name} cannot be combined with draws, which give the dispersion")
    try:
        named = {name: np.asarray(value, dtype=np.float64) for name, value in given.items()}
        drawn = {name: value for name, value in named.items() if value.ndim}
        *columns, weight = np.broadcast_arrays(
            *drawn.values(), np.asarray(weights, dtype=np.float64)
        )
    except (TypeError, ValueError) as error:
        raise InputError(f"the draws are not lists of numbers of one length: {error}") from None
    if any(name not in (*block.names, *block.options) for name in drawn) or weight.ndim != 1:
        raise InputError(
            "with weights a single motion is required: the arrays are draws of one block"
        )
    if not ((weight >= 0.0) & (weight < math.inf)).all() or not weight.sum() > 0.0:
        raise InputError("the weights of draws must be 0 or more, not all 0")
    values = dict(zip(drawn, columns, strict=True))
    for finding in refusals(values, tuple(values), block.options):
        if np.any(finding.holds):
            first = int(np.flatnonzero(finding.holds)[0])
            raise InputError(f"draw {first + 1}: {finding.about(float(finding.value[first]))}")
    draws = Draws(values, weight / weight.sum())
    return UncertainModel.over(model, possible=draws), {**given, **draws.medians()}


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
            raise InputError(f"{sigma} requires {name}: give the median")
    own = [sigma for sigma in sigmas if sigma in rest]
    if not own:
        return model, rest
    return UncertainModel.over(model, possible=BlockScatter.of(model.method.block, iter(own))), rest
