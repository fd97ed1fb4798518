"""Records of the benchmarks, and the measured tables of the documentation, each by one script.

A page shows the few that a reader needs, each between two marks; the others are kept in
benchmarks/results, in a folder by the name of the page.
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pandas as pd

from rbfrag.bench import peers
from rbfrag.campaign.runner import machine

RECORDS_VARIABLE = "RBFRAG_TEST_RECORDS"

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "evidence" / "performance.md"
FIGURE = ROOT / "docs" / "figures" / "work-precision.svg"
RESULTS = ROOT / "benchmarks" / "results"


def parser(description: str | None) -> argparse.ArgumentParser:
    """Return a parser with what every script understands."""
    options = argparse.ArgumentParser(description=description)
    options.add_argument(
        "--records",
        help=f"accelerogram file or folder (default: {RECORDS_VARIABLE}, else as rbfrag bench)",
    )
    options.add_argument("--out", type=Path, help="folder for CSV files")
    options.add_argument("--write", action="store_true", help="keep the table, in docs or results")
    return options


def find_records(path: str | os.PathLike[str] | None = None) -> peers.Records:
    """Return the motions of a file or folder, else of RBFRAG_TEST_RECORDS, else of rbfrag bench."""
    return peers.find_records(path or os.environ.get(RECORDS_VARIABLE) or None)


def markdown(table: tuple[Sequence[str], Sequence[Sequence[str]]]) -> str:
    """Return headers and cells as a Markdown table."""
    headers, cells = table
    lines = [headers, ["---"] * len(headers), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write_csv(rows: Sequence[Any], path: Path) -> None:
    """Write rows (dataclasses) as CSV, one column per field."""
    pd.DataFrame(rows, dtype=object).to_csv(path, index=False)


def report(name: str, text: str, *, write: bool, page: Path | None = None) -> None:
    """Print a table with its machine; put it into the page if asked to."""
    text = f"{text}\n\n{machine_sentence()}"
    print(f"\n{text}", flush=True)
    if write:
        write_table(PAGE if page is None else page, name, text)


def write_table(page: Path, name: str, text: str) -> None:
    """Put a table into its place in the page, or among the results where the page has none."""
    pattern = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(<!-- end -->)", re.S)
    shown, count = pattern.subn(
        lambda match: f"{match[1]}\n{text}\n\n{match[2]}", page.read_text(encoding="utf-8")
    )
    if count:
        page.write_text(shown, encoding="utf-8")
        return
    file = RESULTS / page.stem / f"{name}.md"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{text}\n", encoding="utf-8")


def machine_sentence() -> str:
    """Return processor, cores, load and versions in one sentence."""
    about = machine()
    try:
        about["scikit-sundae"] = version("scikit-sundae")
    except PackageNotFoundError:
        about["scikit-sundae"] = None
    versions = ", ".join(
        f"{name} {about[name]}"
        for name in ("python", "numpy", "numba", "scipy", "scikit-sundae")
        if about[name]
    )
    return (
        f"{about['processor']}, {about['cores']} cores, load {about['load']} at the end of the "
        f"measurement; {about['system']}, {versions}."
    )
