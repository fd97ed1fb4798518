"""Annual rates of failure of many blocks: P at grid nodes times the rate density of the site."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.completion import MOMENTS
from rbfrag.fragility.confidence import ParameterErrors, quantiles_of
from rbfrag.fragility.method import LinearPredictor, arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.uncertain import normal_product, scatter_steps
from rbfrag.fragility.validation import outside_domain
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.rate_density import Grid, Indices, SiteMass, curve_mass, under
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal

_VALUES_AT_ONCE = 1 << 17
"""Blocks times nodes that are worked on together: what they need stays near the processor."""

_EDGE_EVERY = 10
"""Nodes between two edges of what the parts of a rate are given for."""

_FARTHEST = 50.0
"""Logarithm of the factor beyond which an end of an interval is meaningless."""

_HALVINGS = 48
_EVERY = 8
"""The fitted range is checked at every so many nodes of the grid."""


@dataclass(frozen=True, eq=False)
class KernelBlocks:
    """Blocks of one model of a single intensity measure.

    Args:
        model: the model.
        median: the measure at u is median · exp(u).
        numbers: what it reads of them, by field, draws x m; one draw of certain blocks.
        weight: weights of the draws, which sum to 1.
        site: index of each block's site, shape (m,).
    """

    model: FragilityModel
    median: float
    numbers: Mapping[str, FloatArray]
    weight: FloatArray
    site: Indices

    @classmethod
    def of(
        cls,
        model: FragilityModel,
        median: float,
        numbers: Mapping[str, FloatArray],
        site: Indices,
    ) -> list[tuple[Indices, KernelBlocks]]:
        """Return the blocks without and with parameter uncertainty, each with their indices.

        Args:
            numbers: fields of the blocks and their standard deviations, shape (m,) each.
        """
        block = model.method.block
        sigmas = {
            name: np.nan_to_num(np.asarray(numbers[f"{name}_sigma"], dtype=np.float64))
            for name in block.sigmas.values()
            if f"{name}_sigma" in numbers
        }
        medians = {
            name: np.asarray(value, dtype=np.float64)
            for name, value in numbers.items()
            if name not in block.sigmas
        }
        by_field = block.filled(medians)
        # what a block has of itself goes with what it may be, unless that has a scatter of its own
        medians |= {name: by_field[name] for name in sigmas if name in by_field}
        # Uncertain blocks are averaged over a product grid of normal steps, one axis for each
        # parameter with a standard deviation; certain blocks need one point.
        uncertain = np.zeros(site.size, dtype=np.bool_)
        for sigma in sigmas.values():
            uncertain |= sigma > 0.0
        result = []
        for indices in (np.flatnonzero(~uncertain), np.flatnonzero(uncertain)):
            if not indices.size:
                continue
            by_field = {
                name: sigma[indices] for name, sigma in sigmas.items() if sigma[indices].any()
            }
            axes = [scatter_steps(float(sigma.max())) for sigma in by_field.values()]
            points, weight = normal_product(axes)
            drawn = {name: value[indices][None] for name, value in medians.items()}
            for (name, sigma), z in zip(by_field.items(), points, strict=True):
                law = fraction if name in block.fractions else lognormal
                drawn[name] = law(z.reshape(-1, 1), drawn[name], sigma)
            shape = weight.size, indices.size
            drawn = {n: np.broadcast_to(v, shape) for n, v in block.filled(drawn).items()}
            result.append((indices, cls(model, median, drawn, weight, site[indices])))
        return result

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.site.size

    def only(self, chosen: Indices) -> KernelBlocks:
        """Return a selection of the blocks."""
        numbers = {name: values[:, chosen] for name, values in self.numbers.items()}
        return KernelBlocks(self.model, self.median, numbers, self.weight, self.site[chosen])

    def moved(self, step: FloatArray) -> KernelBlocks:
        """Return the blocks with a step added to the parameters of their model."""
        return replace(self, model=self.model.moved(step.tolist()))

    def values(self, u: FloatArray) -> dict[str, Any]:
        """Return the inputs of the model at u, of a shape that broadcasts with draws x blocks."""
        inputs: dict[str, Any] = {
            name: numbers[..., None] for name, numbers in self.numbers.items()
        }
        inputs[self.model.term.inputs[0]] = self.median * np.exp(u)
        return self.model.completed(inputs, arrays())

    def forbidden(self, values: Mapping[str, Any]) -> NDArray[np.bool_]:
        """Return where failure is impossible by mechanics."""
        result = np.zeros((self.weight.size, self.size, 1), dtype=np.bool_)
        for bound in self.model.bounds(values):
            result = result | bound.holds(values)
        return result

    def allowed_from(self, grid: Grid) -> FloatArray:
        """Return the u above which failure is possible, draws x blocks, within the grid."""
        shape = (self.weight.size, self.size)
        low = np.full(shape, grid.u[0] - grid.step)
        high = np.full(shape, grid.u[-1] + grid.step)
        if not self.model.form.bounds:
            return low
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            forbidden = self.forbidden(self.values(middle[..., None]))[..., 0]
            low, high = np.where(forbidden, middle, low), np.where(forbidden, high, middle)
        return high


class NodeTable(NamedTuple):
    """P of m blocks at grid nodes, and its derivatives by the parameters.

    Args:
        probability: P, m x nodes.
        slopes: derivatives of P by each parameter, m x nodes or None.
        outside: 1 where blocks and shaking lie outside the ranges fitted, m x nodes.
    """

    probability: FloatArray
    slopes: tuple[FloatArray, ...] | None
    outside: FloatArray


def table_of(
    blocks: KernelBlocks, grid: Grid, first: int, allowed: FloatArray, *, slopes: bool = True
) -> NodeTable:
    """Return P of the blocks at the grid nodes from a first node on.

    Where P jumps at what mechanics allows, the two nodes about the jump get what makes a sum over
    nodes of a smooth mass right to the second order: with the jump t steps below its next node,
    that node has 1/2 + t - t²/2 of it and the one before t²/2.

    Args:
        allowed: u from which on mechanics lets each fail, draws x blocks.
    """
    u = grid.u[first:]
    with np.errstate(all="ignore"):
        p, by_parameter, values = evaluated(blocks, u, slopes=slopes)
        draws = blocks.weight.size
        # of many draws each jumps elsewhere, which comes to the same
        jumps = draws == 1 and bool((allowed[0] > u[0]).any())
        if jumps:
            # P just above the jump: to P itself, one more node
            at, at_slopes, _ = evaluated(blocks, allowed[..., None] + 1e-9, slopes=slopes)
            _smooth_jumps(grid, first, allowed[0], p[0], at[0, :, 0])
            for slope, slope_at_jump in zip(by_parameter, at_slopes, strict=True):
                _smooth_jumps(grid, first, allowed[0], slope[0], slope_at_jump[0, :, 0])
        outside = _outside(blocks, values, u.size)

    def mean(table: FloatArray) -> FloatArray:
        return table[0] if draws == 1 else np.tensordot(blocks.weight, table, axes=1)

    return NodeTable(
        mean(p), tuple(mean(slope) for slope in by_parameter) if slopes else None, mean(outside)
    )


def evaluated(
    blocks: KernelBlocks, u: FloatArray, *, slopes: bool
) -> tuple[FloatArray, list[FloatArray], dict[str, Any]]:
    """Return P of the blocks at u, draws x m x nodes, its slopes if asked for, and the inputs."""
    model, ns, values = blocks.model, arrays(), blocks.values(u)
    unscaled, h = model.linear_predictor(values, ns)
    eta, link = unscaled.eta * h, model.method.link
    forbidden = blocks.forbidden(values)
    p = np.where(forbidden, 0.0, link.probability(eta, ns))
    if not slopes:
        return p, [], values
    density = np.where(forbidden, 0.0, link.density(eta, ns) * h)
    # far below its bound a density is 0, and a slope there may be infinite
    return (
        p,
        [np.where(density > 0.0, density * slope, 0.0) for slope in unscaled.all_slopes],
        values,
    )


def _smooth_jumps(
    grid: Grid, first: int, allowed: FloatArray, values: FloatArray, jump: FloatArray
) -> None:
    x = allowed / grid.step - grid.first - first
    node = np.ceil(x).astype(np.intp)
    row = np.flatnonzero((x > 0.0) & (node < values.shape[1]) & np.isfinite(jump))
    node, t = node[row], (node - x)[row]
    values[row, node] += jump[row] * (t - 0.5 * t * t - 0.5)
    values[row, node - 1] += jump[row] * 0.5 * t * t


def _outside(blocks: KernelBlocks, values: Mapping[str, Any], size: int) -> FloatArray:
    """Return where blocks and shaking lie outside the fitted range, by every eighth node."""
    nodes = np.arange(_EVERY // 2, size + _EVERY // 2, _EVERY)
    nodes = np.minimum(nodes, size - 1)
    thin = {
        name: value[..., nodes] if np.shape(value)[-1:] == (size,) and size > 1 else value
        for name, value in values.items()
        if name != MOMENTS
    }
    model = blocks.model
    model.with_ratios(thin)
    outside = np.zeros((blocks.weight.size, blocks.size, nodes.size), dtype=np.bool_)
    for finding in outside_domain(model, thin):
        outside |= finding.holds
    if model.spread is not None:
        outside |= ~model.spread.holds(thin, arrays())
    return np.repeat(outside, _EVERY, axis=-1)[..., :size].astype(np.float64)


class Rates(NamedTuple):
    """Annual rates of failure of m blocks.

    Args:
        rate: annual rate of failure of each [1/a].
        half: half-width of the confidence interval of the rate [1/a]: Student's quantile times
            the standard error, by the delta method.
        gradient: derivatives of the rate by the model's parameters, k x m.
        error: bound on the error of the grid [1/a].
        outside: part of the rate from outside the ranges that the model was fitted on [1/a].
        branches: rate in each branch [1/a], branches x m.
        ends: P at the first and the last level of the curve and at its end, 3 x m.
    """

    rate: FloatArray
    half: FloatArray
    gradient: FloatArray
    error: FloatArray
    outside: FloatArray
    branches: FloatArray
    ends: FloatArray


def rates(blocks: KernelBlocks, mass: SiteMass, level: float) -> Rates:
    """Return the annual rates of failure of blocks.

    Args:
        level: confidence level of the interval.
    """
    allowed = blocks.allowed_from(mass.grid)
    k, b = blocks.model.errors.size, mass.branches.shape[0]
    rows = np.zeros((6 + k + b, blocks.size))
    for indices, first in chunks(blocks, mass.grid, allowed):
        group = blocks.only(indices)
        rows[:, indices] = sums_of(
            group, table_of(group, mass.grid, first, allowed[:, indices]), mass, first
        )
    gradient = rows[3 : 3 + k]
    return Rates(
        rows[0], half_width(blocks.model.errors, gradient, level), gradient, rows[1], rows[2],
        rows[3 + k : 3 + k + b], rows[3 + k + b :],
    )  # fmt: skip


def half_width(errors: ParameterErrors, gradient: FloatArray, level: float) -> FloatArray:
    """Return the half-width of a confidence interval by the delta method, shape (m,)."""
    slopes = LinearPredictor(None, tuple(gradient))
    return np.asarray(errors.half_width(slopes, quantiles_of(level), arrays()))


def interval_end(rate: FloatArray, half: FloatArray | float, side: float) -> FloatArray:
    """Return an end of the confidence interval: rate · exp(side · half/rate) (delta method).

    Args:
        half: Student's quantile times the standard error of the rate.
        side: -1 or 1.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.minimum(np.divide(half, rate), _FARTHEST)
        return np.where(rate > 0.0, rate * np.exp(side * reach), rate)


def error_step(model: FragilityModel, gradient: FloatArray, level: float) -> FloatArray:
    """Return the step of the parameters to the upper end of the interval of a quantity, shape (k,).

    The step is along V g, the direction of the ellipse of errors in which the number changes most.

    Args:
        gradient: derivatives g of the number by the parameters, shape (k,).
    """
    along = model.errors.covariance_times(gradient)
    variance = float(gradient @ along)
    if not variance > 0.0:
        return np.zeros(gradient.size)
    return np.asarray(along * (half_width(model.errors, gradient[:, None], level)[0] / variance))


def probabilities(blocks: KernelBlocks, grid: Grid, step: FloatArray | None = None) -> FloatArray:
    """Return P of the blocks at all nodes of a grid, made non-decreasing, m x nodes.

    Args:
        step: what is added to the model's parameters; None for nothing.
    """
    moved = blocks if step is None else blocks.moved(step)
    p = table_of(moved, grid, 0, moved.allowed_from(grid), slopes=False).probability
    return np.maximum.accumulate(p, axis=1)


def chunks(blocks: KernelBlocks, grid: Grid, allowed: FloatArray) -> Iterator[tuple[Indices, int]]:
    """Yield groups of blocks, and the first node at which one of a group may fail.

    Blocks that begin to fail at like levels go together.
    """
    starts = np.floor(allowed.min(axis=0) / grid.step).astype(np.intp) - grid.first - 1
    starts = np.clip(starts, 0, grid.size - 1)
    order = np.argsort(starts, kind="stable")
    start = 0
    while start < order.size:
        first = int(starts[order[start]])
        many = max(1, _VALUES_AT_ONCE // ((grid.size - first) * blocks.weight.size))
        yield order[start : start + many], first
        start += many


def sums_of(blocks: KernelBlocks, table: NodeTable, mass: SiteMass, first: int) -> list[FloatArray]:
    """Return rate, error, part outside the fitted range, gradient, branch rates, and P at the ends.

    Args:
        first: the first node of the table.
    """

    def against(masses: FloatArray, values: FloatArray) -> FloatArray:
        node_mass = masses[:, first:]
        if node_mass.shape[0] == 1:
            return np.asarray(values @ node_mass[0])
        return np.asarray(np.einsum("mn,mn->m", values, node_mass[blocks.site]))

    # the mass of single events has negative parts, by cubic interpolation between nodes
    rate = np.maximum(against(mass.mass, table.probability), 0.0)
    assert table.slopes is not None
    off = against(mass.mass, _off_by(table.probability))
    ends = []
    if mass.ends is not None:
        for unit in mass.ends.units:
            group = unit[mass.ends.group] if unit.shape[0] > 1 else unit
            ends.append(np.minimum(against(group, table.probability), 1.0))
    return [
        rate,
        np.abs(off),
        against(mass.mass, table.probability * table.outside),
        *(against(mass.mass, slope) for slope in table.slopes),
        *(against(branch, table.probability) for branch in mass.branches),
        *ends,
    ]


def _off_by(values: FloatArray) -> FloatArray:
    """Return the difference of every second value from the cubic through its neighbours.

    That is the error of a grid of twice the step.
    """
    result = np.zeros(values.shape)
    if values.shape[1] < 7:
        return result
    a, b, c, d = (values[:, i : values.shape[1] - 6 + i : 2] for i in (0, 2, 4, 6))
    result[:, 3:-3:2] = values[:, 3:-3:2] - (9.0 * (b + c) - a - d) / 16.0
    return result


def curve_contributions(
    branches: Sequence[HazardCurve],
    weight: FloatArray,
    shaking: HazardLevel,
    blocks: Sequence[KernelBlocks],
) -> tuple[FloatArray, FloatArray]:
    """Return the contributions of the levels of a curve to the mean rate of the blocks.

    Args:
        branches: curves of one site.
        weight: weights of these, which sum to 1.

    Returns:
        Edges between levels, shape (k + 1,), and the part of the rate from each interval [1/yr],
        the weighted mean of the branches, shape (1, k); what lies beyond their last levels is in
        none.
    """
    used = np.flatnonzero(weight).tolist()
    curves, weight = [branches[i] for i in used], weight[used]
    mass = curve_mass([[curve] for curve in curves], weight, shaking)
    grid, total = mass.grid, np.zeros(mass.grid.size)
    for group in blocks:
        p = table_of(group, grid, 0, group.allowed_from(grid), slopes=False).probability
        total += p.sum(axis=0)
    mean = mass.smoothing.of(total / sum(group.size for group in blocks))
    part = weight @ under(curves, grid, beyond=False) * mean
    low, high = min(c.levels[0] for c in curves), max(c.levels[-1] for c in curves)
    starts = np.flatnonzero((grid.u > np.log(low)) & (grid.u < np.log(high)))
    starts = starts[_EDGE_EVERY::_EDGE_EVERY]
    edges = np.exp(grid.u[starts] - 0.5 * grid.step)
    return (
        np.concatenate([[low], edges, [high]]),
        np.add.reduceat(part, np.append(0, starts))[None],
    )
