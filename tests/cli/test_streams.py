"""Output appears on any terminal, and a full disk ends with a sentence."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = (sys.executable, "-m", "rbfrag.cli.main", "predict", "--p2", "3", "--kr", "0.1",
           "--component", "single", "--pgv")  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "written"),
    [
        ("ascii", "Block     p2 = 3 s-2, k_r = 0.1;"),
        ("cp1252", "Block     p² = 3 s-², k_r = 0.1;"),
        ("utf-8", "Block     p² = 3 s⁻², k_r = 0.1;"),
    ],
)
def test_a_character_that_a_stream_cannot_write_is_replaced(encoding: str, written: str) -> None:
    process = subprocess.run(
        [*COMMAND, "0.6"], capture_output=True, check=True, env={"PYTHONIOENCODING": encoding}
    )
    assert written in process.stdout.decode(encoding)
    assert process.stderr == b""
    rejected = subprocess.run(
        [*COMMAND, "0.6", "--p2", "-1"], capture_output=True, check=False,
        env={"PYTHONIOENCODING": encoding},
    )  # fmt: skip
    assert rejected.returncode == 2
    assert rejected.stderr.startswith(b"rbfrag: ")


@pytest.mark.parametrize("more", [(), ("--json",)])
def test_a_full_disk_ends_with_a_sentence(more: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        process = subprocess.run(
            [*COMMAND, "0.6", *more], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert process.returncode == 1
    assert process.stderr == "rbfrag: the answer cannot be written: No space left on device\n"
