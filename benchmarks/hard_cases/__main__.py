"""Run the hard cases and print one table:  python -m benchmarks.hard_cases [MODULE ...] [--write].

MODULE is a file of this folder (all of them by default); `--write` puts the rows into the table of
the documentation, and leaves those of other modules there as they are.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.hard_cases import Row
from benchmarks.page import ROOT, machine_sentence, write_table

PAGE = ROOT / "docs" / "evidence" / "hard-cases.md"
MARK = "hard cases"
HEAD = (
    "| module | what | against | tried | wrong | within its error estimate, or certified | not |\n"
    "| --- | --- | --- | --- | --- | --- | --- |"
)


def names() -> list[str]:
    """Return the modules of this folder that hold cases."""
    folder = Path(__file__).parent
    return sorted(
        module.name
        for module in pkgutil.iter_modules([str(folder)])
        if not module.name.startswith("_")
    )


def table_line(name: str, row: Row) -> str:
    return "| " + " | ".join((f"`{name}`", *(str(value) for value in row))) + " |"


def kept_lines(measured: Sequence[str]) -> list[str]:
    """Return the lines of the page's table that belong to modules not measured now."""
    text = PAGE.read_text(encoding="utf-8")
    table = text.split(f"<!-- {MARK} -->")[1].split("<!-- end -->")[0]
    return [
        written
        for written in table.splitlines()
        if written.startswith("| `") and written.split("`")[1] not in measured
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    options.add_argument("modules", nargs="*", metavar="MODULE", help=f"of {', '.join(names())}")
    options.add_argument("--write", action="store_true", help="write the rows into the page")
    chosen = options.parse_args(arguments)
    unknown = sorted(set(chosen.modules) - set(names()))
    if unknown:
        options.error(f"no module {unknown[0]}: choose of {', '.join(names())}")

    measured = chosen.modules or names()
    lines: list[str] = []
    for name in measured:
        print(name, file=sys.stderr, flush=True)
        started = time.process_time()
        rows = importlib.import_module(f"benchmarks.hard_cases.{name}").rows()
        spent_s = time.process_time() - started
        print(f"  {spent_s:.0f} s of one core", file=sys.stderr, flush=True)
        lines += [table_line(name, row) for row in rows]
    table = "\n".join((HEAD, *lines))
    print(f"{table}\n\n{machine_sentence()}")
    if chosen.write:
        table = "\n".join((HEAD, *sorted((*kept_lines(measured), *lines))))
        write_table(PAGE, MARK, f"{table}\n\n{machine_sentence()}")


if __name__ == "__main__":
    main()
