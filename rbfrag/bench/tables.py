"""Measured rows as text: Markdown for people, CSV for programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

from rbfrag.bench.critical_search import SearchTimes
from rbfrag.bench.scaling import LengthRow, WorkersRow
from rbfrag.bench.work_precision import WorkPrecision
from rbfrag.errors import InputError

Row = WorkPrecision | SearchTimes | LengthRow | WorkersRow
Table = tuple[list[str], list[list[str]]]
"""Headers and cells."""

R = TypeVar("R")


def _table(rows: Sequence[R], columns: dict[str, Callable[[R], str]]) -> Table:
    return list(columns), [[text(row) for text in columns.values()] for row in rows]


def work_precision_table(rows: Sequence[WorkPrecision]) -> Table:
    """Return time against error of each method."""
    return _table(rows, {
        "method": lambda row: row.family,
        "setting": lambda row: row.setting,
        "wrong": lambda row: f"{row.wrong} of {row.cases}",
        "error, median": lambda row: _error(row.error_median),
        "error, worst": lambda row: _error(row.error_worst),
        "time of a run": lambda row: seconds(row.time_s),
        "10–90 %": lambda row: f"{seconds(row.time_low_s)} – {seconds(row.time_high_s)}",
        "slower, median": lambda row: ratio(row.slower),
        "slower, least": lambda row: ratio(row.slower_least),
    })  # fmt: skip


def critical_table(rows: Sequence[SearchTimes]) -> Table:
    """Return the times of searches, and of the same runs by others."""
    headers = [
        "work for one combination", "time", "10–90 %", "over rbfrag's 23 runs, median", "least",
        "over the search, median", "least", "other outcomes",
    ]  # fmt: skip
    return headers, [
        [
            row.name,
            seconds(row.time_s),
            f"{seconds(row.time_low_s)} – {seconds(row.time_high_s)}",
            *map(ratio, (row.over_runs, row.over_runs_least)),
            *map(ratio, (row.over_search, row.over_search_least)),
            "" if row.wrong is None else f"{row.wrong} of {23 * row.combinations}",
        ]
        for row in rows
    ]


def length_table(rows: Sequence[LengthRow]) -> Table:
    """Return how time grows with the record."""
    return _table(rows, {
        "made longer by": lambda row: row.lengthened,
        "samples": lambda row: str(row.samples),
        "moved": lambda row: str(row.moved),
        "one run": lambda row: seconds(row.run_s),
        "excitation": lambda row: seconds(row.excitation_s),
    })  # fmt: skip


def workers_table(rows: Sequence[WorkersRow]) -> Table:
    """Return how time falls with the workers."""
    return _table(rows, {
        "workers": lambda row: str(row.workers),
        "combinations": lambda row: str(row.combinations),
        "wall time": lambda row: seconds(row.seconds),
        "combinations per second": lambda row: f"{row.per_s:.0f}",
    })  # fmt: skip


def markdown(table: Table) -> str:
    """Return a table in Markdown."""
    headers, cells = table
    lines = [headers, ["---"] * len(headers), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """Write rows, one column per field."""
    import pandas as pd

    try:
        pd.DataFrame([asdict(row) for row in rows], dtype=object).to_csv(path, index=False)
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
