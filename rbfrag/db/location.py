"""Location of the database and its supported schema, without loading SQLAlchemy.

The revisions of the schema are listed here as well as in the migrations, so that `rbfrag predict`
can check a database without loading Alembic; a test compares both lists.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from rbfrag.errors import InputError, SchemaVersionError

DEFAULT_NAME = "rbfrag.db"
"""File name of the database in the current folder if no other is given."""

REFERENCE = Path(__file__).resolve().parents[1] / "reference" / "reference.db"
"""The database that is shipped with rbfrag, read-only and without samples, if there is one."""

REVISIONS = ("0001", "0002", "0003", "0004")
"""Every schema revision this rbfrag knows, oldest first."""

SCHEMA_REVISION = REVISIONS[-1]
"""The revision that this rbfrag works with."""

VERSION_TABLE = "rbfrag_revision"
"""Alembic's version table; its own name, so that a PostgreSQL schema may be shared."""

APPLICATION_ID = 0x72626672
"""SQLite's application_id of an rbfrag database: the letters "rbfr"."""


def locate(db: str | PathLike[str] | None) -> Path | str:
    """Return the SQLite file, or the URL of another database, for `db`.

    Args:
        db: a path or an SQLAlchemy URL; None for the environment variable ``RBFRAG_DB``,
            or else ``rbfrag.db`` in the current folder.

    Returns:
        A path for SQLite; the URL as text for PostgreSQL.

    Raises:
        InputError: a URL of a database that rbfrag does not use.
    """
    if db is None:
        db = os.environ.get("RBFRAG_DB") or DEFAULT_NAME
    elif not isinstance(db, str | PathLike):
        raise InputError(
            f"db is of type {type(db).__name__}: give the database as a path or an SQLAlchemy URL"
        )
    text = os.fspath(db)
    if not text:
        raise InputError(
            "the database name is empty: give db a path or an SQLAlchemy URL", fields=("db",)
        )
    if "\0" in text:
        raise InputError(f"the database name {text!r} holds a NUL character")
    if "://" not in text:
        return Path(text)
    scheme, _, rest = text.partition("://")
    dialect = scheme.partition("+")[0].lower()
    if dialect in ("postgresql", "postgres"):
        return text
    if dialect != "sqlite":
        advice = "; its tables come over by docs/howto/import-a-table.md"
        raise InputError(
            f"db {scheme}://…: supported are SQLite (a path) and PostgreSQL "
            f"(postgresql://…){advice if dialect in ('mysql', 'mariadb') else ''}",
            fields=("db",),
        )
    name = rest.removeprefix("/")
    if not name or name == ":memory:" or "?" in name or not rest.startswith("/"):
        raise InputError(
            f"db {text}: give an SQLite database as a path, or as sqlite:///path without options",
            fields=("db",),
        )
    return Path(name)


def is_unnamed(db: str | PathLike[str] | None) -> bool:
    """Return whether neither `db` nor the environment names a database."""
    return db is None and not os.environ.get("RBFRAG_DB")


def data_place(db: str | PathLike[str] | None) -> tuple[Path | str, bool]:
    """Return the location of the data, and whether it is the built-in data set (read only).

    Args:
        db: as for :func:`locate`; the built-in data answer where none is named and the current
            folder holds none.
    """
    place, built_in = locate(db), reference_file()
    if built_in is not None and is_unnamed(db) and not Path(place).exists():
        return built_in, True
    return place, False


def reference_file() -> Path | None:
    """Return the built-in database, or None if there is none."""
    return REFERENCE if REFERENCE.is_file() else None


def sole_revision(revisions: Sequence[str], where: str) -> str | None:
    """Return the schema revision of a database, None if it has none.

    Raises:
        SchemaVersionError: it states several, as after a copy of tables into tables.
    """
    if len(revisions) > 1:
        raise SchemaVersionError(
            f"{where}: the database has several schema versions, "
            f"{', '.join(sorted(revisions)[:4])}: restore it from a backup"
        )
    return revisions[0] if revisions else None


def check_revision(revision: str, where: str) -> None:
    """Reject a database with an unsupported schema.

    Args:
        revision: the revision stored in the database.
        where: the database as the user names it, for the message.
    """
    if revision == SCHEMA_REVISION:
        return
    if revision in REVISIONS:
        raise SchemaVersionError(
            f"{where}: the database has schema {revision}, this rbfrag requires "
            f"{SCHEMA_REVISION}: run  rbfrag db upgrade"
        )
    raise SchemaVersionError(
        f"{where}: the database has schema {revision}, newer than {SCHEMA_REVISION} of this "
        "rbfrag: install a newer rbfrag"
    )
