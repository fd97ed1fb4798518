"""What fails in each earthquake of a part of an event set: expected, or sampled jointly."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rbfrag.fragility.joint import FailureCount, count_moments
from rbfrag.hazards.event_set import EventSet
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.standing_blocks import (
    COPULA,
    DEPENDENT,
    INDEPENDENT,
    Normals,
    normals_by_law,
)
from rbfrag.solver.results import FloatArray

IntArray = NDArray[np.int64]
Indices = NDArray[np.intp]

PAIRS_AT_ONCE, SAMPLES_AT_ONCE = 1 << 16, 1 << 22
"""Blocks times rows of shaking, and samples of all events, of one part of the work."""

NOTHING = 1e-12
"""Smaller probabilities are zero."""

MOST_IN_CLOSED_FORM = 100
"""Blocks of one event whose joint law is computed without samples; its cost grows as the square."""

_VALUES_AT_ONCE = 1 << 19
_OF_EVENTS, _OF_BLOCKS = 0, 1


class EventYears(NamedTuple):
    """Events of whole years.

    Args:
        number: place of the part in the order of all.
        events: the events, each weighing as in the whole set.
        counts: numbers of failures that curves are given for, rising.
        losses: losses that curves are given for, rising.
        samples: samples of each event; 0 for expected values alone.
    """

    number: int
    portfolio: Portfolio
    events: EventSet
    counts: FloatArray
    losses: FloatArray
    samples: int
    seed: int


class Curves(NamedTuple):
    """How often numbers are reached: sums of weights, and of their squares.

    The rows are rates of events, years whose largest event, and years whose sum reaches a number,
    each of shape (laws, k).
    """

    events: FloatArray
    largest: FloatArray
    sum: FloatArray

    @classmethod
    def empty(cls, laws: int, k: int) -> Curves:
        """Return curves of nothing."""
        return cls(*(np.zeros((2, laws, k)) for _ in range(3)))

    def plus(self, other: Curves) -> Curves:
        """Return the curves of both."""
        return Curves(*(one + more for one, more in zip(self, other, strict=True)))


@dataclass(frozen=True, eq=False)
class PartCounts:
    """What fails in the n events of a part.

    Args:
        failures: expected failures, shape (n,).
        loss: expected loss, shape (n,).
        loss_variance: its variance, shape (laws, n); NaN where it is not computed.
        any_fails: probability of any failure, shape (laws, n); NaN likewise.
        bounds: the same under full dependence and independence, shape (2, n).
        blocks: annual rate of failure of each block of the portfolio, the sum of squares of its
            contributions, and the part of it from outside the ranges that the model was fitted on,
            shape (3, n blocks).
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


class Shaken(NamedTuple):
    """Blocks that one event may fail.

    Args:
        block: their indices, shape (m,).
        row: rows of their shaking.
        probability: P of each, the mean over all scatter.
        outside: part of it from outside the ranges that the model was fitted on.
    """

    block: Indices
    row: Indices
    probability: FloatArray
    outside: FloatArray


def laws_of(portfolio: Portfolio) -> tuple[str, ...]:
    """Return the joint laws that answer: the stored one, or the two bounds."""
    return (DEPENDENT, INDEPENDENT) if portfolio.dependence is None else (COPULA,)


def count_part(part: EventYears) -> PartCounts:
    """Return what fails in the events of a part; a function of a module, for worker processes."""
    events, portfolio = part.events, part.portfolio
    n, laws = events.event_id.size, laws_of(portfolio)
    cost = portfolio.mean_loss
    failures, loss, bounds = np.zeros(n), np.zeros(n), np.zeros((2, n))
    blocks = np.zeros((3, portfolio.size))
    any_fails, variance = np.zeros((len(laws), n)), np.zeros((len(laws), n))
    counts, losses = (Curves.empty(len(laws), k.size) for k in (part.counts, part.losses))
    drawn = np.zeros((len(laws), n, 2, part.samples)) if part.samples else None
    for event, shaken in _shaken(part):
        own, p = shaken.block, shaken.probability
        failures[event] = p @ portfolio.weight[own]
        counted = portfolio.weight[own] > 0.0
        bounds[0, event] = p[counted].max(initial=0.0)
        bounds[1, event] = -np.expm1(np.log1p(-np.minimum(p[counted], 1.0 - 1e-16)).sum())
        mean = events.weight[event] * p
        blocks[0, own] += mean
        blocks[1, own] += mean * mean
        blocks[2, own] += events.weight[event] * shaken.outside
        if cost is not None:
            loss[event] = p @ cost[own]
        if drawn is None:
            any_fails[:, event], variance[:, event] = _closed_form(
                portfolio, shaken, bounds[:, event]
            )
            continue
        known = portfolio.dependence
        where = None if known is None else portfolio.placement(own)
        for law, normals in enumerate(normals_by_law(known, where, own.size).values()):
            drawn[law, event], any_fails[law, event] = _sampled(part, event, shaken, normals)
    if drawn is not None:
        if part.samples > 1:
            variance = drawn[:, :, 1].var(axis=-1, ddof=1)
        else:
            variance[:] = np.nan
        counts, losses = (
            _curves(events, drawn[:, :, i], ends)
            for i, ends in enumerate((part.counts, part.losses))
        )
    scenario = drawn is not None and events.is_scenario
    return PartCounts(
        part.number, failures, loss, variance, any_fails, bounds, blocks, counts, losses,
        quantiles=drawn if scenario and drawn is not None else np.empty(0),
    )  # fmt: skip


def _shaken(part: EventYears) -> Iterator[tuple[int, Shaken]]:
    """Yield each event that may fail a block, with those blocks."""
    events, portfolio = part.events, part.portfolio
    z, weight = portfolio.scatter_points()
    parts: list[tuple[Indices, Indices, FloatArray, FloatArray]] = []
    for site in np.intersect1d(events.site, portfolio.site):
        own = np.flatnonzero(portfolio.site == site)
        rows = np.flatnonzero(events.site == site)
        at_once = max(1, _VALUES_AT_ONCE // (own.size * weight.size))
        for start in range(0, rows.size, at_once):
            chunk = rows[start : start + at_once]
            shaking = {n: events.measures[n][chunk, None, None] for n in portfolio.measures}
            points = (z[:, 0, None], z[:, 1, None], z[:, 2, None])
            at_points, inside = portfolio.probability(own, shaking, points)
            p, outside = (
                np.einsum("rkm,k->rm", values, weight)
                for values in (at_points, at_points * ~inside)
            )
            which, block = np.nonzero(p > NOTHING)
            parts.append((own[block], chunk[which], p[which, block], outside[which, block]))
    if not parts:
        return
    block, row, p, outside = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((block, events.event[row]))
    block, row, p, outside = block[order], row[order], p[order], outside[order]
    event = events.event[row]
    starts = np.flatnonzero(np.diff(event, prepend=-1))
    for first, last in pairwise([*starts.tolist(), event.size]):
        some = slice(first, last)
        yield (
            int(event[first]),
            Shaken(block[some], row[some], np.minimum(p[some], 1.0), outside[some]),
        )


def _closed_form(
    portfolio: Portfolio, shaken: Shaken, bounds: FloatArray
) -> tuple[FloatArray, ...]:
    """Return the probability of any failure and the variance of the loss by each law."""
    own, p = shaken.block, shaken.probability
    cost = np.zeros(own.size) if portfolio.mean_loss is None else portfolio.mean_loss[own]
    # what one failure costs scatters by itself
    scatter = float((p * cost * cost * np.expm1(portfolio.loss_sigma[own] ** 2)).sum())
    alone = float((p * (1.0 - p) * cost * cost).sum()) + scatter
    law = portfolio.dependence
    if law is None:
        order = np.argsort(p)
        p, cost = p[order], cost[order]
        stronger = cost.sum() - np.cumsum(cost)  # of those whose P is greater: min(P, P') = P
        together = float(p @ (cost * (cost + 2.0 * stronger)) - (p @ cost) ** 2)
        return bounds, np.array([together + scatter, alone])
    if own.size > MOST_IN_CLOSED_FORM:
        return np.full(1, np.nan), np.full(1, np.nan)
    where = portfolio.placement(own)
    variance = count_moments(p, where, law, cost)[1] + scatter if cost.any() else 0.0
    counted = portfolio.weight[own] > 0.0
    count = FailureCount.of(p[counted], where.only(counted), law)
    return np.array([count.probability_any]), np.array([variance])


def _sampled(
    part: EventYears, event: int, shaken: Shaken, normals: Normals
) -> tuple[FloatArray, float]:
    """Return numbers of failures and losses of the samples of one event, and the share with any.

    The stream of random numbers is that of the event, whichever part it stands in.
    """
    portfolio, draws, own = part.portfolio, part.samples, shaken.block
    number = int(part.events.event_id[event])
    generator = np.random.default_rng([part.seed, _OF_EVENTS, number])
    probability = _probabilities(part, shaken, generator)
    counted, result, with_any = portfolio.weight[own] > 0.0, np.zeros((2, draws)), 0
    at_once = max(1, _VALUES_AT_ONCE // own.size)
    for start in range(0, draws, at_once):
        some = slice(start, min(start + at_once, draws))
        k = some.stop - start
        p = probability(k)
        fails = normals(k, generator) <= ndtri(p)
        with_any += int(fails[:, counted].any(axis=1).sum())
        result[0, some] = fails @ portfolio.weight[own]
        if portfolio.loss is not None:
            sample, block = np.nonzero(fails)
            sigma = portfolio.loss_sigma[own[block]]
            z = generator.standard_normal(sample.size) if sigma.any() else 0.0
            cost = portfolio.loss[own[block]] * np.exp(sigma * z)
            result[1, some] = np.bincount(sample, cost, minlength=k)
    return result, with_any / draws


def _probabilities(
    part: EventYears, shaken: Shaken, generator: np.random.Generator
) -> Callable[[int], FloatArray]:
    """Return a function for P of the blocks in the next samples, of a shape that broadcasts.

    The component's scatter is that of the event at the site. A block's own parameters are those of
    its sample in every event.
    """
    portfolio, own = part.portfolio, shaken.block
    if not (portfolio.component.scatter > 0.0 or portfolio.is_uncertain):
        return lambda _: shaken.probability
    sites, site = np.unique(portfolio.site[own], return_inverse=True)
    shaking = {name: part.events.measures[name][shaken.row] for name in portfolio.measures}
    streams = [
        [np.random.default_rng([part.seed, _OF_BLOCKS, block, i]) for block in own.tolist()]
        for i in range(2 if portfolio.is_uncertain else 0)
    ]

    def next_samples(k: int) -> FloatArray:
        xi = generator.standard_normal((k, sites.size))[:, site]
        z = [np.stack([one.standard_normal(k) for one in each], axis=1) for each in streams]
        z_p, z_k = z or (np.zeros(1), np.zeros(1))
        return portfolio.probability(own, shaking, (xi, z_p, z_k))[0]

    return next_samples


def _curves(events: EventSet, drawn: FloatArray, ends: FloatArray) -> Curves:
    """Return how often the samples of events, and of years, reach some numbers.

    Args:
        drawn: samples, shape (laws, n, draws).
        ends: the numbers, shape (k,).
    """
    weight = events.weight
    _, year = np.unique(
        np.stack([events.realization, events.year], axis=1), axis=0, return_inverse=True
    )
    year = np.ravel(year)
    order = np.argsort(year, kind="stable")
    starts = np.flatnonzero(np.diff(year[order], prepend=-1))
    of_year = weight[order[starts]]
    largest = np.maximum.reduceat(drawn[:, order], starts, axis=1)
    total = np.add.reduceat(drawn[:, order], starts, axis=1)

    def reached(values: FloatArray, own: FloatArray) -> FloatArray:
        share = np.stack([(values >= end).mean(axis=-1) for end in ends], axis=-1)
        parts = own[None, :, None] * share if ends.size else np.zeros((*share.shape[:2], 0))
        return np.stack([parts.sum(axis=1), (parts * parts).sum(axis=1)])

    if not ends.size:
        return Curves.empty(drawn.shape[0], 0)
    return Curves(reached(drawn, weight), reached(largest, of_year), reached(total, of_year))
