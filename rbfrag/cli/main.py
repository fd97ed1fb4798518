"""The `rbfrag` command: its subcommands by name, each loaded on its first call.

Command modules import only typer at their top; what a command needs is imported inside it,
so that `rbfrag predict` starts without numba, pandas or matplotlib.
"""

from __future__ import annotations

import codecs
import gc
import os
import signal
import sys
from importlib import import_module

try:
    from typing import Annotated, Any

    import typer

    from rbfrag.cli.command import CommandGroup, Commands, name_in_errors, words_of
    from rbfrag.errors import InputError, RbfragError, one_paragraph
    from rbfrag.version import __version__
    from rbfrag.vocabulary.quantities import MEASURED, ONLY_PREDICT, name_of, option_of
except KeyboardInterrupt:  # Ctrl-C while libraries load
    raise SystemExit(130) from None

ONE_THREAD = "OPENBLAS_NUM_THREADS"
"""Threads of linear algebra, read where numpy is loaded. The matrices here are too narrow to be
shared, and threads that wait for one another on a busy machine spin
(docs/evidence/performance.md)."""

COMMANDS = {
    "block": "Print the failure mode, yield accelerations and p² of a block.",
    "rockmass": "Sample blocks from two joint sets; print their modes and yields.",
    "motions": "Add, list, show, rotate and export accelerograms.",
    "respond": "Compute the response of a block to an accelerogram.",
    "critical": "Compute the critical strength of an accelerogram, with bounds.",
    "spectrum": "Compute the toppling spectrum X(p) of accelerograms.",
    "simulate": "Compute and store critical values and outcomes of all motions.",
    "fit": "Fit a fragility model to stored critical values or outcomes.",
    "predict": "Print the probability of failure of blocks.",
    "scenario": "Print median and dispersion of the shaking in an earthquake.",
    "hazard": "Print annual rate and return period of failure of blocks.",
    "losses": "Compute failures and losses of blocks in an event set.",
    "survival": "Print the survival probability of standing blocks.",
    "shakemap": "Map the probability of failure of blocks over a ShakeMap.",
    "report": "Write a report on blocks (PDF or HTML).",
    "export": "Write fragility functions for other tools.",
    "models": "List, show and choose fitted fragility models.",
    "plot": "Draw models, data, spectra, responses and failure modes.",
    "db": "Upgrade, describe, check, export and merge databases, and import tables.",
    "serve": "Start the HTTP API and the web interface.",
    "bench": "Compare speed and error with general ODE solvers.",
    "demo": "Run an example from records to a prediction.",
    "warm-up": "Compile all kernels, so that later commands start faster.",
}
"""The modules of `rbfrag/cli/commands`, and the first line of each one's help."""


_UsageError: Any = typer.BadParameter.__base__
"""What typer raises for a wrong command line; where it stands depends on typer's version."""


_OPTIONS = {
    "full_map": "--map",
    "rotations_deg": "--rotation",
    "displacements_m": "--displacement",
    "restitution_factors": "--restitution-factor",
}
"""Options of campaigns and searches that Python calls otherwise."""


def usage_message(error: Any) -> str:
    """Return the message of a usage error of typer."""
    context = error.ctx
    option: Any = getattr(error, "option_name", None)
    parameter = getattr(error, "param", None)
    message = one_paragraph(error.format_message())
    if hasattr(error, "possibilities"):
        options = [
            name
            for option_parameter in context.command.get_params(context)
            for name in option_parameter.opts
        ]
        message = f"unknown option {option}{_suggestion(option, options)}"
        if name_of(option.lstrip("-").replace("-", "_")) in MEASURED:
            message = ONLY_PREDICT.format(option)
    elif option is not None:
        takes = "requires a value" if "requires" in message else "takes no value: omit it"
        message = f"{option} {takes}"
    elif parameter is not None:
        message = f"{name_in_errors(parameter)} is missing: {parameter.help}"
    elif message.startswith("No such command '"):
        word = message.split("'")[1]
        message = f"unknown command {word!r}{_suggestion(word, [*context.command.commands])}"
    elif message.startswith("Got unexpected"):
        message = f"unexpected argument {message.partition(' (')[2].rpartition(')')[0]}"
    return message if context is None else f"{message} (help: {words_of(context)} --help)"


def _suggestion(typed: str, words: list[str]) -> str:
    """Return the nearest of some words as a question."""
    from difflib import get_close_matches

    # the name of a field in Python or in a table is an option, too
    near = [option_of(name_of(typed.lstrip("-").replace("-", "_")))]
    near = [name for name in near if name in words] or [
        name for name in words if len(typed) > len("--") and name.startswith(typed)
    ]
    near = near[:3] or get_close_matches(typed, words, 1)
    *first, last = near or [""]
    return f"; did you mean {' or '.join(filter(None, (', '.join(first), last)))}?" if last else ""


def _ended(error: Any) -> Any:
    """Return what ends a wrong command line after its message; help in place of it stays."""
    if type(error).__name__ == "NoArgsIsHelpError":
        return error
    print(f"rbfrag: {usage_message(error)}", file=sys.stderr)
    return typer.Exit(error.exit_code)


class _Commands(CommandGroup):
    """Loads a command on its call, and turns expected errors into messages."""

    def __init__(self, **about: Any) -> None:
        super().__init__(**about)
        names: Any = dict.fromkeys(COMMANDS)
        self.commands = names  # for suggestions after a typing error

    def get_command(self, _: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        name = cmd_name.replace("-", "_")
        module = import_module(f"rbfrag.cli.commands.{name}")
        group = getattr(module, "app", None)
        if group is None:
            group = Commands()
            group.command(cmd_name, epilog=module.EXAMPLE)(getattr(module, name))
        command = typer.main.get_command(group)
        command.name = cmd_name
        return command

    def format_commands(self, _: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def invoke(self, ctx: Any) -> Any:
        """Run the command; print an rbfrag error without a traceback."""
        try:
            return super().invoke(ctx)
        except RbfragError as error:
            from rbfrag.cli.output import typed_option

            text = error.spelled(lambda name: _OPTIONS.get(name) or typed_option(name))
            print(f"rbfrag: {text}", file=sys.stderr)
            raise typer.Exit(error.exit_status) from None
        except OSError as error:
            if error.filename is None:  # a closed pipe, say
                raise
            # of a path that was only looked at: a name that is too long, a folder that is closed
            print(f"rbfrag: {InputError(f'{error.filename}: {error.strerror}')}", file=sys.stderr)
            raise typer.Exit(InputError.exit_status) from None
        except _UsageError as error:
            raise _ended(error) from None

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Read the words before the command."""
        try:
            return super().parse_args(ctx, args)
        except _UsageError as error:
            raise _ended(error) from None


app = typer.Typer(
    name="rbfrag",
    cls=_Commands,
    help="Seismic fragility of rock blocks: from accelerograms to failure probabilities.\n\n"
    "Units: accelerations in g, velocities in m/s, displacements in m, times in s, "
    "p2 in 1/s2, angles in degrees.",
    epilog="Example:  rbfrag predict --height 2.4 --width 0.5 --dip 3 --pgv 0.6",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(is_requested: bool) -> None:
    if is_requested:
        print(f"rbfrag {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit"
        ),
    ] = False,
) -> None:
    pass


_IN_ASCII = {
    "²": "2", "³": "3", "⁻": "-", "·": "*", "±": "+-", "–": "-", "−": "-", "…": "...", "≥": ">=",
    "≤": "<=", "°": " deg", "π": "pi", "φ": "phi", "β": "beta", "θ": "theta", "σ": "sigma",
    "Å": "A", "ø": "o", "é": "e",
}  # fmt: skip
"""What stands for a character that a stream cannot write; "?" for any other."""


def _plainly(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(character, "?") for character in text), error.end


def write_plainly() -> None:
    """Replace characters that a stream cannot encode, instead of failing."""
    codecs.register_error("plainly", _plainly)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="plainly")


def end_unwritten(error: OSError) -> None:
    """End with status 1 and an explanation where output cannot be written."""
    if not isinstance(error, BrokenPipeError):  # nobody reads on, which is no error
        print(f"rbfrag: the answer cannot be written: {error.strerror}", file=sys.stderr)
    # what is left unwritten would be tried again, and complained of, when the program ends
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    raise SystemExit(1)


def run() -> None:
    """Entry point of the console script."""
    os.environ.setdefault(ONE_THREAD, "1")
    gc.set_threshold(50_000)  # most objects belong to modules and stay: search them less often
    write_plainly()
    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except OSError as error:
        end_unwritten(error)
    except KeyboardInterrupt:  # once more while the command ends
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        raise SystemExit(130) from None


if __name__ == "__main__":
    run()
