"""Progress on standard error: a bar on a terminal, lines elsewhere; and what compiling says."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from importlib import import_module

import pytest
from numba import njit

from rbfrag.campaign.executors import run_locally
from rbfrag.cli import output
from rbfrag.cli.output import ProgressBar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_lines_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = iter((0.0, 1.0, 6.0, 10.0, 10.0))
    monkeypatch.setattr(output.time, "monotonic", lambda: next(now))
    with ProgressBar("simulate", "combinations") as bar:
        for completed in (10, 12, 22, 30):
            bar.show(completed, 30, "10 stored before")
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "simulate: 10/30 combinations (10 stored before)",
        "simulate: 22/30 combinations (10 stored before), 2.0 per second, 0:04 left",
        "simulate: 30/30 combinations (10 stored before), 2.0 per second",
    ]
    with ProgressBar("motions add", "files", on_lines=False) as bar:
        bar.show(1, 2)
    assert capsys.readouterr().err == ""


def test_a_bar_with_rate_and_time_left_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr(sys, "stderr", terminal)
    with ProgressBar("simulate", "combinations") as bar:
        for completed in (5, 15, 25):
            bar.show(completed, 25)
    shown = terminal.getvalue()
    assert "simulate:" in shown
    assert "25/25" in shown
    assert "per second" in shown
    assert "0:00:00" in shown


def double(x: int) -> int:
    """Double a number by a kernel that is compiled in each process."""
    doubled: int = njit(lambda y: 2 * y)(x)
    return doubled


PROGRAM = """
from rbfrag.cli.output import say_when_compiling
from tests.cli.test_progress import double
say_when_compiling()
say_when_compiling()
print(double(1), double(2))
"""


def test_compiling_is_said_once_and_on_standard_error() -> None:
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )  # fmt: skip
    assert process.stdout == "2 4\n"
    assert process.stderr == "compiling the kernels for this machine; this happens once\n"


def test_of_several_workers_one_says_that_it_compiles(capfd: pytest.CaptureFixture[str]) -> None:
    output.say_when_compiling()
    answers = run_locally(double, iter(range(6)), 2, after_a_death="try again")
    assert sorted(answers) == [0, 2, 4, 6, 8, 10]
    assert capfd.readouterr().err.count("compiling the kernels for this machine") == 1


@pytest.mark.parametrize("command", ["respond", "critical", "simulate", "rockmass", "plot", "db"])
def test_commands_that_run_kernels_say_it(command: str) -> None:
    assert import_module(f"rbfrag.cli.commands.{command}").say_when_compiling
