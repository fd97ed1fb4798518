"""The built-in data set: no samples, sound, and with the outcome of a block."""

from __future__ import annotations

import csv
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

from benchmarks import reference_set
from rbfrag.db import schema
from rbfrag.db.campaigns import spectrum_values
from rbfrag.db.engine import opened_database
from rbfrag.db.queries import combination_table, outcome_grid
from rbfrag.motions.readers import read_motions
from rbfrag.solver.toppling_run import respond
from tests.synthetic import shaking, write_at2


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reference of two made-up recordings, one with a vertical component."""
    home = tmp_path_factory.mktemp("reference")
    rows: dict[str, list[dict[str, object]]] = {"records": [], "more": []}
    for seed, (component, recording) in enumerate((("000", "a"), ("UP", "a"), ("000", "b"))):
        up, folder = component == "UP", "more" if recording == "b" else "records"
        file = f"{recording}{component}.AT2"
        (home / folder).mkdir(exist_ok=True)
        write_at2(home / folder / file, shaking(seed) * (0.3 if up else 1.0), component=component)
        rows[folder].append(
            {
                "file": file,
                "trace_index": 0,
                "event_id": "somewhere",
                "magnitude": 6.2,
                "is_vertical": int(up),
                "companion_group": recording,
                # a manifest may not say what another says
                **(
                    {"rjb_km": 12.0}
                    if folder == "more"
                    else {"set": "made-up", "format": "PEER AT2", "source_repo": "here"}
                ),
            }
        )
    folders = []
    for folder, lines in rows.items():
        folders += ["--records", str(home / folder)]
        with (home / folder / "MANIFEST.csv").open("w", newline="") as stream:
            table = csv.DictWriter(stream, list(lines[0]))
            table.writeheader()
            table.writerows(lines)
    out = ("--out", str(home / "out" / "reference.db"), "--page", str(home / "page.md"))
    reference_set.main([*folders, "--work", str(home), "--jobs", "1", "--without-models", *out])
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
    rows = raw.execute("SELECT kind, count(*) FROM combination GROUP BY kind").fetchall()
    curves = raw.execute("SELECT count(displacement_m) FROM simulation").fetchone()
    maps = raw.execute("SELECT count(*) FROM outcome_interval").fetchone()
    raw.close()
    assert dict(rows) == {"rocking": 48, "sliding": 4, "toppling": 36}
    assert curves == (4 * 23,)
    assert maps == (0,)
    assert settings == [('{"search_limit":0.01}',)]


def test_every_outcome_that_fits_read_is_in_it(built: Path) -> None:
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
    with opened_database(built / "reference-full.db", read_only=True) as full:  # noqa: SIM117
        with full.connect() as connection:
            all_of_it = combination_table(connection, vertical="without")
            complete = outcome_grid(connection, all_of_it.combination_id)
    assert np.array_equal(all_of_it.natural_key, table.natural_key)
    kr = complete.k_over_pga * table.pga_g[:, None]
    read = kr >= 0.02
    read[:, -1] = True  # above the strongest all are safe
    assert 0 < (~read).sum() < read.sum()
    assert np.array_equal(np.isfinite(grid.outcome), read)
    assert np.array_equal(grid.outcome[read], complete.outcome[read])
    motions = {m.pga_g: m for f in built.glob("*/*.AT2") for m in read_motions(f)}
    for i in range(0, 24, 5):
        motion = motions[table.pga_g[i]]
        record = read[i]
        for k, fails in zip(grid.k_over_pga[i][record], grid.outcome[i][record], strict=True):
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
    assert "| made-up | PEER AT2 | 1 | 1 | 1 | here |" in text
    assert "| more | AT2 (PEER) | 1 | 0 | 1 | not stated |" in text
    assert "| 5.6 to 6.4 | 2 | 1 |" in text
    assert "| 5 to 15 | 1 | 1 |" in text
    assert "| unknown | 1 | 1 |" in text
    assert "| unknown | 2 | 1 |" in text
    assert "36 combinations" in text
    assert str(built) not in text


def test_too_large_a_file_is_not_shipped(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference_set, "MOST_BYTES", 1000)
    with pytest.raises(SystemExit, match="more than 1,000"):
        reference_set.examine(built / "out" / "reference.db")
