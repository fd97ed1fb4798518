"""Uncertain blocks and shaking: the failure probability averaged over their distributions.

P = Σ w_i F(eta_i) over the product of what the block and what the shaking may be. The interval is
that of the sum: the slope of the sum by each parameter is Σ w_i F'(eta_i) x_i, one step of the
parameters moves all together, and the ends are taken on eta as those of a certain block. For a
lognormal fragility and a lognormal strength all of it is exact: the variances add up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.confidence import Quantiles
from rbfrag.fragility.correlation import correlation, nearest_correlation
from rbfrag.fragility.method import SINGLE, ArrayNamespace, LinearPredictor, arrays
from rbfrag.fragility.model import Answer, FragilityModel
from rbfrag.fragility.shaking import POINTS, WEIGHTS, MeanModel, Scatter
from rbfrag.fragility.validation import rejections
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal

SECOND, BESIDE_OTHERS = np.arange(-4.0, 5.0), 1.2 * np.arange(-3.0, 4.0)
"""Points of a second measure given the first, and where there are more than two."""

ALONG = 1.5 * np.arange(-2.0, 3.0)
"""Points of the direction in which eta moves most once two measures are known."""

_PROBED = 2.4
"""Where along the first measure that direction is looked for."""


def correlations(names: tuple[str, ...]) -> FloatArray:
    """Return the matrix of :func:`~rbfrag.fragility.correlation.correlation` for these intensity
    measures.
    """
    matrix = np.array([[correlation(first, other) for other in names] for first in names])
    return np.asarray(nearest_correlation(matrix))


class GroundMotionQuadrature:
    """Quadrature points of the uncertain intensity measures, and their weights.

    The first measure is taken in the equal steps of one alone, the second in steps of what it may
    be given the first. Of the others given both steps are taken in the direction in which eta moves
    most, and one point each of a sequence of low discrepancy in what is left, which moves eta
    little: most formulas are linear in the logarithms of these measures. Where all move together
    the first axis is the only one.

    Args:
        model: the model that answers.
        scatter: what scatters.
        above: score of the first measure up to which nothing fails, which needs no points.
    """

    def __init__(self, model: FragilityModel, scatter: Scatter, above: float = -math.inf) -> None:
        self._model, self._scatter, self._above = model, scatter, above

    @cached_property
    def _axes(self) -> list[FloatArray]:
        """Standard normal scores of the axes."""
        k, first = 1 if self._scatter.single else len(self._scatter.names), np.array(POINTS)
        second = SECOND if k == 2 else BESIDE_OTHERS
        return [first[first > self._above], second, ALONG][:k]

    @cached_property
    def _scores(self) -> list[FloatArray]:
        """Scores of each intensity measure, shape of the axes that it depends on, and (k,)."""
        k, axes = len(self._scatter.names), self._axes
        if self._scatter.single:
            return [axes[0][:, None]] * k
        scores = [
            np.stack(np.meshgrid(*axes[: i + 1], indexing="ij"), axis=-1) for i in range(len(axes))
        ]
        if k > len(axes):
            # Kronecker's sequence of the generalised golden ratio: x^(d+1) = x + 1 (Roberts 2018)
            d, ratio, last = k - len(axes), 1.5, scores[-1]
            for _ in range(60):
                ratio = (1.0 + ratio) ** (1.0 / (d + 1.0))
            steps = ratio ** -np.arange(1.0, d + 1.0)
            uniform = (0.5 + np.outer(np.arange(1.0, last[..., 0].size + 1.0), steps)) % 1.0
            rest = arrays().ndtri(uniform).reshape(*last.shape[:-1], d)
            scores += [np.concatenate([last, rest], axis=-1)] * d
            scores[2] = scores[-1]
        return scores

    @cached_property
    def weight(self) -> FloatArray:
        """Weights of the points, the shape of the axes."""
        result = np.array(WEIGHTS)[-self._axes[0].size :]
        for axis in self._axes[1:]:
            density = np.exp(-0.5 * axis * axis)
            result = np.multiply.outer(result, density / density.sum())
        return result

    def factors(self, inputs: Mapping[str, FloatArray]) -> FloatArray:
        """Return the factors of the scores of the intensity measures, shape (n, k, k)."""
        factors = self.lower(inputs)
        turns = factors.shape[1] > 3 and not self._scatter.single
        return self._turned(inputs, factors) if turns else factors

    def measures(
        self, inputs: Mapping[str, FloatArray], factors: FloatArray
    ) -> dict[str, FloatArray]:
        """Return the uncertain intensity measures, the shape of the axes and (n,).

        Args:
            inputs: the question, shape (n,) each.
            factors: what :meth:`factors` gave for it.
        """
        result, axes = {}, len(self._axes)
        for i, (name, scores) in enumerate(zip(self._scatter.names, self._scores, strict=True)):
            moved = inputs[name] * np.exp(scores @ factors[:, i, : scores.shape[-1]].T)
            result[name] = moved[
                (*[slice(None)] * (moved.ndim - 1), *[None] * (axes + 1 - moved.ndim))
            ]
        return result

    def _eta(
        self, inputs: Mapping[str, FloatArray], factors: FloatArray, scores: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return eta at the scores, shape (scores, n), and where mechanics rules out failure."""
        ns, model = arrays(), self._model
        values: dict[str, Any] = dict(inputs)
        for i, name in enumerate(self._scatter.names):
            values[name] = inputs[name] * np.exp(scores @ factors[:, i].T)
        values = model.completed(values, ns)
        unscaled, h = model.linear_predictor(values, ns)
        eta, forbidden = unscaled.eta * h, np.zeros(1, dtype=np.bool_)
        for bound in model.bounds(values):
            forbidden = forbidden | bound.holds(values)
        return eta, forbidden

    def fails_at(self, inputs: Mapping[str, FloatArray], score: float, least: float) -> Any:
        """Return where P exceeds a threshold at a score of the first measure, shape (n,)."""
        k = len(self._scatter.names)
        scores = np.zeros((2 * k - 1, k))  # all at their medians, and each by itself off it
        scores[:, 0] = score
        for i in range(1, k):
            scores[2 * i - 1 : 2 * i + 1, i] = (-3.0, 3.0)
        with np.errstate(all="ignore"):
            eta, forbidden = self._eta(inputs, self.lower(inputs), scores)
            # P rises with eta: one link is enough
            best = np.where(forbidden, -np.inf, np.nan_to_num(eta, nan=np.inf)).max(axis=0)
            return self._model.method.link.probability(best, arrays()) > least

    def lower(self, inputs: Mapping[str, FloatArray]) -> FloatArray:
        """Return the lower Cholesky factors of the log covariances, shape (n, k, k)."""
        names, scatter = self._scatter.names, self._scatter
        individual, shared = (
            [np.atleast_1d(of(name, inputs)) for name in names]
            for of in (scatter.deviation, scatter.shared)
        )
        k, n = len(names), max(column.size for column in (*individual, *shared))
        factor = np.zeros((n, k, k))
        for i, first in enumerate(names):
            for j, other in enumerate(names[: i + 1]):
                rest = shared[i] * shared[j] - (factor[:, i, :j] * factor[:, j, :j]).sum(axis=1)
                if individual[i].any() and individual[j].any():
                    rho = 1.0 if i == j else scatter.correlation(first, other, inputs)
                    rest = rest + rho * individual[i] * individual[j]
                if i == j:
                    # what is left of rounding is nothing
                    factor[:, i, i] = np.sqrt(np.where(rest > 1e-12, rest, 0.0))
                else:
                    pivot = factor[:, j, j]
                    np.divide(rest, pivot, out=factor[:, i, j], where=pivot > 0.0)
        return factor

    def _turned(self, inputs: Mapping[str, FloatArray], factors: FloatArray) -> FloatArray:
        """Return factors whose third score moves eta most, by a Householder reflection."""
        k = factors.shape[1]
        around = np.zeros((2 * (k - 2), k))
        around[:, 0] = _PROBED
        for i in range(k - 2):
            around[2 * i : 2 * i + 2, i + 2] = (-0.5, 0.5)
        at, _ = self._eta(inputs, factors, around)
        gradient = np.nan_to_num(at[1::2] - at[::2], posinf=0.0, neginf=0.0).T
        length = np.linalg.norm(gradient, axis=1, keepdims=True)
        mirror = np.divide(gradient, length, out=np.zeros_like(gradient), where=length > 0.0)
        mirror[length[:, 0] > 0.0, 0] -= 1.0
        square = (mirror * mirror).sum(axis=1)
        twice = np.divide(2.0, square, out=np.zeros_like(square), where=square > 1e-12)
        turned, rest = factors.copy(), factors[:, :, 2:]
        along = np.einsum("nij,nj->ni", rest, mirror) * twice[:, None]
        turned[:, :, 2:] -= along[:, :, None] * mirror[:, None]
        return turned


REACH = 5.5
"""The outermost point of each normal variable, in standard deviations."""

STRENGTH_POINTS, OTHER_POINTS = 65, 33
"""Points of the strength, in which P is steepest, and of what else is uncertain."""

_AT_ONCE, _STEP = 1 << 15, 0.1


def normal_steps(count: int, reach: float = 4.0) -> tuple[FloatArray, FloatArray]:
    """Return equally spaced points of a standard normal variable, with weights that sum to 1.

    For smooth integrands as good as Gauss-Hermite, and much better for a fragility that is steep
    in addition to the scatter.

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


CERTAIN = Draws({}, np.ones(1))
"""A block without uncertainty."""

Possible = BlockScatter | Draws
"""What blocks one may be, with weights that sum to 1, shape (k,)."""


@dataclass(frozen=True)
class UncertainModel(MeanModel):
    """A fitted model for uncertain blocks and shaking.

    Args:
        possible: what the block may be.
        points: what the shaking may be; None where it is certain.
        judged: whether it is asked how much lies outside the ranges that were fitted.
    """

    possible: Possible = field(kw_only=True, default=CERTAIN)
    points: GroundMotionQuadrature | None = field(kw_only=True, default=None)
    judged: bool = field(kw_only=True, default=True)

    @property
    def of_uncertain_block(self) -> bool:
        """True if the block is uncertain."""
        return self.points is None or self.possible.weight.size > 1

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
        return (probability * share).sum(axis=over), float(self.points.lower(columns)[0, 0, 0])

    def main_excursion(self, inputs: Mapping[str, float]) -> tuple[str, float] | None:
        """Return the variable and edge beyond which most of P lies; see :class:`MeanModel`.

        Under certain shaking: most of the block uncertainty.
        """
        columns = {n: np.atleast_1d(np.asarray(v, dtype=np.float64)) for n, v in inputs.items()}
        points, weight = self.points, self.possible.weight
        factors = np.empty(0) if points is None else points.factors(columns)
        if points is not None:
            weight = np.multiply.outer(weight, points.weight)
        shape = (*weight.shape, 1)
        with np.errstate(all="ignore"):
            values = self._values(columns, factors)
            p = np.ones(shape) if points is None else self._certain(values, shape)[0]
            beyond = {
                (name, edge): float((weight[..., None] * p * holds).sum())
                for name, edge, holds in self.excursions(values)
                if np.any(holds)
            }
        return max(beyond, key=beyond.__getitem__, default=None)

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
        if self.of_uncertain_block:
            block_p = np.tensordot(of_shaking, np.moveaxis(p, 0, -2), of_shaking.ndim)
            block_sd = np.sqrt(of_block @ np.square(block_p - middle))
        outside = None
        if self.judged:
            # of the block, or of P: of low shaking, which fails nothing, nothing is to be said
            outside = np.broadcast_to(self.lies_outside(values, ns), shape)
            if points is None:
                outside = np.tensordot(weight, outside, len(axes))
            else:
                part = np.tensordot(weight, p * outside, len(axes))
                outside = np.divide(part, middle, out=np.zeros(part.shape), where=middle > 0.0)
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

        slopes = tuple(total(slope) * per for slope in unscaled.all_slopes)
        reach = self.errors.half_width(LinearPredictor(None, slopes), quantiles, ns)
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
        return self.completed(values, arrays())

    def _certain(
        self, values: Mapping[str, Any], shape: tuple[int, ...]
    ) -> tuple[FloatArray, Any, FloatArray, LinearPredictor, Any]:
        """Return P at each point, where mechanics rules out failure, eta and its parts."""
        ns = arrays()
        unscaled, h = self.linear_predictor(values, ns)
        eta = np.broadcast_to(unscaled.eta * h, shape)
        forbidden: Any = False
        for bound in FragilityModel.bounds(self, values):
            forbidden = forbidden | bound.holds(values)
        p = np.where(forbidden, 0.0, self.method.link.probability(eta, ns))
        return p, forbidden, eta, unscaled, h


def drawn_model(
    model: FragilityModel, inputs: Mapping[str, Any], weights: ArrayLike
) -> tuple[FragilityModel, dict[str, Any]]:
    """Return the model for draws of one block, and the inputs at their medians.

    Args:
        model: the model of certain blocks.
        inputs: the question: arrays, shape (k,), are draws of the block.
        weights: their weights, shape (k,), or 1 where all weigh the same.

    Raises:
        InputError: a draw that is not a block, invalid weights, or draws together with standard
            deviations.
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
    block = model.method.block
    names = [sigmas[sigma] for sigma in uncertain]
    points, weight = normal_product([
        normal_steps(STRENGTH_POINTS if name == block.strength else OTHER_POINTS, REACH)
        for name in names
    ])  # fmt: skip
    scatter = BlockScatter(block.fractions, dict(zip(names, points, strict=True)), weight)
    return UncertainModel.over(model, possible=scatter), rest
