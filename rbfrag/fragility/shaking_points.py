"""Quadrature points of uncertain shaking, for many inputs at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.shaking import POINTS, WEIGHTS, Scatter, correlation
from rbfrag.solver.results import FloatArray

SECOND, BESIDE_OTHERS = np.arange(-4.0, 5.0), 1.2 * np.arange(-3.0, 4.0)
"""Points of a second measure given the first, and where there are more than two."""

ALONG = 1.5 * np.arange(-2.0, 3.0)
"""Points of the direction in which eta moves most once two measures are known."""

_PROBED = 2.4
"""Where along the first measure that direction is looked for."""


def correlations(names: tuple[str, ...]) -> FloatArray:
    """Return the matrix of :func:`~rbfrag.fragility.shaking.correlation` for these intensity
    measures.
    """
    return np.array([[correlation(first, other) for other in names] for first in names])


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
        factors = self._lower(inputs)
        turns = factors.shape[1] > 3 and not self._scatter.single
        return self._turned(inputs, factors) if turns else factors

    def deviation(self, inputs: Mapping[str, FloatArray]) -> FloatArray:
        """Return the standard deviation of the first intensity measure, shape (n,)."""
        return np.asarray(self._lower(inputs)[:, 0, 0])

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

    def _at(
        self, inputs: Mapping[str, FloatArray], factors: FloatArray, scores: FloatArray
    ) -> dict[str, FloatArray]:
        return {
            name: inputs[name] * np.exp(scores @ factors[:, i].T)
            for i, name in enumerate(self._scatter.names)
        }

    def _eta(
        self, inputs: Mapping[str, FloatArray], factors: FloatArray, scores: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return eta at the scores, shape (scores, n), and where mechanics rules out failure."""
        ns, model = arrays(), self._model
        values: dict[str, Any] = {**inputs, **self._at(inputs, factors, scores)}
        values = model.method.block.completed(values, model.term, ns)
        unscaled, h = model.form.unscaled(model.parameters, values, ns)
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
            eta, forbidden = self._eta(inputs, self._lower(inputs), scores)
            # P rises with eta: one link is enough
            best = np.where(forbidden, -np.inf, np.nan_to_num(eta, nan=np.inf)).max(axis=0)
            return self._model.method.link.probability(best, arrays()) > least

    def _lower(self, inputs: Mapping[str, FloatArray]) -> FloatArray:
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
                    rest = rest + correlation(first, other) * individual[i] * individual[j]
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
