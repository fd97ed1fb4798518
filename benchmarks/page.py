"""The measured tables of the documentation, each by one script.

A page shows the few that a reader needs, each between two marks; the others are kept in
benchmarks/results, in a folder by the name of the page.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from rbfrag.campaign.machine import machine

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "evidence" / "performance.md"
FIGURE = ROOT / "docs" / "figures" / "work-precision.svg"
RESULTS = ROOT / "benchmarks" / "results"


def parser(description: str | None) -> argparse.ArgumentParser:
    """Return a parser with what every script understands."""
    made = argparse.ArgumentParser(description=description)
    made.add_argument(
        "--records", help="file or folder of accelerograms (default: as rbfrag bench)"
    )
    made.add_argument("--out", type=Path, help="folder for CSV files")
    made.add_argument("--write", action="store_true", help="keep the table, in docs or results")
    return made


def report(name: str, text: str, *, write: bool, page: Path | None = None) -> None:
    """Print a table with its machine; put it into the page if asked to."""
    text = f"{text}\n\n{machine_sentence()}"
    print(f"\n{text}", flush=True)
    if write:
        write_table(PAGE if page is None else page, name, text)


def write_table(page: Path, name: str, text: str) -> None:
    """Put a table into its place in the page, or among the results where the page has none."""
    pattern = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(<!-- end -->)", re.S)
    shown, places = pattern.subn(
        lambda match: f"{match[1]}\n{text}\n\n{match[2]}", page.read_text(encoding="utf-8")
    )
    if places:
        page.write_text(shown, encoding="utf-8")
        return
    kept = RESULTS / page.stem / f"{name}.md"
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(f"{text}\n", encoding="utf-8")


def machine_sentence() -> str:
    """Return processor, cores, load and versions in one sentence."""
    about = machine()
    versions = ", ".join(
        f"{name} {about[name]}"
        for name in ("python", "numpy", "numba", "scipy", "scikit-sundae")
        if about[name]
    )
    return (
        f"{about['processor']}, {about['cores']} cores, load {about['load']} at the end of the "
        f"measurement; {about['system']}, {versions}."
    )
