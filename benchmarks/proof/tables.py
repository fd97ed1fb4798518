"""Tables of what was proven, in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.proof.enclosed_run import NOT_ENCLOSED
from benchmarks.proof.ends import Row
from rbfrag.bench.tables import markdown


def by_size(rows: Sequence[Row]) -> str:
    """One line for each p²."""
    cells = []
    for p2 in sorted({row.p2 for row in rows}, reverse=True):
        some = [row for row in rows if row.p2 == p2]
        cells.append([f"{p2:g}", *_counts(some)])
    cells.append(["all", *_counts(rows)])
    head = [
        "p² [1/s²]", "combinations", "with vertical", "both ends at 1e-6 proven",
        "both ends of the bracket itself proven", "widest bracket, relative",
        "widest enclosure, topples [rad]", "widest, stays [s or rad]", "bits", "seconds, median",
    ]  # fmt: skip
    return markdown((head, cells))


def _counts(rows: Sequence[Row]) -> list[str]:
    seconds = sorted(row.seconds for row in rows)
    return [
        str(len(rows)),
        str(sum(row.vertical for row in rows)),
        str(sum(row.off_proven for row in rows)),
        str(sum(row.at_proven for row in rows)),
        f"{max(row.upper_kr / row.lower_kr - 1.0 for row in rows):.1e}",
        f"{max(row.topples_width for row in rows):.0e}",
        f"{max(row.stays_width for row in rows):.0e}",
        str(max(row.bits for row in rows)),
        f"{seconds[len(seconds) // 2]:.1f}",
    ]


def by_combination(rows: Sequence[Row]) -> str:
    """One line for each combination, by size."""
    head = [
        "record, polarity", "p²", "k_r, lower end", "topples at −1e-6, decided by", "width",
        "stays at +1e-6, decided by", "width", "the ends themselves", "s",
    ]  # fmt: skip
    cells = [
        [
            f"{row.motion}, {row.polarity}{', vertical' if row.vertical else ''}",
            f"{row.p2:g}",
            f"{row.lower_kr:.9f}",
            _said(row.topples_off, row.topples_by),
            f"{row.topples_width:.0e}",
            _said(row.stays_off, row.stays_by),
            f"{row.stays_width:.0e}",
            "proven" if row.at_proven else f"{row.topples_at}, {row.stays_at}",
            f"{row.seconds:.1f}",
        ]
        for row in sorted(rows, key=lambda row: -row.p2)
    ]
    return markdown((head, cells))


def _said(outcome: str, why: str) -> str:
    return f"not: {why}" if outcome == NOT_ENCLOSED else f"{outcome}, {why}"
