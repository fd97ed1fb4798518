"""Campaigns of sequences from the command line."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.motions.ground_motion import GroundMotion
from tests.synthetic import shaking


@pytest.fixture
def shocks(tmp_path: Path) -> Path:
    """Two motions of two earthquakes."""
    place = tmp_path / "shocks.db"
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for seed in range(2):
            motion = GroundMotion(shaking(seed, 450), 0.02, source_file=f"{seed}.txt")
            quake = EarthquakeInfo(f"quake-{seed}", guessed=False)
            add_motion(connection, motion, earthquake=quake, is_vertical=False, recording=str(seed))
    return place


def test_the_table_is_printed_written_and_the_same_again(shell: Any, shocks: Path) -> None:
    command = (
        "simulate",
        "--sequence",
        "--kind",
        "sliding",
        "--displacement",
        "0.05",
        "--jobs",
        "1",
    )
    printed = shell(*command, "--db", shocks, "--out", "table.csv")
    first = "16 sequences of sliding blocks stored: "
    assert printed.stdout.startswith(first)
    assert "limit   state left" in printed.stdout
    assert "drawn with seed 1" in printed.stdout
    document = shell.json(*command, "--db", shocks)
    assert (document["combinations"], document["resumed"], document["runs"]) == (16, 16, 0)
    conditional = document["sequence"]["conditional"]
    with Path("table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["blocks"] for row in rows] == [str(row["blocks"]) for row in conditional]
    assert [float(row["probability"]) for row in rows] == [r["probability"] for r in conditional]
    assert set(rows[0]) == set(conditional[0])
    # a campaign of single motions reports what it did before
    assert "sequence" not in shell.json("simulate", "--kind", "sliding", "--db", shocks)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--sequence",), "--kind toppling: a block that topples or rocks carries no state"),
        (("--kind", "sliding", "--seed", "2"), "--seed requires --sequence"),
        (("--kind", "sliding", "--out", "a.csv"), "--out requires --sequence"),
        (
            ("--kind", "sliding", "--sequence", "--vertical", "with"),
            "--vertical cannot be combined with --sequence",
        ),
    ],
)
def test_options_that_do_not_go_together_are_rejected(
    rejects: Any, shocks: Path, more: tuple[str, ...], message: str
) -> None:
    assert message in rejects("simulate", *more, "--db", shocks)
