"""The table of commands, and the list of public names."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from rbfrag.cli.main import COMMANDS, app

COMMAND_FOLDER = Path(__file__).parents[2] / "rbfrag" / "cli" / "commands"


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


def test_help_and_version_load_no_command() -> None:
    for option in ("--help", "--version"):
        program = (
            f"import sys; sys.argv = ['rbfrag', '{option}']\n"
            "from rbfrag.cli.main import run\n"
            "try:\n    run()\nexcept SystemExit:\n    pass\n"
            "own = [m for m in sys.modules if m.startswith('rbfrag.cli.commands')]\n"
            "print(own, file=sys.stderr)\n"
        )
        process = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )  # fmt: skip
        assert process.stderr.strip() == "[]"
        assert "rbfrag" in process.stdout


def test_a_typing_error_is_answered_with_a_suggestion() -> None:
    result = CliRunner().invoke(app, ["prdict"])
    assert result.exit_code == 2
    assert "did you mean predict?" in result.stderr


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
