"""Completions that a shell offers while a command is typed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from tests.cli.conftest import Shell
from tests.fragility.conftest import model_row
from tests.synthetic import write_suite

PROGRAM = "import sys; sys.argv = ['rbfrag']; from rbfrag.cli.main import run; run()"


def offered(typed: str) -> list[str]:
    """Return what is offered for the last word."""
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False,
        env={
            **os.environ, "_RBFRAG_COMPLETE": "complete_bash", "COMP_WORDS": typed,
            "COMP_CWORD": str(len(typed.split(" ")) - 1),
            "PYTHONPATH": os.pathsep.join(part for part in sys.path if part),
        },
    )  # fmt: skip
    assert "Traceback" not in process.stderr
    return process.stdout.split()


def test_models_and_motions(shell: Shell, tmp_path: Path) -> None:
    shell("motions", "add", write_suite(tmp_path / "records", 3), "--db", "own.db")
    with opened_database("own.db") as engine, engine.begin() as connection:
        save_model(connection, model_row())
    name = model_row().name
    assert offered(f"rbfrag predict --db own.db --model {name[:2]}") == [name]
    assert offered(f"rbfrag models show --db own.db {name[:1]}") == [name]
    assert offered("rbfrag motions show --db own.db ") == ["1", "2", "3"]
    assert offered("rbfrag respond --db own.db 2") == ["2"]
    assert offered("rbfrag respond --db nowhere.db 2") == []
    assert "toppling-pgv_pga" in offered("rbfrag models show toppling-p")  # those that are shipped


def test_options_that_help_does_not_show_are_offered_too() -> None:
    assert {"--pgv", "--jrc", "--kct-sigma", "--no-back", "--help-all"} <= {
        *offered("rbfrag predict --")
    }
