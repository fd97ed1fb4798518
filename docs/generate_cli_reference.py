"""Write docs/reference/cli.md from the help of every command; `--check` only compares."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "reference" / "cli.md"
WIDTH = 88

HEAD = """\
# Command line

<!-- Written by docs/generate_cli_reference.py; change the commands, not this page. -->

What every command has in common:

- `--help` shows the 25 most used options with their units and an example, `--help-all` all
  options. `--json` prints one JSON document on standard output and nothing else. Progress goes
  to standard error.
- Exit status 0: done. 1: the work failed part-way, or a check failed; what was finished is
  kept. 2: bad input. 130: interrupted.
- `--db` takes a path or an SQLAlchemy URL. Without it `RBFRAG_DB` is used, else `rbfrag.db` in
  the current folder, else the built-in data set.
- `MOTION` is a file, `FILE#INDEX` for one trace of several, or a database id.

## Shared options

Options with the same meaning in several commands. Each command below lists those it shares, in
the order of this list.

"""


def commands(
    app: Any = None, shared: Collection[tuple[str, str]] = ()
) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    """Yield every command as (words, command, help), the root first, in the order of `--help`.

    Args:
        app: a Typer application; rbfrag's own if None.
        shared: records of options that the help leaves out.
    """
    import typer.main

    if app is None:
        from rbfrag.cli.main import app
    yield from _walk(("rbfrag",), typer.main.get_command(app), None, shared)


def _walk(
    words: tuple[str, ...], command: Any, parent: Any, shared: Collection[tuple[str, str]]
) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    context = _context(command, words[-1], parent)
    left_out = [
        option
        for option in command.get_params(context)
        if not option.hidden and option.get_help_record(context) in shared
    ]
    for option in left_out:
        option.hidden = True
    try:
        lines = command.get_help(context).splitlines()
    finally:
        for option in left_out:
            option.hidden = False
    yield words, command, "\n".join(line.rstrip() for line in lines).strip()
    if hasattr(command, "list_commands"):
        for name in command.list_commands(context):
            yield from _walk((*words, name), command.get_command(context, name), context, shared)


def _context(command: Any, name: str, parent: Any = None) -> Any:
    from rbfrag.cli.command import ALL_OPTIONS

    context = command.context_class(
        command,
        info_name=name,
        parent=parent,
        terminal_width=WIDTH,
        max_content_width=WIDTH,
        color=False,
    )
    context.meta[ALL_OPTIONS] = True
    return context


def records(command: Any) -> list[tuple[str, str]]:
    """Return name and help of each option of a command, as `--help` prints them."""
    context = _context(command, "")
    help_records = (option.get_help_record(context) for option in command.get_params(context))
    return [record for record in help_records if record and record[0].startswith("--")]


def shared_options(options: Collection[list[tuple[str, str]]]) -> list[tuple[str, str]]:
    """Return the options that two commands or more have alike; of one name the most usual.

    Args:
        options: the records of each command.
    """
    times = Counter(record for of_one in options for record in of_one)
    usual: dict[str, tuple[str, str]] = {}
    for record, count in times.items():
        name = record[0].split()[0]
        if count > 1 and (name not in usual or count > times[usual[name]]):
            usual[name] = record
    return list(usual.values())


def page() -> str:
    """Return the whole page."""
    of_each = {words: records(command) for words, command, _ in commands()}
    shared = shared_options(of_each.values())
    parts = [HEAD + "\n".join(f"`{name}`\n: {about}\n" for name, about in shared)]
    for words, _, text in commands(shared=shared):
        level = "#" * (2 if len(words) <= 2 else 3)
        parts.append(f"{level} `{' '.join(words)}`\n\n```text\n{text}\n```\n")
        runs = runs_of(shared, of_each[words])
        if runs:
            parts.append(f"Shared: {', '.join(runs)}.\n")
    return "\n".join(parts)


def runs_of(shared: list[tuple[str, str]], taken: list[tuple[str, str]]) -> list[str]:
    """Return the shared options that a command takes; three or more in a row as first to last."""
    runs: list[list[str]] = [[]]
    for record in shared:
        if record in taken and record[0] != "--help":
            runs[-1].append(f"`{record[0].split()[0]}`")
        elif runs[-1]:
            runs.append([])
    return [name for run in runs for name in ([f"{run[0]} to {run[-1]}"] if len(run) > 2 else run)]


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
