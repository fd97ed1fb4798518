"""Bringing a database to this rbfrag's schema."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection, Engine, inspect, text

import rbfrag.migrations
from rbfrag.db.engine import database_label, raw_sqlite, unchecked_engine
from rbfrag.db.location import locate
from rbfrag.db.revision import (
    APPLICATION_ID,
    REVISIONS,
    SCHEMA_REVISION,
    VERSION_TABLE,
    check_revision,
)
from rbfrag.errors import DatabaseError, NotADatabaseError

_LOCK = APPLICATION_ID  # any number that is ours: two upgrades of one server take turns


def upgrade_database(db: str | PathLike[str] | None = None) -> tuple[str, str]:
    """Bring a database to the schema of this rbfrag, in one transaction.

    Args:
        db: a path or an SQLAlchemy URL; None as for :func:`rbfrag.db.engine.database_url`.

    Returns:
        The revision before and after; they are equal when there was nothing to do.

    Raises:
        DatabaseNotFoundError: there is no such database.
        NotADatabaseError: it is not one of rbfrag's.
        SchemaVersionError: its schema is newer than this rbfrag.
        DatabaseReadOnlyError: it cannot be written.
    """
    engine = unchecked_engine(locate(db), foreign_keys=False)
    label = database_label(engine.url)
    try:
        with engine.connect() as connection:
            before = _revision_of_ours(connection)
        if before is None:
            raise NotADatabaseError(f"{label} is not one of rbfrag's databases: name another")
        if before not in REVISIONS:
            check_revision(before, label)
        if before != SCHEMA_REVISION:
            migrate(engine)
        return before, SCHEMA_REVISION
    finally:
        engine.dispose()


def migrate(engine: Engine) -> None:
    """Run the missing migrations on an engine of :func:`rbfrag.db.engine.unchecked_engine`.

    Args:
        engine: opened for writing and, on SQLite, with foreign keys off: rebuilding a table
            drops it, and with them on that would delete what points to it.
    """
    with engine.begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})
        config = Config()
        folder = Path(rbfrag.migrations.__file__).parent
        config.set_main_option("script_location", str(folder).replace("%", "%%"))
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
        if connection.dialect.name == "sqlite":
            _require_sound_references(connection)


def _revision_of_ours(connection: Connection) -> str | None:
    if connection.dialect.name == "sqlite":
        (application,) = raw_sqlite(connection).execute("PRAGMA application_id").fetchone()
        if application != APPLICATION_ID:
            return None
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    context = MigrationContext.configure(connection, opts={"version_table": VERSION_TABLE})
    return context.get_current_revision()


def _require_sound_references(connection: Connection) -> None:
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchone()
    if broken is not None:
        raise DatabaseError(
            f"the upgrade was undone: table {broken[0]} would hold rows that point nowhere; "
            "run  rbfrag db check  with the rbfrag that wrote the database"
        )
