"""The write-ahead log cut at any byte: what was there before the cut is all there."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

from benchmarks.database_content import table_rows_by_natural_key
from benchmarks.durability import digest
from rbfrag.campaign.simulate import CampaignProgress, simulate
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from tests.durability.conftest import MOTIONS, P2

FRAME = 24 + 4096
HEADER = 32
TABLES = ("combination", "outcome_interval", "simulation")


def _rows(place: Path) -> dict[str, set[tuple[object, ...]]]:
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        assert check_database(connection) == []
        assert len(list(table_rows_by_natural_key(connection, "motion"))) == MOTIONS
        return {name: set(table_rows_by_natural_key(connection, name)) for name in TABLES}


def test_any_cut_leaves_what_was_there_before(
    database: Path, undisturbed: str, tmp_path: Path
) -> None:
    torn = tmp_path / "torn"
    torn.mkdir()

    def copy(progress: CampaignProgress) -> None:
        # as after a power cut: the log is not yet part of the file
        if progress.completed == progress.total:
            for tail in ("", "-wal", "-shm"):
                shutil.copy(f"{database}{tail}", torn / f"whole.db{tail}")

    simulate(database, p2=P2, jobs=1, on_progress=copy)
    log = (torn / "whole.db-wal").read_bytes()
    assert len(log) > 20 * FRAME
    everything = _rows_of(torn, "whole", log)
    rng = random.Random(5)
    frames = (len(log) - HEADER) // FRAME
    cuts = {0, 1, HEADER - 1, HEADER, len(log) - 1, len(log)}
    cuts |= {HEADER + FRAME * rng.randint(0, frames) + shift for shift in (-1, 0, 1) for _ in "123"}
    cuts |= {rng.randint(0, len(log)) for _ in range(25)}
    sizes = []
    resumed = 0
    for number, cut in enumerate(sorted(c for c in cuts if c >= 0)):
        name = f"cut{number}"
        rows = _rows_of(torn, name, log[:cut])
        sizes.append(len(rows["combination"]))
        for table, retained in rows.items():
            assert retained <= everything[table]
        if number % 8 == 0:
            simulate(torn / f"{name}.db", p2=P2, jobs=1)
            assert digest(str(torn / f"{name}.db")) == undisturbed
            resumed += 1
    # a longer log never holds less, and all of it everything
    assert sizes == sorted(sizes)
    assert (sizes[0], sizes[-1]) == (0, 4 * MOTIONS)
    assert resumed > 3


def _rows_of(torn: Path, name: str, log: bytes) -> dict[str, set[tuple[object, ...]]]:
    """Put a database together whose log was cut, its index of the log gone stale."""
    if name != "whole":
        for tail in ("", "-shm"):
            shutil.copy(torn / f"untouched.db{tail}", torn / f"{name}.db{tail}")
        (torn / f"{name}.db-wal").write_bytes(log)
    else:
        for tail in ("", "-shm"):
            shutil.copy(torn / f"whole.db{tail}", torn / f"untouched.db{tail}")
    return _rows(torn / f"{name}.db")


def test_a_log_with_flipped_bytes_ends_before_them(
    database: Path, undisturbed: str, tmp_path: Path
) -> None:
    def copy(progress: CampaignProgress) -> None:
        if progress.completed == progress.total:
            for tail in ("", "-wal"):
                shutil.copy(f"{database}{tail}", tmp_path / f"flipped.db{tail}")

    simulate(database, p2=P2, jobs=1, on_progress=copy)
    log = tmp_path / "flipped.db-wal"
    content = bytearray(log.read_bytes())
    content[len(content) // 2] ^= 0xFF
    log.write_bytes(content)
    flipped = tmp_path / "flipped.db"
    assert 0 <= len(_rows(flipped)["combination"]) < 4 * MOTIONS
    simulate(flipped, p2=P2, jobs=1)
    assert digest(str(flipped)) == undisturbed
