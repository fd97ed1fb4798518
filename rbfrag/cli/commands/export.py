"""`rbfrag export`: fragility functions for other tools."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions
from rbfrag.cli.parameters.stack import command_group, option, stacked
from rbfrag.errors import InputError

app = command_group(
    "Write fragility functions for other tools.",
    "Example:  rbfrag export nrml --p2 3 --kr 0.1 --out block.xml",
)

Out = Annotated[str, typer.Option("--out", help="File to write.")]


@dataclass(frozen=True, kw_only=True)
class FunctionOptions(BlocksOptions):
    """The blocks, one function each, and what a function is of."""

    name: str = option("Identifier of the one block or of the rock mass.", "block")
    imt: str = option("Measure of the function: PGV, PGA, or SA at 0.3, 1, 2 or 3 s.", "PGV")
    levels: int = option("Number of levels of a function that is not lognormal.", 80)
    model: options.Model = None
    db: options.Db = None

    def functions(self) -> tuple[list[Any], tuple[str, ...], list[str]]:
        """Return the functions, name, term and method of their model, and warnings."""
        from rbfrag.exchange.block_fragility import block_functions
        from rbfrag.exchange.fragility_function import openquake_type
        from rbfrag.fragility.measures import SPECTRAL
        from rbfrag.hazards.curve import ANSWERED

        kind = openquake_type(self.imt, "--imt")
        measure = kind.measure if kind.period_s is None else SPECTRAL.get(kind.period_s)
        if measure is None:
            raise InputError(f"--imt {self.imt}: use one of {ANSWERED}")
        table, is_class, remarks = self.toppling_blocks(name=self.name)
        functions, about = block_functions(
            [self.name] if is_class else list(table["block_id"]), table["p2_1_s2"], table["kr"],
            measure, one_class=is_class, levels=self.levels,
            model=self.model, db=self.db,
        )  # fmt: skip
        return functions, about, list(remarks)


@app.command("nrml", epilog="Example:  rbfrag export nrml --blocks blocks.csv --out blocks.xml")
@stacked
def nrml(out: Out, blocks: FunctionOptions, json: options.Json = False) -> None:
    """Write an OpenQuake fragility model, NRML 0.5 (.xml); PGV is in cm/s there."""
    from rbfrag.exchange.nrml import nrml_text
    from rbfrag.files import output_path, write_text

    target = output_path(out, (".xml",), "NRML file")
    functions, about, warnings = blocks.functions()
    write_text(nrml_text(functions, description=_sentence(about)), target)
    _tell(str(target), functions, about, warnings, json)


@app.command(
    "pelicun", epilog="Example:  rbfrag export pelicun --p2 3 --kr 0.1 --out fragility.csv"
)
@stacked
def pelicun(out: Out, blocks: FunctionOptions, json: options.Json = False) -> None:
    """Write a fragility table of pelicun and SimCenter (.csv); PGV is in m/s (mps) there."""
    from rbfrag.exchange.pelicun_table import pelicun_text
    from rbfrag.files import output_path, write_text

    target = output_path(out, (".csv",), "fragility table")
    functions, about, warnings = blocks.functions()
    write_text(pelicun_text(functions), target)
    _tell(str(target), functions, about, warnings, json)


def _sentence(about: tuple[str, ...]) -> str:
    return f"Toppling of rock blocks, model {about[0]} ({about[2]} on {about[1]})"


def _tell(
    path: str, functions: list[Any], about: tuple[str, ...], warnings: list[str], json: bool
) -> None:
    errors = [function.grid_error for function in functions if function.grid_error is not None]
    document = {
        "file": path,
        "functions": len(functions),
        "lognormal": sum(function.is_lognormal for function in functions),
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
