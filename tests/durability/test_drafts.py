"""A process that is killed while it makes a database leaves nothing behind at the next start."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.durability import environment
from rbfrag.db.engine import opened_database

pytestmark = pytest.mark.skipif(os.name != "posix", reason="asks whether a process lives")

KILLED = """
import os, signal, sys
from rbfrag.db import engine as upgrade
from rbfrag.db.engine import open_database
migrate = upgrade.migrate
def killed(engine):
    if sys.argv[2] == "late":
        migrate(engine)
    os.kill(os.getpid(), signal.SIGKILL)
upgrade.migrate = killed
open_database(sys.argv[1], create=True)
"""


def drafts(folder: Path) -> list[str]:
    return [file.name for file in folder.iterdir() if ".new" in file.name]


@pytest.mark.parametrize("moment", ["early", "late"])
def test_the_next_start_removes_the_draft_of_a_dead_process(tmp_path: Path, moment: str) -> None:
    place = tmp_path / "a [1].db"  # a name with what glob gives a meaning
    command = [sys.executable, "-c", KILLED, str(place), moment]
    killed = subprocess.run(command, env=environment(), check=False)
    assert killed.returncode == -signal.SIGKILL
    assert drafts(tmp_path)
    assert not place.exists()
    with opened_database(place, create=True):
        assert drafts(tmp_path) == []
    assert place.exists()


def test_the_draft_of_a_living_process_stays(tmp_path: Path) -> None:
    from rbfrag.db.engine import _draft_prefix

    place = tmp_path / "a.db"
    draft = tmp_path / f"{_draft_prefix(place, os.getppid())}x.new"
    draft.touch()
    other = tmp_path / f"{_draft_prefix(tmp_path / 'b.db', 4_000_000)}x.new"
    other.touch()
    with opened_database(place, create=True):
        assert sorted(drafts(tmp_path)) == sorted([draft.name, other.name])
