"""What commands print: JSON for scripts, tables for people."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping, Sequence


def print_json(document: object) -> None:
    """Print one JSON document on standard output."""
    print(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False))


def print_pairs(pairs: Mapping[str, object]) -> None:
    """Print names and values in two columns; None is shown as a dash."""
    width = max(map(len, pairs), default=0)
    for name, value in pairs.items():
        print(f"{name:<{width}}  {cell(value)}")


def print_table(headers: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table: numbers to the right, text to the left."""
    table = [[cell(value) for value in row] for row in rows]
    numeric = [
        all(_is_number(row[i]) for row in table) and bool(table) for i in range(len(headers))
    ]
    widths = [
        max([len(header), *(len(row[i]) for row in table)]) for i, header in enumerate(headers)
    ]
    for line in [list(headers), *table]:
        fields = (
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(line, widths, numeric, strict=True)
        )
        print("  ".join(fields).rstrip())


def print_warnings(warnings: Iterable[str]) -> None:
    """Print warnings on standard error, one a line."""
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


def cell(value: object) -> str:
    """Return a value as people read it: six digits, a dash for nothing."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(cell(item) for item in value) or "-"
    return str(value)


def _is_number(text: str) -> bool:
    if text == "-":
        return True
    try:
        float(text)
    except ValueError:
        return False
    return True
