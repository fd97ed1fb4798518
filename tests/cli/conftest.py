"""The command line as tests call it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from rbfrag.cli.main import app
from tests.synthetic import shaking, write_at2


class Shell:
    """Runs commands in one folder and keeps what they printed."""

    def __call__(self, *arguments: str | Path, expect: int = 0) -> Any:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == expect, (result.exit_code, result.stdout, result.stderr)
        assert "Traceback" not in result.stderr
        return result

    def json(self, *arguments: str | Path) -> Any:
        """Return a document without its diagnostics, which are its warnings with their codes."""
        document = json.loads(self(*arguments, "--json").stdout)
        for answer in document if isinstance(document, list) else [document]:
            if isinstance(answer, dict) and "warnings" in answer:
                texts = [item["text"] for item in answer.pop("diagnostics")]
                assert texts == [*dict.fromkeys(answer["warnings"])]
        return document


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Shell:
    """Commands run in an empty folder without RBFRAG_DB."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    return Shell()


@pytest.fixture
def record(tmp_path: Path) -> Path:
    return write_at2(tmp_path / "record.AT2", shaking(3))


Rejects = Callable[..., str]


@pytest.fixture
def rejects(shell: Shell) -> Rejects:
    """Run a command that must be rejected with status 2, and return its one message."""

    def run(*arguments: str | Path, status: int = 2) -> str:
        result = shell(*arguments, expect=status)
        assert result.stdout == ""
        message: str = result.stderr.strip()
        assert message.startswith("rbfrag: ")
        assert "\n" not in message
        return message

    return run
