"""Names, help and errors are in the terms of the field, without the words they replace."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import typer

from rbfrag.cli.main import app
from rbfrag.vocabulary.quantities import QUANTITIES, option_of

ROOT = Path(__file__).resolve().parent.parent
SOURCES = sorted(ROOT.glob("rbfrag/**/*.py"))

INSTEAD = {
    "fly flies flight flown": "integrate, trajectory",
    "lane lanes": "batch",
    "fresh": "from rest",
    "seat seats reseat": "impact, closes its contact",
    "fate fates course courses": "outcome, trajectory",
    "ahead behind": "upper or lower bounding trajectory, back",
    "still": "at rest, remaining excitation",
    "drive drives": "excitation",
    "odd": "flagged",
    "plain": "in domain",
    "padded": "zero-filled",
    "house houses room workshop garden shoulder shoulders": "package, module, worker pool",
    "piece pieces leftover leftovers": "chunk, part, remainder",
    "made found asked told said": "what it is: realisations, result, request, warnings",
}
"""Words that no identifier may contain, each with what to say instead."""

WORDS = {word: instead for words, instead in INSTEAD.items() for word in words.split()}
COMPLETE = {"Ground": "excitation", "Starts": "excursion table"}
"""The same of whole identifiers: ground motion is the field's own word."""

EXCEPTIONS = {
    "DatabaseNotFoundError": "a public error: scripts catch it by this name",
    "found": {
        "campaign/summary.py": "a key of the JSON answer of `simulate`",
        "db/queries.py": "the same of `db info --by suite`",
    },
    "FOUND_HAS_VALUE": "about the stored status `found`",
}
"""Identifiers that stay, and why; by file below rbfrag/ where the reason holds there alone."""


def identifiers(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield the names that a source gives: functions, classes, arguments, variables, attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr, node.lineno
        elif isinstance(node, ast.alias) and node.asname:
            yield node.asname, node.lineno


def words_of(name: str) -> set[str]:
    """Return the words of an identifier, by underscores and capitals."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def repeated_classes(sources: Mapping[str, str]) -> list[str]:
    """Return the names of classes that are made in more than one place, and where.

    Args:
        sources: texts by their place.
    """
    homes: dict[str, list[str]] = {}
    for where, source in sources.items():
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(f"{where}:{node.lineno}")
    return [
        f"{name}: {', '.join(positions)}" for name, positions in homes.items() if len(positions) > 1
    ]


def wrong_names(source: str, where: str) -> list[str]:
    """Return the identifiers of a source that are not in the field's terms."""
    values = []
    for name, line in identifiers(ast.parse(source)):
        reason = EXCEPTIONS.get(name, {})
        if isinstance(reason, str) or where in reason:
            continue
        instead = [WORDS[word] for word in sorted(words_of(name) & set(WORDS))]
        instead += [COMPLETE[name]] if name in COMPLETE else []
        values += [f"{where}:{line}: {name} (instead: {'; '.join(instead)})"] if instead else []
    return values


def test_names_are_the_terms_of_the_field() -> None:
    values = [
        text
        for path in SOURCES
        if "versions" not in path.parts  # migrations tell what the tables were once called
        for text in wrong_names(path.read_text(), path.relative_to(ROOT / "rbfrag").as_posix())
    ]
    assert not values, "\n".join(values)


def test_the_name_of_a_class_has_one_meaning() -> None:
    sources = {path.relative_to(ROOT / "rbfrag").as_posix(): path.read_text() for path in SOURCES}
    repeated = repeated_classes(sources)
    assert not repeated, "\n".join(repeated)


def test_a_second_class_of_a_name_is_seen() -> None:
    sources = {"a.py": "class A: pass", "b.py": "def f():\n    class A: pass"}
    assert repeated_classes(sources) == ["A: a.py:1, b.py:2"]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("def fly(ground): pass", "integrate"),
        ("class Ground: pass", "excitation"),
        ("made = 1", "realisations"),
        ("def f(asked): pass", "request"),
        ("class A:\n    lanesInUse: int", "batch"),
        ("import a as leftovers", "chunk"),
        ("self.told = 1", "warnings"),
    ],
)
def test_such_a_name_is_seen(source: str, words: str) -> None:
    (text,) = wrong_names(source, "a.py")
    assert words in text


def test_what_the_field_says_is_free() -> None:
    assert not wrong_names(
        "ground_motion = 1\nclass GroundMotion: pass\nstarts = restarted = 1", "a.py"
    )


def test_no_exception_is_left_over() -> None:
    names: dict[str, set[str]] = {}
    for path in SOURCES:
        where = path.relative_to(ROOT / "rbfrag").as_posix()
        for name, _ in identifiers(ast.parse(path.read_text())):
            names.setdefault(name, set()).add(where)
    for name, reason in EXCEPTIONS.items():
        assert name in names
        assert isinstance(reason, str) or set(reason) <= names[name]


TO_COPY = {
    "fragility/model.py": "the command that fits a model again, to be copied",
    "service/guard.py": "options of rbfrag serve, for who runs it",
    "service/work.py": "options of rbfrag serve, for who runs it",
}
"""Where options of the command line stand outside of it, and why."""


def test_options_are_spelled_by_the_command_line_alone() -> None:
    spelled = []
    for path in SOURCES:
        where = path.relative_to(ROOT / "rbfrag").as_posix()
        if where.startswith("cli/") or where in TO_COPY:
            continue
        tree = ast.parse(path.read_text())
        docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        spelled += [
            f"{where}:{node.lineno}: {node.value}"
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant)
            if isinstance(node.value, str) and id(node) not in docstrings
            if re.search("--[a-z]", node.value)
        ]
    assert not spelled, "\n".join(spelled)


AVOIDED = re.compile(
    r"\b(of 100 such|tells?|telling|told|stated|refuses?|refused|besides?|share|scatters?|"
    r"(?<!there )(is|are) no(ne)?|too far|like blocks|anew|at hand|made[- ]up|shaken|nought|"
    r"what the block may|greatest|goes? with|go together|says?|said|speed after an impact|lobes?|"
    r"left out|leave .{1,40} out|is taken|knows|counting error|brings down|comes loose|rungs?)\b",
    re.IGNORECASE,
)
"""Words of help and errors for which the glossary has a term of the field."""


def avoided_words(text: str) -> list[str]:
    """Return the words of a help or error text for which there is a term of the field."""
    return [match[0] for match in AVOIDED.finditer(text)]


def texts_of_errors(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and text of each message that a source raises, without its variable parts."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            for part in ast.walk(node.exc):
                if isinstance(part, ast.JoinedStr):
                    fixed = [p.value for p in part.values if isinstance(p, ast.Constant)]
                    yield part.lineno, "{}".join(map(str, fixed))
                elif isinstance(part, ast.Constant) and isinstance(part.value, str):
                    yield part.lineno, part.value


def helps_of(command: Any, words: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield name and text of the help of a command, its options and the commands below it."""
    context = command.context_class(command, info_name=words[-1])
    yield " ".join(words), command.help or ""
    for option in command.get_params(context):
        yield f"{' '.join(words)} {option.opts[0]}", getattr(option, "help", "") or ""
    for name in command.list_commands(context) if hasattr(command, "list_commands") else ():
        yield from helps_of(command.get_command(context, name), (*words, name))


def test_help_is_in_the_terms_of_the_field() -> None:
    values = [
        f"{name}: {', '.join(wrong)}"
        for name, text in helps_of(typer.main.get_command(app), ("rbfrag",))
        if (wrong := avoided_words(text))
    ]
    values += [
        f"{name}: {', '.join(wrong)}"
        for name, quantity in QUANTITIES.items()
        if (wrong := avoided_words(f"{quantity.help(option_of)} {quantity.prompt}"))
    ]
    assert not values, "\n".join(values)


def test_errors_are_in_the_terms_of_the_field() -> None:
    values = [
        f"{path.relative_to(ROOT)}:{line}: {', '.join(wrong)}: {text}"
        for path in SOURCES
        for line, text in texts_of_errors(path.read_text())
        if (wrong := avoided_words(text))
    ]
    assert not values, "\n".join(values)


@pytest.mark.parametrize(
    "text",
    ["the displacement that is too far", "'x' is no number", "--out goes with --blocks", "told"],
)
def test_an_avoided_word_is_seen(text: str) -> None:
    assert avoided_words(text)
    assert not avoided_words("there is no column kr; the limit state is read-only: omit --shares")
