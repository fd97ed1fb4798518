"""What the demo proposes at its end works with what `make demo` installs."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

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
    known = tomllib.loads(project)["project"]["optional-dependencies"]
    assert {"plot", "samples", "excel", "service"} <= {*extras.split(",")} <= {*known}


def test_the_first_six_options_are_those_of_a_beginner(shell: Shell) -> None:
    text = shell("predict", "--help").stdout
    first = text[text.index("First:") : text.index("A block by its numbers:")]
    assert re.findall(r"^  (--[a-z-]+)", first, re.M) == [
        "--height", "--width", "--dip", "--phi", "--kind", "--pgv",
    ]  # fmt: skip
    assert len(re.findall(r"^  --pgv ", text, re.M)) == 1
