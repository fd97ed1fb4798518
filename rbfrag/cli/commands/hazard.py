"""`rbfrag hazard`: annual failure rate of blocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, cast

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, argument, option
from rbfrag.cli.inputs import BlocksOrRockMass
from rbfrag.cli.output import OPTION_FIELDS, check_files, print_result, write_table
from rbfrag.errors import InputError
from rbfrag.results.diagnostic import diagnostics
from rbfrag.vocabulary.quantities import BLOCK, COMMON

if TYPE_CHECKING:
    from rbfrag.hazards.curve import CurveKeywords
    from rbfrag.hazards.hazard_answer import HazardAnswer
    from rbfrag.question.fields import AnsweringFields

EXAMPLE = (
    "Example:  rbfrag hazard pgv-curve.csv --height 2.4 --width 0.5 --dip 3 --component rotd50"
)


def hazard(
    *,
    curve: list[str] = argument(
        "Hazard curve: OpenQuake CSV, USGS NSHM JSON, or CSV of two columns with units in "
        "the header (pgv_m_s,annual_rate); several files are branches or statistics of one "
        "logic tree",
        metavar="CURVE...",
    ),
    inputs: Annotated[Inputs, Fields(*BLOCK, *COMMON)],
    blocks: BlocksOrRockMass,
    meaning: options.Curve,
    answering: options.Answering,
    years: float = option("Exposure time of the probability [years]", 50.0),
    weights: options.Weights = None,
    joint: bool = option(
        "Compute also the rate of earthquakes in which at least one of several blocks at a "
        "site fails",
        False,
    ),
    within_km: options.WithinKm = options.WITHIN_KM,
    at_least: str | None = option(
        "Numbers of failures K for rates of earthquakes with at least K failures, such as "
        "1,5,20, with --joint [default: 1, 2, 5, 10, …]",
        metavar="K,K",
    ),
    out: str | None = option(
        "Output table with one row per block and site (.csv, .xlsx, .parquet)"
    ),
    release: str | None = option(
        "Output table of coordinates, sizes and rates of the blocks for rockfall propagation "
        "tools (.csv, .xlsx, .parquet)",
        metavar="FILE",
    ),
    excel_text: options.ExcelText = False,
    plot: str | None = option(
        "Figure of the disaggregation of the rate of a single block by intensity (.png, .pdf, .svg)"
    ),
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Print annual rate and return period of failure of blocks.

    The fragility function is integrated over the hazard curve. Blocks of --blocks are assigned to
    the sites of the curves by site_id, or to the nearest site by lon and lat. --joint adds the rate
    of earthquakes in which at least one block of a site fails, from the dependence model of the
    fragility model. Curves of PGV, SA and PGA are supported, each with a model of the same
    intensity measure; other curves require --convert. With --weights the curves are logic-tree
    branches: the result is the mean rate and its distribution over the branches. Toppling blocks
    are backed by a rock face; a free-standing block overturns at weaker shaking: --kind rocking.
    """
    import numpy as np

    from rbfrag.exchange.nearest_site import blocks_at_sites
    from rbfrag.exchange.rate_tables import RELEASE, SIDES, rate_columns, release_columns
    from rbfrag.fragility import describe
    from rbfrag.fragility.validation import FROM_SUMS
    from rbfrag.hazards.branches import branch_weights
    from rbfrag.hazards.curve_file import select_curves
    from rbfrag.hazards.hazard_rates import hazard_at_sites, with_drained_rates
    from rbfrag.question.classify import numbers_in
    from rbfrag.question.drained_bound import is_wet, without_water

    check_files(table=out, plot=plot, excel_text=excel_text)
    check_files(table=release)
    try:
        counts = None if at_least is None else [int(part) for part in at_least.split(",")]
    except ValueError:
        raise InputError(
            f"--at-least {at_least!r}: give whole numbers separated by commas, such as 1,5,20"
        ) from None
    table, is_class, remarks, rows = blocks.collect(inputs, reads=(*RELEASE, "count"))
    if release is not None and is_class:
        raise InputError(
            "--release requires the coordinates of blocks: use --blocks instead of --rockmass"
        )
    if rows is None:
        table = {**{name: [inputs[name]] for name in SIDES if name in inputs}, **table}
    files = [select_curves(path, **meaning) for path in curve]
    at = blocks_at_sites(files, table, site_chosen=meaning["site"] is not None, within_km=within_km)
    if rows is not None:
        of_none = np.isin(np.arange(rows.blocks["row"].size), [*at.missing])
        rows = rows.without(of_none, at.missing.__getitem__)
        remarks += rows.describe_invalid(FROM_SUMS)
    if plot is not None and len(at.names) > 1 and not is_class:
        raise InputError(
            "--plot requires a single block at a single site: give --site, --p2 and --kr"
        )
    weight = branch_weights(weights, at.sites[0])

    def rates_of(block_inputs: Mapping[str, Any], **together: Any) -> HazardAnswer:
        return hazard_at_sites(
            at.sites, at.site, block_inputs, cast("CurveKeywords", meaning),
            cast("AnsweringFields", answering), weight=weight, years=years,
            **together,
        )  # fmt: skip

    def drained_rates() -> HazardAnswer:
        dry_inputs = Inputs(without_water(inputs))
        dry = blocks.collect(dry_inputs, reads=(*RELEASE, "count"), dry=True)
        return rates_of(at.inputs_of(dry.columns if dry.rows is None else dry.rows.columns))

    answer = rates_of(
        at.inputs, joint=joint, at_least=counts, one_class=is_class,
        count=None if is_class else at.columns.get("count"),
    )  # fmt: skip
    if rows is None and is_wet(inputs):
        answer = with_drained_rates(answer, drained_rates, True)
    elif rows is not None and rows.wet is not None:
        answer = with_drained_rates(answer, drained_rates, rows.wet[at.columns["row"]])
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
    print_result(answer, json=json, verbose=verbose, fields=fields)
