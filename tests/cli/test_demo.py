"""Commands that the demo proposes at its end work with what `make demo` installs."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from rbfrag.cli.commands.demo import NEXT
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
    for package, output in ((None, True), ("rbfrag", False)):
        # a base install has no sample records
        monkeypatch.setattr(
            "rbfrag.motions.sample_motions.sample_folder", lambda p=package: p and Path()
        )
        monkeypatch.setattr("rbfrag.motions.sample_motions.find_spec", lambda name: None)
        end = shell("demo").stdout.partition("written:")[2]
        assert ("12 synthetic pulses" in end) is output
