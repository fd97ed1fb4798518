"""How many blocks fail a year by an event set, how often any does, and what it costs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.intervals import quantiles_of
from rbfrag.hazards import between_measures
from rbfrag.hazards.event_counts import (
    PAIRS_AT_ONCE,
    SAMPLES_AT_ONCE,
    Curves,
    EventYears,
    PartCounts,
    SomeYears,
    count_years,
    laws_of,
    shift_error,
)
from rbfrag.hazards.event_means import EventMeans, axes_of, event_means
from rbfrag.hazards.event_set import EventSet
from rbfrag.hazards.joint_rate import BOUNDS_GIVEN, NO_LAW, SEVERAL_MODELS, UNKNOWN_TO_MODEL
from rbfrag.hazards.kernel import interval_end
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.shaking import NOTABLE
from rbfrag.hazards.standing_blocks import DEPENDENT, INDEPENDENT
from rbfrag.hazards.uncertainty import (
    Ends,
    MeanUncertainty,
    branch_ends,
    ends_by_name,
    rate_interval,
    share_interval,
)
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import (
    annual_rate,
    annual_rates,
    confidence,
    count_of,
    interval,
    percent,
    return_period,
    return_periods,
    two_digits,
)
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import by_model, mode_of_kind
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import QUANTITIES

Run = Callable[[Iterator[SomeYears], int, EventYears], Iterator[PartCounts]]
"""Does the parts of the work by `count_years` and yields the results in any order.

Given are the parts, their number, and what all have in common.
"""

EACH_COUNT_TO = 20
"""Numbers of failures up to which each is given; beyond them steps of equal ratio."""

ROWS_SHOWN = 12
"""Rows of an exceedance curve on a terminal; documents have all."""

_OF_YEARS = ("largest_of_year", "sum_of_year", "beyond_effective_time")
_LABEL_WIDTH = 28
_STEPS = 40
_REACHED = 1.0 - 1e-12  # a sum counts as reaching itself
_THIN = 0.05
_QUANTILES = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Exceedance:
    """How often a number of failures, or a loss, is reached.

    Args:
        value: the number of failures, or the loss.
        annual_rate: rate of events that reach it [1/a]; of a scenario its probability.
        counting: both ends of its interval by the counting error of the event set (`rate_interval`,
            of a scenario `share_interval`).
        knowledge: both ends of that by the uncertain parameters of the model.
        branches: rates that 5 and 95 % of the realizations do not exceed; None where that cannot
            be told (:class:`~rbfrag.hazards.uncertainty.MeanUncertainty`).
        largest_of_year: probability that the largest event of a year reaches it; None of a
            scenario.
        sum_of_year: probability that the sum over a year does; None of a scenario.
        beyond_effective_time: whether it is reached less than once in the time that the event set
            covers.
    """

    value: float
    annual_rate: float
    counting: Ends
    knowledge: Ends
    branches: Ends | None
    largest_of_year: float | None
    sum_of_year: float | None
    beyond_effective_time: bool

    @property
    def return_period_years(self) -> float:
        """Mean time between two such events [a]."""
        return 1.0 / self.annual_rate

    def as_dict(self, name: str, *, scenario: bool) -> dict[str, Any]:
        """Return the numbers under the keys of the JSON contract."""
        ends = ends_by_name(
            counting=self.counting, knowledge=self.knowledge, branches=self.branches
        )
        if scenario:
            return {name: self.value, "probability": self.annual_rate, **ends}
        return {
            name: self.value,
            "annual_rate": self.annual_rate,
            **ends,
            "largest_of_year": self.largest_of_year,
            "sum_of_year": self.sum_of_year,
            "return_period_years": self.return_period_years,
            "beyond_effective_time": self.beyond_effective_time,
        }


@dataclass(frozen=True, eq=False, repr=False)
class LossAnswer(Result):
    """What an event set, or a scenario, does to a portfolio of blocks.

    Its table is that of the events (`to_frame`).

    Of an event set all rates are per year; of a scenario they are what is expected, or probable,
    given the event. Errors are standard errors of the counting: another event set as long gives
    another number.

    Args:
        events: the event set.
        portfolio: the blocks.
        samples: samples of each event; 0 for expected values alone.
        seed: of the samples.
        level: confidence level of the intervals.
        laws: how the blocks of one event fail together; several are bounds.
        failures: expected failures of each event, shape (n,).
        loss: expected loss of each event, shape (n,).
        loss_variance: its variance, shape (laws, n); NaN where it was not computed.
        any_fails: probability of any failure, shape (laws, n); NaN likewise.
        bounds: the same under full dependence and independence, shape (2, n).
        block_rates: rate of each row of the table that can be used, its standard error, its
            loss, NaN where it states none, and what the interval of the rate reaches to by the
            parameters of the model, NaN where that is not known, shape (4, rows).
        uncertainty: of each number of the whole portfolio what is not known of it.
        exceedance: how often numbers of failures are reached, by law.
        loss_exceedance: how often losses are.
        quantiles: of failures and of the loss of a scenario at 5, 50 and 95 %, by law, shape
            (laws, 2, 3); empty where there are none.
        warnings: what to know about the answer.
        refused: rows of the table that could not be used, by their index: ``block_id``, ``site_id``
            and ``reason``.
        tau: standard deviation of ln rate between measures, beside all intervals; None where it is
            not known.
    """

    events: EventSet
    portfolio: Portfolio
    samples: int
    seed: int
    level: float
    laws: tuple[str, ...]
    failures: FloatArray
    loss: FloatArray
    loss_variance: FloatArray
    any_fails: FloatArray
    bounds: FloatArray
    block_rates: FloatArray
    uncertainty: Mapping[str, MeanUncertainty]
    exceedance: Mapping[str, tuple[Exceedance, ...]]
    loss_exceedance: Mapping[str, tuple[Exceedance, ...]]
    quantiles: FloatArray
    warnings: tuple[str, ...]
    refused: Mapping[int, Mapping[str, str]] = field(default_factory=dict)
    tau: float | None = None

    def mean(self, values: FloatArray) -> float:
        """Return the weighted sum over the events: a rate [1/a], or a mean given the event."""
        return float(self.events.weight @ values)

    def error(self, values: FloatArray) -> float:
        """Return the standard error of `mean`: that of a sum over a Poisson number of events."""
        own = values - self.mean(values) if self.events.is_scenario else values
        return float(np.sqrt(((self.events.weight * own) ** 2).sum()))

    @property
    def has_losses(self) -> bool:
        """Whether the blocks state what a failure costs."""
        return self.portfolio.loss is not None

    @property
    def kinds(self) -> list[str]:
        """How the blocks of each row fail that can be used."""
        _, first = np.unique(self.portfolio.row, return_index=True)
        return [self.portfolio.models[i].kind for i in self.portfolio.model[first].tolist()]

    @property
    def modes(self) -> list[str]:
        """Failure mode of the blocks of each of these rows."""
        return [mode_of_kind(kind) for kind in self.kinds]

    @property
    def average_annual_failures(self) -> float:
        """Mean number of failures a year [1/a]; of a scenario, given the event."""
        return self.mean(self.failures)

    @property
    def average_annual_loss(self) -> float | None:
        """Mean loss a year, or given the event; None where no loss is stated."""
        return self.mean(self.loss) if self.has_losses else None

    @property
    def annual_rate_any(self) -> float | None:
        """Rate of events with at least one failure [1/a], or its probability given the event.

        None where only bounds are known.
        """
        if len(self.laws) > 1 or np.isnan(self.any_fails).any():
            return None
        return self.mean(self.any_fails[0])

    def sentences(self) -> Iterator[str]:
        """Yield the loss, the expected failures, their uncertainty, and the rate of any failure."""
        for label, text in self._numbers():
            yield f"{label:<{_LABEL_WIDTH}}{text}"
        yield "Uncertainty of expected failures by source (not combined):"
        yield f"  {' · '.join(self._sources())}"

    def _numbers(self) -> Iterator[tuple[str, str]]:
        blocks = count_of(int(self.portfolio.count.sum()), "block")
        failures, rate = self.average_annual_failures, self.annual_rate_any
        if self.events.is_scenario:
            yield "Expected failures", f"{two_digits(failures)} of {blocks}"
            if rate is not None:
                ends = interval(*self.uncertainty["annual_rate_any"].counting)
                yield "P(at least one failure)", f"{percent(rate)}   ({self._sampling(ends)})"
            return
        if self.average_annual_loss is not None:
            yield "Average annual loss", two_digits(self.average_annual_loss)
        events = f"{self.events.effective_years:,.0f}-year event set"
        yield "Expected failures", f"{annual_rate(failures)} /yr    {blocks}, {events}"
        if rate is not None:
            ends = return_periods(*self.uncertainty["annual_rate_any"].counting)
            often = f"return period {return_period(rate)}   ({self._sampling(ends)})"
            yield "At least one failure", often if rate > 0.0 else "none in the event set"

    def _sampling(self, ends: str) -> str:
        return f"{confidence(self.level, ends)}, event-set sampling"

    def _sources(self) -> Iterator[str]:
        """Yield the interval of the expected failures from each source of uncertainty."""
        uncertainty = self.uncertainty["average_annual_failures"]
        sources = {
            "event-set sampling": uncertainty.counting,
            "fragility parameters": uncertainty.knowledge,
            "logic tree": uncertainty.branches,
        }
        for source, ends in sources.items():
            if ends is not None:
                text = "–".join(map(two_digits, ends))
                text = text if self.events.is_scenario else annual_rates(*ends)
                yield f"{source} {text}{' (5th–95th)' if source == 'logic tree' else ''}"
        if self.tau is not None:
            low, high = between_measures.factors_between(self.tau)
            yield f"choice of intensity measure × {low:.2f}–{high:.2f}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the events, their intensity measures, bounds, and the models."""
        number, shaken = self.events.event_id.size, np.unique(self.events.event).size
        yield TextLine("Events", f"{number:,}, of which {shaken:,} have ground motion at a site")
        measures = describe.measures(self.portfolio.measures)
        yield TextLine("Shaking", f"{measures}, component {self.portfolio.component.name}")
        if self.annual_rate_any is None:
            low, high = (self.mean(values) for values in self.bounds)
            if self.events.is_scenario:
                ends = (
                    f"P(at least one failure) {percent(low)} (full dependence) to {percent(high)} "
                    "(independent)"
                )
            else:
                ends = (
                    f"at least one failure: return period {return_period(high)} (independent) to "
                    f"{return_period(low)} (full dependence)"
                )
            yield TextLine("Bounds", ends)
        models = self.portfolio.models
        names = (f"{row.name} ({describe.stored_model(row)})" for row in models)
        yield TextLine("Model", "; ".join(names))

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the exceedance curves and the rows of blocks; all values if verbose.

        Args:
            verbose: with every value and all rows of the curves.
        """
        document = self.as_dict()
        blocks = document.pop("blocks")
        curves = {
            name: document.pop(name)
            for name in [*document]
            if name.startswith(("exceedance", "loss_exceedance"))
        }
        if verbose:
            yield TextTable.of_values(document)
        for curve in curves.values():
            by_law = curve if isinstance(curve, dict) else {"": curve}
            for law, rows in by_law.items():
                if rows:
                    shown = [
                        {"bound": law.replace("_", " ")}
                        | {name: value for name, value in row.items()
                           if verbose or name not in _OF_YEARS}
                        for row in rows[:: 1 if verbose else math.ceil(len(rows) / ROWS_SHOWN)]
                    ]  # fmt: skip
                    yield TextTable.of_rows(shown, verbose=verbose)
        yield TextTable.of_rows(blocks, verbose=verbose)

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        events, scenario = self.events, self.events.is_scenario
        stated: list[tuple[str, str, FloatArray]] = [
            ("average_annual_failures", "expected_failures", self.failures),
            ("annual_rate_any", "probability_any", self.any_fails[0]),
            *([("average_annual_loss", "expected_loss", self.loss)] if self.has_losses else []),
        ]
        means: dict[str, Any] = {}
        for annual, given_event, values in stated:
            mean = getattr(self, annual)
            error = None if mean is None else self.error(values)
            means |= {annual: mean, f"{annual}_error": error}
            if scenario:
                means |= {annual: None, f"{annual}_error": None}
                means |= {given_event: mean, f"{given_event}_error": error}
        if scenario:
            means |= self._quantiles()
        means["between_measures"] = between_measures.as_dict(self.tau)
        means["uncertainty"] = {name: one.as_dict() for name, one in self.uncertainty.items()}
        what = "probability_any" if scenario else "annual_rate_any"
        bounds = {
            name.replace(" ", "_"): {what: self.mean(values)}
            for name, values in zip((DEPENDENT, INDEPENDENT), self.bounds, strict=True)
        }
        duration = events.duration
        names = ", ".join(row.name for row in self.portfolio.models)
        losses = self._exceedance("loss_exceedance", "loss", self.loss_exceedance)
        return {
            "events": int(events.event_id.size),
            "events_with_shaking": int(np.unique(events.event).size),
            "scenario": scenario,
            **means,
            "joint_law": self.laws[0] if len(self.laws) == 1 else NO_LAW,
            "bounds": bounds,
            **self._exceedance("exceedance", "count", self.exceedance),
            **(losses if self.has_losses else {}),
            "investigation_time": None if duration is None else duration.investigation_time,
            "ses_per_logic_tree_path": None if duration is None else duration.ses,
            "realizations": len(events.realization_weights),
            "effective_years": events.effective_years,
            "samples": self.samples or None,
            "seed": self.seed if self.samples else None,
            "level": self.level,
            "how": by_model(names),
            "model": names,
            "term": ", ".join(dict.fromkeys(row.term for row in self.portfolio.models)),
            "kind": ", ".join(dict.fromkeys(row.kind for row in self.portfolio.models)),
            "measures": list(self.portfolio.measures),
            "component": self.portfolio.component.name,
            "blocks": self._blocks(),
            "warnings": list(self.warnings),
        }

    def _exceedance(
        self, key: str, name: str, curves: Mapping[str, tuple[Exceedance, ...]]
    ) -> dict[str, Any]:
        """Return the curve that answers; where only bounds are known an empty one and both."""
        scenario = self.events.is_scenario
        lists = {
            law: [one.as_dict(name, scenario=scenario) for one in curve]
            for law, curve in curves.items()
        }
        if len(lists) <= 1:
            return {key: next(iter(lists.values()), [])}
        by_law = {law.replace(" ", "_"): rows for law, rows in lists.items()}
        return {key: [], f"{key}_bounds": by_law}

    def _quantiles(self) -> dict[str, Any]:
        if not self.quantiles.size:
            return {}
        names = ["failures", "loss"] if self.has_losses else ["failures"]
        result: dict[str, Any] = {}
        for i, name in enumerate(names):
            for q, values in zip(_QUANTILES, self.quantiles[:, i].T.tolist(), strict=True):
                result[f"{name}_p{round(100 * q):02d}"] = values[0] if len(values) == 1 else values
        return result

    def _blocks(self) -> list[dict[str, Any]]:
        """Return one row of answers for each row of the table of blocks."""
        failures, loss = (
            ("expected_failures", "expected_loss")
            if self.events.is_scenario
            else ("average_annual_failures", "average_annual_loss")
        )
        names = (
            "block_id", "site_id", failures, f"{failures}_error", loss, "knowledge_low",
            "knowledge_high", "reason",
        )  # fmt: skip
        rate, error, cost, half = self.block_rates
        ends = (interval_end(rate, half, side) for side in (-1.0, 1.0))
        answered = zip(
            self.portfolio.block_ids, self.portfolio.site_ids,
            *(map(finite_or_none, values.tolist()) for values in (rate, error, cost, *ends)),
            strict=True,
        )  # fmt: skip
        rows: list[dict[str, Any]] = [
            {**dict.fromkeys(names), **self.refused[i]}
            if i in self.refused
            else dict(zip(names, (*next(answered), ""), strict=True))
            for i in range(len(self.portfolio.block_ids) + len(self.refused))
        ]
        for row in rows:
            if not self.has_losses:
                del row[loss]
        return rows

    def table_columns(self) -> dict[str, NDArray[Any]]:
        """Return the table of events, one row each, also of those that shook no site."""
        events = self.events
        columns: dict[str, NDArray[Any]] = {
            "event_id": events.event_id,
            "rlz_id": events.realization,
            "year": events.year,
            "probability" if events.is_scenario else "annual_weight": events.weight,
            "expected_failures": self.failures,
        }
        columns |= self._by_law("probability_any", self.any_fails)
        if self.has_losses:
            columns["expected_loss"] = self.loss
            columns |= self._by_law("loss_variance", self.loss_variance)
        return columns

    def _by_law(self, name: str, values: FloatArray) -> dict[str, NDArray[Any]]:
        if len(self.laws) == 1:
            return {name: values[0]}
        return {
            f"{name}_{law.replace(' ', '_')}": own
            for law, own in zip(self.laws, values, strict=True)
        }


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
    """Return how many blocks fail by an event set, how often any does, and what it costs.

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
        raise InputError(f"samples = {samples}: give a number from 1 to 100000")
    if isinstance(seed, bool) or seed < 0:
        raise InputError(f"seed = {seed}: give a whole number, 0 or more")
    if not 0.0 < level < 1.0:
        raise InputError(f"level = {level:g}: give a level above 0 and below 1, such as 0.95")
    means = event_means(events, portfolio, level) if len(portfolio.measures) == 1 else None
    ends = _ends(portfolio) if samples else (np.empty(0), np.empty(0))
    shifted = shifted_portfolios(portfolio) if samples else ()
    groups = _groups(events, portfolio, samples) if samples or means is None else []
    none = _only(events, np.empty(0, dtype=np.intp))
    common = EventYears(-1, portfolio, none, *ends, samples, seed, shifted)
    parts = (SomeYears(number, _only(events, group)) for number, group in enumerate(groups))
    do: Run = run or (lambda work, _, shared: (count_years(shared, some) for some in work))
    done = 0
    results: dict[int, PartCounts] = {}
    for result in do(parts, len(groups), common) if groups else ():
        results[result.number] = result
        done += groups[result.number].size
        if on_progress is not None:
            on_progress(done, sum(group.size for group in groups))
    return _answer(events, portfolio, ends, groups, results, means, samples, seed, level)


def _groups(events: EventSet, portfolio: Portfolio, samples: int) -> list[NDArray[np.intp]]:
    """Return the events that shake a site with blocks, in parts of whole years."""
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
    cost = pairs[order] / PAIRS_AT_ONCE + samples / SAMPLES_AT_ONCE
    number = np.floor((np.cumsum(cost) - cost)[starts])
    return np.split(order, starts[1:][np.diff(number) > 0])


def _only(events: EventSet, group: NDArray[np.intp]) -> EventSet:
    """Return some of the events with their rows."""
    place = np.full(events.event_id.size, -1)
    place[group] = np.arange(group.size)
    rows = np.flatnonzero(place[events.event] >= 0)
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
    """Return the numbers of failures and the losses that curves are given for."""
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


def _answer(
    events: EventSet,
    portfolio: Portfolio,
    ends: tuple[FloatArray, FloatArray],
    groups: Sequence[NDArray[np.intp]],
    results: Mapping[int, PartCounts],
    means: EventMeans | None,
    samples: int,
    seed: int,
    level: float,
) -> LossAnswer:
    n, laws, order = (
        events.event_id.size,
        laws_of(portfolio),
        [results[i] for i in range(len(groups))],
    )

    def whole(name: str, *shape: int) -> FloatArray:
        values = np.zeros((*shape, n))
        for group, part in zip(groups, order, strict=True):
            values[..., group] = getattr(part, name)
        return values

    if means is None:
        blocks = sum((part.blocks for part in order), np.zeros((3, portfolio.size)))
        unknown = np.full(portfolio.size, np.nan)
        means = EventMeans(
            whole("failures"), whole("loss"), whole("bounds", 2), blocks, unknown, np.nan, np.nan
        )
    any_fails = whole("any_fails", len(laws))
    variance = whole("loss_variance", len(laws)) if order else np.full((len(laws), n), np.nan)
    if not order:  # known without samples alone where no law matters, as of single blocks
        one = means.bounds[:1] if portfolio.count.sum() < 2 else np.full((1, n), np.nan)
        any_fails = means.bounds if len(laws) > 1 else one
    curves = [
        Curves.whole(parts) if parts else None
        for parts in ([part.counts for part in order], [part.losses for part in order])
    ]
    exceedance, loss_exceedance = (
        {law: _curve(events, curve, end, i, len(laws), level) for i, law in enumerate(laws)}
        if samples
        else {}
        for curve, end in zip(curves, ends, strict=True)
    )
    of_any = curves[0].events[0, :, 0] if curves[0] and ends[0].size else np.empty(0)
    stated = {
        "average_annual_failures": (means.failures, means.failures_half),
        "average_annual_loss": (means.loss, means.loss_half),
        "annual_rate_any": (
            any_fails[0],
            events.weight @ any_fails[0] * _half_of(of_any, len(laws), level),
        ),
    }
    if portfolio.loss is None:
        del stated["average_annual_loss"]
    return LossAnswer(
        events, portfolio, samples, seed, level, laws,
        failures=means.failures,
        loss=means.loss,
        loss_variance=variance,
        any_fails=any_fails,
        bounds=means.bounds,
        block_rates=_of_rows(events, portfolio, means),
        uncertainty={
            name: MeanUncertainty.of(events, values, half, level)
            for name, (values, half) in stated.items()
            if name != "annual_rate_any" or (len(laws) == 1 and not np.isnan(values).any())
        },
        exceedance=exceedance,
        loss_exceedance=loss_exceedance,
        quantiles=_scenario_quantiles(events, groups, order, len(laws), samples),
        warnings=_warnings(events, portfolio, laws, means.blocks, any_fails),
    )  # fmt: skip


def shifted_portfolios(portfolio: Portfolio) -> tuple[Portfolio, ...]:
    """Return the portfolio by models one standard deviation away along each axis of their errors.

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


def _half_of(rates: FloatArray, laws: int, level: float) -> float:
    """Return how far the interval of a rate reaches, as a part of it; rates as `shift_error`."""
    if laws > 1 or rates.size < 2:
        return np.nan
    return float(shift_error(rates) * quantiles_of(level).normal)


def _curve(
    events: EventSet, curve: Curves | None, ends: FloatArray, law: int, laws: int, level: float
) -> tuple[Exceedance, ...]:
    """Return the numbers that are reached at all, each with its intervals."""
    if curve is None:
        return ()
    widest = float(events.weight.max())
    effective, alike = events.effective_years, float((events.weight**2).sum())
    errors = shift_error(curve.events[0, law::laws]) * quantiles_of(level).normal
    rows = []
    for k, end in enumerate(ends.tolist()):
        rate, squares = curve.events[:, law, k].tolist()
        if rate <= 0.0:
            break
        low, high = (interval_end(np.array(rate), rate * errors[k], side) for side in (-1.0, 1.0))
        known = float(low), float(high)
        if effective is None:
            counting = share_interval(rate, squares - rate * rate * alike, alike, level)
            known = known[0], min(known[1], 1.0)
            rows.append(Exceedance(end, rate, counting, known, None, None, None, False))
            continue
        counting = rate_interval(rate, squares, widest, level)
        largest, total = (float(years[0, law, k]) for years in (curve.largest, curve.sum))
        over = branch_ends(events, curve.realizations[..., k]) if law == 0 else None
        rare = rate * effective < 1.0
        rows.append(Exceedance(end, rate, counting, known, over, largest, total, rare))
    return tuple(rows)


def _of_rows(events: EventSet, portfolio: Portfolio, means: EventMeans) -> FloatArray:
    """Return the rate of each row of the table, its error, its loss, and its interval's half."""
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
    result = np.empty((laws, 2, len(_QUANTILES)))
    for law in range(laws):
        for what in range(2):
            values = drawn[law, :, what].ravel()
            order = np.argsort(values, kind="stable")
            reached = np.cumsum(weight[order]) / weight.sum()
            at = [np.searchsorted(reached, q - 1e-12) for q in _QUANTILES]
            result[law, what] = values[order[at]]
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
                f"{percent(outside / rate)} of the failures come from blocks and shaking outside "
                "the fitted range",
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
    """Yield a warning where blocks fail at shaking that the engine may have left out.

    Its minimum_intensity stands in no file; few rows lie below it.
    """
    here = np.isin(events.site, portfolio.site)
    if not here.any() or events.is_scenario:
        return
    name = portfolio.measures[0]
    measure, unit = describe.measures([name]), QUANTITIES[name].unit
    thin = {n: np.full(1, np.quantile(v[here], _THIN)) for n, v in events.measures.items()}
    p, _ = portfolio.probability(np.arange(portfolio.size), thin, (0.0, 0.0, 0.0))
    if p.max() > NOTABLE:
        yield Diagnostic(
            f"P(failure) of a block is already {percent(float(p.max()))} at {measure} = "
            f"{thin[name][0]:.3g} {unit}, and few ground motions of the event set are weaker: "
            "failures are missing if the minimum_intensity of the job is not far below that value",
            "intensity_cutoff",
        )
