"""`rbfrag export`: fragility functions for other tools."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import toppling_blocks
from rbfrag.errors import InputError

app = typer.Typer(
    help="Write fragility functions for other tools.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog="Example:  rbfrag export nrml --p2 3 --kr 0.1 --out block.xml",
)

Blocks = Annotated[
    str | None,
    typer.Option(
        "--blocks",
        metavar="FILE",
        help="Block table (.csv, .parquet) with block_id, p2_1_s2 [1/s²] and kr; one function a "
        "block.",
    ),
]

RockMass = Annotated[
    str | None,
    typer.Option(
        "--rockmass",
        metavar="FILE",
        help="Rock mass file (.toml, .csv): one function, the mean over its toppling blocks.",
    ),
]

Imt = Annotated[str, typer.Option("--imt", help="Measure of the function: PGV, or PGA with --tm.")]

Levels = Annotated[
    int, typer.Option("--levels", help="Number of levels of a function that is not lognormal.")
]

Name = Annotated[
    str, typer.Option("--name", help="Identifier of the one block or of the rock mass.")
]

Out = Annotated[str, typer.Option("--out", help="File to write.")]


@app.command("nrml", epilog="Example:  rbfrag export nrml --blocks blocks.csv --out blocks.xml")
def nrml(
    out: Out,
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    blocks: Blocks = None,
    rockmass: RockMass = None,
    name: Name = "block",
    imt: Imt = "PGV",
    tm: options.Tm = None,
    levels: Levels = 80,
    model: options.Model = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Write an OpenQuake fragility model, NRML 0.5 (.xml); PGV is in cm/s there."""
    from rbfrag.exchange.nrml import nrml_text
    from rbfrag.files import output_path, write_text

    target = output_path(out, (".xml",), "NRML file")
    made, about, warnings = _functions(
        p2, kr, block, blocks, rockmass, name, imt, tm, levels, model, db
    )
    write_text(nrml_text(made, description=_sentence(about, tm)), target)
    _tell(str(target), made, about, warnings, json)


@app.command(
    "pelicun", epilog="Example:  rbfrag export pelicun --p2 3 --kr 0.1 --out fragility.csv"
)
def pelicun(
    out: Out,
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    blocks: Blocks = None,
    rockmass: RockMass = None,
    name: Name = "block",
    imt: Imt = "PGV",
    tm: options.Tm = None,
    levels: Levels = 80,
    model: options.Model = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Write a fragility table of pelicun and SimCenter (.csv); PGV is in m/s (mps) there."""
    from rbfrag.exchange.pelicun_table import pelicun_text
    from rbfrag.files import output_path, write_text

    target = output_path(out, (".csv",), "fragility table")
    made, about, warnings = _functions(
        p2, kr, block, blocks, rockmass, name, imt, tm, levels, model, db
    )
    write_text(pelicun_text(made), target)
    _tell(str(target), made, about, warnings, json)


def _functions(
    p2: float | None,
    kr: float | None,
    block: str | None,
    blocks: str | None,
    rockmass: str | None,
    name: str,
    imt: str,
    tm: float | None,
    levels: int,
    model: str | None,
    db: str | None,
) -> tuple[list[Any], tuple[str, ...], list[str]]:
    from rbfrag.exchange.block_fragility import block_functions

    measures = {"PGV": "pgv_m_s", "PGA": "pga_g"}
    if imt.upper() not in measures:
        raise InputError(f"--imt {imt}: use PGV, or PGA with --tm")
    measure = measures[imt.upper()]
    table, is_class, remarks = toppling_blocks(p2, kr, block, blocks, rockmass, name=name)
    made, about = block_functions(
        [name] if is_class else list(table["block_id"]), table["p2_1_s2"], table["kr"], measure,
        one_class=is_class, tm_s=tm, levels=levels, model=model, db=db,
    )  # fmt: skip
    return made, about, list(remarks)


def _sentence(about: tuple[str, ...], tm: float | None) -> str:
    period = "" if tm is None else f", mean period {tm:g} s"
    return f"Toppling of rock blocks, model {about[0]} ({about[2]} on {about[1]}){period}"


def _tell(
    path: str, made: list[Any], about: tuple[str, ...], warnings: list[str], json: bool
) -> None:
    errors = [function.grid_error for function in made if function.grid_error is not None]
    document = {
        "file": path,
        "functions": len(made),
        "lognormal": sum(function.is_lognormal for function in made),
        "largest_grid_error": max(errors, default=0.0),
        "model": about[0],
        "term": about[1],
        "method": about[2],
    }
    if json:
        print_json({**document, "warnings": warnings})
        return
    print_pairs(document)
    print_warnings(warnings)
