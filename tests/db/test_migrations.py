"""The migrations make the tables that the code describes, and agree with the revisions it names."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, create_engine, func, inspect, select, text

import rbfrag.db.upgrade
import rbfrag.migrations
from benchmarks.database_content import table_rows_by_natural_key
from rbfrag.db.campaigns import start_campaign
from rbfrag.db.check.database import check_database
from rbfrag.db.connect import unchecked_engine
from rbfrag.db.engine import open_database
from rbfrag.db.insert import update_rows
from rbfrag.db.location import REVISIONS, SCHEMA_REVISION, VERSION_TABLE
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import load_model, save_model
from rbfrag.db.motions import (
    LATER_MEASURES,
    MEASURES,
    add_motion,
    load_motion,
    measures_of,
    motion_rows,
)
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.db.schema import combination, metadata, motion, simulation
from rbfrag.db.upgrade import migrate, upgrade_database
from rbfrag.motions.ground_motion import GroundMotion


def _config() -> Config:
    config = Config(stdout=io.StringIO())
    config.set_main_option("script_location", str(Path(rbfrag.migrations.__file__).parent))
    return config


def _texts(options: Any) -> dict[str, str]:
    return {key: str(value) for key, value in (options or {}).items()}


def _described(engine: Engine) -> dict[str, Any]:
    inspector = inspect(engine)
    with engine.connect() as connection:
        without_rowid = set(
            connection.scalars(
                text("SELECT name FROM sqlite_master WHERE sql LIKE '%WITHOUT ROWID%'")
            )
        )
    return {
        table: {
            "columns": [
                (c["name"], str(c["type"]), c["nullable"], c["default"])
                for c in inspector.get_columns(table)
            ],
            "pk": inspector.get_pk_constraint(table),
            "fk": sorted(map(repr, inspector.get_foreign_keys(table))),
            "unique": sorted(map(repr, inspector.get_unique_constraints(table))),
            "check": {
                c["name"]: " ".join(str(c["sqltext"]).split())
                for c in inspector.get_check_constraints(table)
            },
            "index": sorted(
                (str(i["name"]), i["column_names"], i["unique"], _texts(i.get("dialect_options")))
                for i in inspector.get_indexes(table)
            ),
            "rowid": table not in without_rowid,
        }
        for table in inspector.get_table_names()
        if table != VERSION_TABLE
    }


def test_migrated_schema_is_the_described_schema(engine: Engine) -> None:
    with engine.connect() as connection:
        options = {"compare_type": True, "version_table": VERSION_TABLE}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, metadata) == []


def test_migrated_schema_has_every_constraint(sqlite_file: Path, tmp_path: Path) -> None:
    # Alembic's comparison is blind to CHECK, ON DELETE and WITHOUT ROWID.
    direct = create_engine(f"sqlite:///{tmp_path / 'direct.db'}")
    metadata.create_all(direct)
    migrated = open_database(sqlite_file)
    try:
        assert _described(migrated) == _described(direct)
    finally:
        direct.dispose()
        migrated.dispose()


def test_known_revisions_are_those_of_the_migrations() -> None:
    scripts = ScriptDirectory.from_config(_config())
    chain = [script.revision for script in scripts.walk_revisions()]
    assert tuple(reversed(chain)) == REVISIONS
    assert scripts.get_heads() == [SCHEMA_REVISION]


def test_downgrade_leaves_no_table(place: str) -> None:
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    try:
        with engine.begin() as connection:
            config = _config()
            config.attributes["connection"] = connection
            command.downgrade(config, "base")
        assert inspect(engine).get_table_names() == [VERSION_TABLE]
    finally:
        engine.dispose()


def test_an_upgrade_that_fails_is_undone(
    sqlite_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = unchecked_engine(sqlite_file, foreign_keys=False)
    try:
        with engine.begin() as connection:
            config = _config()
            config.attributes["connection"] = connection
            command.downgrade(config, "base")

        def unsound(connection: Connection) -> None:
            assert len(inspect(connection).get_table_names()) > 10
            raise KeyboardInterrupt

        monkeypatch.setattr(rbfrag.db.upgrade, "_require_sound_references", unsound)
        with pytest.raises(KeyboardInterrupt):
            migrate(engine)
        assert inspect(engine).get_table_names() == [VERSION_TABLE]
    finally:
        engine.dispose()


def test_upgrade_of_a_current_database_changes_nothing(place: str) -> None:
    open_database(place, create=True).dispose()
    assert upgrade_database(place) == (SCHEMA_REVISION, SCHEMA_REVISION)


def test_upgrade_prints_nothing(place: str, capfd: pytest.CaptureFixture[str]) -> None:
    open_database(place, create=True).dispose()
    upgrade_database(place)
    assert capfd.readouterr() == ("", "")


def test_upgrade_from_before_the_first_schema(place: str) -> None:
    # The same road that a later migration takes: an older revision, run to the newest.
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    with engine.begin() as connection:
        config = _config()
        config.attributes["connection"] = connection
        command.downgrade(config, "base")
        command.upgrade(config, "head")
    engine.dispose()
    again = open_database(place)
    with again.connect() as connection:
        found = connection.scalar(text(f"SELECT version_num FROM {VERSION_TABLE}"))
    again.dispose()
    assert found == SCHEMA_REVISION


def test_motions_of_the_first_schema_keep_their_samples(
    place: str, make_motion: Callable[..., GroundMotion]
) -> None:
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    given = make_motion(component="090")
    with engine.begin() as connection:
        quake = EarthquakeInfo("E")
        motion_id, _ = add_motion(connection, given, earthquake=quake, is_vertical=False, suite="S")
        config = _config()
        config.attributes["connection"] = connection
        command.downgrade(config, "0001")
        names = {column["name"] for column in inspect(connection).get_columns("motion")}
        assert not names & {"source_sha256", "processing_applied", "start_time"}
    engine.dispose()
    assert upgrade_database(place) == ("0001", SCHEMA_REVISION)
    again = open_database(place)
    with again.connect() as connection:
        back = load_motion(connection, motion_id)
        (row,) = motion_rows(connection, suite="S")
    again.dispose()
    assert back.sha256 == given.sha256 == row.source_sha256
    assert (back.processing_applied, back.start_time) == (None, None)


def test_results_of_the_second_schema_stay_as_they_are(
    place: str, fill: Callable[..., None], model: ModelRow
) -> None:
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    tables = ("combination", "simulation", "fragility_model")

    def content(connection: Connection) -> list[list[tuple[object, ...]]]:
        return [list(table_rows_by_natural_key(connection, table)) for table in tables]

    with engine.begin() as connection:
        fill(connection, [1, 2, 3])
        save_model(connection, replace(model, form=1, leave_out_steps=None, dependence=None))
        before = content(connection)
        config = _config()
        config.attributes["connection"] = connection
        command.downgrade(config, "0002")
        assert "block" not in {c["name"] for c in inspect(connection).get_columns("combination")}
    engine.dispose()
    assert upgrade_database(place) == ("0002", SCHEMA_REVISION)
    again = open_database(place)
    with again.connect() as connection:
        assert content(connection) == before
        assert load_model(connection).kind == "toppling"
    again.dispose()
    assert all(before)


def test_maps_are_no_part_of_keys_any_more(
    place: str, make_motion: Any, make_result: Any, store_result: Any
) -> None:
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    given = make_motion()
    plain = {"search_limit": 0.01}
    with engine.begin() as connection:
        quake = EarthquakeInfo("E")
        motion_id, _ = add_motion(connection, given, earthquake=quake, is_vertical=False)
        campaign = start_campaign(connection, {})
        for p2, widths in ((3.0, {0.3: 1e-3, 0.2: 1e-6}), (1.0, {0.1: 1e-3})):
            for width, depth in widths.items():
                result = make_result(given.pga_g, p2=p2, island_width=width)
                settings = {**plain, "map": "full", "map_depth": depth}
                store_result(connection, campaign, given, motion_id, result, settings=settings)
        config = _config()
        config.attributes["connection"] = connection
        command.downgrade(config, "0003")
    engine.dispose()
    assert upgrade_database(place) == ("0003", SCHEMA_REVISION)
    again = open_database(place)
    with again.begin() as connection:
        assert check_database(connection) == []
        rows = connection.execute(select(combination).order_by(combination.c.p2)).all()
        # of two maps of one search the finer one
        assert [row.island_width for row in rows] == [0.1, 0.2]
        assert {row.settings for row in rows} == {'{"search_limit":0.01}'}
        assert len({row.combination_id for row in connection.execute(select(simulation))}) == 2
        # a search without a map finds itself stored
        again_key = store_result(
            connection, campaign, given, motion_id, make_result(given.pga_g), settings=plain
        )
        assert again_key in {row.natural_key for row in rows}
        assert connection.scalar(select(func.count()).select_from(combination)) == 2
    again.dispose()


def test_outcomes_of_the_fifth_schema_are_not_known_to_be_sensitive(
    place: str, fill: Callable[..., None]
) -> None:
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    with engine.begin() as connection:
        fill(connection, [1, 2])
        update_rows(connection, simulation, simulation.c.kr_over_pga > 0.0, {"sensitive": True})
        config = _config()
        config.attributes["connection"] = connection
        command.downgrade(config, "0005")
        assert "sensitive" not in {c["name"] for c in inspect(connection).get_columns("simulation")}
    engine.dispose()
    assert upgrade_database(place) == ("0005", SCHEMA_REVISION)
    again = open_database(place)
    with again.connect() as connection:
        assert check_database(connection) == []
        assert set(connection.scalars(select(simulation.c.sensitive))) == {None}
    again.dispose()


def test_measures_of_the_fourth_schema_are_computed_where_the_samples_are(
    place: str, make_motion: Callable[..., GroundMotion], model: ModelRow
) -> None:
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    given, other = make_motion(), make_motion(2)
    with engine.begin() as connection:
        quake = EarthquakeInfo("E")
        for each in (given, other):
            add_motion(connection, each, earthquake=quake, is_vertical=False)
        _, without = motion_rows(connection)
        update_rows(connection, motion, motion.c.id == without.id, {"samples": None})
        save_model(connection, model)
        config = _config()
        config.attributes["connection"] = connection
        command.downgrade(config, "0004")
        columns = {c["name"] for c in inspect(connection).get_columns("motion")}
        assert not columns & set(LATER_MEASURES)
    engine.dispose()
    assert upgrade_database(place) == ("0004", SCHEMA_REVISION)
    again = open_database(place)
    with again.connect() as connection:
        assert check_database(connection) == []
        kept, empty = motion_rows(connection)
        old = load_model(connection)
    again.dispose()
    assert {name: getattr(kept, name) for name in MEASURES} == measures_of(given)
    assert {getattr(empty, name) for name in LATER_MEASURES} == {None}
    assert kept.sa10_g is not None
    assert kept.sa10_g > 0.0
    assert (old.form, old.leave_out_steps, old.dependence) == (1, None, None)
