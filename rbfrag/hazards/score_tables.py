"""Scores Φ⁻¹(P) of the blocks at a site on nodes of u = ln(level), for the sampling of failures.

A block fails in a sample where its latent normal Z lies below a score. With one intensity measure
the score is a function of u alone: it is computed on a grid once per site, and each pair of block
and earthquake interpolates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.method import arrays
from rbfrag.hazards.event_means import blocks_by_model, cubic_at
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.rate_density import Grid, Indices, Smoothing
from rbfrag.hazards.rate_integration import KernelBlocks, evaluated, table_of
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.results import FloatArray

SURE, LEAST = 1.0 - 1e-16, 1e-30
_FARTHEST, _TINY, REACH = 38.0, 1e-12, 5.0

MEAN, MEDIAN = 0, 1
"""Scores of :attr:`ScoreTables.scores`: Φ⁻¹ of the mean P over the dispersion of component and
block, and of P of the median block without dispersion."""

OUTSIDE, VARIANCE, SHIFTS = 0, 1, 2
"""Rows of :attr:`ScoreTables.means`: the part of P from outside the fitted range, the variance of
Φ⁻¹(P) by the dispersion of component and block, and the first shift."""


class ScoreTables(NamedTuple):
    """Scores of m blocks on the nodes of a grid.

    Args:
        scores: Φ⁻¹(P), 2 x m x nodes: see `MEAN`; below mechanical bounds a straight line.
        allowed: u from which each score holds, 2 x m: mechanics excludes failure below.
        means: rows x m x nodes: see `OUTSIDE`; the last are the changes of the mean score at b ±
            one standard deviation along the principal axes of each model, one model after the
            other, 0 for blocks of other models.
        grid: the nodes.
        first: row of the portfolio that is the first of these blocks.
    """

    scores: FloatArray
    allowed: FloatArray
    means: FloatArray
    grid: Grid
    first: int

    def means_at(self, block: Indices, u: FloatArray) -> FloatArray:
        """Return `means` of pairs of block and u, rows x pairs."""
        return interpolate(self.means, block, u, *self.grid)

    def score_at(self, which: int, block: Indices, u: FloatArray) -> FloatArray:
        """Return the scores of pairs of block and u, -inf where mechanics excludes failure.

        Args:
            which: `MEAN` or `MEDIAN`.
            block: indices of the blocks, shape (n,).
            u: shape (n,).
        """
        nodes, allowed, step = self.scores[which], self.allowed[which][block], self.grid.step
        score = interpolate(nodes[None], block, u, *self.grid)[0]
        # next to its bound P vanishes as a power of 1 - r, or jumps: with r = exp(-d) at the
        # distance d from it the score is linear in ln(1 - r)
        near = np.flatnonzero(u < allowed + 2.0 * step)
        block, d = block[near], u[near] - allowed[near]
        x = allowed[near] / step - self.grid.first
        node = np.minimum(np.ceil(x).astype(np.intp), self.grid.size - 2)
        low, high, first = nodes[block, node], nodes[block, node + 1], (node - x) * step + _TINY
        with np.errstate(divide="ignore", invalid="ignore"):
            at_d, at_low, at_high = (np.log(-np.expm1(-a)) for a in (d, first, first + step))
            line = low + (high - low) * (at_d - at_low) / (at_high - at_low)
        score[near] = np.where(d > 0.0, line, -np.inf)
        return np.asarray(score)


def score_tables(
    portfolio: Portfolio, indices: Indices, shaking: HazardLevel, grid: Grid, smoothing: Smoothing,
    *, shifts: bool,
) -> ScoreTables:  # fmt: skip
    """Return the scores of some blocks of one site.

    Args:
        indices: m rows of the portfolio, one after the other: `first` locates a block in them.
        shifts: whether the shifts by the parameters are asked for.
    """
    sizes = [2 * len(row.coefficients) if shifts else 0 for row in portfolio.models]
    m = indices.size
    scores, means = np.empty((2, m, grid.size)), np.zeros((SHIFTS + sum(sizes), m, grid.size))
    allowed_from = np.full((2, m), -np.inf)
    for positions, blocks in blocks_by_model(
        portfolio, indices, np.zeros(portfolio.size, np.intp), shaking
    ):
        at = np.searchsorted(indices, positions)
        allowed = blocks.allowed_from(grid)
        bound = np.where(allowed[0] < grid.u[0], -np.inf, allowed[0])
        # the first draw stands for all of them: uncertain blocks sample their own parameters
        scores[:, at], allowed_from[MEDIAN, at] = _unbounded_scores(blocks, grid, bound), bound
        table = table_of(blocks, grid, 0, allowed, slopes=False)
        if smoothing.reach or blocks.weight.size > 1:
            scores[MEAN, at] = ndtri(np.clip(smoothing.of(table.probability), LEAST, SURE))
        else:
            allowed_from[MEAN, at] = bound
        means[VARIANCE, at] = _variance(blocks, grid, smoothing)
        means[OUTSIDE, at] = smoothing.of(table.probability * table.outside)
        if not shifts:
            continue
        number = int(portfolio.model[positions[0]])
        axes, first = axes_of(portfolio.models[number]).T, SHIFTS + sum(sizes[:number])
        # of moved parameters the bound is where it was
        nowhere = np.full(allowed.shape, -np.inf)

        def score_of(
            step: FloatArray, blocks: KernelBlocks = blocks, nowhere: FloatArray = nowhere
        ) -> FloatArray:
            moved = table_of(blocks.moved(step), grid, 0, nowhere, slopes=False)
            return np.asarray(ndtri(np.clip(smoothing.of(moved.probability), LEAST, SURE)))

        middle, factor = score_of(0.0 * axes[0]), _of_regression(blocks, grid)
        for i, axis in enumerate(axes):
            for j, side in enumerate((1.0, -1.0)):
                means[first + 2 * i + j, at] = (score_of(side * axis) - middle) * factor
    return ScoreTables(scores, allowed_from, means, grid, int(indices[0]))


def _unbounded_scores(blocks: KernelBlocks, grid: Grid, allowed: FloatArray) -> FloatArray:
    """Return Φ⁻¹(P) of certain blocks, m x nodes, with a straight line below the bounds.

    A bound cuts P off inside a step: on either side the interpolation needs smooth values.
    """
    model, ns = blocks.model, arrays()
    with np.errstate(all="ignore"):
        unscaled, factor = model.linear_predictor(blocks.values(grid.u), ns)
        score = ndtri(model.method.link.probability((unscaled.eta * factor)[0], ns))
    score = np.clip(np.broadcast_to(score, (blocks.size, grid.size)), -_FARTHEST, _FARTHEST)
    first = np.minimum(np.searchsorted(grid.u, allowed), grid.size - 2)[:, None]
    ends = (np.take_along_axis(score, first + i, axis=1) for i in (0, 1))
    low, high = (np.nan_to_num(end, nan=-_FARTHEST) for end in ends)
    before = np.arange(grid.size) - first
    line = np.maximum(low + (high - low) * before, -_FARTHEST)
    return np.asarray(np.where(before < 0, line, score))


def _variance(blocks: KernelBlocks, grid: Grid, smoothing: Smoothing) -> FloatArray | float:
    """Return the variance of Φ⁻¹(P) by the dispersion of component and block, m x nodes."""
    if not smoothing.reach and blocks.weight.size == 1:
        return 0.0
    with np.errstate(all="ignore"):
        p, _, _ = evaluated(blocks, grid.u, slopes=False)
    score = np.clip(ndtri(p), -REACH, REACH)
    mean, square = (
        smoothing.of(np.tensordot(blocks.weight, values, axes=1)) for values in (score, score**2)
    )
    return np.maximum(square - mean * mean, 0.0)


def axes_of(row: ModelRow) -> FloatArray:
    """Return the principal axes of a model's covariance in columns, one standard deviation long."""
    variances, axes = np.linalg.eigh(np.array(row.covariance))
    return np.asarray(np.sqrt(np.maximum(variances, 0.0)) * axes)


def _of_regression(blocks: KernelBlocks, grid: Grid) -> FloatArray | float:
    """Return the factor on the standard deviation of Φ⁻¹(P) that stands for the errors of the
    regression of a spectral velocity, m x nodes: they are taken to move the blocks as b does.
    """
    errors, k = blocks.model.errors, len(blocks.model.parameters)
    if not errors.node_steps:
        return 1.0
    nowhere = np.full((blocks.weight.size, blocks.size), -np.inf)
    slopes = np.stack(table_of(blocks, grid, 0, nowhere).slopes or ())
    total, part = (
        np.square(np.tensordot(errors.matrix[:, :stop], slopes[:stop], axes=1)).sum(axis=0)
        for stop in (errors.size, k)
    )
    ratio = np.divide(total, part, out=np.ones_like(total), where=part > 0.0)
    return np.asarray(np.sqrt(ratio))


@kernel
def interpolate(
    tables: FloatArray, row: Indices, u: FloatArray, step: float, first: int, size: int
) -> FloatArray:
    """Return tables at u by cubic interpolation, tables x n.

    Args:
        tables: tables x rows x nodes.
        row: row of each, shape (n,).
        u: shape (n,).
        step: of the grid, as are `first` and `size`.
    """
    result = np.empty((tables.shape[0], u.size))
    for i in range(u.size):
        start, a, b, c, d = cubic_at(u[i], step, first, size)
        for k in range(tables.shape[0]):
            node = tables[k, row[i], start : start + 4]
            result[k, i] = a * node[0] + b * node[1] + c * node[2] + d * node[3]
    return result
