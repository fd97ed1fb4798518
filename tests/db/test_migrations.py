"""Databases are made, and older ones brought, to the schema that the code describes."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.operations import Operations
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, MetaData, Table, create_engine, inspect, select, text

import rbfrag.db.engine
import rbfrag.db.insert
import rbfrag.db.location
import rbfrag.migrations
from benchmarks.reference_set import SPARED_INDEX
from rbfrag.campaign.kinds.slumping import FAMILY
from rbfrag.campaign.simulate import simulate
from rbfrag.db.check import check_database
from rbfrag.db.connect import unchecked_engine
from rbfrag.db.engine import migrate, open_database, opened_database, upgrade_database
from rbfrag.db.insert import renew_digests
from rbfrag.db.location import REFERENCE, REVISIONS, SCHEMA_REVISION, VERSION_TABLE
from rbfrag.db.models import save_model
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.db.schema import SITE_COLUMNS, ledger, metadata
from rbfrag.db.views import drop_views, views
from rbfrag.errors import SchemaVersionError
from rbfrag.motions.ground_motion import GroundMotion
from tests.fragility.conftest import model_row


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
            # a column that came later stands last
            "columns": sorted(
                (c["name"], str(c["type"]), c["nullable"], c["default"])
                for c in inspector.get_columns(table)
            ),
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
        differences = compare_metadata(context, metadata)
    assert [(change, table.name) for change, table in differences] == [
        ("remove_table", ledger.name)
    ]


def test_the_shipped_reference_has_every_constraint(tmp_path: Path) -> None:
    # Alembic's comparison is blind to CHECK, ON DELETE and WITHOUT ROWID.
    direct = create_engine(f"sqlite:///{tmp_path / 'direct.db'}")
    metadata.create_all(direct)
    ledger.create(direct)
    with direct.begin() as connection:
        connection.execute(text(f"DROP INDEX {SPARED_INDEX}"))
    shipped = open_database(REFERENCE, read_only=True)
    try:
        assert _described(shipped) == _described(direct)
    finally:
        direct.dispose()
        shipped.dispose()


def test_known_revisions_are_those_of_the_migrations() -> None:
    scripts = ScriptDirectory.from_config(_config())
    chain = [script.revision for script in scripts.walk_revisions()]
    assert tuple(reversed(chain)) == REVISIONS
    assert scripts.get_heads() == [SCHEMA_REVISION]


LATER = f"{int(SCHEMA_REVISION) + 1:04}"

LATER_REVISION = """
from alembic import op
from sqlalchemy import Double, MetaData, Table

from rbfrag.db.insert import renew_digests

revision = "LATER"
down_revision = "BEFORE"
branch_labels = None
depends_on = None


def upgrade():
    connection = op.get_bind()
    before = Table("combination", MetaData(), autoload_with=connection)
    number = Double().compile(dialect=connection.dialect)
    op.execute(
        f"ALTER TABLE combination ADD COLUMN yield_g {number} "
        "CONSTRAINT ck_combination_yield_g CHECK (yield_g > 0)"
    )
    renew_digests(connection, Table("combination", MetaData(), autoload_with=connection), before)
"""
"""A later change of the schema: it adds a column that present databases do not have."""


@pytest.fixture
def older(
    place: str,
    make_motion: Callable[..., GroundMotion],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Engine]:
    """A database of two campaigns without that column, and an rbfrag that upgrades it."""
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        quake = EarthquakeInfo("E")
        add_motion(connection, make_motion(), earthquake=quake, is_vertical=False)
    simulate(place, kind="slumping", family=FAMILY[:2], rotations_deg=[None], jobs=1)
    simulate(place, p2=[3.0], jobs=1)
    folder = tmp_path / "migrations"
    shutil.copytree(Path(rbfrag.migrations.__file__).parent, folder)
    script = LATER_REVISION.replace("LATER", LATER).replace("BEFORE", SCHEMA_REVISION)
    (folder / "versions" / f"{LATER}_yield_of_block.py").write_text(script)
    monkeypatch.setattr(rbfrag.migrations, "__file__", str(folder / "__init__.py"))
    for module in (rbfrag.db.location, rbfrag.db.engine):
        monkeypatch.setattr(module, "REVISIONS", (*REVISIONS, LATER))
        monkeypatch.setattr(module, "SCHEMA_REVISION", LATER)
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    with engine.begin() as connection:
        drop_views(connection)
        operations = Operations(MigrationContext.configure(connection))
        with operations.batch_alter_table("combination") as batch:
            batch.drop_constraint("ck_combination_yield_g", type_="check")
            batch.drop_column("yield_g")
        renew_digests(connection, Table("combination", MetaData(), autoload_with=connection))
    yield engine
    engine.dispose()


def test_an_older_database_is_upgraded(place: str, older: Engine, tmp_path: Path) -> None:
    message = f"has schema {SCHEMA_REVISION}, this rbfrag requires {LATER}"
    with pytest.raises(SchemaVersionError, match=message):
        open_database(place)
    assert upgrade_database(place)[:2] == (SCHEMA_REVISION, LATER)
    direct = create_engine(f"sqlite:///{tmp_path / 'direct.db'}")
    metadata.create_all(direct)
    ledger.create(direct)
    if older.dialect.name == "sqlite":
        assert _described(older) == _described(direct)
    direct.dispose()
    with opened_database(place) as again, again.connect() as connection:
        assert check_database(connection) == []
        for name, view in views.tables.items():
            assert list(connection.execute(text(f"SELECT * FROM {name}")).keys()) == list(
                view.c.keys()
            )


def test_an_altered_row_is_still_found_after_an_upgrade(place: str, older: Engine) -> None:
    with older.begin() as connection:
        connection.execute(text("UPDATE combination SET n_runs = n_runs + 1 WHERE id = 1"))
    upgrade_database(place)
    with opened_database(place) as again, again.connect() as connection:
        assert [finding.row for finding in check_database(connection)] == ["1"]


def test_an_upgrade_that_fails_is_undone(older: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    before = _described(older)

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(rbfrag.db.insert, "table_digests", killed)
    with pytest.raises(KeyboardInterrupt):
        migrate(older)
    assert _described(older) == before


METADATA = {
    "earthquake": ("mechanism", "depth_km"),
    "recording": ("network", *SITE_COLUMNS, "attributes"),
}
"""Columns that came with revision 0003, by table."""


def _rows(connection: Connection) -> dict[str, Any]:
    names = ("motion", "motion_spectrum", "recording_spectrum", *METADATA)
    tables = [metadata.tables[name] for name in names]
    queries = {table.name: select(table).order_by(*table.primary_key.columns) for table in tables}
    return {name: connection.execute(query).all() for name, query in queries.items()}


@pytest.fixture
def first_release(
    place: str, make_motion: Callable[..., GroundMotion]
) -> Iterator[tuple[Engine, dict[str, Any]]]:
    """A database of revision 0001: two horizontals, a vertical, and a motion without samples."""
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        quake = EarthquakeInfo("E")
        for seed, (name, azimuth) in enumerate((("N", 0.0), ("E", 90.0), ("UP", None), ("X", 7.0))):
            recording = "" if name == "X" else "R"
            motion = make_motion(seed, component=name, orientation_deg=azimuth, recording=recording)
            add_motion(connection, motion, earthquake=quake, is_vertical=name == "UP")
        before = _rows(connection)
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    with engine.begin() as connection:
        drop_views(connection)
        operations = Operations(MigrationContext.configure(connection))
        operations.drop_table("motion_spectrum")
        operations.drop_table("recording_spectrum")
        with operations.batch_alter_table("motion") as batch:
            for name in ("d5_75_s", "housner_m"):
                batch.drop_constraint(f"ck_motion_{name}", type_="check")
                batch.drop_column(name)
        for name, columns in METADATA.items():
            with operations.batch_alter_table(name) as batch:
                for column in columns:
                    if column not in ("network", "attributes"):
                        batch.drop_constraint(f"ck_{name}_{column}", type_="check")
                    batch.drop_column(column)
            renew_digests(connection, Table(name, MetaData(), autoload_with=connection))
        with operations.batch_alter_table("fragility_model") as batch:
            batch.drop_column("completions")
        connection.execute(text("UPDATE motion SET samples = NULL WHERE component = 'X'"))
        motion_table = Table("motion", MetaData(), autoload_with=connection)
        renew_digests(connection, motion_table)
        connection.execute(
            text("DELETE FROM ledger WHERE of_table IN ('motion_spectrum', 'recording_spectrum')")
        )
        connection.execute(text(f"UPDATE {VERSION_TABLE} SET version_num = '0001'"))
    yield engine, before
    engine.dispose()


def test_the_first_release_is_upgraded(
    place: str, first_release: tuple[Engine, dict[str, Any]], tmp_path: Path
) -> None:
    engine, before = first_release
    assert upgrade_database(place) == ("0001", SCHEMA_REVISION, ())
    direct = create_engine(f"sqlite:///{tmp_path / 'direct.db'}")
    metadata.create_all(direct)
    ledger.create(direct)
    if engine.dialect.name == "sqlite":
        assert _described(engine) == _described(direct)
    direct.dispose()
    with opened_database(place) as again, again.connect() as connection:
        assert check_database(connection) == []
        for name, view in views.tables.items():
            assert list(connection.execute(text(f"SELECT * FROM {name}")).keys()) == list(
                view.c.keys()
            )
        after = _rows(connection)
    assert len(before["recording_spectrum"]) == 2
    assert after["recording_spectrum"] == before["recording_spectrum"]
    assert after["motion_spectrum"] == before["motion_spectrum"][:3]
    assert after["motion"][:3] == before["motion"][:3]
    assert all(after[name] == before[name] for name in METADATA)
    assert (after["motion"][3].housner_m, after["motion"][3].d5_75_s) == (None, None)


def test_models_that_an_upgrade_deletes_are_named(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())
        connection.execute(text(f"UPDATE {VERSION_TABLE} SET version_num = '0003'"))

    def delete_models(engine: Engine) -> None:
        with engine.begin() as connection:
            connection.execute(text("DELETE FROM fragility_model"))

    monkeypatch.setattr("rbfrag.db.engine.migrate", delete_models)
    assert upgrade_database(place) == ("0003", SCHEMA_REVISION, (model_row().name,))


def test_upgrade_of_a_current_database_changes_nothing(place: str) -> None:
    open_database(place, create=True).dispose()
    assert upgrade_database(place) == (SCHEMA_REVISION, SCHEMA_REVISION, ())


def test_upgrade_prints_nothing(place: str, capfd: pytest.CaptureFixture[str]) -> None:
    open_database(place, create=True).dispose()
    upgrade_database(place)
    assert capfd.readouterr() == ("", "")
