"""Random samples of joint failures in one earthquake, by the copula of
`rbfrag.fragility.dependence`.

The parts of Z are drawn one by one: what an earthquake and a site share are Ornstein-Uhlenbeck
processes in l = ln p, what a component shares is a product of two, in l and ln y. Cost and memory
grow with n alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import COMPONENTS, SIDES, Indices, Placement, checked
from rbfrag.solver.results import FloatArray

JITTER = 1e-8
"""Added to the diagonal, so that a matrix of nearly equal blocks can be factored."""

MOST_OF_A_COMPONENT = 400
"""Unlike blocks of one component up to which its own matrix is factored."""

NODE_STEP = 1.0 / 16.0
"""Step of the nodes that more blocks of a component are moved to, in correlation lengths."""

_VALUES_AT_ONCE = 2**21


class JointSampler:
    """Random generator of joint failures of blocks in one earthquake.

    Blocks that are equal in all that a placement says have the same Z: they fail together if P is
    the same.
    """

    def __init__(self, law: Dependence, blocks: Placement) -> None:
        self._law, self._blocks = law, blocks
        # what is drawn for a block: its own component, or both where the azimuth is not known
        n, drawn = np.arange(blocks.size), blocks.drawn
        self._second = np.flatnonzero(drawn)
        block = np.concatenate([n, self._second])
        component = np.concatenate(
            [np.where(drawn, 0, blocks.component), np.ones_like(self._second)]
        )
        self._event = _Line(blocks.l, (blocks.earthquake,), law.l_e)
        self._site = _Line(blocks.l, (blocks.earthquake, blocks.site), law.l_e)
        of_block = (blocks.earthquake[block], blocks.site[block], component)
        self._symmetric, self._antisymmetric = (
            _Surface(blocks.l[block], blocks.ln_y[block], of_block, (length, law.l_y))
            for length in (law.l_v, law.l_o)
        )

    def sides(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return Z on each side that blocks may face, shape (sides, draws, n).

        Sides are four where an azimuth is not known, of known ones then all alike; else one.
        """
        law, n, second = self._law, self._blocks.size, self._second
        common = np.sqrt(law.rho_e) * self._event.draw(draws, generator)
        common += np.sqrt(law.rho_s) * self._site.draw(draws, generator)
        symmetric = np.sqrt(law.rho_v) * self._symmetric.draw(draws, generator)
        antisymmetric = np.sqrt(law.rho_o) * self._antisymmetric.draw(draws, generator)
        z = np.empty((SIDES if second.size else 1, draws, n))
        for k in range(z.shape[0]):
            columns = np.arange(n)
            if k >= SIDES // COMPONENTS:
                columns[second] = np.arange(n, n + second.size)
            facing = np.where(self._blocks.drawn, 1 - 2 * (k % 2), self._blocks.polarity)
            z[k] = common + symmetric[:, columns] + facing * antisymmetric[:, columns]
        return z

    def normals(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return Z, shape (draws, n)."""
        z = self.sides(draws, generator)
        side = generator.integers(z.shape[0], size=(1, *z.shape[1:]))
        return np.asarray(np.take_along_axis(z, side, axis=0)[0])

    def failures(
        self, probability: ArrayLike, draws: int, generator: np.random.Generator
    ) -> NDArray[np.bool_]:
        """Return which blocks fail, shape (draws, n).

        Args:
            probability: P of each block, shape (n,).
        """
        p, _ = checked(probability, self._blocks, None)
        return np.asarray(self.normals(draws, generator) <= ndtri(p))


def _cholesky(r: FloatArray) -> FloatArray:
    n = r.shape[-1]
    r[..., np.arange(n), np.arange(n)] += JITTER
    return np.asarray(np.linalg.cholesky(r / (1.0 + JITTER)))


def _unlike(*columns: NDArray[np.generic]) -> tuple[Indices, Indices]:
    """Return the indices of distinct rows, sorted by the columns, and the inverse index of each
    row.
    """
    order = np.lexsort(columns[::-1])
    new = np.zeros(order.size, dtype=np.bool_)
    new[:1] = True
    for column in columns:
        new[1:] |= column[order[1:]] != column[order[:-1]]
    node = np.empty(order.size, dtype=np.intp)
    node[order] = np.cumsum(new) - 1
    return order[new], node


class _Line:
    """Ornstein-Uhlenbeck processes in one variable, one for each group."""

    def __init__(self, x: FloatArray, group: tuple[NDArray[np.int64], ...], length: float) -> None:
        first, self._node = _unlike(*group, x)
        starts = np.zeros(first.size, dtype=np.bool_)
        starts[:1] = True
        for labels in group:
            starts[1:] |= labels[first][1:] != labels[first][:-1]
        self._ranks = _by_rank(starts)
        self._steps = _Transitions.of(np.diff(x[first], prepend=0.0), length)

    def draw(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return the values at x, shape (draws, n)."""
        value = generator.standard_normal((self._steps.correlation.size, draws))
        for at in self._ranks[1:]:
            value[at] *= self._steps.new[at, None]
            value[at] += self._steps.correlation[at, None] * value[at - 1]
        return np.asarray(value.T[:, self._node])


@dataclass(frozen=True, eq=False)
class _Transitions:
    """Transitions between nodes of an Ornstein-Uhlenbeck process: correlation and innovation."""

    correlation: FloatArray
    new: FloatArray

    @classmethod
    def of(cls, step: FloatArray, length: float) -> _Transitions:
        away = np.abs(step) / length
        return cls(np.exp(-away), np.sqrt(-np.expm1(-2.0 * away)))


def _by_rank(starts: NDArray[np.bool_]) -> list[Indices]:
    """Return the first rows of all groups, then the second rows, and so on."""
    row = np.arange(starts.size)
    rank = row - np.maximum.accumulate(np.where(starts, row, 0))
    order = np.argsort(rank, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(rank[order])) + 1)


class _Surface:
    """Products of Ornstein-Uhlenbeck kernels in two variables, one field for each group.

    The unlike points of a group are factored together with those of all groups of their number;
    groups of more than `MOST_OF_A_COMPONENT` points are drawn on a grid, whose nodes are the values
    themselves or, where these are many, `NODE_STEP` lengths apart: R of the part then is that of
    points up to one step farther or nearer.
    """

    def __init__(
        self,
        x: FloatArray,
        y: FloatArray,
        group: tuple[NDArray[np.int64], ...],
        lengths: tuple[float, float],
    ) -> None:
        first, self._node = _unlike(*group, x, y)
        self._size = first.size
        of_node = np.zeros(first.size, dtype=np.bool_)
        of_node[:1] = True
        for labels in group:
            of_node[1:] |= labels[first][1:] != labels[first][:-1]
        start = np.flatnonzero(of_node)
        number = np.diff(np.append(start, first.size))
        x, y = x[first], y[first]
        self._factors: list[tuple[Indices, FloatArray]] = []
        for size in np.unique(number[number <= MOST_OF_A_COMPONENT]):
            for rows in _portions(start[number == size][:, None] + np.arange(size)):
                apart = [np.abs(v[rows][:, :, None] - v[rows][:, None, :]) for v in (x, y)]
                r = np.exp(-apart[0] / lengths[0] - apart[1] / lengths[1])
                self._factors.append((rows, _cholesky(r)))
        self._grids: list[tuple[Indices, _Axis, _Axis]] = []
        for begin, size in zip(start, number, strict=True):
            if size > MOST_OF_A_COMPONENT:
                rows = np.arange(begin, begin + size)
                axes = _Axis.at(x[rows], lengths[0]), _Axis.at(y[rows], lengths[1])
                self._grids.append((rows, *axes))

    def draw(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return the values at (x, y), shape (draws, n)."""
        value = np.empty((draws, self._size))
        for rows, factor in self._factors:
            noise = generator.standard_normal((*rows.shape, draws))
            value[:, rows] = np.moveaxis(factor @ noise, -1, 0)
        for rows, first, other in self._grids:
            shape = first.correlation.size, other.correlation.size
            at_once = max(1, _VALUES_AT_ONCE // (shape[0] * shape[1]))
            for start in range(0, draws, at_once):
                field = generator.standard_normal((*shape, min(at_once, draws - start)))
                first.run(field)
                other.run(field.swapaxes(0, 1))
                value[start : start + at_once, rows] = field[first.node, other.node].T
        return value[:, self._node]


def _portions(rows: Indices) -> Iterator[Indices]:
    """Yield groups in batches whose matrices stay within memory."""
    at_once = max(1, _VALUES_AT_ONCE // rows.shape[1] ** 2)
    for start in range(0, rows.shape[0], at_once):
        yield rows[start : start + at_once]


@dataclass(frozen=True, eq=False)
class _Axis(_Transitions):
    """Nodes of one variable of a grid, and the node of each point."""

    node: Indices

    @classmethod
    def at(cls, x: FloatArray, length: float) -> _Axis:
        nodes, node = np.unique(x, return_inverse=True)
        span = float(nodes[-1] - nodes[0])
        enough = int(np.ceil(span / (length * NODE_STEP))) + 1
        if nodes.size > enough:
            nodes = np.linspace(nodes[0], nodes[-1], enough)
            node = np.rint((x - nodes[0]) / max(span, 1e-300) * (enough - 1)).astype(np.intp)
        steps = _Transitions.of(np.diff(nodes, prepend=0.0), length)
        return cls(steps.correlation, steps.new, node)

    def run(self, noise: FloatArray) -> None:
        """Transform independent normals, first axis along the nodes, into the process."""
        for k in range(1, self.correlation.size):
            noise[k] *= self.new[k]
            noise[k] += self.correlation[k] * noise[k - 1]
