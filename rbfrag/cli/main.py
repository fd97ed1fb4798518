"""The `rbfrag` command: where every command group is hung up.

Command modules import only typer at their top; what a command needs is imported inside it,
so that `rbfrag predict` and `rbfrag --help` start without numba, pandas or matplotlib.
"""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from rbfrag.cli.commands import bench as bench_command
from rbfrag.cli.commands import block as block_command
from rbfrag.cli.commands import critical, demo, fit, models, motions, plot, predict, respond
from rbfrag.cli.commands import db as database
from rbfrag.cli.commands import export as export_command
from rbfrag.cli.commands import hazard as hazard_command
from rbfrag.cli.commands import rockmass as rockmass_command
from rbfrag.cli.commands import serve as serve_command
from rbfrag.cli.commands import shakemap as shakemap_command
from rbfrag.cli.commands import simulate as simulate_command
from rbfrag.cli.commands import spectrum as spectrum_command
from rbfrag.errors import RbfragError
from rbfrag.version import __version__


class _OneLineErrors(TyperGroup):
    """Turn every error raised on purpose into one message and its exit status."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an rbfrag error ends it without a traceback."""
        try:
            return super().invoke(ctx)
        except RbfragError as error:
            print(f"rbfrag: {error}", file=sys.stderr)
            raise typer.Exit(error.exit_status) from None


app = typer.Typer(
    name="rbfrag",
    cls=_OneLineErrors,
    help="Seismic fragility of rock blocks: from accelerograms to failure probabilities.\n\n"
    "Units: accelerations in g, velocities in m/s, displacements in m, times in s, "
    "p2 in 1/s2, angles in degrees.",
    epilog="Example:  rbfrag predict --p2 3 --kr 0.1 --pgv 0.6",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"rbfrag {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and stop."
        ),
    ] = False,
) -> None:
    pass


app.command("block", epilog=block_command.EXAMPLE)(block_command.block)
app.command("rockmass", epilog=rockmass_command.EXAMPLE)(rockmass_command.rockmass)
app.add_typer(motions.app, name="motions")
app.command("respond", epilog=respond.EXAMPLE)(respond.respond)
app.command("critical", epilog=critical.EXAMPLE)(critical.critical)
app.command("spectrum", epilog=spectrum_command.EXAMPLE)(spectrum_command.spectrum)
app.command("simulate", epilog=simulate_command.EXAMPLE)(simulate_command.simulate)
app.command("fit", epilog=fit.EXAMPLE)(fit.fit)
app.command("predict", epilog=predict.EXAMPLE)(predict.predict)
app.command("hazard", epilog=hazard_command.EXAMPLE)(hazard_command.hazard)
app.command("shakemap", epilog=shakemap_command.EXAMPLE)(shakemap_command.shakemap)
app.add_typer(export_command.app, name="export")
app.add_typer(models.app, name="models")
app.add_typer(plot.app, name="plot")
app.add_typer(database.app, name="db")
app.command("serve", epilog=serve_command.EXAMPLE)(serve_command.serve)
app.command("bench", epilog=bench_command.EXAMPLE)(bench_command.bench)
app.command("demo", epilog=demo.EXAMPLE)(demo.demo)


def run() -> None:
    """Entry point of the console script."""
    app()
