"""What is shipped: no samples, sound, and still telling the outcome of a block."""

from __future__ import annotations

import csv
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

from benchmarks import reference_set
from rbfrag.db import schema
from rbfrag.db.engine import opened_database
from rbfrag.db.queries import combination_table, outcome_grid
from rbfrag.db.spectra import spectrum_values
from rbfrag.motions.recognise import read_motions
from rbfrag.solver.toppling_run import respond
from tests.synthetic import shaking, write_at2


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reference of two made-up recordings, one with a vertical component."""
    home = tmp_path_factory.mktemp("reference")
    records = home / "records"
    records.mkdir()
    rows = []
    for seed, (component, recording) in enumerate((("000", "a"), ("UP", "a"), ("000", "b"))):
        up = component == "UP"
        file = f"{recording}{component}.AT2"
        write_at2(records / file, shaking(seed) * (0.3 if up else 1.0), component=component)
        rows.append(
            {
                "file": file,
                "trace_index": 0,
                "event_id": "somewhere",
                "is_vertical": int(up),
                "companion_group": recording,
                "set": "made-up",
                "format": "PEER AT2",
                "source_repo": "here",
            }
        )
    with (records / "MANIFEST.csv").open("w", newline="") as stream:
        table = csv.DictWriter(stream, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    out = ("--out", str(home / "out" / "reference.db"), "--page", str(home / "page.md"))
    reference_set.main(["--records", str(records), "--work", str(home), "--jobs", "1",
                        "--without-models", *out])  # fmt: skip
    return home


def test_it_needs_no_journal_and_holds_no_samples(built: Path) -> None:
    file = built / "out" / "reference.db"
    assert list(file.parent.iterdir()) == [file]
    raw = sqlite3.connect(f"{file.as_uri()}?mode=ro&immutable=1", uri=True)
    assert raw.execute("PRAGMA journal_mode").fetchone() == ("delete",)
    assert raw.execute("SELECT count(*), count(samples) FROM motion").fetchone() == (3, 0)
    settings = raw.execute(
        "SELECT DISTINCT settings FROM combination WHERE kind = 'toppling'"
    ).fetchall()
    others = raw.execute("SELECT kind, count(*) FROM combination GROUP BY kind").fetchall()
    curves = raw.execute("SELECT count(displacement_m) FROM simulation").fetchone()
    maps = raw.execute("SELECT count(*) FROM outcome_interval").fetchone()
    raw.close()
    assert dict(others) == {"sliding": 4, "toppling": 36}
    assert curves == (4 * 23,)
    assert maps == (0,)
    assert settings == [('{"search_limit":0.01}',)]


def test_every_outcome_of_the_grid_is_in_it(built: Path) -> None:
    with (
        opened_database(built / "out" / "reference.db", read_only=True) as engine,
        engine.connect() as connection,
    ):
        table = combination_table(connection, vertical="without")
        both = combination_table(connection, vertical="both")
        assert len(spectrum_values(connection)) == 2 * 2 * 6
        grid = outcome_grid(connection, table.combination_id)
    assert (table.p2.size, both.p2.size) == (24, 36)
    assert grid.outcome.shape == (24, 35)
    assert np.isfinite(grid.outcome).all()
    assert (grid.k_over_pga < 0.01).any()
    motions = {m.pga_g: m for f in built.glob("records/*.AT2") for m in read_motions(f)}
    for i in range(0, 24, 5):
        motion = motions[table.pga_g[i]]
        for k, fails in zip(grid.k_over_pga[i], grid.outcome[i], strict=True):
            run = respond(motion, p2=table.p2[i], kr=k * motion.pga_g, polarity=table.polarity[i])
            assert (run.outcome == "toppled") == bool(fails)


def test_its_combinations_are_those_of_a_campaign(built: Path) -> None:
    """Keys and values are the same, so that a merge of both changes nothing."""
    rows = []
    for file in (built / "out" / "reference.db", built / "reference-full.db"):
        with opened_database(file, read_only=True) as engine, engine.connect() as connection:
            table = schema.combination
            query = select(table.c.natural_key, table.c.kr_over_pga, table.c.digest)
            rows.append(set(connection.execute(query).all()))
    assert rows[0] < rows[1]


def test_the_page_says_where_it_comes_from(built: Path) -> None:
    text = (built / "page.md").read_text(encoding="utf-8")
    assert "| made-up | PEER AT2 | 2 | 1 | 1 | here |" in text
    assert "36 combinations" in text
    assert str(built) not in text


def test_too_large_a_file_is_not_shipped(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference_set, "MOST_BYTES", 1000)
    with pytest.raises(SystemExit, match="more than 1,000"):
        reference_set.examine(built / "out" / "reference.db")
