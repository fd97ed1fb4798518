"""Commands that the demo proposes at its end work with what `make demo` installs."""

from __future__ import annotations

import multiprocessing
import re
import shlex
import signal
import subprocess
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest

from benchmarks.durability import COMMAND, environment
from rbfrag.cli.commands.demo import NEXT
from rbfrag.cli.commands.warm_up import compile_search
from rbfrag.errors import InputError
from tests.cli.conftest import Shell, shell

__all__ = ["shell"]

ROOT = Path(__file__).parents[2]


def test_the_last_lines_run_with_the_extras_that_are_installed(shell: Shell) -> None:
    *commands, last = NEXT
    assert (len(NEXT), last) == (3, "rbfrag serve")  # tests/service: it runs until it is stopped
    for command in commands:
        shell(*shlex.split(command)[1:])
    assert Path("blocks.pdf").read_bytes().startswith(b"%PDF")
    makefile, project = ((ROOT / name).read_text() for name in ("Makefile", "pyproject.toml"))
    (extras,) = re.findall(r"--editable '\.\[(plot,.*)\]'", makefile)
    expected = tomllib.loads(project)["project"]["optional-dependencies"]
    assert {"plot", "samples", "excel", "service"} <= {*extras.split(",")} <= {*expected}


def test_the_demo_says_at_its_end_that_it_fitted_synthetic_pulses(
    shell: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbfrag.cli.commands.demo._run", lambda context, arguments: None)
    monkeypatch.setattr("rbfrag.solver.integrator.compiled.is_missing_on_disk", lambda _: False)
    for package, output in ((None, True), ("rbfrag", False)):
        # a base install has no sample records
        monkeypatch.setattr(
            "rbfrag.motions.sample_motions.sample_folder", lambda p=package: p and Path()
        )
        monkeypatch.setattr("rbfrag.motions.sample_motions.find_spec", lambda name: None)
        end = shell("demo").stdout.partition("written:")[2]
        assert ("12 synthetic pulses" in end) is output


def start(folder: Path) -> subprocess.Popen[str]:
    """Start the demo with no compiled kernels."""
    return subprocess.Popen(
        [*COMMAND, "demo"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**environment(), "NUMBA_CACHE_DIR": str(folder / "kernels")}, start_new_session=True,
    )  # fmt: skip


def test_the_workers_of_the_first_demo_compile_nothing(tmp_path: Path) -> None:
    output, errors = start(tmp_path).communicate(timeout=900)
    assert "P(toppling) = " in output
    assert errors.count("compiling the kernels") == 1
    assert "Traceback" not in errors


def test_an_interrupt_ends_the_demo_and_its_second_process(tmp_path: Path) -> None:
    demo = start(tmp_path)
    assert demo.stderr is not None
    assert "compiling" in demo.stderr.readline()
    demo.send_signal(signal.SIGINT)
    # communicate ends when no process holds the other end any more
    assert demo.communicate(timeout=60)[1] == ""
    assert demo.returncode == 130


def wait_and_write() -> None:
    time.sleep(0.5)
    Path("compiled").touch()


def search_with_an_error() -> None:
    patch = pytest.MonkeyPatch()
    patch.setattr("rbfrag.solver.search.critical.critical", lambda *_, **__: 1 / 0)
    compile_search()


@pytest.mark.parametrize("is_missing", [True, False])
def test_the_search_waits_for_the_second_process_if_there_is_one(
    shell: Shell, monkeypatch: pytest.MonkeyPatch, is_missing: bool
) -> None:
    files: list[bool] = []

    def run(_: Any, arguments: tuple[str, ...]) -> None:
        if arguments[0] == "critical":
            files.append(Path("compiled").exists())
            raise InputError("a reason")

    monkeypatch.setattr("rbfrag.cli.commands.demo._run", run)
    monkeypatch.setattr("rbfrag.cli.commands.warm_up.compile_search", wait_and_write)
    monkeypatch.setattr(
        "rbfrag.solver.integrator.compiled.is_missing_on_disk", lambda _: is_missing
    )
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    shell("demo", expect=2)
    assert files == [is_missing]
    assert multiprocessing.active_children() == []


def test_an_error_in_the_second_process_is_left_to_the_first() -> None:
    process = multiprocessing.get_context("spawn").Process(target=search_with_an_error)
    process.start()
    process.join()
    assert process.exitcode == 0
