"""Points of shaking that is not known exactly, for many questions at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.shaking import POINTS, WEIGHTS, Scatter, correlation
from rbfrag.solver.results import FloatArray

SECOND, ALONG = np.arange(-4.0, 5.0), 1.5 * np.arange(-2.0, 3.0)
"""Points of the second measure given the first, and of the direction in which eta moves most once
both are known."""

_LEAST_WEIGHT = 1e-11

_PROBED = 2.4
"""Where along the first measure that direction is looked for."""


class ShakingPoints:
    """Points of the measures that scatter, and their weights.

    The first measure is taken in the equal steps of one alone, the second in steps of what it may
    be given the first. Of the others given both steps are taken in the direction in which eta moves
    most, and one point each of a sequence of low discrepancy in what is left, which moves eta
    little: most formulas are linear in the logarithms of these measures.

    Args:
        model: the model that answers.
        scatter: what scatters.
        above: score of the first measure up to which nothing fails, which needs no points.
    """

    def __init__(
        self, model: FragilityModel, scatter: Scatter, above: float = -math.inf
    ) -> None:
        self._model, self._scatter, self._above = model, scatter, above

    @cached_property
    def _scores(self) -> tuple[FloatArray, FloatArray]:
        """Standard normal scores, shape (points, k), and their weights."""
        k = len(self._scatter.names)
        axes = [np.array(POINTS), SECOND, ALONG][:k]
        weight = np.array(WEIGHTS)
        for axis in axes[1:]:
            density = np.exp(-0.5 * axis * axis)
            weight = np.outer(weight, density / density.sum()).ravel()
        some = (weight > _LEAST_WEIGHT) & (np.repeat(axes[0], weight.size // 41) > self._above)
        grid = [axis.ravel()[some] for axis in np.meshgrid(*axes, indexing="ij")]
        scores = np.column_stack([*grid, *[np.zeros(grid[0].size)] * (k - len(axes))])
        if k > len(axes):
            # Kronecker's sequence of the generalised golden ratio: x^(d+1) = x + 1 (Roberts 2018)
            d, ratio = k - len(axes), 1.5
            for _ in range(60):
                ratio = (1.0 + ratio) ** (1.0 / (d + 1.0))
            steps = ratio ** -np.arange(1.0, d + 1.0)
            uniform = (0.5 + np.outer(np.arange(1.0, len(scores) + 1.0), steps)) % 1.0
            scores[:, len(axes) :] = arrays().ndtri(uniform)
        return scores, weight[some]

    @property
    def weight(self) -> FloatArray:
        """Weights of the points, shape (points,)."""
        return self._scores[1]

    def measures(self, given: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the measures that scatter, shape (points, n), for what is given, shape (n,)."""
        factors = self._factors(given)
        if factors.shape[1] > 3:
            factors = self._turned(given, factors)
        return self._at(given, factors, self._scores[0])

    def _at(
        self, given: Mapping[str, FloatArray], factors: FloatArray, scores: FloatArray
    ) -> dict[str, FloatArray]:
        return {
            name: given[name] * np.exp(scores @ factors[:, i].T)
            for i, name in enumerate(self._scatter.names)
        }

    def _eta(
        self, given: Mapping[str, FloatArray], factors: FloatArray, scores: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return eta at some scores, shape (scores, n), and what mechanics forbids of it."""
        ns, model = arrays(), self._model
        values: dict[str, Any] = {**given, **self._at(given, factors, scores)}
        values = model.method.block.completed(values, model.term, ns)
        unscaled, h = model.form.unscaled(model.parameters, values, ns)
        shape = len(scores), len(factors)
        forbidden = np.zeros(shape, dtype=np.bool_)
        for bound in model.bounds(values):
            forbidden |= bound.holds(values)
        return np.broadcast_to(unscaled.eta * h, shape), forbidden

    def fails_at(self, given: Mapping[str, FloatArray], score: float, least: float) -> Any:
        """Return where P exceeds some least value at a score of the first measure, shape (n,)."""
        k = len(self._scatter.names)
        others = np.array(list(product((-3.0, 0.0, 3.0), repeat=k - 1))).reshape(-1, k - 1)
        scores = np.column_stack([np.full(len(others), score), others])
        with np.errstate(all="ignore"):
            eta, forbidden = self._eta(given, self._factors(given), scores)
            # P rises with eta: one link is enough
            best = np.where(forbidden, -np.inf, np.nan_to_num(eta, nan=np.inf)).max(axis=0)
            return self._model.method.link.probability(best, arrays()) > least

    def _factors(self, given: Mapping[str, FloatArray]) -> FloatArray:
        """Return lower factors of the covariances of the logarithms, shape (n, k, k)."""
        names, scatter = self._scatter.names, self._scatter
        own, shared = (
            [np.atleast_1d(of(name, given)) for name in names]
            for of in (scatter.deviation, scatter.shared)
        )
        k, n = len(names), max(each.size for each in (*own, *shared))
        factor = np.zeros((n, k, k))
        for i, one in enumerate(names):
            for j, other in enumerate(names[: i + 1]):
                rest = shared[i] * shared[j] - (factor[:, i, :j] * factor[:, j, :j]).sum(axis=1)
                if own[i].any() and own[j].any():
                    rest = rest + correlation(one, other) * own[i] * own[j]
                if i == j:
                    # what is left of rounding is nothing
                    factor[:, i, i] = np.sqrt(np.where(rest > 1e-12, rest, 0.0))
                else:
                    pivot = factor[:, j, j]
                    np.divide(rest, pivot, out=factor[:, i, j], where=pivot > 0.0)
        return factor

    def _turned(self, given: Mapping[str, FloatArray], factors: FloatArray) -> FloatArray:
        """Return factors whose third score moves eta most, by a reflection of Householder."""
        k = factors.shape[1]
        around = np.zeros((2 * (k - 2), k))
        around[:, 0] = _PROBED
        for i in range(k - 2):
            around[2 * i : 2 * i + 2, i + 2] = (-0.5, 0.5)
        at, _ = self._eta(given, factors, around)
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
