"""Commands and names in the documentation exist."""

from __future__ import annotations

import importlib.util
import pkgutil
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rbfrag
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.quality import quality_flags

ROOT = Path(__file__).resolve().parent.parent.parent
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if "_build" not in p.parts),
]


@cache
def commands() -> dict[tuple[str, ...], Any]:
    script = ROOT / "docs" / "generate_cli_reference.py"
    spec = importlib.util.spec_from_file_location("generate_cli_reference", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return {words: command for words, command, _ in module.commands()}


def blocks(text: str, *languages: str) -> Iterator[str]:
    """Fenced blocks of a Markdown text in one of the languages."""
    for language, body in re.findall(r"^```(\w+)\n(.*?)^```", text, re.M | re.S):
        if language in languages:
            yield body


def command_lines(text: str) -> Iterator[list[str]]:
    """Words of every `rbfrag ...` command: lines of sh blocks, prompts of console blocks."""
    joined = text.replace("\\\n", " ")
    lines = [line for body in blocks(joined, "sh") for line in body.splitlines()]
    for body in blocks(joined, "console"):
        lines += [line[2:] for line in body.splitlines() if line.startswith("$ ")]
    for line in lines:
        words = shlex.split(line, comments=True)
        if words[:1] == ["rbfrag"]:
            yield words


def complaint(words: list[str]) -> str | None:
    """Return what is wrong with a command line, or None."""
    all_commands = commands()
    depth = 1
    while depth < len(words) and tuple(words[: depth + 1]) in all_commands:
        depth += 1
    command = all_commands[tuple(words[:depth])]
    rest = words[depth:]
    if hasattr(command, "list_commands") and rest and not rest[0].startswith("-"):
        return f"no command {' '.join(words[: depth + 1])}"
    options = {name for parameter in command.params for name in parameter.opts}
    options |= {"--help", "--help-all"}
    for word in rest:
        if word.startswith("--") and word.split("=")[0] not in options:
            return f"{' '.join(words[:depth])} has no option {word}"
    return None


def test_the_check_sees_wrong_commands() -> None:
    text = "```sh\nrbfrag predict \\\n  --p2 3 # three\nls\n```\n"
    text += "```console\n$ rbfrag models list\nrbfrag's output\n```\n"
    lines = list(command_lines(text))
    assert lines == [["rbfrag", "predict", "--p2", "3"], ["rbfrag", "models", "list"]]
    assert complaint(lines[0]) is None
    assert complaint(["rbfrag", "predict", "--p3", "3"]) == "rbfrag predict has no option --p3"
    assert complaint(["rbfrag", "models", "burn"]) == "no command rbfrag models burn"
    assert complaint(["rbfrag", "topple"]) == "no command rbfrag topple"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_documented_commands_and_options_exist(page: Path) -> None:
    for words in command_lines(page.read_text(encoding="utf-8")):
        assert complaint(words) is None, words


def test_make_targets_in_the_documentation_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.M))
    named = set()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        named |= set(re.findall(r"`make ([a-z-]+)`", text))
        for body in blocks(text, "sh"):
            named |= set(re.findall(r"^make ([a-z-]+)", body, re.M))
    assert {"demo", "test"} <= named
    assert named <= targets


def test_readme_starts_with_the_two_commands() -> None:
    first = next(blocks((ROOT / "README.md").read_text(encoding="utf-8"), "sh"))
    assert [line.split("#")[0].strip() for line in first.splitlines()] == ["make demo", "make test"]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_local_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_named_files_and_modules_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"(?<![\w./-])((?:rbfrag|tests|benchmarks)/[\w./-]*\w)", text):
        assert (ROOT / name).exists() or (page.parent / name).exists(), name
    for name in re.findall(r"`((?:rbfrag|benchmarks)(?:\.\w+)+)", text):
        first, *rest = name.split(".")
        place = ROOT / first
        if first == "rbfrag" and rest[0] in (*rbfrag.__all__, "__all__"):
            continue
        # as far as folders go, then a module; what follows is a name in it
        while rest and (place / rest[0]).is_dir():
            place /= rest.pop(0)
        assert not rest or (place / f"{rest[0]}.py").exists(), name


def test_every_quality_flag_is_explained() -> None:
    absurd = GroundMotion(np.full(50, 50.0), 0.5)
    codes = {flag.code for motion in (absurd, absurd.scaled(0.0)) for flag in quality_flags(motion)}
    assert len(codes) == 10
    text = (ROOT / "docs" / "howto" / "add-motions.md").read_text(encoding="utf-8")
    assert {code for code in codes if f"`{code}`" not in text} == set()


def test_every_public_name_is_in_the_reference_with_a_docstring() -> None:
    text = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    documented = set(re.findall(r"^\.\. auto\w+:: rbfrag\.(\w+)$", text, re.M))
    public = set(rbfrag.__all__) - {"__version__"}
    assert documented == public
    for name in public:
        assert getattr(rbfrag, name).__doc__, name


def test_every_name_in_the_reference_exists() -> None:
    text = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    for name in re.findall(r"^\.\. auto\w+:: (\S+)$", text, re.M):
        assert pkgutil.resolve_name(name).__doc__, name


def test_the_gallery_has_every_figure_with_its_line() -> None:
    script = ROOT / "docs" / "generate_gallery.py"
    assert subprocess.run([sys.executable, str(script), "--check"], check=False).returncode == 0
    shown = re.findall(r"\(figures/([^)]+)\)", (ROOT / "docs" / "gallery.md").read_text("utf-8"))
    assert sorted(shown) == sorted(path.name for path in (ROOT / "docs" / "figures").iterdir())


def rows_of(text: str) -> list[list[str]]:
    """Cells of the rows of Markdown tables."""
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.splitlines()
        if line.startswith("|")
    ]


def test_readme_states_the_speeds_that_were_measured() -> None:
    stored = ROOT / "benchmarks" / "results" / "performance" / "work-precision.md"
    measured = {tuple(row[:2]): row for row in rows_of(stored.read_text(encoding="utf-8"))}
    rows = rows_of((ROOT / "README.md").read_text(encoding="utf-8"))
    settings = [
        ("rbfrag, p·h ≤ 0.03", "order 8"),
        ("CVODE in Python", "rtol 1e-06"),
        ("forward Euler", "dt/64"),
    ]
    for (_, errors, time, times), setting in zip(rows[2:5], settings, strict=True):
        of_run = measured[setting]
        median, worst = (float(text) for text in of_run[3:5])
        assert [float(text) for text in errors.strip(")").split(" (")] == [
            float(f"{median:.0e}"),
            float(f"{worst:.0e}"),
        ]
        assert time == of_run[5]
        assert times.removesuffix(" times as long") in ("", of_run[7].strip("×"))


def test_hard_cases_are_counted_as_their_table_has_them() -> None:
    page = (ROOT / "docs" / "evidence" / "hard-cases.md").read_text(encoding="utf-8")
    table = [row for row in rows_of(page) if row[0].startswith("`") and row[3].isdigit()]
    tried, wrong, within, undecided = (sum(int(row[at]) for row in table) for at in range(3, 7))
    assert f"Of {tried:,} cases {within:,} came out" in page
    assert f"or certified, {wrong} wrong. {undecided} got no such claim" in page
