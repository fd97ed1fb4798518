"""`rbfrag hazard`: how often per year blocks topple."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rbfrag.cli.output import check_files, print_json, print_pairs, print_table, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import toppling_blocks
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag hazard pgv-curve.csv --p2 3 --kr 0.1 --component rotd50 --years 50"


def hazard(
    curve: Annotated[
        str,
        typer.Argument(
            metavar="CURVE",
            help="Hazard curve: OpenQuake CSV, USGS NSHM JSON, or CSV of two columns whose header "
            "names their units (pgv_m_s,annual_rate).",
        ),
    ],
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    blocks: Annotated[
        str | None,
        typer.Option(
            "--blocks",
            metavar="FILE",
            help="Block table (.csv, .parquet) with p2_1_s2 [1/s²] and kr, one answer a row.",
        ),
    ] = None,
    rockmass: Annotated[
        str | None,
        typer.Option(
            "--rockmass",
            metavar="FILE",
            help="Rock mass file (.toml, .csv): the rate of a block drawn from its stable toppling "
            "blocks.",
        ),
    ] = None,
    imt: Annotated[
        str | None,
        typer.Option("--imt", help="Intensity measure of the curve: PGV, PGA, 'SA(1.0)'."),
    ] = None,
    site: Annotated[
        str | None,
        typer.Option("--site", help="Site of the file: its number from 1 on, or its name."),
    ] = None,
    years: Annotated[
        float, typer.Option("--years", help="Period of the probability [years].")
    ] = 50.0,
    tm: options.Tm = None,
    convert: Annotated[
        str | None,
        typer.Option(
            "--convert",
            help="Published conversion of a spectral acceleration to PGV: newmark_hall_1982 "
            "(SA(1)) or bommer_alarcon_2006 (SA(0.5)).",
        ),
    ] = None,
    component: Annotated[
        str | None,
        typer.Option(
            "--component",
            help="What the curve's horizontal component means: single, geometric_mean, rotd50 or "
            "larger.",
        ),
    ] = None,
    model: options.Model = None,
    level: options.Level = 0.95,
    out: Annotated[
        str | None, typer.Option("--out", help="Write one row a block and site (.csv, .parquet).")
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot", help="Draw which shaking the rate of one block comes from (.png, .pdf, .svg)."
        ),
    ] = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Print the annual rate at which a block topples, and the probability in a period of years.

    The fragility is integrated over the hazard curve. A PGA curve needs --tm, a spectral
    acceleration --convert.
    """
    from rbfrag.exchange.block_table import write_block_table
    from rbfrag.exchange.hazard_curves import read_hazard_curves, suited_curves
    from rbfrag.hazards.answer import hazard as answer
    from rbfrag.hazards.conversions import velocity_conversion
    from rbfrag.hazards.report import as_dict

    check_files(table=out, plot=plot)
    table, is_class, remarks = toppling_blocks(p2, kr, block, blocks, rockmass)
    names = list(table["block_id"])
    curves = suited_curves(
        read_hazard_curves(curve, imt=imt, site=site),
        with_mean_period=tm is not None,
        converted_period_s=None if convert is None else velocity_conversion(convert).period_s,
    )
    if plot is not None and (len(curves) > 1 or len(names) > 1):
        raise InputError(
            "--plot draws one block at one site: choose them with --site, --p2 and --kr"
        )
    found = [
        answer(
            one, table["p2_1_s2"], table["kr"], tm_s=tm, convert=convert, component=component,
            years=years, model=model, level=level, db=db, one_class=is_class,
        )
        for one in curves
    ]  # fmt: skip
    if out is not None:
        from rbfrag.exchange.rate_table import rate_columns

        write_block_table(rate_columns(curves, table, found), out)
    if plot is not None:
        from rbfrag.plots.hazard import plot_contribution

        plot_contribution(curves[0], found[0], plot)
    document = as_dict(curves, names, found, remarks)
    if json:
        print_json(document)
        return
    warnings = document.pop("warnings")
    if "answers" in document:
        rows = document.pop("answers")
        print_pairs(document)
        print()
        print_table(list(rows[0]), [list(row.values()) for row in rows])
    else:
        del document["contributions"]
        print_pairs(document)
        if document["annual_rate"] > 0.0:
            print(f"once in {1.0 / document['annual_rate']:.4g} years on average")
            print()
            print_table(["from", "to", "share_%"], _shares(found[0], curves[0]))
    print_warnings(warnings)


def _shares(found: Any, curve: Any) -> list[list[object]]:
    """Return which shaking the rate comes from, between the levels of the curve."""
    unit = {"pgv_m_s": "m/s"}.get(found.measure, "g")
    levels, imt = curve.levels, curve.imt
    parts = found.contribution[0].reshape(levels.size - 1, -1).sum(axis=1) / found.annual_rate[0]
    rows: list[list[object]] = [
        [f"{imt} {low:.3g}", f"{high:.3g} {unit}", round(100.0 * share, 1)]
        for low, high, share in zip(levels[:-1], levels[1:], parts.tolist(), strict=True)
        if share >= 5e-4
    ]
    beyond = found.above[0] / found.annual_rate[0]
    if beyond >= 5e-4:
        rows.append([f"{imt} {levels[-1]:.3g}", "beyond", round(100.0 * float(beyond), 1)])
    return rows
