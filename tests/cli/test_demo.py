"""What the demo proposes at its end works with what `make demo` installs."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from rbfrag.cli.commands.demo import NEXT
from rbfrag.cli.parameters.option_groups import LONGEST_HELP, MOST_USED, OUTPUT
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
    first = text[text.index("Block and shaking:") : text.index("Block parameters:")]
    assert re.findall(r"^  (--[a-z-]+)", first, re.M) == [
        "--height", "--width", "--dip", "--phi", "--kind", "--pgv",
    ]  # fmt: skip
    assert len(re.findall(r"^  --pgv ", text, re.M)) == 1


def test_help_shows_the_most_used_options_and_help_all_the_rest(shell: Shell) -> None:
    def options(word: str) -> set[str]:
        return {*re.findall(r"^  (--[a-z0-9-]+)", shell("predict", word).stdout, re.M)}

    most_used, every = options("--help"), options("--help-all")
    assert len(most_used) == LONGEST_HELP
    assert {"--help-all", "--out", "--json"} <= most_used
    assert most_used < every
    assert "--help-all" not in shell("motions", "show", "--help").stdout
    for names in (OUTPUT, MOST_USED):
        assert len(names) == len({*names})


def test_the_demo_says_at_its_end_that_it_fitted_synthetic_pulses(
    shell: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbfrag.cli.commands.demo._run", lambda context, arguments: None)
    for package, told in ((None, True), ("rbfrag", False)):
        # a base install has no sample records
        monkeypatch.setattr(
            "rbfrag.motions.sample_motions.sample_folder", lambda p=package: p and Path()
        )
        monkeypatch.setattr("rbfrag.motions.sample_motions.find_spec", lambda name: None)
        end = shell("demo").stdout.partition("written:")[2]
        assert ("12 synthetic pulses" in end) is told
