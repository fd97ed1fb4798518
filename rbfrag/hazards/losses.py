"""Failures and losses of a portfolio of blocks under an event set, with exceedance curves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.hazards.curve import NOTABLE
from rbfrag.hazards.event_counts import (
    MOST_KEPT,
    PAIRS_AT_ONCE,
    SAMPLES_AT_ONCE,
    Curves,
    EventBatch,
    EventYears,
    PartCounts,
    count_years,
    is_tabulated,
    laws_of,
    log_shaking,
    shift_error,
    tables_of,
)
from rbfrag.hazards.event_means import EventMeans, event_means
from rbfrag.hazards.event_set import (
    QUANTILES,
    EventSet,
    MeanUncertainty,
    branch_ends,
    reached_interval,
)
from rbfrag.hazards.joint_rate import BOUNDS_GIVEN, SEVERAL_MODELS, UNKNOWN_TO_MODEL
from rbfrag.hazards.loss_answer import Exceedance, LossAnswer
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.rate_integration import interval_end
from rbfrag.hazards.score_tables import axes_of
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import QUANTITIES

Run = Callable[[Iterator[EventBatch], int, EventYears], Iterator[PartCounts]]
"""Does the parts of the work by `count_years` and yields the results in any order.

Given are the parts, their number, and what all have in common.
"""

FEWEST_PARTS = 8
"""Parts below which the work is one part: that takes less time than the start of workers."""

LARGER_PARTS = 64
"""By how much parts are larger where each makes tables of its own: some 600 MB."""

EACH_COUNT_TO = 20
"""Numbers of failures up to which each is given; beyond them steps of equal ratio."""

_STEPS = 40
_REACHED = 1.0 - 1e-12  # a sum counts as reaching itself
_THIN = 0.05


def event_losses(
    events: EventSet,
    portfolio: Portfolio,
    *,
    samples: int = 100,
    seed: int = 0,
    level: float = 0.95,
    run: Run | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> LossAnswer:
    """Return expected failures, the rate of any failure, and losses under an event set.

    Means are exact: sums of P over the events. What several blocks do together is sampled, by the
    copula that is stored with the model: in each event one draw of what the earthquake shares, of
    what each site shares, and of each block's own (`rbfrag.fragility.joint_sampling`). The stream
    of random numbers is that of the event, so that the answer does not depend on who computes what.

    Args:
        samples: samples of each event; 0 for expected values alone.
        run: does the parts of the work, as worker processes may; None for here.
        on_progress: called with the numbers of events done and of all.

    Raises:
        InputError: a number of samples or a seed that is none.
    """
    if isinstance(samples, bool) or not 0 <= samples <= 100_000:
        raise InputError(f"samples = {samples}: give 1 to 100000, or 0 for expected values alone")
    if isinstance(seed, bool) or seed < 0:
        raise InputError(f"seed = {seed}: give a whole number, 0 or more")
    if not 0.0 < level < 1.0:
        raise InputError(f"level = {level:g}: give a level above 0 and below 1, such as 0.95")
    means = event_means(events, portfolio, level) if len(portfolio.measures) == 1 else None
    ends = _ends(portfolio) if samples else (np.empty(0), np.empty(0))
    shifted = shifted_portfolios(portfolio) if samples else ()
    by_event = np.argsort(events.event, kind="stable")
    starts = np.searchsorted(events.event[by_event], np.arange(events.event_id.size + 1))
    none = _only(events, np.empty(0, dtype=np.intp), by_event[:0])
    u = log_shaking(events, portfolio)
    range_u = (float(u.min(initial=np.inf)), float(u.max(initial=-np.inf)))
    common = EventYears(-1, portfolio, none, *ends, samples, seed, shifted, range_u)
    pairs_at_once = PAIRS_AT_ONCE
    if samples and u.size:
        common = common._replace(tables=tables_of(common, keep=MOST_KEPT))
        if common.tables is None and is_tabulated(common):  # each part makes its own tables
            pairs_at_once *= LARGER_PARTS
    groups: list[NDArray[np.intp]] = []
    if samples or means is None:
        groups = _groups(events, portfolio, samples, pairs_at_once)
    rows = ([by_event[starts[event] : starts[event + 1]] for event in group] for group in groups)
    parts = (
        (number, _only(events, group, np.sort(np.concatenate(of_group))))
        for number, (group, of_group) in enumerate(zip(groups, rows, strict=True))
    )
    do: Run = run or (lambda work, _, shared: (count_years(shared, batch) for batch in work))
    events_done = 0
    results: dict[int, PartCounts] = {}
    for result in do(parts, len(groups), common) if groups else ():
        results[result.number] = result
        events_done += groups[result.number].size
        if on_progress is not None:
            on_progress(events_done, sum(group.size for group in groups))
    n, laws = events.event_id.size, laws_of(portfolio)
    order = [results[i] for i in range(len(groups))]

    def gather(name: str, *shape: int) -> FloatArray:
        values = np.zeros((*shape, n))
        for group, part in zip(groups, order, strict=True):
            values[..., group] = getattr(part, name)
        return values

    if means is None:
        blocks = sum((part.blocks for part in order), np.zeros((3, portfolio.size)))
        unknown = np.full(portfolio.size, np.nan)
        means = EventMeans(
            gather("failures"), gather("loss"), gather("bounds", 2), blocks, unknown, np.nan, np.nan
        )
    any_fails = gather("any_fails", len(laws))
    variance = gather("loss_variance", len(laws)) if order else np.full((len(laws), n), np.nan)
    if not order:  # known without samples alone where no law matters, as of single blocks
        any_bounds = means.bounds[:1] if portfolio.count.sum() < 2 else np.full((1, n), np.nan)
        any_fails = means.bounds if len(laws) > 1 else any_bounds
    curves = [
        Curves.merge(parts) if parts else None
        for parts in ([part.counts for part in order], [part.losses for part in order])
    ]
    exceedance, loss_exceedance = (
        {law: _curve(events, curve, end, i, len(laws), level) for i, law in enumerate(laws)}
        if samples
        else {}
        for curve, end in zip(curves, ends, strict=True)
    )
    of_any = curves[0].events[0, :, 0] if curves[0] and ends[0].size else np.empty(0)
    half_of_any = np.nan
    if len(laws) == 1 and of_any.size > 1:
        half_of_any = float(shift_error(of_any) * quantiles_of(level).normal)
    quantities = {
        "average_annual_failures": (means.failures, means.failures_half),
        "average_annual_loss": (means.loss, means.loss_half),
        "annual_rate_any": (any_fails[0], events.weight @ any_fails[0] * half_of_any),
    }
    if portfolio.loss is None:
        del quantities["average_annual_loss"]
    return LossAnswer(
        events, portfolio, samples, seed, level, laws,
        failures=means.failures,
        loss=means.loss,
        loss_variance=variance,
        any_fails=any_fails,
        bounds=means.bounds,
        block_rates=_of_rows(events, portfolio, means),
        uncertainty={
            name: MeanUncertainty.of(
                events, values, half, level, are_probabilities=name == "annual_rate_any"
            )
            for name, (values, half) in quantities.items()
            if name != "annual_rate_any" or (len(laws) == 1 and not np.isnan(values).any())
        },
        exceedance=exceedance,
        loss_exceedance=loss_exceedance,
        quantiles=_scenario_quantiles(events, groups, order, len(laws), samples),
        warnings=_warnings(events, portfolio, laws, means.blocks, any_fails),
    )  # fmt: skip


def _groups(
    events: EventSet, portfolio: Portfolio, samples: int, pairs_at_once: int
) -> list[NDArray[np.intp]]:
    """Return the events that shake a site with blocks, grouped by complete years."""
    at_site = np.bincount(portfolio.site, minlength=len(events.site_ids))
    pairs = np.bincount(events.event, at_site[events.site], minlength=events.event_id.size)
    order = np.lexsort((events.event_id, events.year, events.realization))
    order = order[pairs[order] > 0]
    if not order.size:
        return []
    year, realization = events.year[order], events.realization[order]
    new = (np.diff(year) != 0) | (np.diff(realization) != 0) | events.is_scenario
    starts = np.concatenate([[0], np.flatnonzero(new) + 1])
    # what an event costs, in parts of the work
    cost = pairs[order] / pairs_at_once + samples / SAMPLES_AT_ONCE
    if cost.sum() < FEWEST_PARTS:
        return [order]
    number = np.floor((np.cumsum(cost) - cost)[starts])
    return np.split(order, starts[1:][np.diff(number) > 0])


def _only(events: EventSet, group: NDArray[np.intp], rows: NDArray[np.intp]) -> EventSet:
    """Return a subset of the events, with their rows."""
    place = np.full(events.event_id.size, -1)
    place[group] = np.arange(group.size)
    return replace(
        events,
        event_id=events.event_id[group],
        realization=events.realization[group],
        year=events.year[group],
        weight=events.weight[group],
        event=place[events.event[rows]],
        site=events.site[rows],
        measures={name: values[rows] for name, values in events.measures.items()},
    )


def _ends(portfolio: Portfolio) -> tuple[FloatArray, FloatArray]:
    """Return the numbers of failures and the losses at which exceedance is evaluated."""
    weight = portfolio.weight[portfolio.weight > 0.0]
    most = float(portfolio.weight @ portfolio.count)
    if not weight.size:
        counts = np.empty(0)
    elif (weight == np.rint(weight)).all():
        first = np.arange(1.0, min(EACH_COUNT_TO, most) + 1.0)
        more = np.rint(np.geomspace(EACH_COUNT_TO, most, _STEPS)) if most > first[-1] else first
        counts = np.unique(np.concatenate([first, more]))
    else:
        counts = np.unique(np.geomspace(weight.min(), most, _STEPS)) * _REACHED
    loss = portfolio.loss
    if loss is None or not loss.any():
        return counts, np.empty(0)
    sigma = portfolio.loss_sigma
    high = float((loss * np.exp(3.0 * sigma)) @ portfolio.count)
    low = float((loss * np.exp(-2.0 * sigma))[loss > 0.0].min())
    return counts, np.geomspace(low, max(high, low), _STEPS if high > low else 1) * _REACHED


def shifted_portfolios(portfolio: Portfolio) -> tuple[Portfolio, ...]:
    """Return the portfolio with models one standard deviation away along each principal axis.

    Two of each principal axis of each model's covariance, to either side.
    """
    result = []
    for number, row in enumerate(portfolio.models):
        for step in axes_of(row).T:
            for side in (1.0, -1.0):
                values = np.array(list(row.coefficients.values())) + side * step
                moved = replace(
                    row, coefficients=dict(zip(row.coefficients, values.tolist(), strict=True))
                )
                models = (*portfolio.models[:number], moved, *portfolio.models[number + 1 :])
                result.append(replace(portfolio, models=models))
    return tuple(result)


def _curve(
    events: EventSet, curve: Curves | None, ends: FloatArray, law: int, laws: int, level: float
) -> tuple[Exceedance, ...]:
    """Return the exceedance curve up to the largest value reached, with intervals."""
    if curve is None:
        return ()
    effective = events.effective_years
    errors = shift_error(curve.events[0, law::laws]) * quantiles_of(level).normal
    rows = []
    for k, end in enumerate(ends.tolist()):
        rate, squares = curve.events[:, law, k].tolist()
        if rate <= 0.0:
            break
        low, high = (interval_end(np.array(rate), rate * errors[k], side) for side in (-1.0, 1.0))
        fragility = float(low), float(high)
        sampling = reached_interval(events, rate, squares, level)
        if effective is None:
            fragility = fragility[0], min(fragility[1], 1.0)
            rows.append(Exceedance(end, rate, sampling, fragility, None, None, None, False))
            continue
        largest, total = (float(years[0, law, k]) for years in (curve.largest, curve.sum))
        over = branch_ends(events, curve.realizations[..., k]) if law == 0 else None
        rare = rate * effective < 1.0
        rows.append(Exceedance(end, rate, sampling, fragility, over, largest, total, rare))
    return tuple(rows)


def _of_rows(events: EventSet, portfolio: Portfolio, means: EventMeans) -> FloatArray:
    """Return rate, standard error, loss and half-width of the interval of each row."""
    blocks, number = means.blocks, portfolio.count * portfolio.weight
    cost = np.zeros(portfolio.size) if portfolio.mean_loss is None else portfolio.mean_loss
    result = np.empty((4, portfolio.size))
    result[:, portfolio.row] = (
        number * blocks[0], number * np.sqrt(np.maximum(blocks[1], 0.0)),
        portfolio.count * cost * blocks[0], number * means.block_half,
    )  # fmt: skip
    if events.is_scenario:  # the scatter about the mean, of events that weigh alike
        spread = result[1] ** 2 - result[0] ** 2 / events.event_id.size
        result[1] = np.sqrt(np.maximum(spread, 0.0))
    return result


def _scenario_quantiles(
    events: EventSet,
    groups: Sequence[NDArray[np.intp]],
    parts: Sequence[PartCounts],
    laws: int,
    samples: int,
) -> FloatArray:
    """Return quantiles of failures and losses over all samples of a scenario."""
    if not (events.is_scenario and samples):
        return np.empty(0)
    drawn = np.zeros((laws, events.event_id.size, 2, samples))
    for group, part in zip(groups, parts, strict=True):
        drawn[:, group] = part.quantiles
    weight = np.repeat(events.weight, samples)
    result = np.empty((laws, 2, len(QUANTILES)))
    for law in range(laws):
        for column in range(2):
            values = drawn[law, :, column].ravel()
            order = np.argsort(values, kind="stable")
            reached = np.cumsum(weight[order]) / weight.sum()
            at = [np.searchsorted(reached, q - 1e-12) for q in QUANTILES]
            result[law, column] = values[order[at]]
    return result


def _warnings(
    events: EventSet,
    portfolio: Portfolio,
    laws: tuple[str, ...],
    blocks: FloatArray,
    any_fails: FloatArray,
) -> tuple[str, ...]:
    warnings = [*events.warnings, *portfolio.remarks]
    if len(portfolio.measures) > 1:
        names = " and ".join(name.partition("_")[0].upper() for name in portfolio.measures)
        warnings.append(
            Diagnostic(
                f"the event set has {names} drawn independently given the rupture, although they "
                "are correlated: P from PGV and PGA is 10–50 % too low (unconservative); use PGV "
                "alone",
                "independent_measures",
            )
        )
    if len(laws) > 1:
        why = SEVERAL_MODELS if len(portfolio.models) > 1 else UNKNOWN_TO_MODEL
        text = f"{why}: {BOUNDS_GIVEN} at the shaking of each site"
        warnings.append(Diagnostic(text, "unknown_dependence"))
    elif portfolio.count.sum() > 1:
        text = "the azimuths of the blocks are assumed to be unknown and independent"
        warnings.append(Diagnostic(text, "unknown_azimuths"))
    if np.isnan(any_fails).any():
        text = "joint failures of several blocks are not computed without samples: bounds are given"
        warnings.append(Diagnostic(text, "no_samples"))
    rate, outside = float(blocks[0].sum()), float(blocks[2].sum())
    if rate > 0.0 and outside > NOTABLE * rate:
        warnings.append(
            Diagnostic(
                f"{percent(outside / rate)} of the expected failures come from blocks and shaking "
                "outside the fitted range",
                "extrapolation",
            )
        )
    effective = events.effective_years
    if effective is not None:
        rare = (blocks[0] > 0.0) & (blocks[0] * effective < 1.0)
        if rare.any():
            warnings.append(
                Diagnostic(
                    f"{int(portfolio.count @ rare):,} of {int(portfolio.count.sum()):,} blocks "
                    f"fail less than once in the {effective:,.0f} years of the event set: their "
                    "rates are not resolved",
                    "unresolved_rates",
                )
            )
    return (*warnings, *_weakest_at_thin_shaking(events, portfolio))


def _weakest_at_thin_shaking(events: EventSet, portfolio: Portfolio) -> Iterator[Diagnostic]:
    """Yield a warning where blocks fail under shaking that may be below the cut-off of the engine.

    Its minimum_intensity stands in no file; few rows lie below it.
    """
    is_at_block = np.isin(events.site, portfolio.site)
    if not is_at_block.any() or events.is_scenario:
        return
    name = portfolio.measures[0]
    measure, unit = describe.measures([name]), QUANTITIES[name].unit
    thin = {n: np.full(1, np.quantile(v[is_at_block], _THIN)) for n, v in events.measures.items()}
    p, _ = portfolio.probability(np.arange(portfolio.size), thin, (0.0, 0.0, 0.0))
    if p.max() > NOTABLE:
        yield Diagnostic(
            f"P(failure) of a block is already {percent(float(p.max()))} at {measure} = "
            f"{thin[name][0]:.3g} {unit}, and few ground motions of the event set are weaker: "
            "failures are missing if the minimum_intensity of the job is not far below that value",
            "intensity_cutoff",
        )
