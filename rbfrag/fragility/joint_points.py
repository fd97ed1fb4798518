"""Quasi-Monte Carlo points of the latent variables Z of the copula: quadrature over what blocks
share.

A sample of `rbfrag.fragility.joint_sampling` scatters by the root of its size. The same normals on
scrambled Sobol points (Owen 1998), the principal components of what blocks share first, cover their
space evenly: means converge faster, and repeated scrambles give the error of a mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import COMPONENTS, SIDES, Indices, Placement
from rbfrag.solver.results import FloatArray

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


@dataclass(frozen=True, eq=False)
class _Part:
    """One Gaussian field of a group of blocks: the contribution of an earthquake, site or component
    to Z.

    Args:
        kind: row of the values that it adds to: common, symmetric, antisymmetric.
        slot: whether it is of the first or the second component that each may face.
        loading: from independent normals to its values, shape (members, rank).
    """

    kind: int
    member: Indices
    slot: Indices
    loading: FloatArray


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
        variance = [np.square(part.loading).sum(axis=0) for part in self._parts]
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
        field, normal = np.zeros((3, slots, n, self.points)), self._normals()
        for part in self._parts:
            stop = start + part.loading.shape[1]
            values = part.loading @ normal[self._coordinate[start:stop]]
            field[part.kind, part.slot, part.member] += values
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

    def _normals(self) -> FloatArray:
        """Return independent normals, low-discrepancy for the most important coordinates, rank x
        points.
        """
        normal, more = _even_normals(self._power, self._seed), self._coordinate.size - MOST_EVEN
        if more <= 0:
            return normal
        generator = np.random.default_rng([self._seed, more])
        return np.concatenate([normal, generator.standard_normal((more, self.points))])


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
        for site in sites:
            members = shaken[blocks.site[shaken] == site]
            if not single:
                yield from _part(blocks, 0, members, [np.zeros_like(members)], law.rho_s, law.l_e)
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
        loading = np.sqrt(share) * _loading(x, y)
        yield from (_Part(kind, member, slot, loading) for slot in slots)


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
