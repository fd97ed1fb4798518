"""Databases are made, and older ones brought, to the schema that the code describes."""

from __future__ import annotations

import io
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

import rbfrag.db.insert
import rbfrag.migrations
from benchmarks.reference_set import SPARED_INDEX
from rbfrag.campaign.kinds.slumping import FAMILY
from rbfrag.campaign.simulate import simulate
from rbfrag.db.check.database import check_database
from rbfrag.db.connect import unchecked_engine
from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.insert import renew_digests
from rbfrag.db.location import REFERENCE, REVISIONS, SCHEMA_REVISION, VERSION_TABLE
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.db.schema import combination, ledger, metadata
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
    assert [(what, table.name) for what, table in differences] == [("remove_table", ledger.name)]


def test_the_shipped_reference_has_every_constraint(tmp_path: Path) -> None:
    # Alembic's comparison is blind to CHECK, ON DELETE and WITHOUT ROWID.
    direct = create_engine(f"sqlite:///{tmp_path / 'direct.db'}")
    metadata.create_all(direct)
    ledger.create(direct)
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
    assert tuple(reversed(chain)) == REVISIONS
    assert scripts.get_heads() == [SCHEMA_REVISION]


def _made_old(engine: Engine) -> None:
    """Take from a database what came with 0008 and 0009."""
    with engine.begin() as connection:
        with Operations(MigrationContext.configure(connection)).batch_alter_table(
            "combination"
        ) as batch:
            batch.drop_constraint("ck_combination_yield_g", type_="check")
            batch.drop_column("yield_g")
        renew_digests(connection, Table("combination", MetaData(), autoload_with=connection))
    with engine.begin() as connection:
        ledger.drop(connection)
        connection.execute(text(f"UPDATE {VERSION_TABLE} SET version_num = '0007'"))


@pytest.fixture
def unchecked(place: str) -> Iterator[Engine]:
    """An empty database, opened as upgrades open it."""
    open_database(place, create=True).dispose()
    engine = unchecked_engine(Path(place) if "://" not in place else place, foreign_keys=False)
    yield engine
    engine.dispose()


def _with_slumps(engine: Engine, make_motion: Callable[..., GroundMotion]) -> list[float]:
    """Store a block that slumps and one of toppling; return the yields that are stored."""
    with engine.begin() as connection:
        quake = EarthquakeInfo("E")
        add_motion(connection, make_motion(), earthquake=quake, is_vertical=False)
    where = engine.url.render_as_string(hide_password=False)
    simulate(where, kind="slumping", family=FAMILY[:2], rotations_deg=[None], jobs=1)
    simulate(where, p2=[3.0], jobs=1)
    with engine.connect() as connection:
        return _yields(connection)


def _yields(connection: Connection) -> list[float]:
    query = select(combination.c.yield_g).order_by(combination.c.natural_key)
    return list(connection.scalars(query))


def test_blocks_of_the_first_release_get_their_yield(
    place: str, unchecked: Engine, make_motion: Callable[..., GroundMotion]
) -> None:
    described = _described(unchecked)
    yields = _with_slumps(unchecked, make_motion)
    assert sum(value is not None for value in yields) == 4
    _made_old(unchecked)
    assert _described(unchecked) != described
    assert upgrade_database(place) == ("0007", SCHEMA_REVISION)
    assert _described(unchecked) == described
    with opened_database(place) as again, again.connect() as connection:
        assert _yields(connection) == yields
        assert check_database(connection) == []


def test_an_altered_row_is_still_found_after_an_upgrade(
    place: str, unchecked: Engine, make_motion: Callable[..., GroundMotion]
) -> None:
    _with_slumps(unchecked, make_motion)
    _made_old(unchecked)
    with unchecked.begin() as connection:
        connection.execute(text("UPDATE combination SET n_runs = n_runs + 1 WHERE id = 1"))
    upgrade_database(place)
    with opened_database(place) as again, again.connect() as connection:
        assert [finding.row for finding in check_database(connection)] == ["1"]


def test_an_upgrade_that_fails_is_undone(
    place: str,
    unchecked: Engine,
    make_motion: Callable[..., GroundMotion],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _with_slumps(unchecked, make_motion)
    _made_old(unchecked)
    before = _described(unchecked)

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(rbfrag.db.insert, "table_digests", killed)
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
