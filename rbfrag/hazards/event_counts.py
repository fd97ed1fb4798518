"""Failures in each earthquake of an event set: expected values, and joint samples.

A row of a portfolio may stand for like blocks. Z of one of these is that of the side it faces, so
that as many fail as face sides whose Z is low enough; how many face each side is multinomial.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from rbfrag.fragility.joint import SIDES, Indices, IntArray
from rbfrag.fragility.joint_sampling import JointSampler, LargeCounts, LatentEvent
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.hazards.event_set import TOLERANCE, EventSet
from rbfrag.hazards.joint_rate import COPULA, DEPENDENT, INDEPENDENT
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.rate_density import Grid, smoothing_of
from rbfrag.hazards.score_tables import MEAN, MEDIAN, REACH, ScoreTables, score_tables
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.results import FloatArray

PAIRS_AT_ONCE, SAMPLES_AT_ONCE = 1 << 17, 1 << 20
"""Blocks times rows of shaking, and samples of all events, of one part of the work: half a second
and some 50 MB."""

MOST_KEPT = 1 << 26
"""Values on the nodes of all sites up to which they are kept for all parts: 540 MB."""

NOTHING = 1e-12
"""Smaller probabilities are zero."""

_LEAST_SCORE = float(ndtri(NOTHING))

LARGE, ENOUGH_SITES = 1000, 30
"""Numbers of distinct blocks and of sites above which only the count of failures is sampled."""

_VALUES_AT_ONCE = 1 << 19
_OF_EVENTS, _OF_BLOCKS = 0, 1  # streams of random numbers under one seed
_MAX_SAMPLERS = 16
_STRENGTHS, _SIZES = 41, 9
"""Points of what like blocks scatter by, and how far they reach in standard deviations."""

_FARTHEST, _LEAST_SHAKING = 38.0, 1e-4
_MOST_ON_NODES, _STEP, _NODES_A_SHIFT = 1000, 0.02, 4
"""Blocks of a site up to which their scores are tabulated on nodes, and the step of these where
nothing scatters: a score changes slowly with the shaking."""

_MOST_SUMMED = 50
"""Costs of like blocks that are drawn one by one; the sum of more by its three moments."""


class EventYears(NamedTuple):
    """Complete years of an event set, with everything needed to evaluate them.

    Args:
        number: place of the part in the order of all.
        events: the events, each weighing as in the whole set.
        counts: numbers of failures that curves are given for, rising.
        losses: losses that curves are given for, rising.
        samples: samples of each event; 0 for expected values alone.
        range_u: range of ln(level) over all events; None for that of these events.
        shifted: the portfolio by models of other parameters, which answer by the same samples; as
            many as two of each principal axis of the models' errors are taken for these.
        tables: scores of all blocks on nodes; None where they are made site by site, or not at all.
    """

    number: int
    portfolio: Portfolio
    events: EventSet
    counts: FloatArray
    losses: FloatArray
    samples: int
    seed: int
    shifted: tuple[Portfolio, ...] = ()
    range_u: tuple[float, float] | None = None
    tables: ScoreTables | None = None


EventBatch = tuple[int, EventSet]
"""Number and events of a part, as sent to a worker without the data that all parts share."""


class Curves(NamedTuple):
    """Weighted counts of exceedance, and sums of their squares.

    The rows are rates of events, years whose largest event, and years whose sum reaches a number,
    each of shape (laws, k), the laws of shifted portfolios after those of the portfolio itself; and
    rates of the events of each realization by the first law, (realizations, k).
    """

    events: FloatArray
    largest: FloatArray
    sum: FloatArray
    realizations: FloatArray

    @classmethod
    def merge(cls, parts: Sequence[Curves]) -> Curves:
        """Return the sum of the curves of all parts."""
        return cls(*(np.sum(values, axis=0) for values in zip(*parts, strict=True)))


@dataclass(frozen=True, eq=False)
class PartCounts:
    """Failures in the n events of a part.

    Args:
        failures: expected failures, shape (n,).
        loss: expected loss, shape (n,).
        loss_variance: its variance, shape (laws, n); NaN without two samples.
        any_fails: probability of any failure, shape (laws, n); NaN where samples would tell it.
        bounds: the same as `any_fails` under full dependence and independence, shape (2, n).
        blocks: annual rate of failure of one block of each row, the sum of squares of its
            contributions, and the part of it from outside the ranges that the model was fitted on,
            shape (3, rows).
        counts: curves of the numbers of failures.
        losses: curves of the losses.
        quantiles: numbers of failures and losses of all samples of a scenario, else empty.
    """

    number: int
    failures: FloatArray
    loss: FloatArray
    loss_variance: FloatArray
    any_fails: FloatArray
    bounds: FloatArray
    blocks: FloatArray
    counts: Curves
    losses: Curves
    quantiles: FloatArray


class TriggeredBlocks(NamedTuple):
    """Blocks that one event may cause to fail.

    Args:
        block: rows of the portfolio, shape (m,).
        row: rows of their shaking.
        probability: P of one block of each, the mean over all scatter.
        outside: part of it from outside the ranges that the model was fitted on.
        square: variance of Φ⁻¹ of P by the scatter of component and block, shape (m,).
        shift: by how much Φ⁻¹ of P differs by the shifted portfolios, (1 + shifted) x m; first 0.
    """

    block: Indices
    row: Indices
    probability: FloatArray
    outside: FloatArray
    square: FloatArray
    shift: FloatArray

    def only(self, chosen: Indices) -> TriggeredBlocks:
        """Return a selection of the blocks."""
        columns = {name: values[..., chosen] for name, values in self._asdict().items()}
        return TriggeredBlocks(**columns)


def laws_of(portfolio: Portfolio) -> tuple[str, ...]:
    """Return the dependence models: that of the stored model, or the two bounds."""
    return (DEPENDENT, INDEPENDENT) if portfolio.dependence is None else (COPULA,)


def shift_error(rates: FloatArray) -> FloatArray:
    """Return the standard error of ln λ due to parameter uncertainty.

    Args:
        rates: λ by the parameters, then by them one standard deviation to both sides along each
            principal axis of their covariance, shape (1 + 2 axes, …).
    """
    log = np.log(np.maximum(rates, np.finfo(np.float64).tiny))
    return np.asarray(np.sqrt((0.25 * (log[1::2] - log[2::2]) ** 2).sum(axis=0)))


def count_years(common: EventYears, batch: EventBatch) -> PartCounts:
    """Return the failures in the events of a part; a module-level function, for worker processes.

    Args:
        common: the portfolio and what is asked, of no events.
        batch: the events.
    """
    number, events = batch
    return count_part(common._replace(number=number, events=events))


def count_part(part: EventYears) -> PartCounts:
    """Return the failures in the events of a part."""
    # Expected failures and losses are sums of P and need no sampling. Counts of one event need the
    # joint distribution: they are sampled with the dependence model of each site.
    events, portfolio = part.events, part.portfolio
    n, laws = events.event_id.size, len(laws_of(portfolio))
    cost, number = portfolio.mean_loss, portfolio.count
    failures, loss, bounds = np.zeros(n), np.zeros(n), np.zeros((2, n))
    blocks = np.zeros((3, portfolio.size))
    rows = laws * (1 + len(part.shifted))
    drawn, with_any = np.zeros((rows, n, 2, part.samples)), np.zeros((laws, n))
    samplers: dict[bytes, JointSampler | LargeCounts | None] = {}
    for event, shaken in _shaken(part):
        indices, p = shaken.block, shaken.probability
        failures[event] = p @ (portfolio.weight[indices] * number[indices])
        # P of any failure under full dependence and independence
        counted = portfolio.weight[indices] > 0.0
        p_counted, many = p[counted], number[indices][counted]
        bounds[:, event] = p_counted.sum()
        if many.sum() > 1:
            none = many @ np.log1p(-np.minimum(p_counted, 1.0 - 1e-16))
            bounds[:, event] = p_counted.max(initial=0.0), -np.expm1(none)
        mean = events.weight[event] * p
        blocks[0, indices] += mean
        blocks[1, indices] += mean * mean
        blocks[2, indices] += events.weight[event] * shaken.outside
        if cost is not None:
            loss[event] = p @ (cost[indices] * number[indices])
        sampled = _noticeable(portfolio, shaken)
        if part.samples and sampled.size:
            shaken = shaken.only(sampled)
            key = shaken.block.tobytes()
            if key not in samplers:
                if len(samplers) == _MAX_SAMPLERS:
                    samplers.clear()
                samplers[key] = _sampler(portfolio, shaken.block)
            drawn[:, event], with_any[:, event] = _sampled(part, event, shaken, samplers[key])
    # Variance of the loss within an event, over its samples.
    variance = np.full((laws, n), np.nan)
    if part.samples > 1:
        variance = drawn[:laws, :, 1].var(axis=-1, ddof=1)
    if not part.samples:  # known alone where no law matters, as of single blocks
        any_bounds = bounds if laws == len(bounds) else bounds[:1]
        with_any = (
            any_bounds if laws > 1 else np.where(np.ptp(bounds, axis=0) <= 0.0, any_bounds, np.nan)
        )
    counts, losses = (
        _curves(events, drawn[:, :, i], ends, laws)
        for i, ends in enumerate((part.counts, part.losses))
    )
    return PartCounts(
        part.number, failures, loss, variance, with_any, bounds, blocks, counts, losses,
        quantiles=drawn[:laws] if part.samples and events.is_scenario else np.empty(0),
    )  # fmt: skip


def log_shaking(
    events: EventSet, portfolio: Portfolio, row: Indices | slice = slice(None)
) -> FloatArray:
    """Return ln(level) of the first measure of the models for rows of an event set."""
    levels = events.measures[portfolio.measures[0]][row]
    return np.asarray(np.log(np.maximum(levels, _LEAST_SHAKING)))


def is_tabulated(part: EventYears) -> bool:
    """Return whether scores on nodes serve: of one intensity measure, of shifts along the axes of
    the parameter errors or of none, and of sites whose tables are small.
    """
    portfolio = part.portfolio
    most = int(np.bincount(portfolio.site).max(initial=0))
    return (
        len(portfolio.measures) == 1
        and most <= _MOST_ON_NODES
        and len(part.shifted) in (0, _shifts_along_axes(portfolio))
    )


def _shifts_along_axes(portfolio: Portfolio) -> int:
    """Return the number of shifted portfolios: two along each axis of each model's errors."""
    return 2 * sum(len(row.coefficients) for row in portfolio.models)


def tables_of(
    part: EventYears, indices: Indices | None = None, *, keep: int | None = None
) -> ScoreTables | None:
    """Return the scores of blocks on nodes; None unless :func:`is_tabulated`, or beyond `keep`.

    Args:
        part: events, or their range of u alone.
        indices: rows of one site; None for all.
        keep: values up to which the tables are made.
    """
    portfolio = part.portfolio
    if not is_tabulated(part):
        return None
    about = HazardLevel.about(portfolio.measures[0], portfolio.component)
    step, smoothing = _STEP, smoothing_of(about)[1]
    if smoothing.reach:  # scores are smooth: fewer nodes than a rate needs
        step = math.log(about.shift[1] / about.shift[0]) / _NODES_A_SHIFT
        smoothing = smoothing._replace(every=_NODES_A_SHIFT)
    u = log_shaking(part.events, portfolio)
    low, high = part.range_u or (float(u.min()), float(u.max()))
    grid = Grid.over(step, low, high, smoothing.reach)
    rows = np.arange(portfolio.size) if indices is None else indices
    if keep is not None and (len(part.shifted) + 4) * rows.size * grid.size > keep:
        return None
    shifts = len(part.shifted) == _shifts_along_axes(portfolio)
    return score_tables(portfolio, rows, about, grid, smoothing, shifts=shifts)


def _shaken(part: EventYears) -> Iterator[tuple[int, TriggeredBlocks]]:
    """Yield each event that may cause a failure, with the blocks concerned."""
    # P of each pair of event and block, averaged over the component's scatter; pairs below NOTHING
    # are dropped.
    events, portfolio = part.events, part.portfolio
    parts: list[tuple[NDArray[np.generic], ...]] = []
    order = np.argsort(events.site, kind="stable")
    starts = np.searchsorted(events.site[order], np.arange(len(events.site_ids) + 1))
    for site in np.intersect1d(events.site, portfolio.site).tolist():
        indices = np.flatnonzero(portfolio.site == site)
        rows = order[starts[site] : starts[site + 1]]
        tables = part.tables or tables_of(part, indices)
        if tables is None:
            parts += _pairs(part, indices, rows)
        else:
            parts += _pairs_on_nodes(part, indices, rows, tables)
    if not parts:
        return
    block, row, *columns = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((block, events.event[row]))
    block, row, p, outside, square, *shift = (values[order] for values in (block, row, *columns))
    shifts = np.stack([np.zeros(p.size), *shift])
    event = events.event[row]
    starts = np.flatnonzero(np.diff(event, prepend=-1))
    for first, last in pairwise([*starts.tolist(), event.size]):
        span = slice(first, last)
        yield (
            int(event[first]),
            TriggeredBlocks(
                block[span], row[span], p[span], outside[span], square[span], shifts[:, span]
            ),
        )


def _pairs_on_nodes(
    part: EventYears, indices: Indices, rows: Indices, tables: ScoreTables
) -> Iterator[tuple[FloatArray | Indices, ...]]:
    """Yield blocks of a site and rows of their shaking, with P and what :class:`TriggeredBlocks`
    has of them, from the scores on nodes.
    """
    u, in_tables = log_shaking(part.events, part.portfolio, rows), indices - tables.first
    at_once = max(1, _VALUES_AT_ONCE // indices.size)
    for start in range(0, rows.size, at_once):
        chunk = slice(start, start + at_once)
        block, level = np.tile(in_tables, u[chunk].size), np.repeat(u[chunk], indices.size)
        score = tables.score_at(MEAN, block, level)
        pairs = np.flatnonzero(score > _LEAST_SCORE)
        columns = tables.means_at(block[pairs], level[pairs])
        row, place = np.divmod(pairs, indices.size)
        yield indices[place], rows[chunk][row], ndtr(score[pairs]), *columns


def _pairs(
    part: EventYears, indices: Indices, rows: Indices
) -> Iterator[tuple[FloatArray | Indices, ...]]:
    """Yield the same with the models evaluated at each pair."""
    events, portfolio = part.events, part.portfolio
    z, weight = portfolio.scatter_points()
    at_once = max(1, _VALUES_AT_ONCE // (indices.size * weight.size))
    for start in range(0, rows.size, at_once):
        chunk = rows[start : start + at_once]
        shaking = {n: events.measures[n][chunk, None, None] for n in portfolio.measures}
        points = (z[:, 0, None], z[:, 1, None], z[:, 2, None])
        at_points, inside = portfolio.probability(indices, shaking, points)
        p, outside = (
            np.einsum("rkm,k->rm", values, weight) for values in (at_points, at_points * ~inside)
        )
        which, block = np.nonzero(p > NOTHING)
        shifted = (
            np.einsum("rkm,k->rm", other.probability(indices, shaking, points)[0], weight)
            for other in part.shifted
        )
        square = 0.0 * p
        if part.shifted and weight.size > 1:  # the variance of Φ⁻¹(P) over its points
            score = np.clip(ndtri(at_points), -REACH, REACH)
            mean, of_square = (
                np.einsum("rkm,k->rm", values, weight) for values in (score, score * score)
            )
            square = np.maximum(of_square - mean * mean, 0.0)
        p, outside, square, *moved = (
            values[which, block] for values in (p, outside, square, *shifted)
        )
        p = np.minimum(p, 1.0)
        # Parameter errors enter as shifts of the score Φ⁻¹(P), which keep the order of blocks in a
        # sample: all shifted portfolios use the same draws.
        with np.errstate(invalid="ignore"):
            shifts = (
                np.nan_to_num(ndtri(np.minimum(other, 1.0)) - ndtri(p), nan=0.0) for other in moved
            )
        yield indices[block], chunk[which], p, outside, square, *shifts


def _noticeable(portfolio: Portfolio, shaken: TriggeredBlocks) -> Indices:
    """Return the blocks of an event that are sampled.

    The m blocks fail at least once with a probability of at least max P, and add Σ w P to the
    failures and the losses. A block without samples adds less than `TOLERANCE`/m of each.
    """
    block, noticeable = shaken.block, np.zeros(shaken.block.size, dtype=np.bool_)
    p, count = shaken.probability, portfolio.count[shaken.block]
    least = TOLERANCE / max(block.size, 1)
    counted = portfolio.weight[block] > 0.0
    noticeable |= counted & (count * p >= least * p[counted].max(initial=0.0))
    for mark in (portfolio.weight, portfolio.mean_loss):
        if mark is not None:
            expected = p * count * mark[block]
            noticeable |= (expected > 0.0) & (expected >= least * expected.max(initial=0.0))
    return np.flatnonzero(noticeable)


def _sampler(portfolio: Portfolio, indices: Indices) -> JointSampler | LargeCounts | None:
    """Return the sampler of joint failures of the blocks; None where only bounds are available."""
    law = portfolio.dependence
    if law is None:
        return None
    where, sites = portfolio.placement.only(indices), np.unique(portfolio.site[indices]).size
    certain = not portfolio.is_uncertain and (portfolio.weight[indices] > 0.0).all()
    if indices.size > LARGE and sites >= ENOUGH_SITES and certain:
        return LargeCounts(law, where, portfolio.count[indices])
    return JointSampler(law, where)


def _sampled(
    part: EventYears,
    event: int,
    shaken: TriggeredBlocks,
    sampler: JointSampler | LargeCounts | None,
) -> tuple[FloatArray, FloatArray]:
    """Return failures and losses in the samples of one event, and the fraction with failures.

    The stream of random numbers is that of the event, whichever part it stands in. By the shifted
    portfolios the same samples answer.
    """
    portfolio, draws, indices = part.portfolio, part.samples, shaken.block
    laws = laws_of(portfolio)
    generator = np.random.default_rng([part.seed, _OF_EVENTS, int(part.events.event_id[event])])
    result = np.zeros((shaken.shift.shape[0], len(laws), 2, draws))
    if isinstance(sampler, LargeCounts):
        latent = sampler.latent(draws, generator)
        many = [_of_many(part, shaken, sampler, latent, shift) for shift in shaken.shift]
        return np.stack([values for values, _ in many]), np.array([many[0][1]])
    if len(shaken.shift) > 1:
        # the shifts are of P over all scatter, of which each sample knows its own part
        shaken = shaken._replace(shift=np.sqrt(1.0 + shaken.square) * shaken.shift)
    bounds = _bounds_of_z(part, shaken, generator)
    scattered = int((portfolio.count[indices] > 1).sum()) if portfolio.is_uncertain else 0
    at_once = max(1, _VALUES_AT_ONCE // (indices.size + SIDES * _STRENGTHS * _SIZES * scattered))
    for start in range(0, draws, at_once):
        span = slice(start, min(start + at_once, draws))
        k = span.stop - start
        sample_bounds = bounds(k)
        for number, law in enumerate(laws):
            if sampler is not None:  # Z on each side that blocks may face, sides x draws x m
                sides = sampler.sides(k, generator)
            else:
                z = generator.standard_normal((1, k, 1 if law == DEPENDENT else indices.size))
                sides = np.broadcast_to(z, (1, k, indices.size))
            result[:, number, :, span] = _failing(
                portfolio, shaken, sides, sample_bounds, generator, alone=law == INDEPENDENT
            )
    return result.reshape(-1, 2, draws), (result[0, :, 0] > 0.0).mean(axis=1)


class _Bounds(NamedTuple):
    """Thresholds of Z below which a block fails.

    Args:
        bound: of each row, draws x m; the first axis may be 1.
        scattered: which rows are of like blocks whose own parameters scatter, shape (m,).
        scores: their bounds by strength, falling, and size, strengths x sizes x draws x rows.
        strengths: the standard normal values of the strengths.
        weight: of the sizes.
    """

    bound: FloatArray
    scattered: NDArray[np.bool_]
    scores: FloatArray
    strengths: FloatArray
    weight: FloatArray

    def share(self, z: FloatArray, shift: FloatArray) -> FloatArray:
        """Return the failure probability of identical blocks given Z, sides x draws x rows.

        It fails up to the strength at which the bound is Z.
        """
        score = self.scores + shift[self.scattered]
        last = (score >= z[:, None, None]).sum(axis=1, keepdims=True) - 1
        first = np.clip(last, 0, self.strengths.size - 2)
        score = np.broadcast_to(score, (z.shape[0], *score.shape[:2], *z.shape[1:]))
        high, low = (np.take_along_axis(score, first + i, axis=1)[:, 0] for i in (0, 1))
        apart = np.maximum(high - low, 1e-300)
        t = np.clip((high - z[:, None]) / apart, 0.0, 1.0)
        strength = self.strengths[first[:, 0]] + t * (self.strengths[1] - self.strengths[0])
        return np.asarray(np.einsum("spkm,p->skm", ndtr(strength) * (last[:, 0] >= 0), self.weight))


def _failing(
    portfolio: Portfolio,
    shaken: TriggeredBlocks,
    sides: FloatArray,
    bounds: _Bounds,
    generator: np.random.Generator,
    *,
    alone: bool,
) -> FloatArray:
    """Return failures and losses in the samples by shifted portfolio, shifts x 2 x draws.

    What fails by no shift, as most does not, is not looked at again for each of them.

    Args:
        sides: Z on the sides that blocks may face, each as likely, sides x draws x m.
        alone: each of like blocks has a Z of its own.
    """
    # A block fails where its latent normal Z lies below its bound Φ⁻¹(P) plus the shift.
    indices, (number, draws, _) = shaken.block, sides.shape
    count, weight, shift = portfolio.count[indices], portfolio.weight[indices], shaken.shift
    most = shift.max(axis=0)
    like, ones = np.flatnonzero(count > 1), np.flatnonzero(count == 1)
    side = generator.integers(number, size=(1, draws, ones.size))
    facing: IntArray = count[like]
    if like.size and not alone:
        chances = np.full(number, 1.0 / number)
        drawn = generator.multinomial(facing, chances, size=(draws, like.size))
        facing = np.moveaxis(drawn, -1, 0)
    seed = int(generator.integers(1 << 62))
    chance = alone | bounds.scattered[like]
    groups = [(ones, np.take_along_axis(sides[..., ones], side, axis=0), count[ones])]
    if not chance.all():
        groups.append((like[~chance], sides[..., like[~chance]], facing[..., ~chance]))
    parts: list[tuple[NDArray[Any], ...]] = []
    for members, z, many in groups:
        excess = z - bounds.bound[:, members]
        at = np.nonzero((excess <= most[members]) & (many > 0))
        parts.append((at[1], members[at[2]], np.broadcast_to(many, z.shape)[at], excess[at]))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.argsort(columns[3] > 0.0, kind="stable")  # costs do not depend on the shifts
    columns = [column[order] for column in columns]
    sample, block, many, excess = columns
    sums = np.zeros((len(shift), 2, draws))
    cost = _costs(portfolio, indices[block], many, seed)
    add_failing(sums, sample, block, excess, shift, weight[block] * many, cost)
    # Identical blocks of a row are not followed one by one: given Z of a side, their number of
    # failures is binomial.
    scattered = like[chance]
    for i, by in enumerate(shift if scattered.size else ()):
        z = sides[..., scattered]
        bound = bounds.bound[:, scattered] + by[scattered]
        p = ndtr(np.broadcast_to(bound, z.shape[1:])) if alone else bounds.share(z, by)
        by_chance = np.random.default_rng(seed).binomial(facing[..., chance], p)
        by_chance = by_chance if alone else by_chance.sum(axis=0)
        sample, block = np.nonzero(by_chance)
        many, block = by_chance[sample, block], scattered[block]
        cost = _costs(portfolio, indices[block], many, seed)
        for total, values in zip(sums[i], (weight[block] * many, cost), strict=True):
            total += np.bincount(sample, values, draws)
    return sums


@kernel
def add_failing(
    sums: FloatArray,
    sample: Indices,
    block: Indices,
    excess: FloatArray,
    shift: FloatArray,
    number: FloatArray,
    cost: FloatArray,
) -> None:
    """Add what fails in each sample by each shifted portfolio.

    Args:
        sums: failures and losses that are added to, shifts x 2 x draws.
        sample: sample of each candidate, shape (n,), as are the next two.
        block: its block.
        excess: by how much its Z lies above the threshold without a shift.
        shift: changes of the thresholds, shifts x blocks.
        number: failures that a candidate counts, shape (n,), as is `cost`, its loss.
    """
    for i in range(sample.size):
        for row in range(shift.shape[0]):
            if excess[i] <= shift[row, block[i]]:
                sums[row, 0, sample[i]] += number[i]
                sums[row, 1, sample[i]] += cost[i]


def _bounds_of_z(
    part: EventYears, shaken: TriggeredBlocks, generator: np.random.Generator
) -> Callable[[int], _Bounds]:
    """Return a function that draws the thresholds of Z for the next samples.

    The component's scatter is that of the event at the site. A single block's own parameters are
    those of its sample in every event; those of like blocks are drawn by what they are given Z.
    """
    # A block fails where Z <= Φ⁻¹(P), with P given the component's deviation xi at the site and the
    # block's own size and strength. Single blocks draw both; identical blocks keep the scores on a
    # grid of strengths, from which their number of failures is drawn.
    portfolio, indices = part.portfolio, shaken.block
    strengths = np.linspace(-REACH, REACH, _STRENGTHS)
    sizes, weight = normal_steps(_SIZES, REACH)
    sigma = portfolio.size_sigma[indices] + portfolio.strength_sigma[indices]
    scattered = (portfolio.count[indices] > 1) & (sigma > 0.0)
    none = np.empty((_STRENGTHS, _SIZES, 1, 0))
    if not (portfolio.component.sigma > 0.0 or sigma.any()):
        bound = ndtri(shaken.probability)[None]
        return lambda _: _Bounds(bound, scattered, none, strengths, weight)
    sites, site = np.unique(portfolio.site[indices], return_inverse=True)
    shaking = {name: part.events.measures[name][shaken.row] for name in portfolio.measures}
    tables = None if sigma.any() else part.tables
    u = log_shaking(part.events, portfolio, shaken.row)
    streams = [
        [np.random.default_rng([part.seed, _OF_BLOCKS, block, i]) for block in indices.tolist()]
        for i in range(2 if sigma.any() else 0)
    ]

    def next_samples(k: int) -> _Bounds:
        xi = generator.standard_normal((k, sites.size))[:, site]
        z = [np.stack([rng.standard_normal(k) for rng in rngs], axis=1) for rngs in streams]
        z_p, z_k = z or (np.zeros(1), np.zeros(1))
        if tables is not None:
            rows = np.broadcast_to(indices - tables.first, xi.shape).ravel()
            levels = (u + portfolio.component.sigma * xi).ravel()
            bound = tables.score_at(MEDIAN, rows, levels).reshape(xi.shape)
            return _Bounds(bound, scattered, none, strengths, weight)
        p, scores = portfolio.probability(indices, shaking, (xi, z_p, z_k))[0], none
        if scattered.any():
            subset = {name: values[scattered] for name, values in shaking.items()}
            points = (xi[:, scattered], sizes[:, None, None], strengths[:, None, None, None])
            point_p = portfolio.probability(indices[scattered], subset, points)[0]
            chances = np.diff(ndtr(strengths[:-1] + 0.5 * np.diff(strengths)), prepend=0, append=1)
            p = np.broadcast_to(p, xi.shape).copy()
            p[:, scattered] = np.einsum("jikm,j,i->km", point_p, chances, weight)
            scores = np.clip(ndtri(point_p), -_FARTHEST, _FARTHEST)
        return _Bounds(ndtri(p), scattered, scores, strengths, weight)

    return next_samples


def _costs(portfolio: Portfolio, block: Indices, number: IntArray, seed: int) -> FloatArray:
    """Return the losses of numbers of failures of blocks, same shape."""
    cost = number * np.ones(block.size)
    if portfolio.loss is None:
        return 0.0 * cost
    sigma, generator = portfolio.loss_sigma[block], np.random.default_rng([seed, 1])
    for many, draw in ((False, _sum_lognormals), (True, _sum_by_moments)):
        chosen = np.flatnonzero((sigma > 0.0) & ((number > _MOST_SUMMED) == many))
        if chosen.size:
            cost[chosen] = draw(number[chosen].astype(np.int64), sigma[chosen], generator)
    return np.asarray(portfolio.loss[block] * cost)


def _sum_lognormals(
    number: IntArray, sigma: FloatArray, generator: np.random.Generator
) -> FloatArray:
    """Return sums of lognormal variables of median 1."""
    index = np.repeat(np.arange(number.size), number)
    values = np.exp(sigma[index] * generator.standard_normal(index.size))
    return np.asarray(np.bincount(index, values, minlength=number.size))


def _sum_by_moments(
    number: IntArray, sigma: FloatArray, generator: np.random.Generator
) -> FloatArray:
    """Return samples of a shifted gamma distribution with the first three moments of these sums."""
    square = np.exp(sigma * sigma)
    mean, sd = np.sqrt(square), np.sqrt(square * (square - 1.0))
    skewness = (square + 2.0) * np.sqrt(square - 1.0)
    shape, scale = 4.0 * number / skewness**2, 0.5 * sd * skewness
    return number * mean + scale * (generator.standard_gamma(shape) - shape)


def _of_many(
    part: EventYears,
    shaken: TriggeredBlocks,
    sampler: LargeCounts,
    latent: LatentEvent,
    shift: FloatArray,
) -> tuple[FloatArray, float]:
    """Return numbers of failures and losses of many blocks, and the probability of any failure."""
    portfolio, indices = part.portfolio, shaken.block
    mean_loss, square = np.zeros(indices.size), np.zeros(indices.size)
    if portfolio.mean_loss is not None:
        mean_loss = portfolio.mean_loss[indices]
        square = mean_loss**2 * np.exp(portfolio.loss_sigma[indices] ** 2)
    weight = portfolio.weight[indices]
    marks = ((weight, weight**2), (mean_loss, square))
    # the fraction of the variance of failure scores that is due to the component
    common, p = 0.0, shaken.probability
    if portfolio.component.sigma > 0.0:
        shaking = {name: part.events.measures[name][shaken.row] for name in portfolio.measures}
        ends = (portfolio.probability(indices, shaking, (xi, 0.0, 0.0))[0] for xi in (1.0, -1.0))
        high, low = (np.clip(ndtri(end), -REACH, REACH) for end in ends)
        variance = 0.25 * (high - low) ** 2
        of_each = portfolio.count[indices] * p * (1.0 - p) + NOTHING
        common = float(np.average(variance / (1.0 + variance), weights=of_each))
    return sampler.sums(ndtri(p) + shift, common, latent, marks)


def _curves(events: EventSet, drawn: FloatArray, ends: FloatArray, laws: int) -> Curves:
    """Return weighted counts of exceedance for the samples of events and of years.

    Args:
        drawn: samples, shape (rows, n, draws); the laws, then those of shifted portfolios.
        ends: the numbers, shape (k,).
    """
    weight = events.weight
    _, year = np.unique(
        np.stack([events.realization, events.year], axis=1), axis=0, return_inverse=True
    )
    year = np.ravel(year)
    order = np.argsort(year, kind="stable")
    starts = np.flatnonzero(np.diff(year[order], prepend=-1))

    def reached(values: FloatArray, weights: FloatArray) -> FloatArray:
        """Return the weight of each event or year that reaches each threshold, rows x n x k."""
        rows, n, draws = values.shape
        place = np.searchsorted(ends, values, side="right")
        place += (ends.size + 1) * np.arange(rows * n).reshape(rows, n, 1)
        number = np.bincount(place.ravel(), minlength=rows * n * (ends.size + 1))
        number = number.reshape(rows, n, -1)[..., :0:-1].cumsum(axis=-1)[..., ::-1]
        return np.asarray(weights[:, None] * (number / draws))

    def powers(parts: FloatArray) -> FloatArray:
        return np.stack([parts.sum(axis=1), (parts * parts).sum(axis=1)])

    by_event, of_year = reached(drawn, weight), weight[order[starts]]
    realizations = np.zeros((2, len(events.realization_weights), ends.size))
    for power in (1, 2):
        np.add.at(realizations[power - 1], events.branch, by_event[0] ** power)
    largest, total = (
        powers(reached(along.reduceat(drawn[:laws, order], starts, axis=1), of_year))
        for along in (np.maximum, np.add)
    )
    return Curves(powers(by_event), largest, total, realizations)
