"""`rbfrag export`: fragility functions for other tools."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions
from rbfrag.cli.parameters.stack import command_group, option, stacked
from rbfrag.cli.parameters.values import number_list
from rbfrag.errors import InputError

app = command_group(
    "Write fragility functions for other tools.",
    "Example:  rbfrag export nrml --height 2.4 --width 0.5 --out block.xml",
)

Out = Annotated[str, typer.Option("--out", help="File to write.")]


class Exported(NamedTuple):
    """Fragility functions to be written.

    Args:
        functions: the functions.
        about: name, term and method of the model that answered.
        warnings: what is to be said of them.
        descriptions: a sentence on the block of each.
    """

    functions: list[Any]
    about: tuple[str, ...]
    warnings: list[str]
    descriptions: list[str]


@dataclass(frozen=True, kw_only=True)
class FunctionOptions(BlocksOptions):
    """The blocks, one function each, and what a function is of."""

    name: str = option("Identifier of the one block or of the rock mass.", "block")
    imt: str = option("Measure of the function: PGV, PGA, or SA at 0.3, 1, 2 or 3 s.", "PGV")
    levels: int = option("Number of levels of a function that is not lognormal.", 80)
    model: options.Model = None
    db: options.Db = None

    def functions(self) -> Exported:
        """Return the functions of the blocks."""
        measure = self.measure()
        from rbfrag.exchange.block_fragility import block_functions

        table, is_class, remarks = self.toppling_blocks(name=self.name)
        p2, kr = table["p2_1_s2"], table["kr"]
        functions, about = block_functions(
            [self.name] if is_class else list(table["block_id"]), p2, kr,
            measure, one_class=is_class, levels=self.levels,
            model=self.model, db=self.db,
        )  # fmt: skip
        descriptions = (
            [f"Mean over {kr.size} stable toppling blocks of a rock mass, backed by a slope."]
            if is_class
            else [
                f"Rock block backed by a slope, p² = {a:.6g} 1/s², k_r = {b:.6g}."
                for a, b in zip(p2.tolist(), kr.tolist(), strict=True)
            ]
        )
        return Exported(functions, about, list(remarks), descriptions)

    def limit_states(self, shares: list[float]) -> Exported:
        """Return functions of a rock mass, one a share of its blocks [%]."""
        from rbfrag.exchange.share_fragility import share_functions

        measure = self.measure()
        table, _, remarks = self.toppling_blocks(name=self.name)
        functions, about, warnings = share_functions(
            self.name, table["p2_1_s2"], table["kr"], measure, shares, levels=self.levels,
            model=self.model, db=self.db,
        )  # fmt: skip
        return Exported(functions, about, [*remarks, *warnings], [])

    def measure(self) -> str:
        """Return the measure that the functions are of, as `predict` calls it."""
        from rbfrag.fragility.measures import SPECTRAL
        from rbfrag.hazards.curve import ANSWERED
        from rbfrag.hazards.measure_type import openquake_type

        kind = openquake_type(self.imt, "--imt")
        measure = kind.measure if kind.period_s is None else SPECTRAL.get(kind.period_s)
        if measure is None:
            raise InputError(f"--imt {self.imt}: use one of {ANSWERED}")
        return measure


@app.command("nrml", epilog="Example:  rbfrag export nrml --height 2.4 --width 0.5 --out block.xml")
@stacked
def nrml(
    out: Out,
    blocks: FunctionOptions,
    shares: str | None = option(
        "Shares of the blocks of a rock mass [%]: a limit state each, that at least so many fail. "
        "Example: 1,10,50.",
        metavar="LIST",
    ),
    json: options.Json = False,
) -> None:
    """Write an OpenQuake fragility model, NRML 0.5 (.xml); PGV is in cm/s there."""
    from rbfrag.exchange.nrml import nrml_text
    from rbfrag.files import output_path, write_text

    target = output_path(out, (".xml",), "NRML file")
    functions, about, warnings, _ = (
        blocks.functions()
        if shares is None
        else blocks.limit_states(number_list(shares, "--shares"))
    )
    write_text(nrml_text(functions, description=_sentence(about)), target)
    _print_answer(str(target), functions, about, warnings, json)


@app.command(
    "pelicun", epilog="Example:  rbfrag export pelicun --height 2.4 --width 0.5 --out fragility.csv"
)
@stacked
def pelicun(out: Out, blocks: FunctionOptions, json: options.Json = False) -> None:
    """Write a fragility table of pelicun and SimCenter (.csv), and its description (.json).

    PGV is in m/s (mps) there. The description has the table's name: fragility.json stands beside
    fragility.csv, as SimCenter's library has them.
    """
    from rbfrag.exchange.pelicun_table import metadata_text, pelicun_text, without_dashes
    from rbfrag.files import output_path, write_text

    target = output_path(out, (".csv",), "fragility table")
    beside = output_path(str(target.with_suffix(".json")), (".json",), "description")
    functions, about, warnings, descriptions = blocks.functions()
    functions, renamed = without_dashes(functions)
    table = pelicun_text(functions)
    write_text(metadata_text(functions, descriptions, about), beside)
    write_text(table, target)
    more = {"description": str(beside)}
    _print_answer(str(target), functions, about, [*warnings, *renamed], json, more)


def _sentence(about: tuple[str, ...]) -> str:
    return f"Toppling of rock blocks, model {about[0]} ({about[2]} on {about[1]})"


def _print_answer(
    path: str,
    functions: list[Any],
    about: tuple[str, ...],
    warnings: list[str],
    json: bool,
    more: dict[str, Any] | None = None,
) -> None:
    errors = [function.grid_error for function in functions if function.grid_error is not None]
    document = {
        "file": path,
        **(more or {}),
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
