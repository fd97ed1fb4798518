"""Annual rates of failure: the answer of `hazard`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import describe
from rbfrag.hazards.curve import NOTABLE_FACTOR, HazardCurve, is_truncated, rate_bounds
from rbfrag.hazards.joint_rate import JointRate
from rbfrag.hazards.rate_density import Indices
from rbfrag.hazards.shaking import between_measures, between_measures_text
from rbfrag.results.numbers import (
    NEVER,
    SMALLEST,
    annual_rate,
    annual_rates,
    confidence,
    equals,
    interval,
    percent,
    return_period,
    return_periods,
    with_interval,
    years,
)
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import by_model, mode_of_kind
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import FloatArray

ROWS_SHOWN = 20
"""Blocks that a terminal lists; documents and written tables have all."""

SHORTEST_SHOWN = 3
"""Blocks that are named by their return periods."""

SMALLEST_FRACTION = 5e-4
"""Contributions below this fraction of a rate are not printed."""


@dataclass(frozen=True, eq=False)
class BranchRate:
    """Rates of failure under one of several hazard curves.

    Args:
        name: the branch or statistic that the curve is of, or where it comes from.
        weight: its weight; None for a curve that is no branch.
        annual_rate: rates of the blocks [1/a], shape (m,).
        expected: mean number of failures a year of all blocks [1/a].
    """

    name: str
    weight: float | None
    annual_rate: FloatArray
    expected: float

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        return {
            "name": self.name, "weight": self.weight, "expected_failures_per_year": self.expected,
        }  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class HazardAnswer(Result):
    """Annual rates of failure of m blocks at the sites of some hazard curves.

    Args:
        annual_rate: mean number of failures a year [1/a], shape (m,); NaN for a block that
            cannot be used.
        ci_low: lower end of the interval from the uncertain parameters of the model.
        ci_high: upper end of it.
        logic_tree_low: rate that 5 % of the branches of a logic tree do not exceed, by their
            weights; NaN without weights.
        logic_tree_high: the same of 95 %.
        numerical_error: how far quadrature may be off, relative to the rates, shape (m,).
        probability: probability of at least one failure in `years`, shape (m,).
        years: the period [a].
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        site: index of the site of each block among `curves`, shape (m,).
        curves: the curve of each site that answers, or the first of its branches.
        edges: levels of the curve's measure between which contributions are given, (k + 1,).
        contribution: part of the rate of the one block or class from each interval [1/a], shape
            (1, k); without rows for several blocks.
        above: part from beyond the last level, at least [1/a], shape (m,).
        above_at_most: the same at most.
        below: probability of failure at the first level of the curve, shape (m,).
        measure: measure of `edges`: ``pga_g``, ``pgv_m_s`` or ``sa_g``.
        joints: of each site earthquakes with at least one failure among its blocks; None where
            that is not asked for, or there is one block.
        curve_kind: what of a logic tree the curve is (mean, quantile-0.84, rlz-001), the weighted
            branches, or None where that is not stated.
        branches: what each of several curves says; empty for one.
        quantiles: quantiles of the rates over branches with weights and the parameters of the
            model together, by their probability, shape (m,) each; empty without weights.
        total_low: lower end of the interval of the sum of all rates, from the model's parameters,
            which all blocks have in common [1/a].
        total_high: upper end of it.
        warnings: what to know about the answer.
        reason: why a block cannot be used, shape (m,); empty text elsewhere.
        kinds: how each block fails, shape (m,); empty text where it cannot be used.
        count: number of identical blocks of each row, shape (m,).
        tau: standard deviation of ln rate between measures, in no interval; None where it is
            not known.
        drained: rates of the blocks without water pressure [1/a], shape (m,), NaN where they have
            none; None where all blocks are dry.
        names: identifiers of the blocks; empty where they have none.
        rejected: rows of the table of blocks that have no answer, by their index: ``block_id``,
            ``site_id`` and ``reason``.
        block_text: description of the block; empty for several.
    """

    annual_rate: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    logic_tree_low: FloatArray
    logic_tree_high: FloatArray
    numerical_error: FloatArray
    probability: FloatArray
    years: float
    level: float
    model: str
    term: str
    method: str
    site: Indices
    curves: tuple[HazardCurve, ...]
    edges: FloatArray
    contribution: FloatArray
    above: FloatArray
    above_at_most: FloatArray
    below: FloatArray
    measure: str
    joints: tuple[JointRate | None, ...]
    curve_kind: str | None
    branches: tuple[BranchRate, ...]
    quantiles: Mapping[float, FloatArray]
    total_low: float
    total_high: float
    warnings: tuple[str, ...]
    reason: NDArray[np.object_]
    kinds: NDArray[np.object_]
    count: FloatArray
    tau: float | None = None
    drained: FloatArray | None = None
    names: tuple[str | None, ...] = ()
    rejected: Mapping[int, Mapping[str, str]] = field(default_factory=dict)
    block_text: str = ""

    @property
    def modes(self) -> NDArray[np.object_]:
        """Failure mode of each block, shape (m,)."""
        return np.array([mode_of_kind(kind) for kind in self.kinds], dtype=object)

    @property
    def joint(self) -> JointRate | None:
        """Joint failures of the blocks of the first site; None if not requested."""
        return self.joints[0]

    @property
    def annual_rate_any(self) -> float | None:
        """Annual rate of earthquakes with at least one failure at the one site [1/a].

        None for several blocks unless their joint answer is asked for, and where their dependence
        is not known: `joint` has its bounds.
        """
        if len(self.curves) > 1:
            return None
        if self.joint is not None:
            return self.joint.annual_rate_any
        indices = np.flatnonzero(~np.isnan(self.annual_rate))
        alone = indices.size == 1 and self.count[indices[0]] == 1.0
        return float(self.annual_rate[indices[0]]) if alone else None

    @property
    def expected_failures_per_year(self) -> float:
        """Expected failures per year of all blocks [1/a]: Σ count · rate of the answered blocks."""
        return float(np.nansum(self.count * self.annual_rate))

    @property
    def upper_bound(self) -> FloatArray:
        """Upper bounds of the rates [1/yr], shape (m,); see :func:`rate_bounds`."""
        return rate_bounds(self.annual_rate, self.above, self.above_at_most, self.below)

    @property
    def expected_failures_upper_bound(self) -> float | None:
        """Upper bound of `expected_failures_per_year`; None where that of a block is unknown."""
        has_rate = ~np.isnan(self.annual_rate)
        return finite_or_none(float((self.count * self.upper_bound)[has_rate].sum()))

    @property
    def _is_truncated(self) -> NDArray[np.bool_]:
        """True where the rate is a range because the curve ends or begins too early, shape (m,)."""
        return is_truncated(self.annual_rate, self.upper_bound)

    def return_period_text(self, index: int) -> str:
        """Return the return period of a block, "840 years", or its range if the curve is too short.

        Args:
            index: which of the blocks.
        """
        rate, bound = float(self.annual_rate[index]), float(self.upper_bound[index])
        if not self._is_truncated[index]:
            return return_period(rate)
        if math.isnan(bound):
            return f"at most {return_period(rate)}"
        if rate > NEVER:
            return f"between {years(bound)} and {return_period(rate)}"
        return f"at least {return_period(bound)}"

    @property
    def rate_columns(self) -> dict[str, FloatArray]:
        """The rates and their uncertainty under the names of tables and JSON, shape (m,) each."""
        columns = {
            "annual_rate": self.annual_rate,
            "annual_rate_upper_bound": self.upper_bound,
            "ci_low": self.ci_low,
            "ci_high": self.ci_high,
            "numerical_error": self.numerical_error,
            "probability": self.probability,
        }
        if self.drained is not None:
            columns["drained_annual_rate"] = self.drained
        if self.quantiles:
            columns |= {
                "logic_tree_low": self.logic_tree_low,
                "logic_tree_high": self.logic_tree_high,
            }
        for q, values in self.quantiles.items():
            columns[f"annual_rate_p{round(100.0 * q):02d}"] = values
        return columns

    def fractions_between(self, levels: FloatArray) -> FloatArray:
        """Return the fractions of the first block's rate from shaking between levels.

        Of weighted branches they are those of the mean rate.
        """
        rate = max(float(self.annual_rate[0]), np.finfo(float).tiny)
        below = np.append(0.0, self.contribution[0].cumsum()) / rate
        return np.diff(np.interp(np.log(levels), np.log(self.edges), below))

    @property
    def _is_single(self) -> bool:
        return self.annual_rate.size == 1 and not self.rejected

    def sentences(self) -> Iterator[str]:
        """Yield the return period of one block, or the expected failures of several."""
        yield from self._of_one_block() if self._is_single else self._of_all_blocks()
        bound = self.expected_failures_upper_bound
        has_interval = (
            not self._is_truncated[0] and float(self.ci_high[0]) > NEVER
            if self._is_single
            else bound is not None and bound <= NOTABLE_FACTOR * self.expected_failures_per_year
        )
        if self.tau is not None and has_interval:
            yield between_measures_text(self.tau)

    def _of_one_block(self) -> Iterator[str]:
        rate, bound, low, high, chance = (
            float(values[0])
            for values in (
                self.annual_rate, self.upper_bound, self.ci_low, self.ci_high, self.probability,
            )
        )  # fmt: skip
        in_years = f"P(failure in {self.years:g} years)"
        period = f"Return period of failure {self.return_period_text(0)}"
        if not self._is_truncated[0]:
            ends = confidence(self.level, return_periods(low, high))
            chances = [1.0 - math.exp(-end * self.years) for end in (low, high)]
            yield period + (f"   ({ends})" if high > NEVER else "")
            yield (
                f"Mean annual rate {annual_rate(rate)} /yr; "
                f"{equals(in_years, with_interval(chance, *chances))}"
            )
        elif math.isnan(bound):
            yield f"{period}: the hazard curve begins at {self.curves[0].level_text(0)}"
            yield (
                f"Mean annual rate at least {annual_rate(rate)} /yr; {in_years} at least "
                f"{percent(chance)}"
            )
        else:
            yield f"{period}: the hazard curve ends at {self.curves[0].level_text(-1)}"
            most = 1.0 - math.exp(-bound * self.years)
            most = 1.0 if most > 1.0 - SMALLEST else most
            yield (
                f"Mean annual rate {annual_rates(rate, bound)} /yr; {in_years} = "
                f"{interval(chance, most)}"
                if rate > NEVER
                else f"Mean annual rate at most {annual_rate(bound)} /yr; {in_years} at most "
                f"{percent(most)}"
            )
        if self.drained is not None and self.drained[0] >= 0.0:
            yield f"Drained return period {return_period(float(self.drained[0]))}"

    def _of_all_blocks(self) -> Iterator[str]:
        size, sites = int(self.count.sum()), len(self.curves)
        expected, bound = self.expected_failures_per_year, self.expected_failures_upper_bound
        blocks = f"{size:,} blocks{f' at {sites:,} sites' if sites > 1 else ''}"
        at_most = ""
        if bound is None:
            at_most = "at most "
            yield (
                f"Expected failures at least {annual_rate(expected)} /yr of {blocks}: a block "
                "fails below the first level of its hazard curve"
            )
        elif bound > NOTABLE_FACTOR * expected:
            at_most = "at most "
            text = annual_rates(expected, bound)
            yield f"Expected failures {text} /yr of {blocks}: the hazard curve ends too early"
        else:
            ends = confidence(self.level, annual_rates(self.total_low, self.total_high))
            yield f"Expected failures {annual_rate(expected)} /yr of {blocks}   ({ends})"
        for curve, joint in zip(self.curves, self.joints, strict=True):
            if joint is not None:
                place = f"{curve.place}: at" if curve.place else "At"
                yield f"{place} least one failure: {self._of_any_failure(joint, at_most)}"
        names, order = self._names(), np.argsort(-np.nan_to_num(self.annual_rate), kind="stable")
        shortest = [
            f"{names[i] or f'block {i + 1}'} ({self.return_period_text(i)})"
            for i in order[:SHORTEST_SHOWN].tolist()
        ]
        yield f"Shortest return periods: {', '.join(shortest)}"

    def _of_any_failure(self, joint: JointRate, at_most: str) -> str:
        in_years = f"P in {self.years:g} years"
        rate, chance, ends = joint.annual_rate_any, joint.probability_any, joint.annual_rate_any_ci
        if rate is None or chance is None or ends is None:
            least, most = (
                percent(joint.bounds[name]["probability_any"])
                for name in ("fully_dependent", "independent")
            )
            return f"{in_years} from {least} (full dependence) to {most} (independence)"
        if at_most:
            return f"return period at most {return_period(rate)}"
        period = f"return period {return_period(rate)}; {equals(in_years, percent(chance))}"
        return f"{period}   ({confidence(self.level, f'{return_periods(*ends)} years')})"

    def _names(self) -> tuple[str | None, ...]:
        return self.names or (None,) * self.annual_rate.size

    def lines(self) -> Iterator[TextLine]:
        """Yield the hazard curve, the block, the period and the model."""
        curve = self.curves[0]
        place = curve.place if len(self.curves) == 1 else ""
        source = "" if self.branches or len(self.curves) > 1 else Path(curve.source).name
        curve_parts = (curve.imt, source, place, self.curve_kind)
        yield TextLine("Curve", ", ".join(filter(None, curve_parts)))
        if self.block_text:
            yield TextLine("Block", self.block_text)
        if self.quantiles and self._is_single:
            low, high = float(self.logic_tree_low[0]), float(self.logic_tree_high[0])
            periods = return_periods(low, high)
            yield TextLine(
                "Branches", f"return period {periods} years (5th–95th percentile of the logic tree)"
            )
        if not self._is_single:
            yield TextLine("Period", f"{self.years:g} years, of the column probability")
        yield TextLine("Model", describe.named_model(vars(self)))
        rows = self.annual_rate.size + len(self.rejected)
        if not self._is_single and rows > ROWS_SHOWN:
            yield TextLine("Blocks", f"{rows:,}, of which the first {ROWS_SHOWN} are listed")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield contributions of the shaking, branches and rows of blocks; all values if verbose.

        Args:
            verbose: with every value and every row.
        """
        document = self.as_dict()
        rows = document.get("blocks", [])
        if verbose:
            yield TextTable.of_values(document)
        if self._is_single and self.annual_rate[0] > 0.0:
            curve = self.curves[0]
            headers = (f"{curve.imt} [{curve.unit}]", "percentage of the rate")
            yield TextTable(headers, self._contributions())
        omitted = {"numerical_error"}
        if not self._is_truncated.any():
            omitted.add("annual_rate_upper_bound")
        if verbose:
            omitted.clear()
        shown = [
            {
                name if name != "drained" else "drained_annual_rate": (
                    value["annual_rate"] if name == "drained" and value else value
                )
                for name, value in row.items()
                if name not in omitted
            }
            for row in (rows if verbose else rows[:ROWS_SHOWN])
        ]
        counts = [
            {name: value for name, value in row.items() if name not in omitted}
            for row in document.get("annual_rate_at_least") or ()
        ]
        for table in (counts, document.get("branches"), shown):
            if table:
                yield TextTable.of_rows(table, verbose=verbose)

    def _contributions(self) -> list[list[object]]:
        """Return the percentages of the rate between the levels of the curve."""
        levels = self.curves[0].levels
        rows: list[list[object]] = [
            [f"{low:.3g}–{high:.3g}", round(100.0 * part, 1)]
            for low, high, part in zip(
                levels[:-1], levels[1:], self.fractions_between(levels).tolist(), strict=True
            )
            if part >= SMALLEST_FRACTION
        ]
        beyond = float(self.above[0] / self.annual_rate[0])
        if beyond >= SMALLEST_FRACTION:
            last = f"{levels[-1]:.3g}"
            rows.append([f"> {last}, with P(failure) at {last}", round(100.0 * beyond, 1)])
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract.

        One block is an object with its contributions. Several are a list, with their joint
        rates, at several sites one for each; rejected rows have no numbers.
        """
        sites = [curve.place or None for curve in self.curves]
        columns = self.rate_columns
        rows: list[dict[str, Any]] = [
            {"site": sites[site], "block_id": name, **dict(zip(columns, values, strict=True))}
            for site, name, *values in zip(
                self.site.tolist(), self._names(),
                *(map(finite_or_none, column.tolist()) for column in columns.values()),
                strict=True,
            )
        ]  # fmt: skip
        for row in rows:
            bound = row.pop("drained_annual_rate", None)
            row["drained"] = None if bound is None else {"annual_rate": bound}
        shared = {
            "years": self.years,
            "level": self.level,
            "how": by_model(self.model),
            "model": self.model,
            "term": self.term,
            "method": self.method,
            "imt": self.curves[0].imt,
            "curve_kind": self.curve_kind,
            "between_measures": between_measures(self.tau),
        }
        if self.branches:
            shared["branches"] = [branch.as_dict() for branch in self.branches]
        warnings = list(self.warnings)
        if not self._is_single:
            # the joint rates of each site and the sums over all blocks
            common: dict[str, Any] = {"annual_rate_any": self.annual_rate_any}
            if len(sites) == 1:
                joint = {} if self.joint is None else self.joint.as_dict()
                common = {"site": sites[0], **common, **joint}
            elif any(self.joints):
                common["sites"] = [
                    {"site": site, **of_site.as_dict()}
                    for site, of_site in zip(sites, self.joints, strict=True)
                    if of_site is not None
                ]
            return {
                **common,
                "expected_failures_per_year": self.expected_failures_per_year,
                "expected_failures_upper_bound": self.expected_failures_upper_bound,
                "expected_failures_low": self.total_low,
                "expected_failures_high": self.total_high,
                **shared,
                "blocks": self._with_rejected(rows),
                "warnings": warnings,
            }
        del rows[0]["block_id"]
        contributions = [
            {"from": low, "to": high, "annual_rate": part}
            for low, high, part in zip(
                self.edges[:-1].tolist(), self.edges[1:].tolist(),
                self.contribution[0].tolist(), strict=True,
            )
        ]  # fmt: skip
        return {**rows[0], **shared, "contributions": contributions, "warnings": warnings}

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns of the table, one row a block."""
        columns = super().table_columns()
        return {name: value for name, value in columns.items() if name != "block_text"}

    def _with_rejected(self, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Return the rows with their reasons, the rejected ones among them."""
        empty = dict.fromkeys(rows[0])
        answered = iter([{**row, "reason": ""} for row in rows])
        rejected = {
            i: {**empty, "site": about.get("site_id"), "block_id": about["block_id"],
                "reason": about["reason"]}
            for i, about in self.rejected.items()
        }  # fmt: skip
        indices = range(max(len(rows) + len(rejected), *rejected, 0) + 1)
        merged = (rejected[i] if i in rejected else next(answered, None) for i in indices)
        return [row for row in merged if row is not None]
