"""Expected failures in the earthquakes of an event set, from tables of P for each site.

A site has a few sums over its blocks on the nodes of a grid, Σ w P, Σ loss P, Σ ln(1 - P) and the
greatest P, which are interpolated at the shaking of each earthquake: no pair of block and
earthquake is visited. The rate of a block is its P against the mass of the site's earthquakes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rbfrag.fragility.confidence import ParameterErrors
from rbfrag.hazards.event_set import EventSet, IntArray
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.rate_density import Grid, Indices, SiteMass, smoothing_of
from rbfrag.hazards.rate_integration import KernelBlocks, half_width, sums_of, table_of
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.solver.integrator.compiled import inner_kernel, kernel
from rbfrag.solver.results import FloatArray

_BLOCKS_AT_ONCE = 256
_SURE = 1.0 - 1e-16
_MUCH = 1e3


class EventMeans(NamedTuple):
    """Expected failures and losses in n events.

    Args:
        failures: expected failures, shape (n,).
        loss: expected loss, shape (n,).
        bounds: probability of any failure under full dependence and independence, shape (2, n).
        blocks: annual rate of failure of one block of each row, the sum of squares of its
            contributions, and the part of it from outside the ranges that the model was fitted on,
            shape (3, rows).
        block_half: what the interval of each of these rates reaches to by the parameters, (rows,).
        failures_half: the same of the rate of all failures.
        loss_half: the same of the average loss.
    """

    failures: FloatArray
    loss: FloatArray
    bounds: FloatArray
    blocks: FloatArray
    block_half: FloatArray
    failures_half: float
    loss_half: float


def event_means(events: EventSet, portfolio: Portfolio, level: float) -> EventMeans:
    """Return the expected failures in the events; all models use the same single measure.

    Args:
        level: confidence level of the intervals.
    """
    # With one intensity measure P of a block is a function of u = ln im alone. Its table over u is
    # made once per site, and each earthquake only interpolates sums over the blocks.
    (name,) = portfolio.measures
    shaking = HazardLevel.about(name, portfolio.component)
    sites, site = np.unique(portfolio.site, return_inverse=True)
    mass, squared, u = event_mass(events, name, sites, shaking)
    order = np.argsort(events.site, kind="stable")
    starts = np.searchsorted(events.site[order], np.append(sites, len(events.site_ids)))
    n = events.event_id.size
    sums, blocks, half = np.zeros((4, n)), np.zeros((3, portfolio.size)), np.zeros(portfolio.size)
    place = np.full(len(events.site_ids), -1)
    place[sites] = np.arange(sites.size)
    counted = portfolio.weight > 0.0
    waiting = portfolio.count * counted
    number = portfolio.count * portfolio.weight
    cost = np.zeros(portfolio.size) if portfolio.mean_loss is None else portfolio.mean_loss
    cost = portfolio.count * cost
    totals: dict[str, tuple[ParameterErrors, Any]] = {}
    for first, last in _groups(site, sites.size):
        tables = np.zeros((4, last - first, mass.grid.size))
        rows = np.flatnonzero((site >= first) & (site < last))
        for indices, group in blocks_by_model(portfolio, rows, site, shaking):
            allowed = group.allowed_from(mass.grid)
            table = table_of(group, mass.grid, 0, allowed)
            p = np.clip(mass.smoothing.of(table.probability), 0.0, 1.0)
            rate, _, outside, *gradient = sums_of(group, table, mass, 0)
            blocks[0, indices], blocks[2, indices] = rate, outside
            blocks[1, indices] = np.einsum("mn,mn->m", p * p, squared[group.site])
            half[indices] = half_width(group.model.errors, np.stack(gradient), level)
            _, before = totals.get(group.model.name, (None, 0.0))
            by = np.stack([number[indices], cost[indices]])
            totals[group.model.name] = group.model.errors, before + by @ np.stack(gradient).T
            site_index = group.site - first
            stands = -np.log1p(-np.minimum(p, _SURE))
            for part, values, factor in (
                (0, p, number), (1, p, cost), (2, stands, waiting)
            ):  # fmt: skip
                np.add.at(tables[part], site_index, values * factor[indices, None])
            np.maximum.at(tables[3], site_index, p * counted[indices, None])
        # Rates of any failure have two bounds: full dependence, max P, and independence, 1 - Π(1 -
        # P).
        with np.errstate(divide="ignore"):
            logs = np.log(tables)
        rows = order[starts[first] : starts[last]]
        _add_rows(sums, tables, logs, rows, place - first, events.site, events.event, u, *mass.grid)
    halves = np.array([half_width(errors, sums.T, level) for errors, sums in totals.values()])
    total_half = np.sqrt((halves**2).sum(axis=0))
    failures, loss, stand, greatest = sums
    dependent = np.minimum(greatest, 1.0)
    bounds = np.stack([dependent, np.maximum(-np.expm1(-stand), dependent)])
    return EventMeans(
        failures, loss, bounds, blocks, half, float(total_half[0]), float(total_half[1])
    )  # fmt: skip


def event_mass(
    events: EventSet, name: str, sites: Indices, shaking: HazardLevel
) -> tuple[SiteMass, FloatArray, FloatArray]:
    """Return the rate density of an event set at sites, and u of each row.

    Args:
        name: the measure.
        sites: indices of the sites, rising.

    Returns:
        The mass; one of squared weights without scatter, sites x nodes; and ln(level) of the rows,
        -inf where nothing shook.
    """
    step, smoothing = smoothing_of(shaking)
    with np.errstate(divide="ignore"):
        u = np.log(events.measures[name])
    place = np.full(len(events.site_ids), -1)
    place[sites] = np.arange(sites.size)
    seen = np.isfinite(u) & (place[events.site] >= 0)
    ends = (u[seen].min(), u[seen].max()) if seen.any() else (0.0, 0.0)
    grid = Grid.over(step, float(ends[0]), float(ends[1]), smoothing.reach)
    masses = np.zeros((2, sites.size, grid.size))
    add_mass(masses, place, events.site, events.event, events.weight, u, *grid)
    site_mass = smoothing.of(masses[0])
    empty = np.empty((0, *site_mass.shape))
    return SiteMass(grid, site_mass, empty, np.ones(1), smoothing), masses[1], u


@kernel
def add_mass(
    mass: FloatArray,
    place: Indices,
    site: IntArray,
    event: IntArray,
    weight: FloatArray,
    u: FloatArray,
    step: float,
    first: int,
    size: int,
) -> None:
    """Add the weights of events, and their squares, to the nodes near the shaking of each row.

    Args:
        mass: what is added to, 2 x sites x nodes.
        place: index among these sites of each site, -1 for one that is left out.
        site: site of each row.
        event: event of each row.
        weight: of each event.
        u: ln(level) of each row; what is not finite is left out.
        step: of the grid, as are `first` and `size`.
    """
    for row in range(u.size):
        site_row = place[site[row]]
        if site_row < 0 or not np.isfinite(u[row]):
            continue
        start, a, b, c, d = cubic_at(u[row], step, first, size)
        w = weight[event[row]]
        for node, part in ((0, a), (1, b), (2, c), (3, d)):
            mass[0, site_row, start + node] += part * w
            mass[1, site_row, start + node] += part * w * w


@inner_kernel
def cubic_at(
    u: float, step: float, first: int, size: int
) -> tuple[int, float, float, float, float]:
    """Return the first of four nodes about u and their weights; see :meth:`Grid.cubic`."""
    x = u / step - first
    start = min(max(int(np.floor(x)) - 1, 0), size - 4)
    a = min(max(x, 0.0), size - 1.0) - start
    b, c, d = a - 1.0, a - 2.0, a - 3.0
    return start, -b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0


def _groups(site: Indices, sites: int) -> Iterator[tuple[int, int]]:
    """Yield ranges of sites with a few hundred blocks in total, or of one larger site."""
    number = np.bincount(site, minlength=sites)
    first, total = 0, 0
    for last, count in enumerate(number.tolist()):
        if total and total + count > _BLOCKS_AT_ONCE:
            yield first, last
            first, total = last, 0
        total += count
    yield first, sites


def blocks_by_model(
    portfolio: Portfolio, rows: Indices, site: Indices, shaking: HazardLevel
) -> Iterator[tuple[Indices, KernelBlocks]]:
    """Yield rows of the portfolio by model, a few at a time."""
    for number, model in enumerate(portfolio.answering):
        indices = rows[portfolio.model[rows] == number]
        for start in range(0, indices.size, _BLOCKS_AT_ONCE):
            batch = indices[start : start + _BLOCKS_AT_ONCE]
            numbers = portfolio.numbers_of(model, batch)
            for positions, blocks in KernelBlocks.of(model, shaking.median, numbers, site[batch]):
                # of an uncertain block the draws are many
                step = max(1, _BLOCKS_AT_ONCE // blocks.weight.size)
                for first in range(0, positions.size, step):
                    part = np.arange(first, min(first + step, positions.size))
                    yield batch[positions[part]], blocks.only(part)


@kernel
def _add_rows(
    sums: FloatArray,
    tables: FloatArray,
    logs: FloatArray,
    rows: Indices,
    place: Indices,
    site: IntArray,
    event: IntArray,
    u: FloatArray,
    step: float,
    first: int,
    size: int,
) -> None:
    """Add interpolated table values to the event of each row; of the last table the maximum.

    Cubic in their logarithms, that small values are as right as great ones, and in the values
    themselves where these change much from node to node, as where P jumps.
    """
    for row in rows:
        site_row = place[site[row]]
        if site_row < 0 or site_row >= tables.shape[1] or not np.isfinite(u[row]):
            continue
        start, a, b, c, d = cubic_at(u[row], step, first, size)
        for k in range(tables.shape[0]):
            four = tables[k, site_row, start : start + 4]
            if four.max() < _MUCH * four.min():
                log = logs[k, site_row, start : start + 4]
                value = np.exp(a * log[0] + b * log[1] + c * log[2] + d * log[3])
            else:
                value = max(a * four[0] + b * four[1] + c * four[2] + d * four[3], 0.0)
            if k < tables.shape[0] - 1:
                sums[k, event[row]] += value
            else:
                sums[k, event[row]] = max(sums[k, event[row]], value)
