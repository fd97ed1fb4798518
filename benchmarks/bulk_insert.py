"""Writing results beside plain sqlite3:  python -m benchmarks.bulk_insert DATABASE

The combinations of a finished campaign are written again into empty copies: by rbfrag as a campaign
writes them, one transaction a motion, and by `sqlite3.executemany` of the very same tuples, once
with the same transactions and once in a single one. In turns, processor time, least of three.
"""

from __future__ import annotations

import json
import sqlite3
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select

from rbfrag.db import schema
from rbfrag.db.campaigns import CombinationRecord, insert_combinations
from rbfrag.db.engine import opened_database
from rbfrag.db.sqlite_file import connect_sqlite
from rbfrag.db.stored_combination import stored_combination
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import SearchPoints

TABLES = ("combination", "outcome_interval", "simulation")
ROUNDS = 3

Rows = dict[str, list[tuple[object, ...]]]


def main() -> None:
    print(measure(Path(sys.argv[1])))


@dataclass(frozen=True)
class Way:
    """How long one way of writing took [s]."""

    name: str
    transactions: int
    processor_s: float
    wall_s: float


@dataclass(frozen=True)
class BulkInsert:
    """The ways, rbfrag's first, then sqlite3's with the same transactions and with one."""

    rows: int
    ways: tuple[Way, Way, Way]


def measure(finished: Path) -> BulkInsert:
    """Write the results of a finished campaign again in each way."""
    records, rows = read(finished)
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / "empty.db"
        make_empty(finished, empty)
        ways: dict[str, Callable[[Path], None]] = {
            "rbfrag, a transaction a motion": lambda place: by_rbfrag(place, records),
            "sqlite3.executemany, the same": lambda place: by_sqlite3(place, rows, list(rows)),
            "sqlite3.executemany, all in one": lambda place: by_sqlite3(place, rows, None),
        }
        best = dict.fromkeys(ways, (float("inf"), float("inf")))
        for number in range(ROUNDS):
            for name, way in ways.items():
                place = Path(folder) / f"{number}.db"
                place.write_bytes(empty.read_bytes())
                used, passed = time.process_time(), time.perf_counter()
                way(place)
                taken = time.process_time() - used, time.perf_counter() - passed
                best[name] = min(best[name], taken)
                check(place, rows)
                place.unlink()
    transactions = (len(rows), len(rows), 1)
    one, two, three = (
        Way(name, number, *best[name]) for name, number in zip(ways, transactions, strict=True)
    )
    count = sum(len(some) for by_table in rows.values() for some in by_table.values())
    return BulkInsert(count, (one, two, three))


def read(finished: Path) -> tuple[dict[int, list[CombinationRecord]], dict[int, Rows]]:
    """Return what a campaign stored, by motion: as the solver gave it, and as rows."""
    records: dict[int, list[CombinationRecord]] = defaultdict(list)
    motion_of: dict[int, int] = {}
    with opened_database(finished, read_only=True) as engine, engine.connect() as connection:
        for key in connection.scalars(select(schema.combination.c.natural_key)).all():
            stored = stored_combination(connection, key)
            motion_of[stored.id] = stored.motion_id
            values = stored.values
            given = {
                name: values[name] for name in CriticalResult.__dataclass_fields__ if name in values
            }
            result = CriticalResult(
                **{
                    **given,
                    "pga_g": stored.pga_g,
                    "warnings": tuple(json.loads(values["warnings"])),
                    "points": some_of(stored.points, stored.grid < 0),
                    "intervals": stored.intervals,
                }
            )
            blocks = np.flatnonzero(stored.grid >= 0)
            records[stored.motion_id].append(
                CombinationRecord(
                    natural_key=key,
                    motion_id=stored.motion_id,
                    vertical_motion_id=stored.vertical_motion_id,
                    **{name: values[name] for name in ("polarity", "kind", "p2")},
                    settings=stored.settings,
                    result=result,
                    block=stored.block,
                    numerics_version=values["numerics_version"],
                    grid=some_of(stored.points, blocks[np.argsort(stored.grid[blocks])]),
                )
            )
    rows: dict[int, Rows] = {motion: {table: [] for table in TABLES} for motion in records}
    raw = sqlite3.connect(finished)
    for table in TABLES:
        for row in raw.execute(f"SELECT * FROM {table}"):
            rows[motion_of[row[0]]][table].append(row)
    raw.close()
    return records, rows


def some_of(points: SearchPoints, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> SearchPoints:
    """Return some of the simulated blocks."""
    return SearchPoints(
        kr_over_pga=points.kr_over_pga[chosen],
        theta_n=points.theta_n[chosen],
        outcome=tuple(np.array(points.outcome, dtype=object)[chosen].tolist()),
    )


def make_empty(finished: Path, empty: Path) -> None:
    """Copy a database without its results."""
    raw = sqlite3.connect(finished)
    raw.execute("VACUUM INTO ?", (str(empty),))
    raw.close()
    raw = sqlite3.connect(empty, isolation_level=None)
    for table in ("simulation", "outcome_interval", "combination"):
        raw.execute(f"DELETE FROM {table}")
    raw.execute("VACUUM")
    raw.execute("PRAGMA journal_mode = WAL")
    raw.close()


def by_rbfrag(place: Path, records: dict[int, list[CombinationRecord]]) -> None:
    with opened_database(place) as engine:
        for some in records.values():
            with engine.begin() as connection:
                insert_combinations(connection, 1, some)


def by_sqlite3(place: Path, rows: dict[int, Rows], motions: list[int] | None) -> None:
    raw = connect_sqlite(place, read_only=False)
    groups = [[motion] for motion in motions] if motions is not None else [list(rows)]
    for group in groups:
        raw.execute("BEGIN IMMEDIATE")
        for table in TABLES:
            some = [row for motion in group for row in rows[motion][table]]
            if not some:
                continue
            marks = ", ".join("?" for _ in some[0])
            raw.executemany(f"INSERT INTO {table} VALUES ({marks})", some)
        raw.execute("COMMIT")
    raw.close()


def check(place: Path, rows: dict[int, Rows]) -> None:
    """Make sure that every way wrote as much as the others."""
    raw = sqlite3.connect(place)
    for table in TABLES:
        (found,) = raw.execute(f"SELECT count(*) FROM {table}").fetchone()
        wanted = sum(len(by_table[table]) for by_table in rows.values())
        if found != wanted:
            raise SystemExit(f"{table}: {found} rows instead of {wanted}")
    raw.close()


if __name__ == "__main__":
    main()
