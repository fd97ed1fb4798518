"""Options of commands: groups of them, their help, and which go together."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer.testing import CliRunner

from rbfrag.cli import options
from rbfrag.cli.command import (
    CONFLICTS,
    LONGEST_HELP,
    MOST_USED,
    NEEDS,
    OUTPUT,
    Commands,
    argument,
    option,
    reject,
)
from rbfrag.cli.main import COMMANDS, app
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import option_of
from tests.cli.conftest import Shell, shell

__all__ = ["shell"]

REFERENCE = Path(__file__).parents[2] / "docs" / "reference" / "cli.md"


def all_commands() -> Iterator[tuple[tuple[str, ...], Any]]:
    group: Any = typer.main.get_command(app)
    for name in COMMANDS:
        command = group.get_command(None, name)
        if hasattr(command, "commands"):
            yield from (((name, word), part) for word, part in command.commands.items())
        else:
            yield (name,), command


ALL = dict(all_commands())


def listed(text: str) -> list[str]:
    """Names of options between the first heading and the example."""
    text = text.partition("  Example:")[0]
    _, text = re.split(r"^[A-Z][A-Za-z -]+:$", text, maxsplit=1, flags=re.MULTILINE)
    return re.findall(r"^  (--[a-z0-9-]+)", text, re.MULTILINE)


@pytest.mark.parametrize("words", ALL, ids=" ".join)
def test_help_shows_the_most_used_options_and_help_all_every_one(
    shell: Shell, words: tuple[str, ...]
) -> None:
    every = [max(item.opts, key=len) for item in ALL[words].params
             if item.param_type_name == "option"]  # fmt: skip
    text = shell(*words, "--help").stdout
    most_used = listed(text)
    assert "--help" in most_used
    assert len(most_used) <= LONGEST_HELP
    assert "Example:  rbfrag " in text
    more = f"More options:  rbfrag {' '.join(words)} --help-all"
    if "--help-all" in every:
        assert len(most_used) == LONGEST_HELP
        assert more in " ".join(text.split("\n"))
        text = shell(*words, "--help-all").stdout
    assert "More options:" not in text or "--help-all" in every
    matches = re.findall(r"(?<![^ ]) (--[a-z0-9-]+)", text)  # with second names
    assert {*every} <= {*matches}
    reference = REFERENCE.read_text(encoding="utf-8")
    for name in every:
        assert re.search(rf"{name}\b", reference), name


def test_the_most_used_options_are_declared_once_and_exist() -> None:
    expected = {name for command in ALL.values() for item in command.params for name in item.opts}
    for names in (OUTPUT, MOST_USED):
        assert len(names) == len({*names})
        assert {*names} - {"--help"} <= expected


def test_the_first_six_options_are_those_of_a_beginner(shell: Shell) -> None:
    text = shell("predict", "--help").stdout
    first = text[: text.index("Block parameters:")]
    assert listed(first) == ["--height", "--width", "--dip", "--phi", "--kind", "--pgv"]
    assert len(re.findall(r"^  --pgv ", text, re.MULTILINE)) == 1
    assert {"--out", "--json"} <= {*listed(text)}


def _pair(first: float = option("One."), two: str | None = option("Two.", None, "--second")) -> Any:
    return first, two


def application(function: Any) -> typer.Typer:
    commands = Commands()
    commands.command("show", epilog="Example:  show")(function)
    return commands


def test_a_command_gets_what_the_function_of_a_group_returns() -> None:
    def show(
        *,
        name: str = argument("Name"),
        pair: Annotated[Any, _pair],
        flag: bool = option("Flag.", False),
        json: options.Json = False,
    ) -> None:
        """Show them."""
        typer.echo(f"{name} {pair} {flag} {json}")

    run, show_command = CliRunner().invoke, application(show)
    assert run(show_command, ["a", "--second", "b", "--first", "3", "--flag"]).stdout == (
        "a (3.0, 'b') True False\n"
    )
    assert run(show_command, ["a"]).stdout == "a (None, None) False False\n"
    text = run(show_command, ["--help"]).stdout
    assert "--second" in text
    assert "--no-flag" not in text


def test_inputs_are_given_by_field_and_two_words_of_one_are_rejected() -> None:
    def show(*, block: options.Block, measures: options.Measures) -> None:
        """Show them."""
        typer.echo(f"{block} {measures}")

    run, show_command = CliRunner().invoke, application(show)
    words = ["--dip", "3", "--no-back", "--kind", "rocking", "--pga", "0.3"]
    assert run(show_command, words).stdout == (
        "{'beta_deg': 3.0, 'back_fracture': False, 'kind': 'rocking'} {'pga_g': 0.3}\n"
    )
    rejected = run(show_command, ["--dip", "3", "--beta", "3"]).exception
    assert isinstance(rejected, InputError)
    assert rejected.spelled(option_of).startswith("--beta cannot be combined with --dip")


def test_options_without_effect_are_rejected() -> None:
    reject("any", ["--p2", "--kr"], ["--p2", "--kr", "--motion", "--vertical"])
    with pytest.raises(InputError, match=r"--blocks cannot be combined with --p2: give one desc"):
        reject("hazard", ["--p2", "--blocks"], ["--p2", "--blocks"])
    with pytest.raises(InputError, match=r"--vertical requires --motion: give it, too, or omit"):
        reject("any", ["--vertical"], ["--motion", "--vertical"])
    reject("respond", ["--vertical"], ["--vertical"])  # its motion is an argument
    reject("predict", ["--model"], ["--model", "--pgv"])
    with pytest.raises(InputError, match=r"--model requires an intensity measure, such as"):
        reject("rockmass", ["--model"], ["--model", "--pgv", "--pga", "--tm"])


def test_every_option_of_the_rules_is_one_of_a_command() -> None:
    expected = {words[-1]: {name for item in command.params for name in item.opts}
             for words, command in ALL.items()}  # fmt: skip
    everywhere = set().union(*expected.values())
    needs = [(tuple(words.split()), rest, commands) for words, rest, commands in NEEDS]
    for names, rest, commands in (*((a, b, d) for a, b, _, d in CONFLICTS), *needs):
        assert {*names, *rest} <= everywhere
        for command in commands:
            assert {*names} & expected[command]
            assert {*rest} & expected[command]
