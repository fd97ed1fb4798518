"""`rbfrag hazard`: annual failure rate of blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, cast

from rbfrag.cli.commands.simulate import WorkerOptions
from rbfrag.cli.output import OPTION_FIELDS, check_files, print_result, write_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions
from rbfrag.cli.parameters.option_groups import ParsedInputs, argument, fields_of, option, stacked
from rbfrag.errors import InputError
from rbfrag.results.diagnostic import diagnostics
from rbfrag.vocabulary.quantities import BLOCK, COMMON

if TYPE_CHECKING:
    from rbfrag.hazards.curve import CurveKeywords
    from rbfrag.question.fields import AnsweringFields

EXAMPLE = (
    "Example:  rbfrag hazard pgv-curve.csv --height 2.4 --width 0.5 --dip 3 --component rotd50"
)


@dataclass(frozen=True, kw_only=True)
class RateOptions:
    """Options of the annual rates."""

    years: float = option("Exposure time of the probability [years]", 50.0)
    weights: str | None = option(
        "Weights of the logic-tree branches in the order of the curves, such as 0.5,0.3,0.2, "
        "or the realizations file of OpenQuake"
    )
    joint: bool = option(
        "Compute also the rate of earthquakes in which at least one of several blocks at a "
        "site fails",
        False,
    )
    within_km: float = option(options.WITHIN_HELP, options.WITHIN_KM)
    at_least: str | None = option(
        "Numbers of failures K for rates of earthquakes with at least K failures, such as "
        "1,5,20, with --joint [default: 1, 2, 5, 10, …]",
        metavar="K,K",
    )

    def counts(self) -> list[int] | None:
        """Return the numbers of failures at a site whose rates are requested."""
        if self.at_least is None:
            return None
        try:
            return [int(part) for part in self.at_least.split(",")]
        except ValueError:
            raise InputError(
                f"--at-least {self.at_least!r}: give whole numbers separated by commas, such as "
                "1,5,20"
            ) from None


@stacked
def hazard(
    *,
    curve: list[str] = argument(
        "Hazard curve: OpenQuake CSV, USGS NSHM JSON, or CSV of two columns with units in "
        "the header (pgv_m_s,annual_rate); several files are branches or statistics of one "
        "logic tree",
        metavar="CURVE...",
    ),
    inputs: Annotated[ParsedInputs, fields_of(*BLOCK, *COMMON)],
    blocks: BlocksOptions,
    meaning: options.Curve,
    answering: options.Answering,
    rate_options: RateOptions,
    workers: WorkerOptions,
    out: str | None = option(
        "Output table with one row per block and site (.csv, .xlsx, .parquet)"
    ),
    release: str | None = option(
        "Output table of coordinates, sizes and rates of the blocks for rockfall propagation "
        "tools (.csv, .xlsx, .parquet)",
        metavar="FILE",
    ),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    plot: str | None = option(
        "Figure of the disaggregation of the rate of a single block by intensity (.png, .pdf, .svg)"
    ),
    printing: options.Printing,
) -> None:
    """Print annual rate and return period of failure of blocks.

    The fragility function is integrated over the hazard curve. Blocks of --blocks are assigned to
    the sites of the curves by site_id, or to the nearest site by lon and lat. --joint adds the rate
    of earthquakes in which at least one block of a site fails, from the dependence model of the
    fragility model. Curves of PGV, SA at 1 s and PGA are supported, each with a model of the same
    intensity measure; other curves require --convert. With --weights the curves are logic-tree
    branches: the result is the mean rate and its distribution over the branches. Toppling blocks
    are backed by a rock face; a free-standing block overturns at weaker shaking: --kind rocking.
    """
    import numpy as np

    from rbfrag.exchange.release import RELEASE, SIDES, release_columns
    from rbfrag.exchange.site_rates import blocks_at_sites, numbers_of_dry, rate_columns
    from rbfrag.fragility import describe
    from rbfrag.fragility.invalid_rows import FROM_SUMS
    from rbfrag.hazards.branches import branch_weights
    from rbfrag.hazards.curve_file import suited_in
    from rbfrag.hazards.hazard_rates import hazard_at_sites
    from rbfrag.hazards.rate_integration import rate_part
    from rbfrag.question.classify import numbers_in
    from rbfrag.question.question import is_wet, no_drained_bound, without_water

    check_files(table=out, plot=plot, excel_text=excel_text)
    check_files(table=release)
    table, is_class, remarks, rows = blocks.collect_blocks(inputs, reads=(*RELEASE, "count"))
    if release is not None and is_class:
        raise InputError(
            "--release requires the coordinates of blocks: use --blocks instead of --rockmass"
        )
    if rows is None:
        table = {**{name: [inputs[name]] for name in SIDES if name in inputs}, **table}
    files = [suited_in(path, **vars(meaning)) for path in curve]
    at = blocks_at_sites(
        files, table, site_chosen=meaning.site is not None, within_km=rate_options.within_km
    )
    if rows is not None:
        of_none = np.isin(np.arange(rows.blocks["row"].size), [*at.missing])
        rows = rows.without(of_none, at.missing.__getitem__)
        remarks += rows.describe_invalid(FROM_SUMS)
    if plot is not None and len(at.names) > 1 and not is_class:
        raise InputError(
            "--plot requires a single block at a single site: give --site, --p2 and --kr"
        )
    elsewhere = workers.scheduler is not None or (workers.jobs or 1) > 1
    run = workers.runner(rate_part) if elsewhere else None
    answer = hazard_at_sites(
        at.sites, at.site, at.inputs, cast("CurveKeywords", vars(meaning)),
        cast("AnsweringFields", answering),
        weight=branch_weights(rate_options.weights, at.sites[0]), joint=rate_options.joint,
        at_least=rate_options.counts(), years=rate_options.years, one_class=is_class,
        count=None if is_class else at.columns.get("count"), run=run,
    )  # fmt: skip
    if is_wet(inputs) if rows is None else rows.wet is not None:
        try:
            dry = blocks.collect_blocks(
                ParsedInputs(without_water(inputs)), reads=(*RELEASE, "count"), dry=True
            )
            bound = hazard_at_sites(
                at.sites, at.site, numbers_of_dry(dry.columns, at),
                cast("CurveKeywords", vars(meaning)), cast("AnsweringFields", answering),
                years=rate_options.years, run=run,
            )  # fmt: skip
            drained = bound.annual_rate
            if rows is not None and rows.wet is not None:
                drained = np.where(rows.wet[at.columns["row"]], drained, np.nan)
            answer = replace(answer, drained=drained)
        except InputError as error:
            remarks += (no_drained_bound(error),)
    answer = replace(
        answer, names=tuple(at.names), rejected={} if rows is None else rows.rejected_by_row(),
        warnings=diagnostics(remarks, at.remarks, answer.warnings),
    )  # fmt: skip
    if rows is None and not is_class:
        numbers = {name: values[0] for name, values in numbers_in(table).items()}
        answer = replace(answer, block_text=describe.block(answer.method, {**inputs, **numbers}))
    if out is not None:
        table = rate_columns(answer, at.columns, rows)
        write_table(table, out, excel_text=excel_text, notes=answer.warnings)
    if release is not None:
        table = release_columns(answer, at.columns)
        write_table(table, release, excel_text=excel_text, notes=answer.warnings)
    if plot is not None:
        from rbfrag.plots.hazard import plot_contribution

        plot_contribution(at.sites[0][0], answer, plot)
    fields = OPTION_FIELDS if rows is None else ()  # notes on a table name its columns
    print_result(answer, json=printing.json, verbose=printing.verbose, fields=fields)
