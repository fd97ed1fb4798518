"""`rbfrag export`: fragility functions for other tools."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.command import Commands, Fields, Inputs, option
from rbfrag.cli.inputs import BlocksOrRockMass
from rbfrag.cli.output import print_result
from rbfrag.vocabulary.quantities import ANSWERING

if TYPE_CHECKING:
    from rbfrag.exchange.export import ExportAnswer

app = Commands(
    "Write fragility functions for other tools.",
    "Example:  rbfrag export nrml --height 2.4 --width 0.5 --out block.xml",
)

Out = Annotated[str, typer.Option("--out", help="Output file")]


def _functions(
    inputs: options.Block,
    blocks: BlocksOrRockMass,
    answering: Annotated[Inputs, Fields(*ANSWERING, without=("level",))],
    name: str = option("Identifier of the single block or of the rock mass", "block"),
    imt: str = option("Intensity measure of the fragility function: PGV, PGA, 'SA(0.5)'", "PGV"),
    levels: int = option(
        "Maximum number of intensity levels of a function that is not lognormal", 80
    ),
    component: str = option(
        "Horizontal component of the intensity measure: single, geometric_mean, rotd50, "
        "rotd100 or larger",
        "single",
    ),
    shares: str | None = option(
        "Fractions of the blocks of a rock mass [%], such as 1,10,50; each defines a limit "
        "state: at least this fraction fails",
        metavar="LIST",
    ),
) -> tuple[dict[str, Any], tuple[str, ...]]:
    several = blocks.collect(inputs, one_kind=True)
    of_many = several.is_class or several.rows is not None
    keywords = {
        **({"blocks": several.question} if of_many else several.numbers),
        "one_class": several.is_class, "imt": imt, "name": name, "levels": levels,
        "component": component,
        "shares": None if shares is None else options.number_list(shares, "--shares"),
        "kind": str(several.columns["kind"][0]), **answering,
    }  # fmt: skip
    return keywords, several.remarks


Functions = Annotated[tuple[dict[str, Any], tuple[str, ...]], _functions]
"""Keywords of `rbfrag.export`, and warnings about the blocks."""


@app.command("nrml", epilog="Example:  rbfrag export nrml --height 2.4 --width 0.5 --out block.xml")
def nrml(out: Out, functions: Functions, json: options.Json = False) -> None:
    """Export an OpenQuake fragility model (NRML 0.5).

    PGV is in cm/s.
    """
    from rbfrag.exchange.export import nrml as written

    _print(written(out, **functions[0]), functions[1], json=json)


@app.command(
    "pelicun", epilog="Example:  rbfrag export pelicun --height 2.4 --width 0.5 --out fragility.csv"
)
def pelicun(out: Out, functions: Functions, json: options.Json = False) -> None:
    """Export a fragility table for pelicun and SimCenter.

    PGV is in m/s (mps). A description (.json) is written next to the table (.csv) under the same
    name.
    """
    from rbfrag.exchange.export import pelicun as written

    _print(written(out, **functions[0]), functions[1], json=json)


def _print(answer: ExportAnswer, remarks: tuple[str, ...], *, json: bool) -> None:
    answer = replace(answer, warnings=(*remarks, *answer.warnings))
    print_result(answer, json=json, fields=())
