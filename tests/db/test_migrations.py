"""Databases are made, and older ones brought, to the schema that the code describes."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, create_engine, func, inspect, select, text

import rbfrag.db.upgrade
import rbfrag.migrations
from benchmarks.database_content import table_rows_by_natural_key
from benchmarks.reference_set import SPARED_INDEX
from rbfrag.db.campaigns import start_campaign
from rbfrag.db.check.database import check_database
from rbfrag.db.connect import unchecked_engine
from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.insert import update_rows
from rbfrag.db.location import FIRST_RELEASE, REFERENCE, REVISIONS, SCHEMA_REVISION, VERSION_TABLE
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
    without_rowid: set[str] = set()
    if engine.dialect.name == "sqlite":
        query = text("SELECT name FROM sqlite_master WHERE sql LIKE '%WITHOUT ROWID%'")
        with engine.connect() as connection:
            without_rowid = set(connection.scalars(query))
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


def test_the_shipped_reference_has_every_constraint(tmp_path: Path) -> None:
    # Alembic's comparison is blind to CHECK, ON DELETE and WITHOUT ROWID.
    direct = create_engine(f"sqlite:///{tmp_path / 'direct.db'}")
    metadata.create_all(direct)
    with direct.begin() as connection:
        connection.execute(text(f"DROP INDEX {SPARED_INDEX}"))
    copy = tmp_path / "reference.db"
    copy.write_bytes(REFERENCE.read_bytes())
    upgrade_database(copy)
    upgraded = open_database(copy)
    try:
        assert _described(upgraded) == _described(direct)
    finally:
        direct.dispose()
        upgraded.dispose()


def test_known_revisions_are_those_of_the_migrations() -> None:
    scripts = ScriptDirectory.from_config(_config())
    chain = [script.revision for script in scripts.walk_revisions()]
    assert tuple(reversed(chain)) == REVISIONS[REVISIONS.index(FIRST_RELEASE) :]
    assert scripts.get_heads() == [SCHEMA_REVISION]


CAME: dict[str, dict[str, Sequence[str]]] = {
    "0002": {"motion": ("source_sha256", "processing_applied", "start_time")},
    "0003": {
        "combination": ("block",),
        "simulation": ("displacement_m",),
        "fragility_model": ("kind",),
    },
    "0004": {**dict.fromkeys(metadata.tables, ("digest",)), "simulation": ("grid", "digest")},
    "0005": {
        "motion": LATER_MEASURES,
        "fragility_model": ("form", "leave_out_steps", "dependence"),
    },
    "0006": {"simulation": ("sensitive",)},
    "0007": {"shock_pair": ()},
}
"""Tables and columns that came with each schema."""


def _made_old(engine: Engine, revision: str) -> None:
    """Leave of a database the columns of an older schema, without constraints, which none asks."""
    later = [tables for each, tables in CAME.items() if each > revision]
    kept = {
        table.name: [
            column.name
            for column in table.c
            if not any(column.name in tables.get(table.name, ()) for tables in later)
        ]
        for table in metadata.sorted_tables
    }
    with engine.begin() as connection:
        for table, columns in kept.items():
            listed = ", ".join(columns)
            connection.execute(text(f"CREATE TABLE old_{table} AS SELECT {listed} FROM {table}"))
        for table in reversed(kept):
            connection.execute(text(f"DROP TABLE {table}"))
        for table in kept:
            connection.execute(text(f"ALTER TABLE old_{table} RENAME TO {table}"))
        connection.execute(text("DROP TABLE shock_pair"))
        connection.execute(text(f"UPDATE {VERSION_TABLE} SET version_num = '{revision}'"))


@pytest.fixture
def unchecked(place: str) -> Iterator[Engine]:
    """An empty database, opened as upgrades open it."""
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    yield engine
    engine.dispose()


@pytest.mark.parametrize("revision", REVISIONS[: REVISIONS.index(FIRST_RELEASE)])
def test_an_old_database_gets_every_constraint_and_counts_on(
    place: str, unchecked: Engine, fill: Callable[..., None], revision: str
) -> None:
    described = _described(unchecked)
    with unchecked.begin() as connection:
        fill(connection, [1, 2])
    _made_old(unchecked, revision)
    assert _described(unchecked) != described
    assert upgrade_database(place) == (revision, SCHEMA_REVISION)
    assert _described(unchecked) == described
    with opened_database(place) as again, again.begin() as connection:
        assert check_database(connection) == []
        fill(connection, [1, 2, 3])
        assert len(motion_rows(connection)) == 3


def test_an_upgrade_that_fails_is_undone(
    unchecked: Engine, fill: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    with unchecked.begin() as connection:
        fill(connection, [1])
    _made_old(unchecked, "0002")
    before = _described(unchecked)

    def killed(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(rbfrag.db.upgrade.command, "stamp", killed)
    with pytest.raises(KeyboardInterrupt):
        migrate(unchecked)
    assert _described(unchecked) == before


def test_upgrade_of_a_current_database_changes_nothing(place: str) -> None:
    open_database(place, create=True).dispose()
    assert upgrade_database(place) == (SCHEMA_REVISION, SCHEMA_REVISION)


def test_upgrade_prints_nothing(place: str, capfd: pytest.CaptureFixture[str]) -> None:
    open_database(place, create=True).dispose()
    upgrade_database(place)
    assert capfd.readouterr() == ("", "")


def test_motions_of_the_first_schema_keep_their_samples(
    place: str, unchecked: Engine, make_motion: Callable[..., GroundMotion]
) -> None:
    given = make_motion(component="090")
    with unchecked.begin() as connection:
        quake = EarthquakeInfo("E")
        motion_id, _ = add_motion(connection, given, earthquake=quake, is_vertical=False, suite="S")
    _made_old(unchecked, "0001")
    assert upgrade_database(place) == ("0001", SCHEMA_REVISION)
    with opened_database(place) as again, again.connect() as connection:
        back = load_motion(connection, motion_id)
        (row,) = motion_rows(connection, suite="S")
    assert back.sha256 == given.sha256 == row.source_sha256
    assert (back.processing_applied, back.start_time) == (None, None)


def test_results_of_the_second_schema_stay_as_they_are(
    place: str, unchecked: Engine, fill: Callable[..., None], model: ModelRow
) -> None:
    tables = ("combination", "simulation", "fragility_model")

    def content(connection: Connection) -> list[list[tuple[object, ...]]]:
        return [list(table_rows_by_natural_key(connection, table)) for table in tables]

    with unchecked.begin() as connection:
        fill(connection, [1, 2, 3])
        save_model(connection, replace(model, form=1, leave_out_steps=None, dependence=None))
        before = content(connection)
    _made_old(unchecked, "0002")
    assert upgrade_database(place) == ("0002", SCHEMA_REVISION)
    with opened_database(place) as again, again.connect() as connection:
        assert content(connection) == before
        assert load_model(connection).kind == "toppling"
    assert all(before)


def test_maps_are_no_part_of_keys_any_more(
    place: str, unchecked: Engine, make_motion: Any, make_result: Any, store_result: Any
) -> None:
    given = make_motion()
    plain = {"search_limit": 0.01}
    with unchecked.begin() as connection:
        quake = EarthquakeInfo("E")
        motion_id, _ = add_motion(connection, given, earthquake=quake, is_vertical=False)
        campaign = start_campaign(connection, {})
        for p2, widths in ((3.0, {0.3: 1e-3, 0.2: 1e-6}), (1.0, {0.1: 1e-3})):
            for width, depth in widths.items():
                result = make_result(given.pga_g, p2=p2, island_width=width)
                settings = {**plain, "map": "full", "map_depth": depth}
                store_result(connection, campaign, given, motion_id, result, settings=settings)
    _made_old(unchecked, "0003")
    assert upgrade_database(place) == ("0003", SCHEMA_REVISION)
    with opened_database(place) as again, again.begin() as connection:
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


def test_outcomes_of_the_fifth_schema_are_not_known_to_be_sensitive(
    place: str, unchecked: Engine, fill: Callable[..., None]
) -> None:
    with unchecked.begin() as connection:
        fill(connection, [1, 2])
        update_rows(connection, simulation, simulation.c.kr_over_pga > 0.0, {"sensitive": True})
    _made_old(unchecked, "0005")
    assert upgrade_database(place) == ("0005", SCHEMA_REVISION)
    with opened_database(place) as again, again.connect() as connection:
        assert check_database(connection) == []
        assert set(connection.scalars(select(simulation.c.sensitive))) == {None}


def test_measures_of_the_fourth_schema_are_computed_where_the_samples_are(
    place: str, unchecked: Engine, make_motion: Callable[..., GroundMotion], model: ModelRow
) -> None:
    given, other = make_motion(), make_motion(2)
    with unchecked.begin() as connection:
        quake = EarthquakeInfo("E")
        for each in (given, other):
            add_motion(connection, each, earthquake=quake, is_vertical=False)
        _, without = motion_rows(connection)
        update_rows(connection, motion, motion.c.id == without.id, {"samples": None})
        save_model(connection, model)
    _made_old(unchecked, "0004")
    assert upgrade_database(place) == ("0004", SCHEMA_REVISION)
    with opened_database(place) as again, again.connect() as connection:
        assert check_database(connection) == []
        kept, empty = motion_rows(connection)
        old = load_model(connection)
    assert {name: getattr(kept, name) for name in MEASURES} == measures_of(given)
    assert {getattr(empty, name) for name in LATER_MEASURES} == {None}
    assert kept.sa10_g is not None
    assert kept.sa10_g > 0.0
    assert (old.form, old.leave_out_steps, old.dependence) == (1, None, None)
