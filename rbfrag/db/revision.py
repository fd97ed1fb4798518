"""Which schema this rbfrag reads and writes.

Kept apart from the migrations so that `rbfrag predict` can check a database without
loading Alembic; a test proves that both agree.
"""

from __future__ import annotations

from rbfrag.errors import SchemaVersionError

REVISIONS = ("0001", "0002", "0003", "0004")
"""Every schema revision this rbfrag knows, oldest first."""

SCHEMA_REVISION = REVISIONS[-1]
"""The revision that this rbfrag works with."""

VERSION_TABLE = "rbfrag_revision"
"""Alembic's version table; its own name, so that a PostgreSQL schema may be shared."""

APPLICATION_ID = 0x72626672
"""SQLite's application_id of an rbfrag database: the letters "rbfr"."""


def check_revision(found: str, where: str) -> None:
    """Refuse a database whose schema this rbfrag does not work with.

    Args:
        found: the revision stored in the database.
        where: the database as the user names it, for the message.

    Raises:
        SchemaVersionError: the schema is older or newer.
    """
    if found == SCHEMA_REVISION:
        return
    if found in REVISIONS:
        raise SchemaVersionError(
            f"{where}: the database has schema {found}, this rbfrag needs {SCHEMA_REVISION}: "
            f"run  rbfrag db upgrade --db {where}"
        )
    raise SchemaVersionError(
        f"{where}: the database has schema {found}, newer than {SCHEMA_REVISION} of this rbfrag: "
        "install a newer rbfrag"
    )
