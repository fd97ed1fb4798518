"""Spatially correlated ground-motion residuals, without a dense matrix."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import SPECTRAL

Indices = NDArray[np.intp]

EARTH_RADIUS_KM = 6371.0

NEIGHBOURS = 40
"""Places that the value at another one is drawn from."""

_NUGGET = 1e-9
"""Added to the diagonal of the correlations of neighbours, which may lie very close."""

_SOLVED_AT_ONCE = 2**21
"""Numbers of the matrices that are solved at once."""

_PERIODS_S = {
    "pgv_m_s": 1.0,
    "pga_g": 0.0,
    **{name: period for period, name in SPECTRAL.items()},
}
"""Period whose range is that of a measure [s]; of PGV by usage, for PGV goes with SA(1 s)."""


def correlation_range_km(measure: str) -> float:
    """Return the range b of the within-event residual of a measure's logarithm [km].

        ρ(h) = exp(-3h/b),   b = 8.5 + 17.2 T  for T < 1 s,   b = 22.0 + 3.7 T  for T ≥ 1 s

    Jayaram, N. & Baker, J. W. (2009): Correlation model for spatially distributed ground-motion
    intensities. Earthquake Engineering & Structural Dynamics 38(15), 1687-1708, equations 17 to
    20, below 1 s for regions where Vs30 does not cluster. PGA is taken at T = 0, PGV at T = 1 s,
    b = 25.7 km.

    Args:
        measure: name in :func:`rbfrag.predict`, such as ``pgv_m_s``.
    """
    period = _PERIODS_S[measure]
    return 22.0 + 3.7 * period if period >= 1.0 else 8.5 + 17.2 * period


class SpatialField:
    """Standard normal random fields with the correlation exp(-3h/b) at given locations.

    The value at a place is drawn given those at the nearest `NEIGHBOURS` of the places that stand
    before it in a random order: the approximation of Vecchia, A. V. (1988), Journal of the Royal
    Statistical Society B 50(2), 297-312. It is exact up to as many places; of thousands the
    correlations are right to 0.01, in the mean to 0.001. Cost and memory grow with the number of
    places alone.

    Args:
        lon: longitudes [deg], shape (n,); equal places have equal values.
        lat: latitudes [deg], shape (n,).
        range_km: b [km], at which the correlation is 0.05; above zero.
    """

    def __init__(self, lon: FloatArray, lat: FloatArray, range_km: float) -> None:
        coordinates, self._of = np.unique(np.column_stack([lon, lat]), axis=0, return_inverse=True)
        # the order belongs to the approximation, not to the draws
        self._order = np.random.default_rng(0).permutation(len(coordinates))
        points = on_sphere(*coordinates[self._order].T)
        self._neighbours = _earlier_neighbours(points)
        self._weight, self._new = _conditionals(points, self._neighbours, range_km)

    def draw(self, count: int, generator: np.random.Generator) -> FloatArray:
        """Return independent fields, shape (n, count)."""
        value = generator.standard_normal((self._order.size, count))
        value *= self._new[:, None]
        for i in range(1, self._order.size):
            k = min(i, NEIGHBOURS)
            value[i] += self._weight[i, :k] @ value[self._neighbours[i, :k]]
        field = np.empty_like(value)
        field[self._order] = value
        return np.asarray(field[self._of])


def on_sphere(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Return locations as points on a sphere [km], shape (n, 3)."""
    x, y = np.radians(lon), np.radians(lat)
    around = np.cos(y)
    return EARTH_RADIUS_KM * np.column_stack([around * np.cos(x), around * np.sin(x), np.sin(y)])


def _earlier_neighbours(points: FloatArray) -> Indices:
    """Return the nearest preceding points of each point, shape (n, NEIGHBOURS).

    Of point i only the first min(i, NEIGHBOURS) count.
    """
    from scipy.spatial import KDTree

    n = len(points)
    neighbours = np.zeros((n, NEIGHBOURS), dtype=np.intp)
    for i in range(1, min(n, NEIGHBOURS + 1)):
        neighbours[i, :i] = np.arange(i)
    start = NEIGHBOURS + 1
    while start < n:
        # of the points before a doubled end at least half stand before each of the second half
        end = min(2 * start, n)
        tree, waiting, count = KDTree(points[:end]), np.arange(start, end), 4 * NEIGHBOURS
        while waiting.size:
            near = np.asarray(tree.query(points[waiting], k=min(count, end))[1])
            before = near < waiting[:, None]
            enough = before.sum(axis=1) >= NEIGHBOURS
            first = np.argsort(~before[enough], axis=1, kind="stable")[:, :NEIGHBOURS]
            neighbours[waiting[enough]] = np.take_along_axis(near[enough], first, axis=1)
            waiting, count = waiting[~enough], 2 * count
        start = end
    return neighbours


def _conditionals(
    points: FloatArray, neighbours: Indices, range_km: float
) -> tuple[FloatArray, FloatArray]:
    """Return the weights of the neighbours, and the conditional standard deviations."""
    weight, new = np.zeros(neighbours.shape), np.ones(len(points))
    for rows, k in _alike(len(points)):
        near = points[neighbours[rows, :k]]
        between = _correlation(near[:, :, None] - near[:, None, :], range_km)
        between[:, np.arange(k), np.arange(k)] += _NUGGET
        there = _correlation(near - points[rows][:, None], range_km)
        weight[rows, :k] = np.linalg.solve(between, there[:, :, None])[:, :, 0]
        explained = (weight[rows, :k] * there).sum(axis=1)
        new[rows] = np.sqrt(np.maximum(1.0 - explained, 0.0))
    return weight, new


def _correlation(apart: FloatArray, range_km: float) -> FloatArray:
    """Return exp(-3h/b) of vectors; the chord h of 100 km is a metre shorter than the arc."""
    h = np.sqrt(np.einsum("...i,...i->...", apart, apart))
    return np.asarray(np.exp(-3.0 / range_km * h))


def _alike(n: int) -> Iterator[tuple[Indices, int]]:
    """Yield groups of points with the same number of neighbours, and that number."""
    for i in range(1, min(n, NEIGHBOURS)):
        yield np.array([i]), i
    step = _SOLVED_AT_ONCE // NEIGHBOURS**2
    for start in range(NEIGHBOURS, n, step):
        yield np.arange(start, min(start + step, n)), NEIGHBOURS
