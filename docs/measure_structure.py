"""How much of the package knows one field of a question: the table of docs/architecture.md.

    python docs/measure_structure.py

Counted are the files of `rbfrag` outside `solver` and `fragility/fit` that name a field, the
functions of more than ten parameters outside the solver, the calls that hand on four or more names
unchanged, all lines, and code lines: those without blank lines, comments and docstrings.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "rbfrag"
APART = ("solver/", "fragility/fit/")
FIELDS = ("displacement_m", "restitution")
MOST_PARAMETERS, HANDED_ON = 10, 4


def measured() -> dict[str, int]:
    """Return the figures by what they count."""
    sources = {
        path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(PACKAGE.rglob("*.py"))
    }
    outside = {name: text for name, text in sources.items() if not name.startswith(APART)}
    figures = {
        f"files that name `{field}`": sum(
            re.search(rf"\b{field}\b", text) is not None for text in outside.values()
        )
        for field in FIELDS
    }
    nodes = [(name, node) for name, text in sources.items() for node in ast.walk(ast.parse(text))]
    figures[f"functions of more than {MOST_PARAMETERS} parameters"] = sum(
        _parameters(node) > MOST_PARAMETERS
        for name, node in nodes
        if isinstance(node, ast.FunctionDef) and not name.startswith("solver/")
    )
    figures[f"calls that hand on {HANDED_ON} names or more unchanged"] = sum(
        sum(_is_handed_on(each) for each in node.keywords) >= HANDED_ON
        for _, node in nodes
        if isinstance(node, ast.Call)
    )
    figures["files"] = len(sources)
    figures["lines"] = sum(text.count("\n") for text in sources.values())
    figures["code lines"] = sum(map(code_lines, sources.values()))
    return figures


_NOT_CODE = frozenset({
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
    tokenize.ENDMARKER,
})  # fmt: skip


def code_lines(source: str) -> int:
    """Return the number of lines of a module without blank lines, comments and docstrings."""
    docstrings: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                docstrings.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _NOT_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - docstrings)


def _parameters(function: ast.FunctionDef) -> int:
    own = function.args
    return len(own.posonlyargs) + len(own.args) + len(own.kwonlyargs)


def _is_handed_on(keyword: ast.keyword) -> bool:
    value = keyword.value
    return isinstance(value, ast.Name) and value.id == keyword.arg


if __name__ == "__main__":
    for what, count in measured().items():
        print(f"{count:7,}  {what}")
