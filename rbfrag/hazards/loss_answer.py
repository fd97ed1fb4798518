"""Failures and losses by an event set: the answer of `losses`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import describe
from rbfrag.hazards.event_set import (
    QUANTILES,
    SOURCES,
    TOLERANCE,
    Ends,
    EventSet,
    MeanUncertainty,
    ends_by_name,
)
from rbfrag.hazards.joint_rate import DEPENDENT, INDEPENDENT, NO_LAW
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.rate_integration import interval_end
from rbfrag.hazards.shaking import between_measures, factors_between
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
    years,
)
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import by_model, mode_of_kind
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import FloatArray

ROWS_SHOWN = 12
"""Rows of an exceedance curve on a terminal; documents have all."""

_LABEL_WIDTH = 28


@dataclass(frozen=True)
class Exceedance:
    """Annual rate of exceedance of a number of failures, or of a loss.

    Args:
        value: the number of failures, or the loss.
        annual_rate: rate of events that reach it [1/a]; of a scenario its probability.
        event_set_sampling: both ends of its interval by event-set sampling.
        fragility: both ends of that by the parameters of the fragility model.
        logic_tree: 5th and 95th percentile over the realizations; None where these cannot be
            distinguished (:class:`~rbfrag.hazards.event_set.MeanUncertainty`).
        largest_of_year: probability that the largest event of a year reaches it; None of a
            scenario.
        sum_of_year: probability that the sum over a year does; None of a scenario.
        beyond_effective_time: whether it is reached less than once in the time that the event set
            covers.
    """

    value: float
    annual_rate: float
    event_set_sampling: Ends
    fragility: Ends
    logic_tree: Ends | None
    largest_of_year: float | None
    sum_of_year: float | None
    beyond_effective_time: bool

    @property
    def return_period_years(self) -> float:
        """Mean time between two such events [a]."""
        return 1.0 / self.annual_rate

    def as_dict(self, name: str, *, scenario: bool) -> dict[str, Any]:
        """Return the numbers under the keys of the JSON contract."""
        ends = ends_by_name(self)
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

    def as_text(self, name: str, *, scenario: bool) -> dict[str, object]:
        """Return the cells that a terminal shows, by the header of their column."""
        rates = interval if scenario else annual_rates
        rate: dict[str, object] = {"probability": percent(self.annual_rate)}
        if not scenario:
            period = years(self.annual_rate)
            rate = {
                "rate [1/yr]": annual_rate(self.annual_rate),
                "return period [yr]": f"{period} (beyond)"
                if self.beyond_effective_time
                else period,
            }
        intervals = {source: getattr(self, key) for key, source in SOURCES.items()}
        return {
            name: two_digits(self.value) if name == "loss" else f"{self.value:g}",
            **rate,
            **{source: ends and rates(*ends) for source, ends in intervals.items()},
        }


@dataclass(frozen=True, eq=False, repr=False)
class LossAnswer(Result):
    """Failures and losses of a portfolio of blocks under an event set or a scenario.

    Its table is that of the events (`to_frame`).

    Of an event set all rates are per year; of a scenario they are what is expected, or probable,
    given the event. Errors are standard errors by event-set sampling: another event set as long
    gives another number.

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
        rejected: unusable rows of the table, by their index: ``block_id``, ``site_id`` and
            ``reason``.
        tau: standard deviation of ln rate between measures, in no interval; None where it is
            unknown.
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
    rejected: Mapping[int, Mapping[str, str]] = field(default_factory=dict)
    tau: float | None = None

    def mean(self, values: FloatArray) -> float:
        """Return the weighted sum over the events: a rate [1/a], or a mean given the event."""
        return float(self.events.weight @ values)

    def error(self, values: FloatArray) -> float:
        """Return the standard error of `mean`: that of a sum over a Poisson number of events."""
        deviations = values - self.mean(values) if self.events.is_scenario else values
        return float(np.sqrt(((self.events.weight * deviations) ** 2).sum()))

    @property
    def has_losses(self) -> bool:
        """True if the blocks have losses."""
        return self.portfolio.loss is not None

    @property
    def kinds(self) -> list[str]:
        """Failure kind of each answered row."""
        _, first = np.unique(self.portfolio.row, return_index=True)
        return [self.portfolio.models[i].kind for i in self.portfolio.model[first].tolist()]

    @property
    def modes(self) -> list[str]:
        """Failure mode of each answered row."""
        return [mode_of_kind(kind) for kind in self.kinds]

    @property
    def average_annual_failures(self) -> float:
        """Mean number of failures a year [1/a]; of a scenario, given the event."""
        return self.mean(self.failures)

    @property
    def average_annual_loss(self) -> float | None:
        """Mean loss per year, or given the event; None without losses."""
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
        sources, uncertainty = [], self.uncertainty["average_annual_failures"]
        for key, source in SOURCES.items():
            if (ends := getattr(uncertainty, key)) is not None:
                text = "–".join(map(two_digits, ends))
                text = text if self.events.is_scenario else annual_rates(*ends)
                sources.append(f"{source} {text}{' (5th–95th)' if key == 'logic_tree' else ''}")
        if self.tau is not None:
            low, high = factors_between(self.tau)
            sources.append(f"choice of intensity measure, rate × {low:.2f}–{high:.2f}")
        yield f"  {' · '.join(sources)}"

    def _numbers(self) -> Iterator[tuple[str, str]]:
        blocks = count_of(int(self.portfolio.count.sum()), "block")
        failures, rate = self.average_annual_failures, self.annual_rate_any
        if self.events.is_scenario:
            yield "Expected failures", f"{two_digits(failures)} of {blocks}"
            if rate is not None:
                ends = interval(*self.uncertainty["annual_rate_any"].event_set_sampling)
                yield "P(at least one failure)", f"{percent(rate)}   ({self._sampling(ends)})"
            return
        if self.average_annual_loss is not None:
            yield "Average annual loss", two_digits(self.average_annual_loss)
        events = f"{self.events.effective_years:,.0f}-year event set"
        yield "Expected failures", f"{annual_rate(failures)} /yr    {blocks}, {events}"
        if rate is not None:
            ends = return_periods(*self.uncertainty["annual_rate_any"].event_set_sampling)
            often = f"return period {return_period(rate)}   ({self._sampling(ends)})"
            yield "At least one failure", often if rate > 0.0 else "none in the event set"

    def _sampling(self, ends: str) -> str:
        return f"{confidence(self.level, ends)}, event-set sampling"

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
        if verbose:
            values = {name: value for name, value in document.items() if "exceedance" not in name}
            yield TextTable.of_values(values)
        scenario, effective = self.events.is_scenario, self.events.effective_years
        how_often = "Probability" if scenario else "Annual rate of events"
        for name, of, curves in (
            ("count", "so many failures", self.exceedance),
            ("loss", "such a loss", self.loss_exceedance),
        ):
            for law, curve in curves.items():
                if not curve:
                    continue
                title = f"{how_often} with at least {of}{f', {law}' if len(curves) > 1 else ''}"
                step = 1 if verbose else math.ceil(len(curve) / ROWS_SHOWN)
                listed = curve[::step]
                if any(row.beyond_effective_time for row in listed):
                    title += f" (beyond: rarer than the {effective:,.0f}-year event set resolves)"
                shown = [
                    (row.as_dict if verbose else row.as_text)(name, scenario=scenario)
                    for row in listed
                ]
                yield TextTable.of_rows(shown, verbose=verbose, title=title)
        yield TextTable.of_rows(blocks, verbose=verbose, title="Rows of the table of blocks")

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        events, scenario = self.events, self.events.is_scenario
        quantities: list[tuple[str, str, FloatArray]] = [
            ("average_annual_failures", "expected_failures", self.failures),
            ("annual_rate_any", "probability_any", self.any_fails[0]),
            *([("average_annual_loss", "expected_loss", self.loss)] if self.has_losses else []),
        ]
        means: dict[str, Any] = {}
        for annual, given_event, values in quantities:
            mean = getattr(self, annual)
            error = None if mean is None else self.error(values)
            means |= {annual: mean, f"{annual}_error": error}
            if scenario:
                means |= {annual: None, f"{annual}_error": None}
                means |= {given_event: mean, f"{given_event}_error": error}
        if scenario:
            drawn = ("failures", "loss") if self.has_losses else ("failures",)
            for i, name in enumerate(drawn if self.quantiles.size else ()):
                for q, by_law in zip(QUANTILES, self.quantiles[:, i].T.tolist(), strict=True):
                    key = f"{name}_p{round(100 * q):02d}"
                    means[key] = by_law[0] if len(by_law) == 1 else by_law
        means["between_measures"] = between_measures(self.tau)
        means["uncertainty"] = [
            row for name, mean in self.uncertainty.items() for row in mean.as_dicts(name)
        ]
        key = "probability_any" if scenario else "annual_rate_any"
        bounds = {
            name.replace(" ", "_"): {key: self.mean(values)}
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
            "tolerance": TOLERANCE if self.samples else None,
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
        """Return the exceedance curve; an empty one and both bounds without a dependence model."""
        scenario = self.events.is_scenario
        lists = {
            law: [point.as_dict(name, scenario=scenario) for point in curve]
            for law, curve in curves.items()
        }
        if len(lists) <= 1:
            return {key: next(iter(lists.values()), [])}
        by_law = {law.replace(" ", "_"): rows for law, rows in lists.items()}
        return {key: [], f"{key}_bounds": by_law}

    def _blocks(self) -> list[dict[str, Any]]:
        """Return one row of answers for each row of the table of blocks."""
        failures, loss = (
            ("expected_failures", "expected_loss")
            if self.events.is_scenario
            else ("average_annual_failures", "average_annual_loss")
        )
        names = (
            "block_id", "site_id", failures, f"{failures}_error", loss, "fragility_low",
            "fragility_high", "reason",
        )  # fmt: skip
        rate, error, cost, half = self.block_rates
        ends = (interval_end(rate, half, side) for side in (-1.0, 1.0))
        answered = zip(
            self.portfolio.block_ids, self.portfolio.site_ids,
            *(map(finite_or_none, values.tolist()) for values in (rate, error, cost, *ends)),
            strict=True,
        )  # fmt: skip
        rows: list[dict[str, Any]] = [
            {**dict.fromkeys(names), **self.rejected[i]}
            if i in self.rejected
            else dict(zip(names, (*next(answered), ""), strict=True))
            for i in range(len(self.portfolio.block_ids) + len(self.rejected))
        ]
        for row in rows:
            if not self.has_losses:
                del row[loss]
        return rows

    def table_columns(self) -> dict[str, NDArray[Any]]:
        """Return the table of events, one row each, including events without shaking at a site."""
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
            f"{name}_{law.replace(' ', '_')}": row
            for law, row in zip(self.laws, values, strict=True)
        }
