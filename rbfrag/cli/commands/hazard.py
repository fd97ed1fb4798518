"""`rbfrag hazard`: how often per year blocks topple."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, cast

from rbfrag.cli.commands.simulate import WorkerOptions
from rbfrag.cli.hazard_sentences import most_often, rounded_values
from rbfrag.cli.output import (
    check_files,
    print_json,
    print_pairs,
    print_rows,
    print_table,
    print_warnings,
    write_table,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions
from rbfrag.cli.parameters.stack import Given, argument, fields_of, option, stacked
from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.hazards.report import range_in_words, rate_in_words
from rbfrag.results.diagnostic import diagnostics
from rbfrag.results.numbers import confidence, percent, return_period
from rbfrag.vocabulary.quantities import BLOCK, QUANTITIES, WHOLE

if TYPE_CHECKING:
    from rbfrag.hazards.answer import HazardAnswer
    from rbfrag.hazards.curve import CurveKeywords
    from rbfrag.question.fields import AnsweringFields

SHORT = (
    "site", "annual_rate", "ci_low", "ci_high", "annual_rate_any", "expected_failures_per_year",
    "expected_failures_low", "expected_failures_high", "branches_low", "branches_high",
    "probability", "probability_any", "years", "model", "imt", "curve_kind",
)  # fmt: skip
"""Values that are shown without --verbose."""

MOST_ROWS = 20
"""Blocks that people are shown; JSON and tables have all."""

EXAMPLE = (
    "Example:  rbfrag hazard pgv-curve.csv --height 2.4 --width 0.5 --dip 3 --component rotd50"
)


@dataclass(frozen=True, kw_only=True)
class RateOptions:
    """Which rates are asked for."""

    years: float = option("Period of the probability [years].", 50.0)
    weights: str | None = option(
        "Weights of the branches: 0.5,0.3,0.2 in the order of the curves, or OpenQuake's file of "
        "realizations."
    )
    joint: bool = option(
        "Count earthquakes in which any of several blocks of a site fails, too.", False
    )
    within_km: float = option(options.WITHIN_HELP, options.WITHIN_KM)
    at_least: str | None = option(
        "Numbers of failures in one earthquake whose rates are wanted, as 1,5,20, with --joint. "
        "Default: 1, 2, 5, 10, …",
        metavar="K,K",
    )

    def counts(self) -> list[int] | None:
        """Return the numbers of failures whose rates are wanted at a site."""
        if self.at_least is None:
            return None
        try:
            return [int(part) for part in self.at_least.split(",")]
        except ValueError:
            raise InputError(
                f"--at-least {self.at_least!r}: give whole numbers with commas, as 1,5,20"
            ) from None


@stacked
def hazard(
    *,
    curve: list[str] = argument(
        "Hazard curve: OpenQuake CSV, USGS NSHM JSON, or CSV of two columns whose header "
        "names their units (pgv_m_s,annual_rate); several are branches or statistics of one "
        "logic tree.",
        metavar="CURVE...",
    ),
    given: Annotated[Given, fields_of(*BLOCK, *WHOLE)],
    blocks: BlocksOptions,
    meaning: options.Curve,
    answering: options.Answering,
    wanted: RateOptions,
    workers: WorkerOptions,
    out: str | None = option("Write one row a block and site (.csv, .xlsx, .parquet)."),
    release: str | None = option(
        "Write places, sizes and rates of the blocks for tools of rockfall propagation (.csv, "
        ".xlsx, .parquet).",
        metavar="FILE",
    ),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    plot: str | None = option(
        "Draw which shaking the rate of one block comes from (.png, .pdf, .svg)."
    ),
    printing: options.Printing,
) -> None:
    """Print the annual rate at which a block topples.

    The fragility is integrated over the hazard curve, and the probability in a period of years
    follows. Blocks of --blocks stand at the curves' sites by site_id, or at the nearest by lon and
    lat. With --joint it gives how often an earthquake fails at least one block of a site, or more,
    by what the model knows of blocks that share the shaking. Curves of PGV, SA at 1 s and PGA are
    answered, each by a model of that very measure; another needs --convert. With --weights curves
    are branches of a logic tree: the mean of the rates, and how they are distributed. The block is
    backed by a slope; a free-standing one fails at weaker shaking: --kind rocking.
    """
    import numpy as np

    from rbfrag.exchange.release import RELEASE, SIDES, release_columns
    from rbfrag.exchange.site_rates import blocks_at_sites, numbers_of_dry, rate_columns
    from rbfrag.fragility.unusable import FROM_SUMS
    from rbfrag.hazards.answer import hazard_at_sites
    from rbfrag.hazards.branches import branch_weights
    from rbfrag.hazards.curve_file import suited_in
    from rbfrag.hazards.kernel import rate_part
    from rbfrag.hazards.report import as_dict
    from rbfrag.question.question import is_wet, no_drained_bound, without_water

    check_files(table=out, plot=plot, excel_text=excel_text)
    check_files(table=release)
    table, is_class, remarks, rows = blocks.given_blocks(given, reads=(*RELEASE, "count"))
    if release is not None and is_class:
        raise InputError("--release needs the places of blocks, and a rock mass has none: --blocks")
    if rows is None:
        table = {**{name: [given[name]] for name in SIDES if name in given}, **table}
    files = [suited_in(path, **vars(meaning)) for path in curve]
    at = blocks_at_sites(
        files, table, site_chosen=meaning.site is not None, within_km=wanted.within_km
    )
    if rows is not None:
        of_none = np.isin(np.arange(rows.blocks["row"].size), [*at.missing])
        rows = rows.without(of_none, at.missing.__getitem__)
        remarks += rows.unusable_in_words(FROM_SUMS)
    if plot is not None and len(at.names) > 1 and not is_class:
        raise InputError(
            "--plot draws one block at one site: choose them with --site, --p2 and --kr"
        )
    elsewhere = workers.scheduler is not None or (workers.jobs or 1) > 1
    run = workers.runner(rate_part) if elsewhere else None
    answer = hazard_at_sites(
        at.sites, at.site, at.given, cast("CurveKeywords", vars(meaning)),
        cast("AnsweringFields", answering),
        weight=branch_weights(wanted.weights, at.sites[0]), joint=wanted.joint,
        at_least=wanted.counts(), years=wanted.years, one_class=is_class,
        count=None if is_class else at.columns.get("count"), run=run,
    )  # fmt: skip
    if is_wet(given) if rows is None else rows.wet is not None:
        try:
            dry = blocks.given_blocks(
                Given(without_water(given)), reads=(*RELEASE, "count"), dry=True
            )
            bound = hazard_at_sites(
                at.sites, at.site, numbers_of_dry(dry.columns, at),
                cast("CurveKeywords", vars(meaning)), cast("AnsweringFields", answering),
                years=wanted.years, run=run,
            )  # fmt: skip
            drained = bound.annual_rate
            if rows is not None and rows.wet is not None:
                drained = np.where(rows.wet[at.columns["row"]], drained, np.nan)
            answer = replace(answer, drained=drained)
        except InputError as error:
            remarks += (no_drained_bound(error),)
    notes = diagnostics(remarks, at.remarks, answer.warnings)
    if out is not None:
        table = rate_columns(answer, at.columns, rows)
        write_table(table, out, excel_text=excel_text, notes=notes)
    if release is not None:
        table = release_columns(answer, at.columns)
        write_table(table, release, excel_text=excel_text, notes=notes)
    if plot is not None:
        from rbfrag.plots.hazard import plot_contribution

        plot_contribution(at.sites[0][0], answer, plot)
    document = as_dict(
        answer, at.names, (*remarks, *at.remarks), None if rows is None else rows.refused_by_row()
    )
    if printing.json:
        print_json(document)
        return
    _print(document, answer, at.names, verbose=printing.verbose)


def _print(
    document: dict[str, Any],
    answer: HazardAnswer,
    names: list[str | None],
    *,
    verbose: bool,
) -> None:
    from rbfrag.hazards import between_measures

    warnings = document.pop("warnings")
    branches = document.pop("branches", None)
    spread = None if answer.tau is None else between_measures.in_words(answer.tau)
    rows = document.pop("blocks", None)
    if rows is not None:
        for sentence in (*_of_all(answer), most_often(names, answer.annual_rate.tolist())):
            print(sentence)
        if spread is not None:
            print(spread)
        document.pop("sites", None)
        for law, bound in document.pop("bounds", {}).items():
            document |= {f"{name}_{law}": value for name, value in bound.items()}
        counts = document.pop("annual_rate_at_least", None)
        print_pairs(document if verbose else _short(document))
        shown = rows[: len(rows) if verbose else MOST_ROWS]
        wet = any(row["drained"] for row in rows)
        for row in shown:
            bound = row.pop("drained")
            if wet:
                row["drained_annual_rate"] = None if bound is None else bound["annual_rate"]
        for some in filter(None, (counts, branches, shown)):
            print()
            if not verbose:
                for row in some:
                    row.pop("numerical_error", None)
            print_rows(some if verbose else [rounded_values(row) for row in some])
        if len(shown) < len(rows):
            print(f"{len(rows) - len(shown):,} more: --out FILE writes all, --verbose prints them")
    else:
        for sentence in rate_in_words(document, range_in_words(answer)):
            print(sentence)
        del document["contributions"], document["drained"]
        if spread is not None:
            print(spread)
        print()
        print_pairs(document if verbose else _short(document))
        if document["annual_rate"] > 0.0:
            print()
            print_table(["from", "to", "share_%"], _shares(answer, answer.curves[0]))
        if branches:
            print()
            print_table(list(branches[0]), [list(row.values()) for row in branches])
    print_warnings(warnings)


def _short(document: dict[str, Any]) -> dict[str, Any]:
    """Return what is shown without --verbose."""
    named = {**document, "model": describe.model(document)}
    return rounded_values({name: named[name] for name in SHORT if named.get(name) is not None})


def _of_all(answer: HazardAnswer) -> Iterator[str]:
    """Yield what all blocks do, in sentences."""
    size, sites = int(answer.count.sum()), len(answer.curves)
    expected = answer.expected_failures_per_year
    ends = confidence(answer.level, f"{answer.total_low:.2g}–{answer.total_high:.2g}")
    where = f" at {sites:,} sites" if sites > 1 else ""
    yield f"Expected failures {expected:.2g} /yr of {size:,} blocks{where}   ({ends})"
    for curve, joint in zip(answer.curves, answer.joints, strict=True):
        if joint is None:
            continue
        place = f"{curve.place}: at" if curve.place else "At"
        period = f"P in {answer.years:g} years"
        rate, chance = joint.annual_rate_any, joint.probability_any
        if rate is not None and chance is not None:
            yield (
                f"{place} least one failure: return period {return_period(rate)}; {period} "
                f"{percent(chance)}"
            )
            continue
        least, most = (
            percent(joint.bounds[name]["probability_any"])
            for name in ("fully_dependent", "independent")
        )
        ends = f"{least} (full dependence) to {most} (independent)"
        yield f"{place} least one failure: {period} {ends}"


def _shares(answer: Any, curve: Any) -> list[list[object]]:
    """Return which shaking the rate comes from, between the levels of the curve."""
    from rbfrag.hazards.report import shares_between

    unit = QUANTITIES[answer.measure].unit
    levels, imt, parts = curve.levels, curve.imt, shares_between(answer, curve.levels)
    rows: list[list[object]] = [
        [f"{imt} {low:.3g}", f"{high:.3g} {unit}", round(100.0 * share, 1)]
        for low, high, share in zip(levels[:-1], levels[1:], parts.tolist(), strict=True)
        if share >= 5e-4
    ]
    beyond = answer.above[0] / answer.annual_rate[0]
    if beyond >= 5e-4:
        rows.append([f"{imt} {levels[-1]:.3g}", "beyond", round(100.0 * float(beyond), 1)])
    return rows
