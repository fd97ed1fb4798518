"""Write docs/reference/cli.md from the help of every command; `--check` only compares."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "reference" / "cli.md"
WIDTH = 88

HEAD = """\
# Command line

<!-- Written by docs/generate_cli_reference.py; change the commands, not this page. -->

What every command has in common:

- `--help` names units and shows an example; `--json` prints one JSON document on standard
  output and nothing else. Progress and warnings go to standard error.
- Exit status 0: done. 1: the work failed part-way, or a check failed; what was finished is
  kept. 2: bad input. 130: interrupted.
- `--db` takes a path or an SQLAlchemy URL; without it `RBFRAG_DB` is used, or else
  `rbfrag.db` in the current folder.
- `MOTION` is a file, `FILE#INDEX` for one trace of several, or a database id.
"""


def commands(app: Any = None) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    """Yield every command as (words, command, help), the root first, in the order of `--help`.

    Args:
        app: a Typer application; rbfrag's own if None.
    """
    import typer.main

    if app is None:
        from rbfrag.cli.main import app
    yield from _walk(("rbfrag",), typer.main.get_command(app), None)


def _walk(
    words: tuple[str, ...], command: Any, parent: Any
) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    context = command.context_class(
        command,
        info_name=words[-1],
        parent=parent,
        terminal_width=WIDTH,
        max_content_width=WIDTH,
        color=False,
    )
    lines = command.get_help(context).splitlines()
    yield words, command, "\n".join(line.rstrip() for line in lines).strip()
    if hasattr(command, "list_commands"):
        for name in command.list_commands(context):
            yield from _walk((*words, name), command.get_command(context, name), context)


def page() -> str:
    """Return the whole page."""
    parts = [HEAD]
    for words, _, text in commands():
        level = "#" * (2 if len(words) <= 2 else 3)
        parts.append(f"{level} `{' '.join(words)}`\n\n```text\n{text}\n```\n")
    return "\n".join(parts)


def main(arguments: list[str]) -> int:
    """Write the page, or compare it; return the exit status."""
    os.environ["COLUMNS"] = str(WIDTH)
    sys.path.insert(0, str(ROOT))
    text = page()
    if arguments == ["--check"]:
        if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
            print(f"{PAGE.relative_to(ROOT)} is stale: run  make cli-reference", file=sys.stderr)
            return 1
        return 0
    if arguments:
        print("usage: generate_cli_reference.py [--check]", file=sys.stderr)
        return 2
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
