"""Measured rows as text: Markdown for people, CSV for programs."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rbfrag.bench.critical_search import SearchTimes
from rbfrag.bench.scaling import LengthRow, WorkersRow
from rbfrag.bench.work_precision import WorkPrecision
from rbfrag.errors import InputError

Row = WorkPrecision | SearchTimes | LengthRow | WorkersRow
Table = tuple[list[str], list[list[str]]]


def work_precision_table(rows: Sequence[WorkPrecision]) -> Table:
    """Return headers and cells."""
    headers = [
        "method", "setting", "wrong", "error, median", "error, worst",
        "time of a run", "10–90 %", "slower, median", "slower, least",
    ]  # fmt: skip
    return headers, [
        [
            row.family,
            row.setting,
            f"{row.wrong} of {row.cases}",
            _error(row.error_median),
            _error(row.error_worst),
            seconds(row.time_s),
            f"{seconds(row.time_low_s)} – {seconds(row.time_high_s)}",
            ratio(row.slower),
            ratio(row.slower_least),
        ]
        for row in rows
    ]


def critical_table(rows: Sequence[SearchTimes]) -> Table:
    """Return headers and cells."""
    headers = [
        "work for one combination", "time", "10–90 %", "over rbfrag's 23 runs, median", "least",
        "over the search, median", "least", "other outcomes",
    ]  # fmt: skip
    return headers, [
        [
            row.name,
            seconds(row.time_s),
            f"{seconds(row.time_low_s)} – {seconds(row.time_high_s)}",
            ratio(row.over_runs),
            ratio(row.over_runs_least),
            ratio(row.over_search),
            ratio(row.over_search_least),
            "" if row.wrong is None else f"{row.wrong} of {23 * row.combinations}",
        ]
        for row in rows
    ]


def length_table(rows: Sequence[LengthRow]) -> Table:
    """Return headers and cells."""
    headers = ["made longer by", "samples", "moved", "one run", "excitation"]
    return headers, [
        [
            row.lengthened,
            str(row.samples),
            str(row.moved),
            seconds(row.run_s),
            seconds(row.excitation_s),
        ]
        for row in rows
    ]


def workers_table(rows: Sequence[WorkersRow]) -> Table:
    """Return headers and cells."""
    headers = ["workers", "combinations", "wall time", "combinations per second"]
    return headers, [
        [str(row.workers), str(row.combinations), seconds(row.seconds), f"{row.per_s:.0f}"]
        for row in rows
    ]


def markdown(table: Table) -> str:
    """Return a table in Markdown."""
    headers, cells = table
    lines = [headers, ["---"] * len(headers), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """Write rows, one column per field."""
    table = [asdict(row) for row in rows]
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(table[0]) if table else [])
            writer.writeheader()
            writer.writerows(table)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from error


def seconds(value: float) -> str:
    """Return a time to two digits with a unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= 0.9995 * size:
            return f"{_two_digits(value / size)} {unit}"
    return f"{_two_digits(value / 1e-9)} ns"


def ratio(value: float) -> str:
    """Return a ratio to two digits."""
    return f"{_two_digits(value)}×"


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):,.0f}" if value >= 9.95 else f"{value:.2g}"


def _error(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"
