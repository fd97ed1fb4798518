"""Files without an end: rejected at once by every command that takes a file."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Rejects, Shell

BLOCK = ("--p2", "3", "--kr", "0.1")

COMMANDS: dict[str, tuple[Callable[[str], tuple[str, ...]], str]] = {
    "respond": (lambda file: ("respond", file, *BLOCK), ".AT2"),
    "critical": (lambda file: ("critical", file, "--p2", "3"), ".AT2"),
    "spectrum": (lambda file: ("spectrum", file), ".AT2"),
    "predict": (lambda file: ("predict", *BLOCK, "--motion", file), ".AT2"),
    "table": (lambda file: ("predict", "--blocks", file, "--pgv", "0.6"), ".csv"),
    "workbook": (lambda file: ("predict", "--blocks", file, "--pgv", "0.6"), ".xlsx"),
    "parquet": (lambda file: ("predict", "--blocks", file, "--pgv", "0.6"), ".parquet"),
    "points": (lambda file: ("predict", "--blocks", file, "--pgv", "0.6"), ".geojson"),
    "metadata": (lambda file: ("motions", "add", ".", "--metadata", file), ".csv"),
    "outline": (lambda file: ("block", "--polygon", file), ".toml"),
    "mesh": (lambda file: ("block", "--mesh", file), ".obj"),
    "rock mass": (lambda file: ("rockmass", file), ".toml"),
    "curve": (lambda file: ("hazard", file, *BLOCK), ".csv"),
    "NRML curve": (lambda file: ("hazard", file, *BLOCK), ".xml"),
    "NSHM curve": (lambda file: ("hazard", file, *BLOCK), ".json"),
    "block file": (lambda file: ("predict", "--block", file, "--pgv", "0.6"), ".toml"),
    "draws": (lambda file: ("predict", "--block-draws", file, "--pgv", "0.6"), ".csv"),
    "rates": (lambda file: ("hazard", file, "--blocks", file), ".csv"),
    "shakemap": (lambda file: ("shakemap", file, *BLOCK, "--out", "out.csv"), ".xml"),
    "model": (lambda file: ("predict", *BLOCK, "--pgv", "0.6", "--db", file), ".db"),
}


def endless(folder: Path, kind: str, suffix: str) -> tuple[Path, Callable[[], None]]:
    """Make a path without an end, and what closes it."""
    path = folder / f"endless{suffix}"
    if kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "socket":
        server = socket.socket(socket.AF_UNIX)
        server.bind(os.path.relpath(path))
        return path, server.close
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        with path.open("wb") as file:
            file.truncate(300 << 30)
    return path, lambda: None


@pytest.mark.parametrize("kind", ["device", "pipe", "socket", "sparse"])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_without_an_end_is_rejected(
    shell: Shell, rejects: Rejects, tmp_path: Path, command: str, kind: str
) -> None:
    arguments, suffix = COMMANDS[command]
    path, close = endless(tmp_path, kind, suffix)
    try:
        message = rejects(*arguments(path.name))
    finally:
        close()
    assert path.name in message
    assert len(message) < 500
