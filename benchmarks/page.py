"""The measured tables of the documentation: each stands between two marks, by one script."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from rbfrag.campaign.machine import machine

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "evidence" / "performance.md"
FIGURE = ROOT / "docs" / "figures" / "work-precision.svg"


def parser(description: str | None) -> argparse.ArgumentParser:
    """Return a parser with what every script understands."""
    made = argparse.ArgumentParser(description=description)
    made.add_argument(
        "--records", help="file or folder of accelerograms (default: as rbfrag bench)"
    )
    made.add_argument("--out", type=Path, help="folder for CSV files")
    made.add_argument("--write", action="store_true", help="write the table into the documentation")
    return made


def report(name: str, text: str, *, write: bool, page: Path | None = None) -> None:
    """Print a table with its machine; put it into the page if asked to."""
    text = f"{text}\n\n{machine_sentence()}"
    print(f"\n{text}", flush=True)
    if write:
        page = PAGE if page is None else page
        page.write_text(replaced(page.read_text(encoding="utf-8"), name, text), encoding="utf-8")


def replaced(page: str, name: str, text: str) -> str:
    """Return the page with the text between the marks of `name` exchanged."""
    pattern = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(<!-- end -->)", re.S)
    if len(pattern.findall(page)) != 1:
        raise SystemExit(f"{PAGE.name} has no single place marked <!-- {name} --> ... <!-- end -->")
    return pattern.sub(lambda match: f"{match[1]}\n{text}\n\n{match[2]}", page)


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
