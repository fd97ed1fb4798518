"""The table of commands, the objects that options travel in, and what is rejected."""

from __future__ import annotations

import importlib.util
import inspect
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer.testing import CliRunner

from rbfrag.cli.main import COMMANDS, app
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.option_groups import stacked
from rbfrag.cli.parameters.option_rules import CONFLICTS, NEEDS, reject
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import option_of

COMMAND_FOLDER = Path(__file__).parents[2] / "rbfrag" / "cli" / "commands"
MODULES = [import_module(f"rbfrag.cli.commands.{name.replace('-', '_')}") for name in COMMANDS]

MOST_PARAMETERS = 12


def test_the_table_names_every_module_and_its_first_line() -> None:
    assert {path.stem for path in COMMAND_FOLDER.glob("*.py")} == {
        *(name.replace("-", "_") for name in COMMANDS),
        "__init__",
    }
    group: Any = typer.main.get_command(app)
    for name, line in COMMANDS.items():
        command = group.get_command(None, name)
        assert command.name == name
        assert (command.help or "").split("\n")[0] == line, name
        assert len(name) + len(line) < 80, name


def test_no_command_has_more_parameters_than_a_reader_can_hold() -> None:
    for module in MODULES:
        for name, function in inspect.getmembers(module, callable):
            if inspect.isclass(function):
                continue
            whole = inspect.unwrap(function)
            if whole.__module__ == module.__name__:
                assert len(inspect.signature(whole, follow_wrapped=True).parameters) <= (
                    MOST_PARAMETERS
                ), (module.__name__, name)


def test_help_and_version_load_no_command() -> None:
    for option in ("--help", "--version"):
        program = (
            f"import sys; sys.argv = ['rbfrag', '{option}']\n"
            "from rbfrag.cli.main import run\n"
            "try:\n    run()\nexcept SystemExit:\n    pass\n"
            "own = [m for m in sys.modules if m.startswith('rbfrag.cli.commands')]\n"
            "print(own, file=sys.stderr)\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )  # fmt: skip
        assert done.stderr.strip() == "[]"
        assert "rbfrag" in done.stdout


def test_a_typing_error_is_answered_with_a_suggestion() -> None:
    result = CliRunner().invoke(app, ["prdict"])
    assert result.exit_code == 2
    assert "did you mean predict?" in result.stderr


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two options."""

    one: Annotated[float, typer.Option("--one", help="One.")] = 1.0
    two: Annotated[str | None, typer.Option("--two", help="Two.")] = None


def test_a_command_gets_the_object_and_the_shell_its_fields(
    capsys: pytest.CaptureFixture[str],
) -> None:
    made = typer.Typer(add_completion=False)

    @made.command()
    @stacked
    def show(
        name: Annotated[str, typer.Argument()], pair: Pair, json: options.Json = False
    ) -> None:
        """Show them."""
        typer.echo(f"{name} {pair} {json}")

    run = CliRunner().invoke
    assert run(made, ["a", "--two", "b", "--one", "3"]).stdout == (
        "a Pair(one=3.0, two='b') False\n"
    )
    assert run(made, ["a"]).stdout == "a Pair(one=1.0, two=None) False\n"
    assert "--two" in run(made, ["--help"]).stdout


def test_what_was_given_is_said_by_field_and_two_words_of_one_are_rejected() -> None:
    made = typer.Typer(add_completion=False)

    @made.command()
    @stacked
    def show(given: options.Block, measures: options.Measures) -> None:
        """Show them."""
        typer.echo(f"{given} {measures}")

    run = CliRunner().invoke
    assert run(made, ["--dip", "3", "--no-back", "--kind", "rocking", "--pga", "0.3"]).stdout == (
        "{'beta_deg': 3.0, 'back_fracture': False, 'kind': 'rocking'} {'pga_g': 0.3}\n"
    )
    rejected = run(made, ["--dip", "3", "--beta", "3"]).exception
    assert isinstance(rejected, InputError)
    assert rejected.spelled(option_of).startswith("--beta cannot be combined with --dip")


def test_the_table_rejects_by_what_is_given_and_known() -> None:
    reject("any", ["--p2", "--kr"], ["--p2", "--kr", "--motion", "--vertical"])
    with pytest.raises(
        InputError, match=r"--block cannot be combined with --p2: give one description"
    ):
        reject("any", ["--p2", "--block"], ["--p2", "--block"])
    with pytest.raises(
        InputError, match=r"--vertical requires --motion: give also the accelerogram"
    ):
        reject("any", ["--vertical"], ["--motion", "--vertical"])
    reject("respond", ["--vertical"], ["--vertical"])  # its motion is an argument
    reject("predict", ["--model"], ["--model", "--pgv"])
    with pytest.raises(InputError, match="--model requires an intensity measure"):
        reject("rockmass", ["--model"], ["--model", "--pgv"])


def test_every_option_of_the_table_is_one_of_a_command() -> None:
    group: Any = typer.main.get_command(app)
    known: dict[str, set[str]] = {}

    def walk(command: Any) -> None:
        for name in command.list_commands(None) if hasattr(command, "list_commands") else ():
            walk(command.get_command(None, name))
        known.setdefault(command.name, set()).update(o for p in command.params for o in p.opts)

    walk(group)
    everywhere = set().union(*known.values())
    for rule in (*CONFLICTS, *NEEDS):
        assert {*rule.options, *rule.other_options} <= everywhere, rule
        for command in rule.commands:
            assert {*rule.options} & known[command], rule
            assert {*rule.other_options} & known[command], rule


def test_the_stub_is_the_list_of_public_names() -> None:
    import rbfrag

    spec = importlib.util.find_spec("rbfrag")
    assert spec is not None
    stub = Path(str(spec.origin)).with_suffix(".pyi").read_text(encoding="utf-8")
    lines = [line for line in stub.splitlines() if not line.startswith("#")]
    assert len(lines) == len(rbfrag.__all__)
    for line in lines:
        *_, name = line.split()
        assert hasattr(rbfrag, name)
    with pytest.raises(AttributeError, match="no attribute 'nobody'"):
        _ = rbfrag.nobody
