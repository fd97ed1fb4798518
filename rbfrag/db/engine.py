"""Opening of the database: SQLAlchemy engines whose errors become rbfrag errors."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

from sqlalchemy import Connection, Engine, inspect, text

from rbfrag.db.connect import database_label, raw_sqlite, unchecked_engine
from rbfrag.db.location import VERSION_TABLE, check_revision, locate, sole_revision
from rbfrag.db.sqlite_file import check_sqlite_database
from rbfrag.errors import NotADatabaseError


def open_database(
    db: str | PathLike[str] | None = None,
    *,
    create: bool = False,
    read_only: bool = False,
) -> Engine:
    """Open a database with the schema of this rbfrag version.

    A transaction of a writing SQLite engine takes the write lock when it begins
    (``BEGIN IMMEDIATE``), so that it never fails half-way for want of it: open with
    `read_only` what only reads. Call ``engine.dispose()`` when done, or use
    :func:`opened_database`.

    Args:
        db: a path or an SQLAlchemy URL; None for the environment variable ``RBFRAG_DB``,
            or else ``rbfrag.db`` in the current folder. ``postgresql://`` goes to psycopg.
        create: make the database when there is none; it appears complete or not at all.
        read_only: forbid writes; works on a file in a folder that cannot be written.

    Returns:
        An engine that raises the errors of :mod:`rbfrag.errors` for whatever happens to
        the database, and SQLAlchemy's own only for mistakes in rbfrag.

    Raises:
        InputError: a URL that cannot be read, or of a database that rbfrag does not use.
        DatabaseError: one of its kinds: not found, no database, another schema, read-only, busy.
        MissingExtraError: PostgreSQL without psycopg.
    """
    place = locate(db)
    if create:
        # Imported here: the migrations and Alembic are no business of a reader.
        from rbfrag.db.upgrade import create_if_missing

        create_if_missing(place)
    engine = unchecked_engine(place, read_only=read_only)
    try:
        # A transaction, so that what cannot be written is found out now and not after hours.
        with engine.begin() as connection:
            if isinstance(place, Path):
                check_sqlite_database(raw_sqlite(connection), place, read_only=read_only)
            else:
                label = database_label(engine.url)
                _check_server_database(connection, label, read_only=read_only)
    except BaseException:
        engine.dispose()
        raise
    return engine


@contextmanager
def opened_database(
    db: str | PathLike[str] | None = None, *, create: bool = False, read_only: bool = False
) -> Iterator[Engine]:
    """Open a database for a ``with`` block and close its connections afterwards."""
    engine = open_database(db, create=create, read_only=read_only)
    try:
        yield engine
    finally:
        engine.dispose()


def _check_server_database(connection: Connection, label: str, *, read_only: bool) -> None:
    revision = stated_revision(connection)
    if revision is None:
        raise NotADatabaseError(
            f"{label} has no rbfrag tables: add motions with  rbfrag motions add"
        )
    check_revision(revision, label, read_only=read_only)


def stated_revision(connection: Connection) -> str | None:
    """Return the schema revision of a database."""
    revisions = (
        connection.scalars(text(f"SELECT version_num FROM {VERSION_TABLE}")).all()
        if inspect(connection).has_table(VERSION_TABLE)
        else ()
    )
    return sole_revision([*map(str, revisions)], database_label(connection.engine.url))
