"""The command-line page is what `--help` prints, and leaves no command out."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
SCRIPT = ROOT / "docs" / "generate_cli_reference.py"
PAGE = ROOT / "docs" / "reference" / "cli.md"


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate_cli_reference", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.mark.parametrize(
    "environment", [{"COLUMNS": "40"}, {"COLUMNS": "300", "FORCE_COLOR": "1"}], ids=str
)
def test_page_is_up_to_date_whatever_the_terminal(environment: dict[str, str]) -> None:
    result = run("--check", **environment)
    assert result.stderr == ""
    assert result.returncode == 0


def test_a_stale_page_is_noticed(
    generator: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stale = tmp_path / "cli.md"
    stale.write_text(PAGE.read_text(encoding="utf-8").replace("--help", "--halp"))
    monkeypatch.setattr(generator, "PAGE", stale)
    monkeypatch.setattr(generator, "ROOT", tmp_path)
    assert generator.main(["--check"]) == 1
    assert "make cli-reference" in capsys.readouterr().err
    assert generator.main([]) == 0
    assert generator.main(["--check"]) == 0


def test_every_command_is_documented_with_help_and_example(generator: ModuleType) -> None:
    text = PAGE.read_text(encoding="utf-8")
    seen = 0
    for words, command, help_text in generator.commands():
        seen += 1
        section = text.split(f"# `{' '.join(words)}`\n")[1].split("\n## ")[0].split("\n### ")[0]
        for name, about in generator.records(command):
            assert name in section or f"`{name}`\n: {about}" in text, words
        assert command.help, words
        if not hasattr(command, "list_commands"):
            assert f"Example:  {' '.join(words)}" in help_text, words
            for parameter in command.params:
                assert parameter.help, (words, parameter.name)
    assert seen > 10
