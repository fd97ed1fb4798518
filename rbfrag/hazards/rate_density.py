"""Annual rate density of shaking at equally spaced levels of some sites.

A rate of failure is a sum over u = ln(level),

    λ_f = ∫ P(u) (-dλ) = Σ W_n P(u_n),

with the mass W_n = ∫ c_n(u) (-dλ), c_n the cardinal function of cubic interpolation between nodes.
The mass belongs to a site and P to a block, so that each is computed once. What else a level may
mean to a model, the scatter of a single component about it, is put on the mass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.sparse import csr_array

from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.results import FloatArray

Indices = NDArray[np.intp]

_GAUSS = np.array([-1.0, 1.0]) / math.sqrt(3.0)
"""Points of the rule of Gauss and Legendre on [-1, 1]; both weigh 1."""

_BESIDE = 2  # nodes that cubic interpolation reads on either side


class Grid(NamedTuple):
    """Grid nodes at integer multiples of a step of u = ln(level).

    Args:
        step: the step.
        first: multiple of the first node.
        size: number of nodes.
    """

    step: float
    first: int
    size: int

    @classmethod
    def over(cls, step: float, low: float, high: float, shift: int = 0) -> Grid:
        """Return the grid that covers a range of u, with extra nodes on either side."""
        first = math.floor(low / step) - _BESIDE - shift
        return cls(step, first, math.ceil(high / step) + _BESIDE + 1 + shift - first)

    @property
    def u(self) -> FloatArray:
        """ln(level) of the nodes, shape (size,)."""
        return np.asarray(self.step * (self.first + np.arange(self.size)))

    def cubic(self, u: FloatArray) -> tuple[Indices, FloatArray]:
        """Return the first of four nodes about each u and Lagrange's weights, shape (4, …)."""
        x = np.clip(u / self.step - self.first, 0.0, self.size - 1.0)
        start = np.clip(np.floor(x).astype(np.intp) - 1, 0, self.size - 4)
        t = x - start
        a, b, c, d = t, t - 1.0, t - 2.0, t - 3.0
        weights = np.stack([-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0])
        return start, weights

    def linear(self, u: FloatArray) -> tuple[Indices, FloatArray]:
        """Return the first of two nodes about each u and their weights, shape (2, …)."""
        x = np.clip(u / self.step - self.first, 0.0, self.size - 1.0)
        start = np.minimum(np.floor(x).astype(np.intp), self.size - 2)
        return start, np.stack([1.0 - (x - start), x - start])

    def spread(self, u: FloatArray, *, linear: bool = False) -> csr_array:
        """Return the matrix that distributes masses at u to the nodes, (size, number of u)."""
        start, weights = self.linear(u) if linear else self.cubic(u)
        rows = (start + np.arange(weights.shape[0])[:, None]).ravel()
        columns = np.tile(np.arange(u.size), weights.shape[0])
        return csr_array((weights.ravel(), (rows, columns)), shape=(self.size, u.size))


class Smoothing(NamedTuple):
    """Dispersion about a level, as weights at nodes a constant number of nodes apart.

    Args:
        every: nodes between two of them.
        weight: their weights, an odd number, which sum to 1.
    """

    every: int
    weight: FloatArray

    @property
    def reach(self) -> int:
        """Distance to the outermost weight, in nodes."""
        return self.every * (self.weight.size // 2)

    def of(self, values: FloatArray) -> FloatArray:
        """Return node values (last axis) smoothed by the dispersion; zero beyond the ends.

        The scatter is the same to both sides, so that this smooths a mass and a probability alike.
        """
        if self.weight.size == 1:
            return values
        result = np.zeros(values.shape)
        rows = np.ascontiguousarray(values).reshape(-1, values.shape[-1])
        smooth_rows(rows, result.reshape(rows.shape), self.weight, self.every)
        return result


@kernel
def smooth_rows(values: FloatArray, result: FloatArray, weight: FloatArray, every: int) -> None:
    """Add the weighted values of nodes `every` apart to each node of the result, rows x nodes."""
    size, reach = values.shape[1], every * (weight.size // 2)
    for row in range(values.shape[0]):
        for k in range(weight.size):
            shift = k * every - reach
            for i in range(max(shift, 0), size + min(shift, 0)):
                result[row, i] += weight[k] * values[row, i - shift]


@dataclass(frozen=True, eq=False)
class CurveEnds:
    """First and last levels of the curves of sites, as unit masses.

    Args:
        group: which of the rows each site has, shape (sites,).
        units: unit masses at the first level, at the last level with a rate, and at the level from
            which on nothing is exceeded (0 where the curve states none), 3 x rows x nodes.
        open: whether it states none, shape (rows,).
        rate: rate of the last level of each site [1/a], shape (sites,).
    """

    group: Indices
    units: FloatArray
    open: NDArray[np.bool_]
    rate: FloatArray


@dataclass(frozen=True, eq=False)
class SiteMass:
    """Rate density at sites, for the mean and for each logic-tree branch.

    Args:
        mass: the weighted mean over the branches, with scatter [1/a], sites x nodes.
        branches: the same of each, branches x sites x nodes; empty for one.
        weight: weights of the branches, which sum to 1.
        smoothing: the scatter that is on the masses.
        ends: levels of the curves that have most weight, with the mean rates of all; None of
            event sets.
    """

    grid: Grid
    mass: FloatArray
    branches: FloatArray
    weight: FloatArray
    smoothing: Smoothing
    ends: CurveEnds | None = None


def smoothing_of(shaking: HazardLevel) -> tuple[float, Smoothing]:
    """Return the step of the grid and the dispersion for the shaking of a model."""
    if shaking.shift.size == 1:
        return STEP, Smoothing(1, np.ones(1))
    apart = math.log(shaking.shift[1] / shaking.shift[0])
    return apart / NODES_A_SHIFT, Smoothing(NODES_A_SHIFT, shaking.weight)


STEP = 0.005
"""Step of the grid where nothing scatters about the levels."""

NODES_A_SHIFT = 8
"""Nodes between two points of the scatter."""


def curve_mass(
    branches: Sequence[Sequence[HazardCurve]], weight: FloatArray, shaking: HazardLevel
) -> SiteMass:
    """Return the rate density under the hazard curves of sites.

    Shaking beyond the last level counts as that level, the least that it can be; below the first
    level nothing is counted.

    Args:
        branches: curves of one measure, one a site in each branch.
        weight: weights of the branches, which sum to 1.
    """
    step, smoothing = smoothing_of(shaking)
    curves = [curve for branch in branches for curve in branch]
    highest = (c.levels[-1] if c.end_level is None else c.end_level for c in curves)
    low = math.log(min(float(curve.levels[0]) for curve in curves))
    grid = Grid.over(step, low, math.log(max(highest)), smoothing.reach)
    masses = np.stack([under(branch, grid) for branch in branches])
    masses = np.stack([smoothing.of(mass) for mass in masses])
    keys: dict[tuple[float, float, float | None], int] = {}
    group = np.array(
        [
            keys.setdefault((c.levels[0], c.levels[-1], c.end_level), len(keys))
            for c in branches[int(np.argmax(weight))]
        ]
    )
    levels = np.array([*keys], dtype=np.float64).T
    is_open = np.isnan(levels[2])
    at_levels = grid.spread(np.log(np.nan_to_num(levels, nan=1.0)).ravel(), linear=True)
    units = at_levels.toarray().T.reshape(*levels.shape, grid.size)
    units[2, is_open] = 0.0
    last = weight @ [[float(curve.annual_rate[-1]) for curve in branch] for branch in branches]
    return SiteMass(
        grid,
        np.tensordot(weight, masses, axes=1),
        masses if len(branches) > 1 else np.empty((0, *masses.shape[1:])),
        weight,
        smoothing,
        CurveEnds(group, smoothing.of(units), is_open, last),
    )


def under(curves: Sequence[HazardCurve], grid: Grid, *, beyond: bool = True) -> FloatArray:
    """Return the rate density under the curves, without dispersion, sites x nodes.

    Two points of Gauss to each step of the grid: a rule that is alike in each step leaves a mass as
    smooth as the curve. Cardinal functions of cubic interpolation are negative beyond the nodes
    next to their own. Where that would make a mass negative, at the ends of the curve and at its
    kinks, mass is put on the two nodes about it by linear interpolation, to the second order. A
    rate is then never negative, falls where P falls, and never exceeds that of the first level.

    Args:
        beyond: count shaking beyond the last level as that level.
    """
    mass = np.zeros((len(curves), grid.size))
    by_levels: dict[bytes, list[int]] = {}  # sites whose curves have the same levels
    for i, curve in enumerate(curves):
        by_levels.setdefault(curve.levels.tobytes(), []).append(i)
    for indices in map(np.array, by_levels.values()):
        u = np.log(curves[indices[0]].levels)
        inner = grid.u[(grid.u > u[0]) & (grid.u < u[-1])]
        edges = np.concatenate([u[:1], inner, u[-1:]])
        half = 0.5 * np.diff(edges)
        points = ((edges[:-1] + half)[:, None] + half[:, None] * _GAUSS).ravel()
        rates = np.stack([curves[i].annual_rate for i in indices.tolist()], axis=1)
        cubic = grid.spread(points)
        change, touched = grid.spread(points, linear=True) - cubic, abs(cubic).T
        last = grid.spread(u[-1:], linear=True).toarray()
        for start in range(0, indices.size, _SITES_AT_ONCE):
            batch = slice(start, start + _SITES_AT_ONCE)
            log_rate = PchipInterpolator(u, np.log(rates[:, batch]))
            density = np.maximum(-log_rate(points, 1), 0.0) * np.exp(log_rate(points))
            density *= np.repeat(half, 2)[:, None]
            node_mass, near = cubic @ density, np.zeros(density.shape, dtype=np.bool_)
            while (new := (touched @ (node_mass < 0.0) > 0.0) & ~near).any():
                near |= new
                points_near = np.flatnonzero(new.any(axis=1))
                node_mass += change[:, points_near] @ (density * new)[points_near]
            node_mass = np.maximum(node_mass, 0.0) + float(beyond) * last * rates[-1:, batch]
            total = rates[:1, batch] - float(not beyond) * rates[-1:, batch]
            # neither the rule of Gauss nor rounding may make the whole exceed the first level
            sums = np.maximum(node_mass.sum(axis=0), TINY)
            mass[indices[batch]] = (node_mass * (total * (1.0 - ROUNDING) / sums)).T
    return mass


_SITES_AT_ONCE = 512

TINY = float(np.finfo(np.float64).tiny)
ROUNDING = 1e-12
