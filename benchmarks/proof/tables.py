"""Tables of what was proven, in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.page import markdown
from benchmarks.proof.brackets import Row
from benchmarks.proof.enclosed_run import NOT_ENCLOSED


def by_size(rows: Sequence[Row]) -> str:
    """One line for each p²."""
    head = [
        "p² [1/s²]", "combinations, with vertical", "lower end topples, upper stays",
        "at 1e-6 from them", "nothing above topples", "of these, bracket below K_up",
        "widest enclosure [rad, s]", "seconds: ends, above",
    ]  # fmt: skip
    sizes = sorted({row.p2 for row in rows}, reverse=True)
    cells = [[f"{p2:g}", *_counts([row for row in rows if row.p2 == p2])] for p2 in sizes]
    return markdown((head, [*cells, ["all", *_counts(rows)]]))


BELOW_K_UP = 1e-8
"""Relative distance from which on a bracket lies below K_up."""


def _counts(rows: Sequence[Row]) -> list[str]:
    below = [row for row in rows if row.k_up > row.upper_kr * (1.0 + BELOW_K_UP)]
    return [
        f"{len(rows)}, {sum(row.vertical for row in rows)}",
        str(sum(row.at_proven for row in rows)),
        str(sum(row.off_proven for row in rows)),
        str(sum(row.above_proven for row in rows)),
        f"{sum(row.above_proven for row in below)} of {len(below)}",
        f"{max(max(row.topples_width, row.stays_width) for row in rows):.0e}",
        f"{_median([row.seconds for row in rows])}, {_median([row.above_seconds for row in rows])}",
    ]


def _median(values: Sequence[float]) -> str:
    return f"{sorted(values)[len(values) // 2]:.1f}"


def by_combination(rows: Sequence[Row]) -> str:
    """One line for each combination, by size."""
    head = [
        "record, polarity", "p²", "k_r, lower end", "upper, relative to it",
        "at −1e-6, decided by", "width", "at +1e-6, decided by", "width", "the ends themselves",
        "nothing above topples", "intervals", "s",
    ]  # fmt: skip
    cells = [
        [
            f"{row.motion}, {row.polarity}{', vertical' if row.vertical else ''}",
            f"{row.p2:g}",
            f"{row.lower_kr:.9f}",
            f"+{row.upper_kr / row.lower_kr - 1.0:.1e}",
            _said(row.topples_off, row.topples_by),
            f"{row.topples_width:.0e}",
            _said(row.stays_off, row.stays_by),
            f"{row.stays_width:.0e}",
            "proven" if row.at_proven else f"{row.topples_at}, {row.stays_at}",
            row.above_reason or _proven(row.above_undecided),
            str(row.above_intervals),
            f"{row.seconds + row.above_seconds:.1f}",
        ]
        for row in sorted(rows, key=lambda row: -row.p2)
    ]
    return markdown((head, cells))


def _said(outcome: str, why: str) -> str:
    return f"not: {why}" if outcome == NOT_ENCLOSED else f"{outcome}, {why}"


def _proven(undecided: float) -> str:
    return f"proven but for {undecided:.0e} of k_r" if undecided else "proven"
