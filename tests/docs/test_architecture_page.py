"""The page on the architecture names functions that exist and prints today's structure."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def structure() -> ModuleType:
    script = ROOT / "docs" / "measure_structure.py"
    spec = importlib.util.spec_from_file_location("measure_structure", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("file", "name"), re.findall(r"\| `([\w/.]+)`: `(\w+)` \|", PAGE))
def test_each_step_names_what_its_file_defines(file: str, name: str) -> None:
    names = {
        getattr(node, "name", getattr(node, "id", None))
        for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Name)
    }
    assert name in names


def test_the_three_walks_have_fifteen_steps_at_most() -> None:
    walks = PAGE.split("\n## From the command")[1].split("\n## ")[0].split("\n### ")[1:]
    assert [walk.split("`")[1].split()[1] for walk in walks] == ["predict", "hazard", "simulate"]
    assert all(10 <= len(re.findall(r"\n\|.*`rbfrag/", walk)) <= 15 for walk in walks)


def test_the_table_of_the_structure_is_that_of_today(
    structure: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert structure.main(["--check"]) == 0, capsys.readouterr().err


def test_what_is_counted(structure: ModuleType) -> None:
    source = "import os  # a comment\n\n\ndef _f():\n    '''Doc.'''\n    return os\n\n\n_f()\n"
    assert structure.count_lines(source) == {"code lines": 4, "import lines": 1, "comments": 1}
    record = "from typing import NamedTuple\nclass A(NamedTuple):\n    a: int\n"
    counts = structure.count_definitions(source) + structure.count_definitions(record)
    assert counts == {
        "private functions": 1, "private functions used once": 1, "record classes": 1,
    }  # fmt: skip
