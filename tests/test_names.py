"""Names and first sentences in the code: no pronouns or participles, nouns and verbs instead."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

FOLDERS = ("rbfrag", "benchmarks", "docs", "examples", "tests")
"""Folders whose names are checked."""

SOURCES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))

REJECTED_NAMES = frozenset({
    "each", "given", "own", "places", "one", "whole", "some", "left", "here", "known", "free",
    "done", "what", "who", "others", "kept", "said", "stated", "found", "told", "asked", "made",
    "wanted", "usable",
})  # fmt: skip
"""Words that do not say what a thing is; with underscores or in capitals they are no better."""

REJECTED_FIRST_WORDS = frozenset({"What", "How", "Which", "Whether", "That"})
"""A docstring begins with a noun phrase or an imperative."""


JSON_KEYS = frozenset({"found"})
"""Fields of results that are called as their JSON keys: combinations of the status "found"."""


def names_in(source: str) -> list[tuple[int, str]]:
    """Return line and name of everything that a module names: variables, arguments, functions."""
    names: list[tuple[int, str]] = []
    nodes = list(ast.walk(ast.parse(source)))
    fields = {id(node.target) for node in nodes if isinstance(node, ast.AnnAssign)}
    for node in nodes:
        match node:
            case ast.Name(id=name) if name in JSON_KEYS and id(node) in fields:
                pass
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                names.append((node.lineno, name))
            case ast.arg(arg=name):
                names.append((node.lineno, name))
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                names.append((node.lineno, name))
            case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                names.append((node.lineno, name))
            case ast.alias(asname=str(name)) | ast.ExceptHandler(name=str(name)):
                names.append((node.lineno, name))
    return names


def rejected_names(source: str) -> list[str]:
    """Return 'line: name' of each name that says nothing."""
    return [
        f"{line}: {name}"
        for line, name in names_in(source)
        if name.strip("_").lower() in REJECTED_NAMES
    ]


def rejected_docstrings(source: str) -> list[str]:
    """Return 'line: first line' of each docstring that begins with a question word."""
    lines = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.get_docstring(node)
            if text and text.split()[0] in REJECTED_FIRST_WORDS:
                lines.append(f"{getattr(node, 'lineno', 1)}: {text.splitlines()[0]}")
    return lines


@pytest.mark.parametrize(
    "source",
    [
        "each = 1",
        "for own in []: pass",
        "[given for given in []]",
        "lambda known: 1",
        "def f(*, whole): pass",
        "def _stated(): pass",
        "class Wanted: pass",
        "class A:\n    left: int",
        "class A:\n    def __init__(self): self._places = 1",
        "match 1:\n    case one: pass",
        "import os as free",
        "_WHAT = ''",
        "(found := 1)",
    ],
)
def test_a_name_that_says_nothing_is_seen(source: str) -> None:
    assert rejected_names(source)


def test_a_question_as_docstring_is_seen() -> None:
    assert rejected_docstrings('"""What a run does."""')
    assert rejected_docstrings('def f():\n    """Whether it fails."""')
    assert not rejected_docstrings('"""Result of a run."""')


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_names_say_what_things_are(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    assert rejected_names(source) == []
    if path.is_relative_to(ROOT / "rbfrag"):
        assert rejected_docstrings(source) == []
