"""The figures of the documentation, drawn again:  python -m benchmarks.figures

Reads the commands off the captions ("Drawn by `rbfrag …`") and runs them from the top of the
source, so that what a caption says is what was done. Left out are those that need a database or a
record of one's own.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.page import ROOT

CAPTION = re.compile(r"Drawn by\*\s+`rbfrag\s+((?:plot|block|rockmass|report)\s[^`]+)`")


def commands(docs: Path = ROOT / "docs") -> list[tuple[Path, list[str]]]:
    """Return the page and the arguments of each caption's command."""
    return [
        (page, shlex.split(command))
        for page in sorted(docs.rglob("*.md"))
        for command in CAPTION.findall(page.read_text(encoding="utf-8"))
    ]


def figure_of(arguments: Sequence[str]) -> str:
    """Return the file that a command draws."""
    option = "--out" if arguments[0] in ("plot", "report") else "--plot"
    return arguments[arguments.index(option) + 1]


def main(arguments: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--only", help="a part of the names of the figures to draw")
    options.add_argument("--list", action="store_true", help="print the commands, draw nothing")
    chosen = options.parse_args(arguments)
    for _, command in commands():
        if chosen.only is not None and chosen.only not in figure_of(command):
            continue
        print(shlex.join(["rbfrag", *command]), flush=True)
        if not chosen.list:
            start = "from rbfrag.cli.main import run; run()"
            subprocess.run(
                [sys.executable, "-c", start, *command],
                cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
            )  # fmt: skip


if __name__ == "__main__":
    main()
