"""A campaign at full scale:  python -m benchmarks.campaign_scale --records FOLDER

FOLDER is the collection of real records that the tests use, with its MANIFEST.csv. Everything is
done by rbfrag itself on databases in a temporary folder; each campaign is a process of its own.
"""

from __future__ import annotations

import os
import sqlite3
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import bulk_insert
from benchmarks.one_campaign import run_campaign
from benchmarks.page import RECORDS_VARIABLE, markdown, parser, report
from rbfrag.campaign.add_motions import add_motions
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_to_suite, motion_rows

RECORDS = (50, 100, 265)
"""Numbers of records at which the memory is looked at."""

COMBINATIONS = 11_278
"""Combinations of the dissertation, of 23 runs each."""

GRID = 23

COARSE = 1e-3
"""Width of k_r/PGA that the maps leave undecided at a border."""

PARTS = ("default", "memory", "insert", "dissertation")


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    options.add_argument("--motions", type=int, help="take only so many horizontal motions")
    options.add_argument(
        "--sizes",
        type=int,
        default=-(-COMBINATIONS // (2 * RECORDS[-1])),
        help="number of p² in the dissertation-sized campaign",
    )
    chosen = options.parse_args(arguments)
    root = chosen.records or os.environ.get(RECORDS_VARIABLE)
    if root is None:
        raise SystemExit("no records: name a folder with --records")
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder) / "base.db"
        motions = prepare(Path(root), base, chosen.motions)
        measures = {
            "default": lambda: default(base, motions),
            "memory": lambda: memory(base, motions),
            "insert": lambda: insert(base, motions),
            "dissertation": lambda: dissertation(base, motions, chosen.sizes),
        }
        for part in PARTS:
            if part in chosen.parts:
                table = markdown(measures[part]())
                text = f"{table}\n\n{motions} horizontal motions."
                report(f"campaign-{part}", text, write=chosen.write)


def prepare(root: Path, base: Path, at_most: int | None) -> int:
    """Make a database of the records with nested suites; return how many horizontals count."""
    manifest = root / "MANIFEST.csv"
    added = add_motions([root], db=base, metadata=manifest if manifest.exists() else None)
    print(f"{len(added.added)} traces added", flush=True)
    with opened_database(base) as engine, engine.begin() as connection:
        rows = [row for row in motion_rows(connection) if not row.is_vertical]
        # The longest one is in every suite: what a campaign needs depends on it. The others
        # follow in an order that has nothing to do with them.
        rows.sort(key=lambda row: (-row.npts, row.sha256))
        rows[1:] = sorted(rows[1:], key=lambda row: row.sha256)
        rows = rows[:at_most]
        for size in sizes_up_to(len(rows)):
            for row in rows[:size]:
                add_to_suite(connection, f"first {size}", row.id)
    return len(rows)


def sizes_up_to(motions: int) -> list[int]:
    """Return the numbers of records to compare; of a smaller collection the same shares."""
    if motions >= RECORDS[-1]:
        return [*RECORDS[:-1], motions]
    return sorted({-(-size * motions // RECORDS[-1]) for size in RECORDS})


def default(base: Path, motions: int) -> tuple[list[str], list[list[str]]]:
    """The default campaign on one and on two workers."""
    cells = []
    for jobs in (1, 2):
        place = copy(base)
        before = place.stat().st_size
        done = run_campaign(place, jobs=jobs, suite=f"first {motions}")
        rows = stored_rows(place)
        cells.append(
            [
                str(jobs),
                f"{done['combinations']:,}",
                f"{done['found']:,} / {done['below_limit']:,} / {done['no_motion']:,}",
                f"{done['certified']:,}",
                f"{done['runs']:,}",
                f"{rows:,}",
                f"{done['seconds']:.0f} s",
                f"{done['writer_s'] + done['workers_s']:.0f} s",
                f"{rows / done['seconds']:,.0f}",
                f"{(place.stat().st_size - before) / 1e6:.1f} MB",
            ]
        )
        place.unlink()
    headers = [
        "workers", "combinations", "found / below the limit / no motion", "certified",
        "runs", "rows", "wall time", "processor time", "rows per second",
        "database grows by",
    ]  # fmt: skip
    return headers, cells


def memory(base: Path, motions: int) -> tuple[list[str], list[list[str]]]:
    """Peak memory against the number of records, one p² each."""
    cells = []
    for size in sizes_up_to(motions):
        place = copy(base)
        done = run_campaign(place, jobs=2, suite=f"first {size}", p2=[3.0])
        cells.append(
            [
                str(size),
                f"{done['combinations']:,}",
                f"{done['writer_mb']:.0f} MB",
                f"{done['worker_mb']:.0f} MB",
            ]
        )
        place.unlink()
    return ["records", "combinations", "peak of the writer", "peak of a worker"], cells


def insert(base: Path, motions: int) -> tuple[list[str], list[list[str]]]:
    """Writing the rows of the default campaign, beside plain sqlite3."""
    place = copy(base)
    run_campaign(place, jobs=2, suite=f"first {motions}")
    found = bulk_insert.measure(place)
    place.unlink()
    cells = [
        [
            way.name,
            f"{found.rows:,}",
            str(way.transactions),
            f"{way.processor_s:.2f} s",
            f"{found.rows / way.processor_s:,.0f}",
            f"{way.processor_s / found.ways[1].processor_s:.2f}×",
            f"{way.wall_s:.2f} s",
        ]
        for way in found.ways
    ]
    headers = [
        "way", "rows", "transactions", "processor time", "rows per second of it",
        "over sqlite3", "wall time",
    ]  # fmt: skip
    return headers, cells


def dissertation(base: Path, motions: int, sizes: int) -> tuple[list[str], list[list[str]]]:
    """As many combinations as the dissertation's, certified; then what else may be stored."""
    p2 = np.geomspace(30.0, 0.1, sizes).tolist()
    cells = []
    asked: dict[str, Any]
    for what, asked in (
        ("certified, with outcome grids", {}),
        (f"{GRID} more blocks each, after that", {"grid": GRID}),
        (f"maps to {COARSE:g} of PGA, after that", {"full_map": True, "map_depth": COARSE}),
    ):
        if not asked:
            place = copy(base)
        before, started = stored_rows(place), time.perf_counter()
        done = run_campaign(place, jobs=2, suite=f"first {motions}", p2=p2, **asked)
        command_s = time.perf_counter() - started
        cells.append(
            [
                what,
                f"{done['combinations']:,}",
                f"{done['certified']:,}",
                f"{done['runs']:,}",
                f"{stored_rows(place) - before:,}",
                f"{command_s:.0f} s",
                f"{done['writer_s'] + done['workers_s']:.0f} s",
                f"{done['writer_s']:.0f} s",
                f"{place.stat().st_size / 1e6:.0f} MB",
            ]
        )
    place.unlink()
    headers = [
        "campaign", "combinations", "certified", "runs", "rows", "wall time", "processor time",
        "of it the writer", "database",
    ]  # fmt: skip
    return headers, cells


def copy(base: Path) -> Path:
    """Return a copy of the closed database beside it."""
    place = base.with_name("run.db")
    for leftover in ("", "-wal", "-shm"):
        base.with_name(f"run.db{leftover}").unlink(missing_ok=True)
    place.write_bytes(base.read_bytes())
    return place


def stored_rows(place: Path) -> int:
    """Return the number of rows of results."""
    raw = sqlite3.connect(place)
    counts = (raw.execute(f"SELECT count(*) FROM {t}").fetchone()[0] for t in bulk_insert.TABLES)
    found = sum(counts)
    raw.close()
    return found


if __name__ == "__main__":
    main()
