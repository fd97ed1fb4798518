"""`rbfrag survival`: test of a seismic hazard curve against blocks that still stand."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, argument, option
from rbfrag.cli.inputs import BlockTable
from rbfrag.cli.output import OPTION_FIELDS, check_files, print_result
from rbfrag.vocabulary.quantities import BLOCK, COMMON

EXAMPLE = (
    "Example:  rbfrag survival pgv-curve.csv --height 1 --width 0.25 --kind toppling "
    "--kr-sigma 0.1 --age 10000 --age-sd 2000 --component rotd50"
)


def survival(
    *,
    curves: list[str] = argument(
        "Hazard curves of one site and intensity measure: OpenQuake CSV (mean, quantiles, "
        "branches), USGS NSHM JSON, or CSV of two columns with units in the header",
        metavar="CURVE...",
    ),
    inputs: Annotated[Inputs, Fields(*BLOCK, *COMMON, without=("kind",))],
    kind: str | None = option(
        "Kind of failure: rocking (free-standing), toppling (backed by a rock face), slumping, "
        "confined_toppling or sliding; required except for tables with a column kind, and with "
        "the parameters of other kinds (--restitution, --ky, --ks, --kct)",
        rich_help_panel="Block and shaking",
    ),
    blocks: BlockTable,
    age: float = option("Mean age of the blocks in their present position [years]", ...),
    age_sd: float = option("Standard deviation of the lognormal age [years]", 0.0),
    draws: int = option("Number of draws for several uncertain blocks", 128),
    seed: int = option("Seed of the draws", 0),
    meaning: options.Curve,
    answering: options.Answering,
    weights: options.Weights = None,
    plot: str | None = option(
        "Figure of the curves, survival probability over the factor on their rates, and "
        "weights (.png, .pdf, .svg)"
    ),
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Print the survival probability of standing blocks.

    The blocks of --blocks stand at one site. The factors on all rates of the hazard are those at
    which the survival probability is 5 % and 50 %. With --weights the weights of logic-tree
    branches are updated with the survival of the blocks.
    """
    import numpy as np

    from rbfrag.fragility import describe
    from rbfrag.hazards.curve_file import as_curves
    from rbfrag.hazards.standing_blocks import ALL_STAND
    from rbfrag.hazards.survival import KIND_MISSING, require_kind
    from rbfrag.hazards.survival import survival as answered

    check_files(plot=plot)
    if kind is not None:
        inputs["kind"] = kind
    if blocks.blocks is None:
        require_kind(inputs)
    several = blocks.collect(inputs, reads=("count",), need_kind=KIND_MISSING)
    remarks, rows, numbers = several.remarks, several.rows, several.numbers
    if rows is not None:
        rows.require_all(ALL_STAND)
        remarks += rows.remarks
        count = rows.blocks.get("count", np.ones(len(numbers["kind"]))).astype(np.intp)
        numbers = {name: np.repeat(values, count).tolist() for name, values in numbers.items()}
    read = as_curves(curves, **meaning)
    answer = answered(
        read, age_years=age, age_sd_years=age_sd, weights=weights,
        draws=draws, seed=seed, **numbers, **meaning, **answering,
    )  # fmt: skip
    answer = replace(answer, warnings=(*remarks, *answer.warnings))
    if rows is None:
        values = {name: column[0] for name, column in numbers.items()}
        # how the block is assumed to stand is among the notes
        text = describe.block(str(answer.method), {**inputs, **values}, support=False)
        answer = replace(answer, block_text=text)
    if plot is not None:
        from rbfrag.plots.hazard import plot_survival

        plot_survival(read, answer, plot)
    fields = OPTION_FIELDS if rows is None else ()  # notes on a table name its columns
    print_result(answer, json=json, verbose=verbose, fields=fields)
