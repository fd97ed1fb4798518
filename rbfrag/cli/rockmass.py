"""`rbfrag rockmass`: the blocks between two fracture sets that scatter."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.output import cell, print_json, print_pairs, print_table, print_warnings
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag rockmass rockmass.toml --pgv 0.6 --out blocks.csv --plot counts.png"


def rockmass(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="Rock mass file (.toml or .csv): dips [deg], spacings [m], friction [deg].",
            show_default=False,
        ),
    ],
    n: Annotated[
        int | None,
        typer.Option("--n", help="Number of realisations. Default: the file's, else 20000."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", help="Seed of the random numbers. Default: the file's, else 1."),
    ] = None,
    pgv: options.Pgv = None,
    pga: options.Pga = None,
    tm: options.Tm = None,
    pgd: options.Pgd = None,
    model: options.Model = None,
    level: options.Level = 0.95,
    out: Annotated[
        str | None,
        typer.Option(
            "--out", help="Write one row a block (.csv, .parquet), for predict --batch and others."
        ),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            help="Draw the cumulative counts of blocks against PGA by mode (.png, .pdf, .svg).",
        ),
    ] = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Draw blocks from two fracture sets; print their modes and yield accelerations.

    With a measure of the motion (--pgv ...), the probability of failure is averaged over the
    blocks of each mode for which there is a fragility model.
    """
    from rbfrag.exchange.block_table import table_path, write_block_table
    from rbfrag.fragility.rockmass_counts import crossings, mode_counts
    from rbfrag.fragility.rockmass_file import read_rock_mass
    from rbfrag.fragility.rockmass_report import as_dict
    from rbfrag.fragility.rockmass_scenario import scenario
    from rbfrag.fragility.rockmass_table import block_columns

    if out is not None:
        table_path(out)
    if plot is not None:
        from rbfrag.plots.canvas import plot_path

        plot_path(plot)
    measures = {"pgv_m_s": pgv, "pga_g": pga, "tm_s": tm, "pgd_m": pgd}
    shaken = any(value is not None for value in measures.values())
    if not shaken and (model is not None or db is not None):
        extra = "--db" if model is None else "--model"
        raise InputError(
            f"{extra} goes with a measure of the motion: give --pgv, --pga and --tm, or --pgd and "
            "--tm, too"
        )
    made = read_rock_mass(file).realise(n, seed)
    answer = None
    if shaken:
        answer = scenario(made, **measures, model=model, level=level, db=db)
    counts, meetings = mode_counts(made), crossings(made)
    document = as_dict(made, counts, meetings, answer)
    if out is not None:
        write_block_table(block_columns(made, answer), out)
    if plot is not None:
        from rbfrag.plots.rockmass import plot_rockmass

        plot_rockmass(made, plot)
    if json:
        print_json(document)
        return
    _print(document)
    print_warnings(document["warnings"])


def _print(document: dict[str, Any]) -> None:
    print_pairs(
        {
            "realisations": document["realisations"],
            "blocks": document["blocks"],
            "seed": document["seed"],
            **document["variables"],
            "block.back_fracture": document["back_fracture"],
        }
    )
    for text, count in document["impossible"].items():
        print(f"no block {count} times: {text}")
    print()
    quantiles = ("q05", "q50", "q95")
    print_table(
        ["mode", "count", "share_%", "+-", "unstable", "locked", *(f"k_{q}_g" for q in quantiles)],
        [
            [
                mode,
                found["count"],
                round(100.0 * found["share"], 2),
                round(100.0 * found["share_error"], 2),
                found["unstable"],
                found["locked"],
                *((found["yield_g"] or {}).get(q) for q in quantiles),
            ]
            for mode, found in document["modes"].items()
        ],
    )
    for crossing in document["crossings"]:
        print(
            f"counts cross at {crossing['pga_g']:.4g} +- {_short(crossing['standard_error_g'])} g "
            f"({cell(crossing['count'])} blocks each): more {_words(crossing['below'])} below, "
            f"more {_words(crossing['above'])} above"
        )
    if document["scenario"] is not None:
        _print_scenario(document["scenario"])


def _print_scenario(found: dict[str, Any]) -> None:
    print()
    names = ("pgv_m_s", "pga_g", "tm_s", "pgd_m", "model", "level")
    print_pairs({name: found[name] for name in names if name in found})
    rows = [
        [mode, 100.0 * answer["share"], answer["covered"], *_probability(answer)]
        for mode, answer in found["modes"].items()
    ]
    total = found["covered_only"]
    rows.append(["covered blocks only", 100.0 * found["covered_share"], total["covered"]])
    rows[-1] += _probability(total)
    print_table(["mode", "share_%", "covered", "probability", "+-", "ci_low", "ci_high"], rows)


def _probability(answer: dict[str, Any]) -> list[Any]:
    return [answer[key] for key in ("probability", "standard_error", "ci_low", "ci_high")]


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"


def _words(mode: str) -> str:
    return {"confined_topple": "confined topples"}.get(mode, f"{mode}s")
