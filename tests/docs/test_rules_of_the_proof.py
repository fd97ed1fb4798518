"""The page of the proof names, for each rule, the function and the lines that do it."""

from __future__ import annotations

import importlib.util
import inspect
import re
from pathlib import Path

import pytest

from rbfrag.solver.search import envelopes

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "theory" / "critical.md"
ROWS = re.findall(
    r"^\| ([A-F]) \| `(\w+)` \| `([\w/.]+)`, (\d+)–(\d+) \|", PAGE.read_text("utf-8"), re.M
)


def test_every_rule_of_the_text_is_in_the_table() -> None:
    in_text = re.findall(r"^([A-Z])\. \*", PAGE.read_text("utf-8"), re.M)
    assert in_text == list("ABCDEF")
    assert {letter for letter, *_ in ROWS} == set(in_text)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}-{row[1]}")
def test_the_lines_are_those_of_a_function_that_names_the_rule(row: tuple[str, ...]) -> None:
    letter, name, file, first, last = row
    lines = (ROOT / file).read_text("utf-8").splitlines()
    body = lines[int(first) - 1 : int(last)]
    assert body[0].startswith(f"def {name}(")
    assert f'"""Rule {letter}: ' in "\n".join(body)
    assert all(line.startswith((" ", ")")) for line in body[1:] if line)
    following = next((line for line in lines[int(last) :] if line), "@")
    assert not following.startswith((" ", ")"))


def test_decide_has_the_letter_beside_the_branch() -> None:
    source = Path(inspect.getfile(envelopes)).read_text("utf-8")
    comments = "\n".join(re.findall(r"# .*", source))
    assert [letter for letter in "ABCDEF" if not re.search(rf"\b{letter}\b", comments)] == []


def test_the_table_is_as_the_script_writes_it() -> None:
    script = ROOT / "docs" / "locate_rules.py"
    spec = importlib.util.spec_from_file_location("locate_rules", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.main(["--check"]) == 0, "run python docs/locate_rules.py"
