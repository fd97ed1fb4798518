"""Rows that another program deletes or adds are found, and rbfrag's own writing never is."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, delete, func, insert, select

import rbfrag.db.ledger
from rbfrag.campaign.simulate import simulate
from rbfrag.db import schema
from rbfrag.db.campaigns import GRID_MEETS_POINT, POINT_COLUMNS
from rbfrag.db.check import accept_rows, check_database, check_ledger, coverage, mark_sound
from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.insert import delete_rows, insert_rows, table_digests
from rbfrag.db.ledger import last_sound, stored_tallies, written_tallies
from rbfrag.db.location import REFERENCE
from rbfrag.db.merge import merge_databases
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import DatabaseError, DatabaseReadOnlyError
from rbfrag.motions.ground_motion import GroundMotion
from tests.cli.conftest import Shell, shell

__all__ = ["shell"]


def _problems(engine: Engine) -> list[tuple[str, str, str]]:
    with engine.connect() as connection:
        return [
            (finding.table, finding.row, finding.problem) for finding in check_ledger(connection)
        ]


@pytest.mark.parametrize("table", ["combination", "fragility_model", "simulation", "suite_motion"])
def test_a_deleted_row_is_found(filled: Engine, model: ModelRow, table: str) -> None:
    with filled.begin() as connection:
        save_model(connection, model)
    assert _problems(filled) == []
    changed = schema.metadata.tables[table]
    key = list(changed.primary_key.columns)
    with filled.begin() as connection:
        first = connection.execute(select(*key).limit(1)).one()
        same = [column == value for column, value in zip(key, first, strict=True)]
        connection.execute(delete(changed).where(*same))
    assert (table, "rows were deleted by another program") in {
        (name, problem.partition(":")[0]) for name, _, problem in _problems(filled)
    }


def test_a_deleted_search_is_found_with_its_campaign(filled: Engine) -> None:
    with filled.begin() as connection:
        column = schema.combination.c
        campaign, lost = connection.execute(select(column.campaign_id, column.id).limit(1)).one()
        blocks = select(func.count()).where(schema.simulation.c.combination_id == lost)
        number = connection.scalar(blocks)
        connection.execute(delete(schema.combination).where(column.id == lost))
    tables = {table: (row, problem) for table, row, problem in _problems(filled)}
    assert tables.keys() == {"combination", "simulation"}
    assert tables["combination"][0] == f"campaign {campaign}"
    assert tables["combination"][1].endswith(": 6 were written, 5 are there")
    written, there = map(int, re.findall(r"[0-9]+", tables["simulation"][1]))
    assert written - there == number


def test_added_and_replaced_rows_are_found(filled: Engine) -> None:
    event = schema.earthquake
    values = {"event_id": "x", "guessed": True, "name": "", "magnitude": None, "time": None}
    with filled.begin() as connection:
        (digest,) = table_digests(event, [*values], [[*values.values()]])
        connection.execute(insert(event).values(**values, digest=digest))
    ((table, _, problem),) = _problems(filled)
    assert (table, problem.partition(":")[0]) == (
        "earthquake", "rows were added by another program"
    )  # fmt: skip
    with filled.begin() as connection:
        oldest = select(func.min(event.c.id)).scalar_subquery()
        connection.execute(event.update().where(event.c.id == oldest).values(digest=7))
        connection.execute(delete(event).where(event.c.event_id == "x"))
    ((_, _, problem),) = _problems(filled)
    assert problem.startswith("rows were replaced, or altered together with their digests")


@pytest.mark.parametrize("over", ["", "DO NOTHING"])
def test_rows_whose_key_is_there_are_counted_once(filled: Engine, over: str) -> None:
    """The grid of a kind meets blocks that were run before, or another campaign was quicker."""
    with filled.begin() as connection:
        simulation = connection.execute(select(schema.simulation).limit(1)).mappings().one()
        number = simulation["combination_id"]
        rows = [
            (number, simulation["kr_over_pga"], 0.25, "stable", None, 3, None),
            (number, 0.123, 0.5, "stable", None, 4, None),
        ]
        meeting = over or GRID_MEETS_POINT
        insert_rows(connection, schema.simulation, POINT_COLUMNS, rows, on_conflict=meeting)
    with filled.connect() as connection:
        assert written_tallies(connection) == stored_tallies(connection)
        changed = select(schema.simulation.c.grid).where(
            schema.simulation.c.combination_id == number,
            schema.simulation.c.kr_over_pga == simulation["kr_over_pga"],
        )
        assert connection.scalar(changed) == (None if over else 3)


def test_what_is_undone_is_not_counted(filled: Engine, make_motion: Any) -> None:
    with filled.begin() as connection:
        add_motion(connection, make_motion(9), earthquake=EarthquakeInfo("E"), is_vertical=False)
        connection.rollback()
    with filled.begin() as connection:
        delete_rows(connection, schema.simulation)
        connection.rollback()
    assert _problems(filled) == []


@pytest.mark.parametrize("kind", ["toppling", "sliding"])
def test_campaigns_and_merges_keep_the_ledger(
    place: str, tmp_path: Path, make_motion: Callable[..., GroundMotion], kind: str
) -> None:
    other = str(tmp_path / "other.db")
    for at, seeds in ((place, (0, 1)), (other, (1, 2))):
        with opened_database(at, create=True) as engine, engine.begin() as connection:
            for seed in seeds:
                add_motion(
                    connection, make_motion(seed), earthquake=EarthquakeInfo("E"), is_vertical=False
                )
        simulate(at, jobs=1, kind=kind, p2=[3.0] if kind == "toppling" else None)
    merge_databases(other, db=place)
    merge_databases(other, db=place)
    with opened_database(place) as engine, engine.connect() as connection:
        assert written_tallies(connection) == stored_tallies(connection)
        assert check_database(connection) == []


def test_a_loss_that_is_known_is_accepted(place: str, filled: Engine, tmp_path: Path) -> None:
    with filled.begin() as connection:
        connection.execute(delete(schema.suite_motion))
    assert _problems(filled)
    with pytest.raises(DatabaseError, match=r"damaged in 1 places.*rows were deleted"):
        merge_databases(place, db=tmp_path / "into.db")
    assert [row.table for row in accept_rows(place)] == ["suite_motion"]
    assert _problems(filled) == []
    assert accept_rows(place) == []


def test_the_built_in_data_have_a_ledger_and_are_never_written(tmp_path: Path) -> None:
    before = REFERENCE.read_bytes()
    with pytest.raises(DatabaseReadOnlyError, match="the built-in data set is read-only: copy"):
        open_database(REFERENCE)
    mark_sound(REFERENCE, "2026-01-01T00:00:00+00:00")
    assert REFERENCE.read_bytes() == before
    path = tmp_path / "copy.db"
    shutil.copy(REFERENCE, path)
    with opened_database(path) as engine, engine.begin() as connection:
        assert last_sound(connection) is None
        assert written_tallies(connection) == stored_tallies(connection)
        assert "by the ledger" in coverage(connection)
        models = schema.fragility_model
        first = select(func.min(models.c.id)).scalar_subquery()
        connection.execute(delete(models).where(models.c.id == first))
        assert len([*check_ledger(connection)]) == 1


def test_the_commands_say_when_it_was_sound(shell: Shell, sqlite_file: Path, fill: Any) -> None:
    at = ("--db", sqlite_file)
    assert "Checked   never" in shell("db", "info", *at).stdout
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        fill(connection, [1, 2])
    assert shell.json("db", "check", "--sample", "0", *at)["sound"]
    sound = shell.json("db", "info", *at)["last_sound"]
    assert sound.startswith("20")
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        connection.execute(delete(schema.simulation))
    lost = shell("db", "check", "--sample", "0", *at, expect=1)
    assert "rows were deleted" in lost.stdout
    assert "rbfrag db check with accept" in lost.stdout
    assert shell.json("db", "info", *at)["last_sound"] == sound


def test_long_transactions_write_in_portions(
    engine: Engine, fill: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rbfrag.db.ledger, "_MOST_KEPT", 2)
    with engine.begin() as connection:
        fill(connection, [1, 2, 3])
    assert _problems(engine) == []
