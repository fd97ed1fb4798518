"""What commands print: JSON for scripts, tables for people, and how far a long command is."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol


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


def check_files(*, table: str | None = None, plot: str | None = None) -> None:
    """Refuse a table or a figure that cannot be written, before long work."""
    if table is not None:
        from rbfrag.exchange.block_table import table_path

        table_path(table)
    if plot is not None:
        from rbfrag.plots.canvas import plot_path

        plot_path(plot)


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


SECONDS_BETWEEN_LINES = 5.0
"""Pause between two lines where they are not rewritten in place [s]."""


class Progress(Protocol):
    """What a line tells of."""

    @property
    def done(self) -> int:
        """Things done."""

    @property
    def total(self) -> int:
        """Things to do."""

    @property
    def rate_per_s(self) -> float:
        """Things done per second; 0 while that is not known."""

    @property
    def seconds_left(self) -> float | None:
        """Estimated time left [s]."""


class ProgressLine:
    """A line on standard error: rewritten on a terminal, now and then elsewhere.

    Args:
        command: the command that is under way.
        things: what is counted.
    """

    def __init__(self, command: str, things: str) -> None:
        self._command = command
        self._things = things
        self._terminal = sys.stderr.isatty()
        self._last = -SECONDS_BETWEEN_LINES
        self._shown = False

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(self, *_: object) -> None:
        if self._terminal and self._shown:
            print(file=sys.stderr)

    def show(self, progress: Progress, remark: str = "") -> None:
        """Show how far the command is."""
        now = time.monotonic()
        finished = progress.done == progress.total
        if not self._terminal and now - self._last < SECONDS_BETWEEN_LINES and not finished:
            return
        self._last = now
        left = progress.seconds_left
        text = f"{self._command}: {progress.done}/{progress.total} {self._things}"
        if remark:
            text += f" ({remark})"
        if progress.rate_per_s:
            text += f", {progress.rate_per_s:.1f} per second"
        if left is not None and not finished:
            text += f", {int(left) // 60}:{int(left) % 60:02d} left"
        if self._terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
            self._shown = True
        else:
            print(text, file=sys.stderr, flush=True)


def show_prediction(document: dict[str, Any], *, json: bool) -> None:
    """Print what `rbfrag predict` answers for one block."""
    if json:
        print_json(document)
        return
    answers = document.pop("answers")
    polarities = document.pop("polarities", None)
    warnings = document.pop("warnings")
    print_pairs({name: value for name, value in document.items() if name not in _LEFT_OUT or value})
    if polarities:
        print()
        print_table(
            ("polarity", "probability", "ci_low", "ci_high", "intensity_m_s"),
            [
                (name, p["probability"], p["ci_low"], p["ci_high"], p["intensity_m_s"])
                for name, p in polarities.items()
            ],
        )
    if len(answers) > 1:
        print()
        columns = ("model", "term", "probability", "ci_low", "ci_high", "in_domain", "recommended")
        print_table(columns, [tuple(answer[name] for name in columns) for answer in answers])
    print_warnings(warnings)


_LEFT_OUT = ("y_m_s", "median_displacement_m")
"""Keys that a table leaves out where they do not apply."""
