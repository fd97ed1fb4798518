"""Write into the page of the proof where each of its rules is done; --check only compares."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "theory" / "critical.md"
SOURCE = ROOT / "rbfrag" / "solver" / "search"

BEGIN = "<!-- Written by docs/locate_rules.py from the docstrings; do not edit. -->\n\n"
END = "\n<!-- End of what docs/locate_rules.py writes. -->\n"


def rules() -> Iterator[tuple[str, str, str, str]]:
    """Yield letter, what is done, function and lines, of every function that does a rule."""
    for file in sorted(SOURCE.glob("*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.FunctionDef):
                continue
            first = (ast.get_docstring(node) or "").split("\n\n")[0].replace("\n", " ")
            if rule := re.fullmatch(r"Rule ([A-F]): (.*)\.", first):
                where = f"`{file.relative_to(ROOT)}`, {node.lineno}–{node.end_lineno}"
                yield rule[1], rule[2], f"`{node.name}`", where


def page(text: str) -> str:
    """Return the page with the table of the rules as the source has them."""
    before, rest = text.split(BEGIN)
    lines = ["| rule | function | lines | what it does |", "| --- | --- | --- | --- |"]
    lines += [
        f"| {rule} | {name} | {where} | {subject} |"
        for rule, subject, name, where in sorted(rules(), key=itemgetter(0))
    ]
    return before + BEGIN + "\n".join(lines) + "\n" + END + rest.split(END)[1]


def main(arguments: list[str]) -> int:
    """Write the page, or say whether it is up to date."""
    text = PAGE.read_text(encoding="utf-8")
    if "--check" not in arguments:
        PAGE.write_text(page(text), encoding="utf-8")
    elif page(text) != text:
        print(f"{PAGE} is out of date: run python docs/locate_rules.py")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
