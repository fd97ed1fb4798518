"""Brackets of critical values, proven: their ends, and that no stronger block topples."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from benchmarks.certify.recordings import Combination, Recording
from benchmarks.page import markdown
from benchmarks.proof.above import nothing_above
from benchmarks.proof.enclosed_run import NOT_ENCLOSED, STABLE, TOPPLED, Enclosure, enclose
from rbfrag.solver.results import DEFAULT_P2, POLARITIES

DISTANCE = 1e-6
"""Relative distance from the bracket at which blocks are proven to topple and to stay."""

EVERY_VERTICAL = 4
"""Each so many-th combination has its vertical."""


@dataclass(frozen=True)
class Row:
    """One combination; widths in rad (past recovery, energy) or s (last impact).

    The ends are those of the bracket itself (`at`) and blocks at `DISTANCE` from it (`off`); what
    begins with `above` is of all blocks from its upper end on.
    """

    motion: str
    polarity: str
    vertical: bool
    p2: float
    lower_kr: float
    upper_kr: float
    k_up: float
    certified: bool
    topples_off: str
    topples_at: str
    stays_at: str
    stays_off: str
    topples_by: str
    topples_width: float
    stays_by: str
    stays_width: float
    bits: int
    steps: int
    seconds: float
    above_reason: str
    above_undecided: float
    above_intervals: int
    above_seconds: float

    @property
    def key(self) -> tuple[str, str, bool, float]:
        return self.motion, self.polarity, self.vertical, self.p2

    @property
    def off_proven(self) -> bool:
        return (self.topples_off, self.stays_off) == (TOPPLED, STABLE)

    @property
    def at_proven(self) -> bool:
        return (self.topples_at, self.stays_at) == (TOPPLED, STABLE)

    @property
    def above_proven(self) -> bool:
        return not self.above_reason


def draw(records: Sequence[Recording], rng: np.random.Generator) -> Iterator[Combination]:
    """Combinations without end: p² in turn, recording and polarity at random."""
    upright = [recording for recording in records if recording.vertical is not None]
    number = 0
    while True:
        up = number % EVERY_VERTICAL == EVERY_VERTICAL - 1
        among = upright if up else records
        yield Combination(
            among[int(rng.integers(len(among)))],
            POLARITIES[int(rng.integers(2))],
            DEFAULT_P2[number % len(DEFAULT_P2)],
            up,
        )
        number += 1


def prove(combination: Combination, seconds: float) -> Row | None:
    """Search one combination and prove its bracket; None where no block topples or w <= 0.

    Args:
        combination: the combination.
        seconds: processor time after which the proof of all stronger blocks is given up.
    """
    result = combination.search()
    if result.status != "found" or result.lower is None or result.upper is None:
        return None
    excited = combination.excited()
    lower, upper = result.lower * excited.pga_g, result.upper * excited.pga_g
    k_up = (result.k_up_over_pga or np.nan) * excited.pga_g
    started = time.process_time()
    ends: list[Enclosure] = [
        enclose(excited, p2=combination.p2, kr=kr)
        for kr in (lower * (1.0 - DISTANCE), lower, upper, upper * (1.0 + DISTANCE))
    ]
    took = time.process_time() - started
    above = nothing_above(excited, p2=combination.p2, kr=upper, k_up=k_up, seconds=seconds)
    return Row(
        motion=combination.recording.name,
        polarity=combination.polarity,
        vertical=combination.with_vertical,
        p2=combination.p2,
        lower_kr=lower,
        upper_kr=upper,
        k_up=k_up,
        certified=result.certified,
        topples_off=ends[0].outcome,
        topples_at=ends[1].outcome,
        stays_at=ends[2].outcome,
        stays_off=ends[3].outcome,
        topples_by=ends[0].decided_by or ends[0].reason,
        topples_width=ends[0].width,
        stays_by=ends[3].decided_by or ends[3].reason,
        stays_width=ends[3].width,
        bits=max(end.bits for end in ends),
        steps=sum(end.steps for end in ends),
        seconds=took,
        above_reason=above.reason,
        above_undecided=above.undecided,
        above_intervals=above.intervals,
        above_seconds=above.seconds,
    )


def study(
    records: Sequence[Recording], limit: int, seed: int, rows: Path, seconds: float
) -> list[Row]:
    """Prove the brackets of `wanted` combinations; those in the file of rows are not repeated.

    Args:
        records: recordings to draw from.
        limit: combinations with a bracket.
        seed: draws.
        rows: CSV file to which each row is written as it is known.
        seconds: processor time for all stronger blocks of one combination.
    """
    before = {row.key: row for row in read(rows)} if rows.is_file() else {}
    proven: list[Row] = []
    seen = set()
    for combination in draw(records, np.random.default_rng(seed)):
        if len(proven) >= limit:
            break
        key = (
            combination.recording.name,
            combination.polarity,
            combination.with_vertical,
            combination.p2,
        )
        if key in seen:
            continue
        seen.add(key)
        row = before.get(key)
        if row is None:
            row = prove(combination, seconds)
            if row is None:
                continue
            write([*before.values(), row], rows)
            before[key] = row
        above = row.above_reason or "nothing above topples"
        print(
            f"{len(proven) + 1:3} {combination.name}: {row.topples_at}, {row.stays_at}, {above}",
            flush=True,
        )
        proven.append(row)
    return proven


def write(rows: Sequence[Row], path: Path) -> None:
    """Write rows as CSV."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, [field.name for field in fields(Row)], lineterminator="\n")
        table.writeheader()
        table.writerows(asdict(row) for row in rows)


def read(path: Path) -> list[Row]:
    """Read rows that `write` wrote."""
    as_is = {"float": float, "int": int, "bool": lambda text: text == "True", "str": str}
    with path.open(encoding="utf-8", newline="") as stream:
        return [
            Row(**{field.name: as_is[str(field.type)](row[field.name]) for field in fields(Row)})
            for row in csv.DictReader(stream)
        ]


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
            _describe(row.topples_off, row.topples_by),
            f"{row.topples_width:.0e}",
            _describe(row.stays_off, row.stays_by),
            f"{row.stays_width:.0e}",
            "proven" if row.at_proven else f"{row.topples_at}, {row.stays_at}",
            row.above_reason or _proven(row.above_undecided),
            str(row.above_intervals),
            f"{row.seconds + row.above_seconds:.1f}",
        ]
        for row in sorted(rows, key=lambda row: -row.p2)
    ]
    return markdown((head, cells))


def _describe(outcome: str, why: str) -> str:
    return f"not: {why}" if outcome == NOT_ENCLOSED else f"{outcome}, {why}"


def _proven(undecided: float) -> str:
    return f"proven but for {undecided:.0e} of k_r" if undecided else "proven"
