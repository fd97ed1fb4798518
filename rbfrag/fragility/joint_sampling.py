"""Random samples of joint failures in one earthquake, by the copula of
`rbfrag.fragility.dependence`.

The parts of Z are drawn one by one: what an earthquake and a site share are Ornstein-Uhlenbeck
processes in l = ln p, what a component shares is a product of two, in l and ln y. Cost and memory
grow with n alone.

A sample of :class:`JointSampler` scatters by the root of its size. The normals of
:class:`LatentPoints` stand on scrambled Sobol points (Owen 1998), the principal components of what
blocks share first, and cover their space evenly: means converge faster, and repeated scrambles give
the error of a mean.

:class:`LargeCounts` draws the number of failures among very many blocks, without simulating each.
Given what an earthquake shares, E(l), failures of different sites are independent: their number has
the mean Σ Φ((a - √ρ E)/√(1-ρ)) and a variance to which pairs of one site add. Drawn is E, and then
a number of this mean and variance: negative binomial, or binomial where pairs add nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import (
    COMPONENTS,
    SIDES,
    Indices,
    IntArray,
    Placement,
    checked,
    joint_excess,
    pair_correlations,
)
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.results import FloatArray

JITTER = 1e-8
"""Correlations of different points are divided by one more than this, so that the matrix of nearly
equal blocks can be factored."""

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
        n, unknown = np.arange(blocks.size), blocks.drawn
        self._second = np.flatnonzero(unknown)
        block = np.concatenate([n, self._second])
        component = np.concatenate(
            [np.where(unknown, 0, blocks.component), np.ones_like(self._second)]
        )
        event, site = (blocks.earthquake,), (blocks.earthquake, blocks.site)
        of_block = (blocks.earthquake[block], blocks.site[block], component)
        self._event, self._site = (_Line(blocks.l, group, law.l_e) for group in (event, site))
        points = _GroupedNodes.of(blocks.l[block], blocks.ln_y[block], of_block)
        self._symmetric, self._antisymmetric = (
            _Surface(points, (length, law.l_y)) for length in (law.l_v, law.l_o)
        )
        self._completed: list[_Line] = []
        if (blocks.loadings.variance > 1.0).any():
            nowhere = np.zeros(block.size)
            self._completed = [_Line(nowhere[: group[0].size], group, 1.0)
                               for group in (event, site, of_block)]  # fmt: skip

    def sides(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return Z on each side that blocks may face, shape (sides, draws, n).

        Sides are four where an azimuth is not known, of known ones then all alike; else one.
        """
        law, n, second = self._law, self._blocks.size, self._second
        common = np.sqrt(law.rho_e) * self._event.draw(draws, generator)
        common += np.sqrt(law.rho_s) * self._site.draw(draws, generator)
        symmetric = np.sqrt(law.rho_v) * self._symmetric.draw(draws, generator)
        antisymmetric = np.sqrt(law.rho_o) * self._antisymmetric.draw(draws, generator)
        loadings = self._blocks.loadings
        if self._completed:
            event, site, component = (line.draw(draws, generator) for line in self._completed)
            common += loadings.event[:, None] * event + loadings.site[:, None] * site
            of_component = np.append(loadings.component, loadings.component[second])
            symmetric += of_component[:, None] * component
            scale = 1.0 / np.sqrt(loadings.variance)[:, None]
            common *= scale
            both = np.concatenate([scale, scale[second]])
            symmetric *= both
            antisymmetric *= both
        sides = np.arange(SIDES if second.size else 1)[:, None]
        row = np.tile(np.arange(n), (sides.size, 1))
        row[SIDES // COMPONENTS :, second] = np.arange(n, n + second.size)
        facing = np.where(self._blocks.drawn, 1 - 2 * (sides % 2), self._blocks.polarity)
        return sum_of_parts(common, symmetric, antisymmetric, row, facing)

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


@kernel
def sum_of_parts(
    common: FloatArray,
    symmetric: FloatArray,
    antisymmetric: FloatArray,
    row: Indices,
    facing: IntArray,
) -> FloatArray:
    """Return Z = common + symmetric ± antisymmetric on each side, sides x draws x n.

    Args:
        common: what the earthquake and the site share, n x draws.
        symmetric: even part of the components, rows x draws, as is `antisymmetric`.
        row: row of each side and block, sides x n.
        facing: sign of the antisymmetric part, sides x n.
    """
    n, draws = common.shape
    z = np.empty((row.shape[0], draws, n))
    for side in range(row.shape[0]):
        for i in range(n):
            at, sign = row[side, i], facing[side, i]
            for k in range(draws):
                z[side, k, i] = common[i, k] + symmetric[at, k] + sign * antisymmetric[at, k]
    return z


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


class _GroupedNodes(NamedTuple):
    """Distinct points of groups of blocks, sorted by group, x and y.

    Args:
        x: first variable, shape (k,).
        y: second variable, shape (k,).
        node: point of each block, shape (n,).
        start: first point of each group, and k.
    """

    x: FloatArray
    y: FloatArray
    node: Indices
    start: Indices

    @classmethod
    def of(
        cls, x: FloatArray, y: FloatArray, group: tuple[NDArray[np.int64], ...]
    ) -> _GroupedNodes:
        """Return the points of blocks, whose groups are given by labels."""
        first, node = _unlike(*group, x, y)
        is_new = np.zeros(first.size, dtype=np.bool_)
        is_new[:1] = True
        for labels in group:
            is_new[1:] |= labels[first][1:] != labels[first][:-1]
        return cls(x[first], y[first], node, np.append(np.flatnonzero(is_new), first.size))


class _Line:
    """Ornstein-Uhlenbeck processes in one variable, one for each group."""

    def __init__(self, x: FloatArray, group: tuple[NDArray[np.int64], ...], length: float) -> None:
        points = _GroupedNodes.of(x, np.zeros(x.size), group)
        self._node = points.node
        self._correlation, self._new = _transitions(np.diff(points.x, prepend=0.0), length)
        self._correlation[points.start[:-1]], self._new[points.start[:-1]] = 0.0, 1.0

    def draw(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return the values at x, shape (n, draws)."""
        value = generator.standard_normal((self._correlation.size, draws))
        run_line(value, self._correlation, self._new)
        return np.asarray(value[self._node])


@kernel
def run_line(value: FloatArray, correlation: FloatArray, new: FloatArray) -> None:
    """Transform independent normals, nodes x draws, into Ornstein-Uhlenbeck processes."""
    for i in range(1, value.shape[0]):
        for k in range(value.shape[1]):
            value[i, k] = new[i] * value[i, k] + correlation[i] * value[i - 1, k]


def _transitions(step: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Return the correlation of each node of an Ornstein-Uhlenbeck process with the one before, and
    the standard deviation of what is new.
    """
    away = np.abs(step) / length
    return np.exp(-away), np.sqrt(-np.expm1(-2.0 * away))


class _Surface:
    """Products of Ornstein-Uhlenbeck kernels in two variables, one field for each group.

    The unlike points of a group are factored together with those of all groups of their number;
    groups of more than `MOST_OF_A_COMPONENT` points are drawn on a grid, whose nodes are the values
    themselves or, where these are many, `NODE_STEP` lengths apart: R of the part then is that of
    points up to one step farther or nearer.
    """

    def __init__(self, points: _GroupedNodes, lengths: tuple[float, float]) -> None:
        self._points = points
        self._factors = factor_groups(*points[:2], points.start, *lengths, MOST_OF_A_COMPONENT)
        self._grids: list[tuple[slice, _Axis, _Axis]] = []
        for begin, end in pairwise(points.start.tolist()):
            if end - begin > MOST_OF_A_COMPONENT:
                rows = slice(begin, end)
                axes = _Axis(points.x[rows], lengths[0]), _Axis(points.y[rows], lengths[1])
                self._grids.append((rows, *axes))

    def draw(self, draws: int, generator: np.random.Generator) -> FloatArray:
        """Return the values at (x, y), shape (n, draws)."""
        value = generator.standard_normal((self._points.x.size, draws))
        correlate_groups(value, self._points.start, self._factors, MOST_OF_A_COMPONENT)
        for rows, first, other in self._grids:
            shape = first.correlation.size, other.correlation.size
            at_once = max(1, _VALUES_AT_ONCE // (shape[0] * shape[1]))
            for start in range(0, draws, at_once):
                field = generator.standard_normal((*shape, min(at_once, draws - start)))
                first.run(field)
                other.run(field.swapaxes(0, 1))
                value[rows, start : start + at_once] = field[first.node, other.node]
        return np.asarray(value[self._points.node])


@kernel
def factor_groups(
    x: FloatArray, y: FloatArray, start: Indices, length_x: float, length_y: float, most: int
) -> FloatArray:
    """Return the Cholesky factors U of R = UᵀU = exp(-|Δx|/length_x - |Δy|/length_y), one group
    after the other, flat; of groups with more than `most` points none.
    """
    size = np.diff(start)
    factors = np.empty(np.sum(np.where(size > most, 0, size * size)))
    end = 0
    for group in range(size.size):
        n, at = size[group], start[group]
        if n > most:
            continue
        r = factors[end : end + n * n].reshape((n, n))
        end += n * n
        for i in range(n):
            for j in range(i, n):
                away = abs(x[at + i] - x[at + j]) / length_x + abs(y[at + i] - y[at + j]) / length_y
                r[i, j] = np.exp(-away) / (1.0 + JITTER)
            r[i, i] = 1.0
        # row by row, in place: the inner loop runs along a row in memory
        for i in range(n):
            r[i, i:] /= np.sqrt(r[i, i])
            for j in range(i + 1, n):
                r[j, j:] -= r[i, j] * r[i, j:]
    return factors


@kernel
def correlate_groups(value: FloatArray, start: Indices, factors: FloatArray, most: int) -> None:
    """Transform independent normals, points x draws, into fields of the groups: z = Uᵀ value."""
    # in place, the last point first: those before it are still independent normals then
    end = 0
    for group in range(start.size - 1):
        at, n = start[group], start[group + 1] - start[group]
        if n > most:
            continue
        r = factors[end : end + n * n].reshape((n, n))
        end += n * n
        for i in range(n - 1, -1, -1):
            for k in range(value.shape[1]):
                value[at + i, k] *= r[i, i]
            for j in range(i):
                for k in range(value.shape[1]):
                    value[at + i, k] += r[j, i] * value[at + j, k]


class _Axis:
    """Nodes of one variable of a grid, and the node of each point."""

    def __init__(self, x: FloatArray, length: float) -> None:
        nodes, self.node = np.unique(x, return_inverse=True)
        span = float(nodes[-1] - nodes[0])
        enough = int(np.ceil(span / (length * NODE_STEP))) + 1
        if nodes.size > enough:
            nodes = np.linspace(nodes[0], nodes[-1], enough)
            self.node = np.rint((x - nodes[0]) / max(span, 1e-300) * (enough - 1)).astype(np.intp)
        self.correlation, self._new = _transitions(np.diff(nodes, prepend=0.0), length)

    def run(self, noise: FloatArray) -> None:
        """Transform independent normals, first axis along the nodes, into the process."""
        for k in range(1, self.correlation.size):
            noise[k] *= self._new[k]
            noise[k] += self.correlation[k] * noise[k - 1]


REPLICATES = 2
"""Independent scrambles of the points; what means over them differ by is their error."""

MOST_RANK = 256
"""Principal components that are kept of one part of Z; more blocks are unlike in these alone."""

MOST_EVEN = 256
"""Coordinates of a point that are of low discrepancy; those beyond it matter least."""

_LEAST = 2.0**-33
_LEAST_SHARE = 1e-13


@lru_cache(maxsize=4)
def _even_normals(power: int, seed: int) -> FloatArray:
    """Return low-discrepancy normals, `MOST_EVEN` x points of all scrambles: one set for all."""
    from scipy.stats.qmc import Sobol

    drawn = [
        Sobol(MOST_EVEN, rng=generator).random_base2(power)
        for generator in np.random.default_rng(seed).spawn(REPLICATES)
    ]
    uniform = np.ascontiguousarray(np.concatenate(drawn).T)
    return np.asarray(ndtri(np.clip(uniform, _LEAST, 1.0 - _LEAST)))


@lru_cache(maxsize=4)
def _first_sides(power: int, seed: int, rows: int) -> NDArray[np.int8]:
    """Return the first side that each block faces, rows x points."""
    generator = np.random.default_rng([seed, rows])
    return generator.integers(SIDES, size=(rows, REPLICATES << power), dtype=np.int8)


_Part = tuple[int, Indices, Indices, FloatArray]
"""One Gaussian field of a group of blocks, the contribution of an earthquake, site or component to
Z: the row of the values that it adds to (common, symmetric, antisymmetric), its blocks, whether it
is of the first or the second component that each may face, and the matrix from independent normals
to its values, shape (members, rank)."""


class LatentPoints:
    """Z of blocks at low-discrepancy points, reproducible.

    A block of unknown azimuth has a Z for each of the four sides that it may face, all equally
    likely; one of known azimuth has the same in all four.

    Args:
        points: number of points of all replicates, of which a power of two in each is taken.
        seed: seed of the scrambles.
    """

    def __init__(
        self, dependence: Dependence, blocks: Placement, points: int, seed: int = 0
    ) -> None:
        self._blocks = blocks
        self._seed = seed
        self._power = max(0, int(np.log2(max(1, points // REPLICATES))))
        self._parts = list(_parts(dependence, blocks))
        variance = [np.square(loading).sum(axis=0) for *_, loading in self._parts]
        order = np.argsort(-np.concatenate([*variance, np.zeros(0)]), kind="stable")
        self._coordinate = np.argsort(order, kind="stable")

    @property
    def points(self) -> int:
        """Number of points of all replicates."""
        return REPLICATES << self._power

    def sides(self) -> tuple[FloatArray, NDArray[np.int8]]:
        """Return Z on each side that blocks may face, and the first side of each.

        Sides are four where an azimuth is not known, else one; turned by one after another, each
        block faces each of its sides once.

        Returns:
            Sides x n x points of one replicate after another, and n x points.
        """
        blocks, start = self._blocks, 0
        n, drawn = blocks.size, blocks.drawn
        slots, ways = (COMPONENTS, SIDES) if drawn.any() else (1, 1)
        # of low discrepancy for the most important coordinates
        normal, more = _even_normals(self._power, self._seed), self._coordinate.size - MOST_EVEN
        if more > 0:
            generator = np.random.default_rng([self._seed, more])
            normal = np.concatenate([normal, generator.standard_normal((more, self.points))])
        field = np.zeros((3, slots, n, self.points))
        for kind, member, slot, loading in self._parts:
            stop = start + loading.shape[1]
            field[kind, slot, member] += loading @ normal[self._coordinate[start:stop]]
            start = stop
        common, symmetric, antisymmetric = field
        symmetric += common[0]
        z = np.stack([symmetric[k // 2] + q * antisymmetric[k // 2] for k, q in _SIDES[:ways]])
        has_azimuth = ~drawn
        z[:, has_azimuth] = (symmetric[0] + blocks.polarity[:, None] * antisymmetric[0])[
            has_azimuth
        ]
        rows = max(n, MOST_EVEN)  # one set for all but large sites
        return z, _first_sides(self._power, self._seed, rows)[:n]


_SIDES = tuple(enumerate((1, -1) * COMPONENTS))
"""Sides: both polarities of one component, then of the other."""


def _parts(law: Dependence, blocks: Placement) -> Iterator[_Part]:
    """Yield the fields whose sum is Z."""
    everyone = np.arange(blocks.size)
    for earthquake in np.unique(blocks.earthquake):
        shaken = everyone[blocks.earthquake == earthquake]
        sites = np.unique(blocks.site[shaken])
        single = sites.size == 1  # what the earthquake and what the site shares then is one field
        share = law.rho_e + (law.rho_s if single else 0.0)
        yield from _part(blocks, 0, shaken, [np.zeros_like(shaken)], share, law.l_e)
        yield from _completed(blocks, 0, shaken, [np.zeros_like(shaken)], blocks.of_event)
        for site in sites:
            members = shaken[blocks.site[shaken] == site]
            if not single:
                yield from _part(blocks, 0, members, [np.zeros_like(members)], law.rho_s, law.l_e)
            yield from _completed(blocks, 0, members, [np.zeros_like(members)], blocks.of_site)
            yield from _of_components(law, blocks, members)


def _of_components(law: Dependence, blocks: Placement, members: Indices) -> Iterator[_Part]:
    """Yield the contributions of the components of a site; blocks of unknown azimuth belong to
    both.
    """
    drawn, components = blocks.drawn[members], blocks.component[members]
    slots: dict[bytes, tuple[Indices, list[Indices]]] = {}
    for number, name in enumerate(range(COMPONENTS) if drawn.any() else np.unique(components)):
        rows = members[drawn | (components == name)]
        slot = np.where(blocks.drawn[rows], number, 0)
        slots.setdefault(rows.tobytes(), (rows, []))[1].append(slot)
    for rows, several in slots.values():
        for kind, share, length in ((1, law.rho_v, law.l_v), (2, law.rho_o, law.l_o)):
            yield from _part(blocks, kind, rows, several, share, length, law.l_y)
        yield from _completed(blocks, 1, rows, several, blocks.of_component)


def _completed(
    blocks: Placement, kind: int, member: Indices, slots: Sequence[Indices], loading: FloatArray
) -> Iterator[_Part]:
    """Yield what the completion of a spectral velocity adds, for each row of slots."""
    if loading[member].any():
        column = (loading / np.sqrt(blocks.loadings.variance))[member, None]
        yield from ((kind, member, slot, column) for slot in slots)


def _part(
    blocks: Placement,
    kind: int,
    member: Indices,
    slots: Sequence[Indices],
    share: float,
    length: float,
    length_y: float = np.inf,
) -> Iterator[_Part]:
    """Yield independent fields of one covariance, one for each row of slots."""
    if share > 0.0 and member.size:
        x, y = blocks.l[member] / length, blocks.ln_y[member] / length_y
        scale = np.sqrt(share / blocks.loadings.variance[member])
        loading = scale[:, None] * _loading(x, y)
        yield from ((kind, member, slot, loading) for slot in slots)


def _loading(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return principal components of exp(-|Δx| - |Δy|), shape (n, rank), rows of norm 1."""

    def kernel(rows: Indices | slice) -> FloatArray:
        away = np.abs(x[:, None] - x[None, rows]) + np.abs(y[:, None] - y[None, rows])
        return np.asarray(np.exp(-away))

    if x.size <= MOST_RANK:
        value, vector = np.linalg.eigh(kernel(slice(None)))
        loading = vector * np.sqrt(np.maximum(value, 0.0))
    else:
        root = _pivoted_root(kernel, x.size)
        value, vector = np.linalg.eigh(root.T @ root)
        loading = root @ vector
    loading = loading[:, ::-1][:, value[::-1] > _LEAST_SHARE * x.size]
    return np.asarray(loading / np.linalg.norm(loading, axis=1, keepdims=True))


def _pivoted_root(kernel: Callable[[Indices], FloatArray], size: int) -> FloatArray:
    """Return `MOST_RANK` columns of the pivoted Cholesky factor.

    The pivoted factorization of Harbrecht, Peters and Schneider (2012).
    """
    root, variance = np.zeros((size, MOST_RANK)), np.ones(size)
    for k in range(MOST_RANK):
        pivot = int(variance.argmax())
        column = kernel(np.array([pivot]))[:, 0] - root[:, :k] @ root[pivot, :k]
        root[:, k] = column / np.sqrt(variance[pivot])
        variance = np.maximum(variance - root[:, k] ** 2, 0.0)
        variance[pivot] = 0.0
    return root


NODES = 25
"""Nodes of E over ln p."""

_CELL, _WIDEST = 0.2, 40
"""Width of Φ⁻¹(P) of blocks that are taken together, and how many of it there are to both sides."""

_PAIRS, _LEVELS = 256, np.array([-1.7, 0.0, 1.7])
"""Pairs of one site that stand for all, and the values of E at which they are taken."""

_FLOOR, _LITTLE = 1e-12, 1e-7


class LatentEvent(NamedTuple):
    """Latent variables shared by all blocks of an earthquake.

    Args:
        value: E at the nodes, draws x nodes.
        seed: of what else is random.
    """

    value: FloatArray
    seed: int


class LargeCounts:
    """Random generator of the number of failures among many blocks in one earthquake.

    Args:
        blocks: rows of like blocks of unknown azimuths, those of one site together.
        count: blocks of each row, shape (m,).
    """

    def __init__(self, law: Dependence, blocks: Placement, count: IntArray) -> None:
        self._law, self._blocks, self._count = law, blocks, count
        # the completed part of it is taken to change with l as the rest does
        self._rho_e = float(np.average(law.shares(blocks.loadings).rho_e, weights=count))
        nodes = np.linspace(blocks.l.min(), blocks.l.max(), NODES)
        step = max(float(nodes[1] - nodes[0]), 1e-9)
        self._node = np.rint((blocks.l - nodes[0]) / step).astype(np.intp)
        away = np.abs(nodes[:, None] - nodes) / law.l_e
        self._factor = np.linalg.cholesky(np.exp(-away) + 1e-9 * np.eye(NODES))
        self._last = np.cumsum(count)
        starts = np.flatnonzero(np.diff(blocks.site, prepend=blocks.site[0] - 1))
        number = np.diff(np.append(starts, count.size))
        self._from = np.repeat(self._last[starts] - count[starts], number)
        self._of_site = np.repeat(np.add.reduceat(count, starts), number)

    def latent(self, draws: int, generator: np.random.Generator) -> LatentEvent:
        """Return the shared latent variables of the samples of one earthquake."""
        value = generator.standard_normal((draws, NODES)) @ self._factor.T
        return LatentEvent(value, int(generator.integers(1 << 62)))

    def sums(
        self,
        bound: FloatArray,
        common: float,
        latent: LatentEvent,
        marks: Sequence[tuple[FloatArray, FloatArray]],
    ) -> tuple[FloatArray, float]:
        """Return sums of marks over the failed blocks of each sample, and P that any fails.

        Args:
            bound: Φ⁻¹ of P of a block of each row, shape (m,).
            common: fraction of the variance that the blocks of a site share in addition to Z, as
                by dispersion of the shaking.
            marks: mean and mean square of what a failure of each row adds, shape (m,) each.

        Returns:
            Marks x draws; the probability.
        """
        p, rho = ndtr(bound), self._rho_e * (1.0 - common)
        number = self._count * p
        cells = np.clip(np.rint(bound / _CELL), -_WIDEST, _WIDEST).astype(np.intp) + _WIDEST
        cells = cells * NODES + self._node

        def summed(values: FloatArray | IntArray) -> FloatArray:
            total = np.bincount(cells, values, minlength=NODES * (2 * _WIDEST + 1))
            return total.astype(np.float64)

        mean = summed(number)
        used = np.flatnonzero(mean > _LITTLE * mean.sum())
        many, mean, node = summed(self._count)[used], mean[used], used % NODES
        a = ndtri(mean / many)

        def conditional_p(value: FloatArray) -> FloatArray:
            return np.asarray(ndtr((a - np.sqrt(rho) * value) / np.sqrt(1.0 - rho)))

        at_levels = conditional_p(_LEVELS[:, None])
        alone = (at_levels * (1.0 - at_levels)) @ many
        more = self._of_pairs(bound, number, common, rho) / np.maximum(alone, _FLOOR)
        q = conditional_p(latent.value[:, node])
        mean_of = q @ many
        order = np.argsort(at_levels @ many)
        shared = np.interp(mean_of, (at_levels @ many)[order], more[order])
        variance = (q * (1.0 - q)) @ many * (1.0 + np.maximum(shared, 0.0))
        generator = np.random.default_rng(latent.seed)
        failures, none = _number(mean_of, variance, generator)
        result = np.empty((len(marks), failures.size))
        for row, (mark, square) in zip(result, marks, strict=True):
            mean_mark, squares = (
                q @ (many * summed(number * moment)[used] / mean) / mean_of
                for moment in (mark, square)
            )
            row[:] = failures * mean_mark
            scatter = np.maximum(squares - mean_mark * mean_mark, 0.0)
            is_random = (failures > 0) & (scatter > _FLOOR * mean_mark * mean_mark)
            shape = failures[is_random] * mean_mark[is_random] ** 2 / scatter[is_random]
            row[is_random] *= generator.standard_gamma(shape) / shape
        return result, float(1.0 - none.mean())

    def _of_pairs(
        self, bound: FloatArray, number: FloatArray, common: float, rho: float
    ) -> FloatArray:
        """Return the variance from pairs at one site at the levels of E, shape (levels,).

        Each of some blocks, the more likely the more it fails, stands for all, with one other of
        its site for all others.
        """
        law, blocks, generator = self._law, self._blocks, np.random.default_rng(0)
        below = np.cumsum(number)
        i = np.searchsorted(below, below[-1] * (np.arange(_PAIRS) + 0.5) / _PAIRS)
        other_blocks = self._of_site[i] - 1
        position = self._last[i] - 1 - self._from[i]
        other = np.floor((generator.permutation(_PAIRS) + 0.5) / _PAIRS * other_blocks).astype(
            np.int64
        )
        other += other >= position
        j = np.searchsorted(
            self._last, self._from[i] + np.minimum(other, other_blocks), side="right"
        )
        apart, _, (opposite, same) = pair_correlations(blocks, i, j, law)
        event = self._rho_e * np.exp(-np.abs(blocks.l[i] - blocks.l[j]) / law.l_e)
        total = np.zeros(_LEVELS.size)
        for weight, r in ((0.5, apart), (0.25, opposite), (0.25, same)):
            within = ((1.0 - common) * (r - event) + common) / (1.0 - rho)
            a, b = (
                (bound[k] - np.sqrt(rho) * _LEVELS[:, None]) / np.sqrt(1.0 - rho) for k in (i, j)
            )
            excess = joint_excess(a, b, np.clip(within, -1.0, 1.0))
            total += weight * (excess * other_blocks / ndtr(bound[i])).sum(axis=1)
        return np.asarray(total * below[-1] / _PAIRS)


def _number(
    mean: FloatArray, variance: FloatArray, generator: np.random.Generator
) -> tuple[IntArray, FloatArray]:
    """Return random counts with these means and variances, and the probability of zero."""
    wide = variance > mean * (1.0 + 1e-9)
    mean = np.maximum(mean, _FLOOR)
    size = np.where(wide, mean * mean / np.where(wide, variance - mean, 1.0), 1.0)
    p = np.clip(np.where(wide, mean / np.maximum(variance, _FLOOR), 0.5), _FLOOR, 1.0 - 1e-15)
    trials = np.ceil(mean / np.maximum(1.0 - np.minimum(variance / mean, 1.0), _FLOOR))
    trials = np.minimum(trials, 1e15)
    chance = np.minimum(mean / trials, 1.0)
    number = np.where(
        wide,
        generator.negative_binomial(size, p),
        generator.binomial(trials.astype(np.int64), chance),
    )
    with np.errstate(divide="ignore"):
        none = np.where(wide, size * np.log(p), trials * np.log1p(-chance))
    return number, np.exp(none)
