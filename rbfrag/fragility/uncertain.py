"""Uncertain blocks and shaking: the failure probability averaged over their distributions.

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
from rbfrag.fragility.confidence import Quantiles
from rbfrag.fragility.method import SINGLE, ArrayNamespace, BlockParameters, LinearPredictor, arrays
from rbfrag.fragility.model import Answer, FragilityModel
from rbfrag.fragility.shaking import MeanModel
from rbfrag.fragility.shaking_points import GroundMotionQuadrature
from rbfrag.fragility.validation import rejections
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal

REACH = 5.5
"""The outermost point of each normal variable, in standard deviations."""

STRENGTH_POINTS, OTHER_POINTS = 65, 33
"""Points of the strength, in which P is steepest, and of what else is uncertain."""

_AT_ONCE, _STEP = 1 << 15, 0.1


def normal_steps(count: int, reach: float = 4.0) -> tuple[FloatArray, FloatArray]:
    """Return equally spaced points of a standard normal variable, with weights that sum to 1.

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
    """Return :func:`normal_steps` of at most 0.1 in a logarithm; without dispersion the mean alone.

    Args:
        sigma: standard deviation of the logarithm.
        fewest: number of points that there are at least.
    """
    count = max(fewest, 2 * math.ceil(reach * sigma / _STEP) + 1)
    return normal_steps(count if sigma else 1, reach)


def normal_product(
    axes: Sequence[tuple[FloatArray, FloatArray]],
) -> tuple[list[FloatArray], FloatArray]:
    """Return product points of independent variables, shape (k,) each, and their weights."""
    weight = np.ones(1)
    for _, of_one in axes:
        weight = np.outer(weight, of_one).ravel()
    points = np.meshgrid(*(x for x, _ in axes), indexing="ij")
    return [grid.ravel() for grid in points], weight


@dataclass(frozen=True, eq=False)
class BlockScatter:
    """Block uncertainty: strength and size lognormal, fractions normal truncated at 0 and 1;
    independent.

    Args:
        z: standard normal points by the name of the value, shape (k,) each.
        weight: their weights, shape (k,).
    """

    fractions: tuple[str, ...]
    z: Mapping[str, FloatArray]
    weight: FloatArray

    @classmethod
    def of(cls, block: BlockParameters, sigmas: Iterator[str]) -> BlockScatter:
        """Return the integration points of the uncertain block parameters, a product of steps.

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

    def blocks(self, inputs: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the uncertain values, shape (k, n), from the inputs, shape (n,) each."""
        result = {}
        for name, z in self.z.items():
            law = fraction if name in self.fractions else lognormal
            result[name] = law(z[:, None], inputs[name], inputs[f"{name}_sigma"])
        return result


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws from the block uncertainty, which keep the dependence between parameters.

    Args:
        values: values by name, shape (k,) each.
        weight: weights that sum to 1, shape (k,).
    """

    values: Mapping[str, FloatArray]
    weight: FloatArray

    def blocks(self, inputs: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the uncertain values, shape (k, 1)."""
        del inputs
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
    """A block without uncertainty."""

    weight: FloatArray = field(default_factory=lambda: np.ones(1))

    def blocks(self, inputs: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return no values: the block is certain."""
        del inputs
        return {}


Possible = BlockScatter | Draws | _Certain
"""What blocks one may be, with weights that sum to 1, shape (k,)."""


@dataclass(frozen=True)
class UncertainModel(MeanModel):
    """A fitted model for uncertain blocks and shaking.

    Args:
        possible: what the block may be.
        points: what the shaking may be; None where it is certain.
        judged: whether it is asked how much lies outside the ranges that were fitted.
    """

    possible: Possible = field(kw_only=True, default_factory=_Certain)
    points: GroundMotionQuadrature | None = field(kw_only=True, default=None)
    judged: bool = field(kw_only=True, default=True)

    @property
    def scattered(self) -> bool:
        """True if the shaking is uncertain."""
        return self.points is not None

    def answer(
        self,
        values: Mapping[str, Any],
        quantiles: Quantiles | None,
        ns: ArrayNamespace,
        inputs: Mapping[str, Any],
    ) -> Answer:
        """Return the prediction averaged over block uncertainty; see :class:`FragilityModel`."""
        del values  # they are those of the medians
        columns = {n: np.atleast_1d(np.asarray(v, dtype=np.float64)) for n, v in inputs.items()}
        size = max(column.size for column in columns.values())
        n_points, points, factors = self.possible.weight.size, self.points, np.empty(0)
        parts = []
        with np.errstate(all="ignore"):
            if points is not None:
                n_points *= points.weight.size
                factors = points.factors(columns)
            step = max(1, _AT_ONCE // n_points)
            for start in range(0, size, step):
                chunk = {
                    n: c if c.size == 1 else c[start : start + step] for n, c in columns.items()
                }
                of_these = factors if len(factors) <= 1 else factors[start : start + step]
                parts.append(self._part(chunk, of_these, quantiles, min(step, size - start)))
        rows = [None if row[0] is None else np.concatenate(row) for row in zip(*parts, strict=True)]
        if ns is SINGLE:
            return Answer(*(None if row is None else float(row[0]) for row in rows))
        return Answer(*rows)

    def along(self, inputs: Mapping[str, Any]) -> tuple[FloatArray, float]:
        """Return P at each point of the first intensity measure, and its standard deviation.

        Args:
            inputs: the question, single numbers.
        """
        assert self.points is not None
        columns = {name: np.array([float(value)]) for name, value in inputs.items()}
        weight = self.points.weight
        with np.errstate(all="ignore"):
            values = self._values(columns, self.points.factors(columns))
            p = self._certain(values, (self.possible.weight.size, *weight.shape, 1))[0]
        over = tuple(range(1, weight.ndim))
        probability = np.tensordot(self.possible.weight, p, 1)[..., 0]
        share = weight / weight.sum(axis=over, keepdims=True)
        return (probability * share).sum(axis=over), float(self.points.deviation(columns)[0])

    def _part(
        self,
        inputs: Mapping[str, FloatArray],
        factors: FloatArray,
        quantiles: Quantiles | None,
        size: int,
    ) -> Answer:
        """Return the predictions for a chunk of inputs."""
        ns, of_block, points = arrays(), self.possible.weight, self.points
        # blocks, each variable of the shaking, and questions are the axes
        of_shaking = np.ones(()) if points is None else points.weight
        weight = np.multiply.outer(of_block, of_shaking)
        shape, axes = (*weight.shape, size), tuple(range(weight.ndim))
        values = self._values(inputs, factors)
        p, forbidden, eta, unscaled, h = self._certain(values, shape)
        link = self.method.link
        middle = np.tensordot(weight, p, len(axes))
        block_sd = None
        if points is None or of_block.size > 1:
            block_p = np.tensordot(of_shaking, np.moveaxis(p, 0, -2), of_shaking.ndim)
            block_sd = np.sqrt(of_block @ np.square(block_p - middle))
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
            """Return Σ share · slope; the share is summed over axes that a slope lacks."""
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

    def _values(self, inputs: Mapping[str, FloatArray], factors: FloatArray) -> dict[str, Any]:
        """Return completed values at all integration points of block and shaking."""
        ndim = 0 if self.points is None else self.points.weight.ndim
        apart = (slice(None), *[None] * ndim)
        blocks = {name: value[apart] for name, value in self.possible.blocks(inputs).items()}
        values: dict[str, Any] = {**inputs, **blocks}
        if self.points is not None:
            measures = self.points.measures(inputs, factors)
            values |= {name: value[None] for name, value in measures.items()}
        return self.method.block.completed(values, self.term, arrays())

    def _certain(
        self, values: Mapping[str, Any], shape: tuple[int, ...]
    ) -> tuple[FloatArray, Any, FloatArray, LinearPredictor, Any]:
        """Return P at each point, where mechanics rules out failure, eta and its parts."""
        ns = arrays()
        unscaled, h = self.form.unscaled(self.parameters, values, ns)
        eta = np.broadcast_to(unscaled.eta * h, shape)
        forbidden: Any = False
        for bound in FragilityModel.bounds(self, values):
            forbidden = forbidden | bound.holds(values)
        p = np.where(forbidden, 0.0, self.method.link.probability(eta, ns))
        return p, forbidden, eta, unscaled, h

    def _outside(self, values: dict[str, Any], p: FloatArray, weight: FloatArray) -> Any:
        """Return the fraction of the block, or of P for uncertain shaking, outside the fitted
        ranges.
        """
        outside = np.broadcast_to(self.lies_outside(values, arrays()), p.shape)
        if self.points is None:
            return np.tensordot(weight, outside, weight.ndim)
        # of low shaking, which fails nothing, nothing is to be said
        share = np.tensordot(weight, p * outside, weight.ndim)
        total = np.tensordot(weight, p, weight.ndim)
        return np.divide(share, total, out=np.zeros(share.shape), where=total > 0.0)


def drawn_model(
    model: FragilityModel, inputs: Mapping[str, Any], weights: ArrayLike
) -> tuple[FragilityModel, dict[str, Any]]:
    """Return the model for draws of one block, and the inputs at their medians.

    Args:
        model: the model of certain blocks.
        inputs: the question: arrays, shape (k,), are draws of the block.
        weights: their weights, shape (k,), or 1 where all weigh the same.

    Raises:
        InputError: a draw that is no block, weights that are none, or standard deviations beside.
    """
    block = model.method.block
    for name in inputs:
        if name in block.sigmas:
            raise InputError(f"{name} cannot be combined with draws, which give the dispersion")
    try:
        named = {name: np.asarray(value, dtype=np.float64) for name, value in inputs.items()}
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
    for finding in rejections(values, tuple(values), block.options):
        if np.any(finding.holds):
            first = int(np.flatnonzero(finding.holds)[0])
            raise InputError(f"draw {first + 1}: {finding.about(float(finding.value[first]))}")
    draws = Draws(values, weight / weight.sum())
    return UncertainModel.over(model, possible=draws), {**inputs, **draws.medians()}


def uncertain_model(
    model: FragilityModel, inputs: Mapping[str, Any]
) -> tuple[FragilityModel, dict[str, Any]]:
    """Return the model for the inputs, and the inputs without zero standard deviations.

    Args:
        model: the model of certain blocks.
        inputs: the question, with standard deviations among its values.

    Raises:
        InputError: a standard deviation is negative or no number, or of what is not given.
    """
    sigmas = model.method.block.sigmas
    rest = dict(inputs)
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
    uncertain = [sigma for sigma in sigmas if sigma in rest]
    if not uncertain:
        return model, rest
    return UncertainModel.over(
        model, possible=BlockScatter.of(model.method.block, iter(uncertain))
    ), rest
