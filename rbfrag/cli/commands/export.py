"""`rbfrag export`: fragility functions for other tools."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli.output import print_result
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions
from rbfrag.cli.parameters.option_groups import (
    ParsedInputs,
    command_group,
    fields_of,
    option,
    stacked,
)
from rbfrag.vocabulary.quantities import ANSWERING

if TYPE_CHECKING:
    from rbfrag.exchange.export import ExportAnswer

app = command_group(
    "Write fragility functions for other tools.",
    "Example:  rbfrag export nrml --height 2.4 --width 0.5 --out block.xml",
)

Answering = Annotated[ParsedInputs, fields_of(*ANSWERING, without=("level",))]

Out = Annotated[str, typer.Option("--out", help="Output file")]


@dataclass(frozen=True, kw_only=True)
class FunctionOptions(BlocksOptions):
    """Options of the exported fragility functions, one per block."""

    name: str = option("Identifier of the single block or of the rock mass", "block")
    imt: str = option("Intensity measure of the fragility function: PGV, PGA, or SA at 1 s", "PGV")
    levels: int = option(
        "Maximum number of intensity levels of a function that is not lognormal", 80
    )
    component: str = option(
        "Horizontal component of the intensity measure: single, geometric_mean, rotd50, "
        "rotd100 or larger",
        "single",
    )
    shares: str | None = option(
        "Fractions of the blocks of a rock mass [%], such as 1,10,50; each defines a limit "
        "state: at least this fraction fails",
        metavar="LIST",
    )

    def keywords(
        self, inputs: ParsedInputs, answering: ParsedInputs
    ) -> tuple[dict[str, Any], tuple[str, ...]]:
        """Return the keywords of `rbfrag.export`, and warnings about the blocks."""
        several = self.collect_blocks(inputs, one_kind=True)
        of_many = several.is_class or several.rows is not None
        keywords = {
            **({"blocks": several.question} if of_many else several.numbers),
            "one_class": several.is_class, "imt": self.imt, "name": self.name,
            "levels": self.levels, "component": self.component,
            "shares": None if self.shares is None else options.number_list(self.shares, "--shares"),
            "kind": str(several.columns["kind"][0]), **answering,
        }  # fmt: skip
        return keywords, several.remarks


@app.command("nrml", epilog="Example:  rbfrag export nrml --height 2.4 --width 0.5 --out block.xml")
@stacked
def nrml(
    out: Out,
    inputs: options.Block,
    blocks: FunctionOptions,
    answering: Answering,
    json: options.Json = False,
) -> None:
    """Export an OpenQuake fragility model (NRML 0.5).

    PGV is in cm/s.
    """
    from rbfrag.exchange.export import nrml as written

    keywords, remarks = blocks.keywords(inputs, answering)
    _print(written(out, **keywords), remarks, json=json)


@app.command(
    "pelicun", epilog="Example:  rbfrag export pelicun --height 2.4 --width 0.5 --out fragility.csv"
)
@stacked
def pelicun(
    out: Out,
    inputs: options.Block,
    blocks: FunctionOptions,
    answering: Answering,
    json: options.Json = False,
) -> None:
    """Export a fragility table for pelicun and SimCenter.

    PGV is in m/s (mps). A description (.json) is written next to the table (.csv) under the same
    name.
    """
    from rbfrag.exchange.export import pelicun as written

    keywords, remarks = blocks.keywords(inputs, answering)
    _print(written(out, **keywords), remarks, json=json)


def _print(answer: ExportAnswer, remarks: tuple[str, ...], *, json: bool) -> None:
    answer = replace(answer, warnings=(*remarks, *answer.warnings))
    print_result(answer, json=json, fields=())
