"""Measure the size and structure of the package: the table of docs/architecture.md.

    python docs/measure_structure.py            print the table
    python docs/measure_structure.py --write    write it into docs/architecture.md
    python docs/measure_structure.py --check    compare it with docs/architecture.md

Everything is read from the syntax trees and tokens of `rbfrag`, but for the last two parts: the
functions of one answer come from a profile, the options from the commands themselves.
"""

from __future__ import annotations

import ast
import io
import os
import re
import subprocess
import sys
import tempfile
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "rbfrag"
PAGE = ROOT / "docs" / "architecture.md"
START, END = "<!-- structure -->\n", "<!-- end of structure -->\n"

QUESTION = ["predict", "--height", "2", "--width", "0.4", "--phi", "40", "--pgv", "0.9"]

PROFILE = f"""
import inspect, sys
calls = set()
def note(frame, event, argument):
    code = frame.f_code
    is_function = code.co_flags & inspect.CO_OPTIMIZED and not code.co_name.startswith("<")
    if is_function and "/rbfrag/" in code.co_filename:
        calls.add((code.co_filename, code.co_qualname))
from rbfrag.cli.main import run
sys.argv = ["rbfrag", *{QUESTION!r}]
sys.setprofile(note)
try:
    run()
except SystemExit:
    pass
sys.setprofile(None)
print("measured", len(calls), len({{file for file, _ in calls}}))
"""

NOT_CODE = frozenset({
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
    tokenize.ENDMARKER,
})  # fmt: skip

RECORD_BASES = frozenset({"NamedTuple", "TypedDict"})
IMPORTS = (ast.Import, ast.ImportFrom)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def count_lines(source: str) -> Counter[str]:
    """Return the numbers of code, comment and import lines of a module.

    A code line is one that is not blank and neither a comment nor part of a docstring.
    """
    docstrings: set[int] = set()
    imports: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                docstrings.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
            case ast.Import() | ast.ImportFrom():
                imports.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    code: set[int] = set()
    comments = 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        comments += token.type == tokenize.COMMENT
        if token.type not in NOT_CODE:
            code.update(range(token.start[0], token.end[0] + 1))
    return Counter(
        {
            "code lines": len(code - docstrings),
            "import lines": len(imports),
            "comments": comments,
        }
    )


def count_definitions(source: str) -> Counter[str]:
    """Return the numbers of private functions, those called once in their file, and record classes.

    A record class is a dataclass, a NamedTuple or a TypedDict.
    """
    nodes = list(ast.walk(ast.parse(source)))
    uses = Counter(
        node.id if isinstance(node, ast.Name) else node.attr
        for node in nodes
        if isinstance(node, ast.Name | ast.Attribute)
    )
    helpers = [
        node.name
        for node in nodes
        if isinstance(node, FUNCTIONS) and re.match(r"_[a-z]", node.name)
    ]
    return Counter(
        {
            "private functions": len(helpers),
            "private functions used once": sum(uses[name] == 1 for name in helpers),
            "record classes": sum(_is_record(node) for node in nodes),
        }
    )


def _is_record(node: ast.AST) -> bool:
    if not isinstance(node, ast.ClassDef):
        return False
    words = {
        name.id if isinstance(name, ast.Name) else name.attr
        for part in (*node.bases, *node.decorator_list)
        for name in ast.walk(part)
        if isinstance(name, ast.Name | ast.Attribute)
    }
    return "dataclass" in words or not words.isdisjoint(RECORD_BASES)


def profile_prediction() -> tuple[int, int]:
    """Return how many functions of rbfrag, in how many files, one `predict` of a shape runs."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("RBFRAG_DB", None)
    # in an empty folder the built-in data set answers
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.run(
            [sys.executable, "-c", PROFILE],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
    functions, files = process.stdout.splitlines()[-1].split()[1:]
    return int(functions), int(files)


def count_options() -> Iterator[tuple[str, int]]:
    """Yield the command line of each command and its number of options."""
    import typer.main

    from rbfrag.cli.main import app

    def walk(words: str, command: object) -> Iterator[tuple[str, int]]:
        commands = getattr(command, "commands", None)
        if commands is None:
            parameters = getattr(command, "params", ())
            yield words, sum(option.param_type_name == "option" for option in parameters)
            return
        for name in commands:
            yield from walk(f"{words} {name}", command.get_command(None, name))  # type: ignore[attr-defined]

    yield from walk("rbfrag", typer.main.get_command(app))


def measure() -> dict[str, int]:
    """Return the figures of the table by what they count, without those of single commands."""
    sources = [path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))]
    totals = sum((count_lines(text) + count_definitions(text) for text in sources), Counter())
    functions, files = profile_prediction()
    return {
        "files": len(sources),
        "code lines": totals["code lines"],
        "import lines": totals["import lines"],
        "comments": totals["comments"],
        "private functions": totals["private functions"],
        "private functions used once in their file": totals["private functions used once"],
        "record classes": totals["record classes"],
        "functions of one `predict` with a shape": functions,
        "files of one `predict` with a shape": files,
    }


def table() -> str:
    """Return the table of docs/architecture.md."""
    options = dict(count_options())
    most = sorted(options, key=lambda command: (-options[command], command))[:8]
    rows = [
        *measure().items(),
        *((f"options of `{command}`", options[command]) for command in most),
        ("options of all commands", sum(options.values())),
    ]
    lines = "".join(f"| {name} | {count:,} |\n" for name, count in rows)
    return f"| counted in `rbfrag` | number |\n| --- | ---: |\n{lines}"


def main(arguments: list[str]) -> int:
    """Print, write or compare the table."""
    if not arguments:
        print(table(), end="")
        return 0
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(START)
    page = f"{before}{START}\n{table()}\n{END}{rest.split(END, 1)[1]}"
    if "--check" not in arguments:
        PAGE.write_text(page, encoding="utf-8")
    elif page != text:
        print(f"{PAGE} is out of date: run python {__file__} --write", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
