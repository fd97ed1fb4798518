"""Z of the copula at points of low discrepancy: quadrature over what blocks share.

A sample of `rbfrag.fragility.joint_sampling` scatters by the root of its size. The same normals on
scrambled Sobol points (Owen 1998), the principal components of what blocks share first, cover their
space evenly: means converge faster, and repeated scrambles give the error of a mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import COMPONENTS, Placement
from rbfrag.solver.results import FloatArray

Indices = NDArray[np.intp]

REPLICATES = 8
"""Independent scrambles of the points; what means over them differ by is their error."""

MOST_RANK = 256
"""Principal components that are kept of one part of Z; more blocks are unlike in these alone."""

MOST_EVEN = 256
"""Coordinates of a point that are of low discrepancy; those beyond it matter least."""

_LEAST = 2.0**-33
_LEAST_SHARE = 1e-13


def uniform_points(size: int, power: int, seed: int) -> Iterator[FloatArray]:
    """Yield one scramble of points after another, uniform between 0 and 1, shape (2^power, size).

    Args:
        size: number of coordinates; those beyond the first `MOST_EVEN` are drawn at random.
        power: base-2 logarithm of the number of points.
    """
    from scipy.stats.qmc import Sobol

    for generator in np.random.default_rng(seed).spawn(REPLICATES):
        even = min(size, MOST_EVEN)
        rest = generator.random((1 << power, size - even))
        drawn = [Sobol(even, rng=generator).random_base2(power)] if even else []
        yield np.clip(np.concatenate([*drawn, rest], axis=1), _LEAST, 1.0 - _LEAST)


@dataclass(frozen=True, eq=False)
class _Part:
    """One Gaussian field of a group of blocks: what an earthquake, site or component adds to Z.

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
    """Z of some blocks at points of low discrepancy, the same whenever asked.

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
        self._order = np.argsort(-np.concatenate([*variance, np.zeros(0)]), kind="stable")

    @property
    def points(self) -> int:
        """Number of points of all replicates."""
        return REPLICATES << self._power

    def replicates(self) -> Iterator[FloatArray]:
        """Yield Z of one scramble after another, shape (sides, points, n).

        Sides are four where an azimuth is not known, else one.
        """
        for point in uniform_points(self._order.size, self._power, self._seed):
            normal = np.empty_like(point)
            normal[:, self._order] = ndtri(point)
            yield self._values(normal)

    def _values(self, normal: FloatArray) -> FloatArray:
        blocks, start = self._blocks, 0
        slots = COMPONENTS if blocks.drawn.any() else 1
        field = np.zeros((3, slots, blocks.size, normal.shape[0]))
        for part in self._parts:
            stop = start + part.loading.shape[1]
            field[part.kind, part.slot, part.member] += part.loading @ normal[:, start:stop].T
            start = stop
        common, symmetric, antisymmetric = field
        sides = (
            [(slot, side) for slot in range(slots) for side in (1, -1)] if slots > 1 else [(0, 1)]
        )
        z = np.empty((len(sides), normal.shape[0], blocks.size))
        for k, (slot, side) in enumerate(sides):
            own = np.where(blocks.drawn, slot, 0)
            facing = np.where(blocks.drawn, side, blocks.polarity)[:, None]
            rows = own, np.arange(blocks.size)
            z[k] = (common[0] + symmetric[rows] + facing * antisymmetric[rows]).T
        return z


def _parts(law: Dependence, blocks: Placement) -> Iterator[_Part]:
    """Yield the fields that Z is the sum of."""
    everyone = np.arange(blocks.size)
    for earthquake in np.unique(blocks.earthquake):
        shaken = everyone[blocks.earthquake == earthquake]
        sites = np.unique(blocks.site[shaken])
        single = sites.size == 1  # what the earthquake and what the site shares then is one field
        share = law.rho_e + (law.rho_s if single else 0.0)
        yield from _part(blocks, 0, shaken, [np.zeros_like(shaken)], share, law.l_e)
        for site in sites:
            here = shaken[blocks.site[shaken] == site]
            if not single:
                yield from _part(blocks, 0, here, [np.zeros_like(here)], law.rho_s, law.l_e)
            yield from _of_components(law, blocks, here)


def _of_components(law: Dependence, blocks: Placement, here: Indices) -> Iterator[_Part]:
    """Yield what the components of a site add; blocks of unknown azimuth are of both."""
    drawn, known = blocks.drawn[here], blocks.component[here]
    slots: dict[bytes, tuple[Indices, list[Indices]]] = {}
    for number, name in enumerate(range(COMPONENTS) if drawn.any() else np.unique(known)):
        own = here[drawn | (known == name)]
        slot = np.where(blocks.drawn[own], number, 0)
        slots.setdefault(own.tobytes(), (own, []))[1].append(slot)
    for own, several in slots.values():
        for kind, share, length in ((1, law.rho_v, law.l_v), (2, law.rho_o, law.l_o)):
            yield from _part(blocks, kind, own, several, share, length, law.l_y)


def _part(
    blocks: Placement,
    kind: int,
    member: Indices,
    slots: Sequence[Indices],
    share: float,
    length: float,
    length_y: float = np.inf,
) -> Iterator[_Part]:
    """Yield independent fields of one law, one for each of some rows of slots."""
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
    """Return `MOST_RANK` columns of the Cholesky factor, greatest remaining variance first.

    The pivoted factorization of Harbrecht, Peters and Schneider (2012).
    """
    root, left = np.zeros((size, MOST_RANK)), np.ones(size)
    for k in range(MOST_RANK):
        pivot = int(left.argmax())
        column = kernel(np.array([pivot]))[:, 0] - root[:, :k] @ root[pivot, :k]
        root[:, k] = column / np.sqrt(left[pivot])
        left = np.maximum(left - root[:, k] ** 2, 0.0)
        left[pivot] = 0.0
    return root
