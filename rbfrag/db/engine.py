"""Opening of the database, its creation, and its upgrade to the current schema."""

from __future__ import annotations

import glob
import os
import platform
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from sqlalchemy import Connection, Engine, inspect, text

import rbfrag.migrations
from rbfrag.db.connect import database_label, raw_sqlite, unchecked_engine
from rbfrag.db.location import (
    APPLICATION_ID,
    REFERENCE,
    REVISIONS,
    SCHEMA_REVISION,
    VERSION_TABLE,
    check_revision,
    locate,
    sole_revision,
)
from rbfrag.db.schema import ledger, metadata
from rbfrag.db.sqlite_file import check_sqlite_database, explained_sqlite_error
from rbfrag.errors import (
    DatabaseError,
    DatabaseNotFoundError,
    DatabaseReadOnlyError,
    NotADatabaseError,
)


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
    if not read_only and isinstance(place, Path) and place.resolve() == REFERENCE:
        raise DatabaseReadOnlyError(
            f"{place}: the built-in data set is read-only: copy it, and give the copy as db",
            fields=("db",),
        )
    if create:
        create_if_missing(place)
    engine = unchecked_engine(place, read_only=read_only)
    try:
        # A transaction, so that what cannot be written is found out now and not after hours.
        with engine.begin() as connection:
            if isinstance(place, Path):
                check_sqlite_database(raw_sqlite(connection), place)
            elif (revision := stored_revision(connection)) is not None:
                check_revision(revision, database_label(engine.url))
            else:
                raise NotADatabaseError(
                    f"{database_label(engine.url)} has no rbfrag tables: add motions with  rbfrag "
                    "motions add"
                )
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


def stored_revision(connection: Connection) -> str | None:
    """Return the schema revision of a database; None if it is not one of rbfrag."""
    if connection.dialect.name == "sqlite":
        (application,) = raw_sqlite(connection).execute("PRAGMA application_id").fetchone()
        if application != APPLICATION_ID:
            return None
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    revisions = connection.scalars(text(f"SELECT version_num FROM {VERSION_TABLE}"))
    return sole_revision([*map(str, revisions)], database_label(connection.engine.url))


class Upgrade(NamedTuple):
    """Result of an upgrade.

    Args:
        before: the revision before.
        after: the revision after, the same when there was nothing to do.
        deleted_models: names of fitted models of forms that are no longer supported.
    """

    before: str
    after: str
    deleted_models: tuple[str, ...] = ()


def upgrade_database(db: str | PathLike[str] | None = None) -> Upgrade:
    """Upgrade a database to the current schema, in one transaction.

    Args:
        db: a path or an SQLAlchemy URL; None as for :func:`open_database`.

    """
    engine = unchecked_engine(locate(db), foreign_keys=False)
    label = database_label(engine.url)
    try:
        with engine.connect() as connection:
            before = stored_revision(connection)
        if before is None:
            raise NotADatabaseError(f"{label} is not an rbfrag database: give another")
        if before not in REVISIONS:
            check_revision(before, label)
        if before == SCHEMA_REVISION:
            return Upgrade(before, before)
        models = _model_names(engine)
        migrate(engine)
        remaining = _model_names(engine)
        deleted = tuple(name for name in models if name not in remaining)
        return Upgrade(before, SCHEMA_REVISION, deleted)
    finally:
        engine.dispose()


def _model_names(engine: Engine) -> list[str]:
    with engine.connect() as connection:
        return list(connection.scalars(text("SELECT name FROM fragility_model ORDER BY name")))


def migrate(engine: Engine) -> None:
    """Create the tables, or upgrade the existing ones to the current schema.

    Args:
        engine: of :func:`rbfrag.db.connect.unchecked_engine`, opened for writing and, on SQLite,
            with foreign keys off: rebuilding a table drops it, and with them on that would
            delete what points to it.
    """
    # Imported here: most commands migrate nothing.
    from alembic import command
    from alembic.config import Config

    with engine.begin() as connection:
        if connection.dialect.name == "postgresql":
            # two upgrades of one server take turns
            lock = {"key": APPLICATION_ID}
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), lock)
        config = Config()
        folder = Path(rbfrag.migrations.__file__).parent
        config.set_main_option("script_location", str(folder).replace("%", "%%"))
        config.attributes["connection"] = connection
        if stored_revision(connection) is None:
            metadata.create_all(connection, checkfirst=False)
            ledger.create(connection)
            command.stamp(config, "head", purge=True)
        else:
            command.upgrade(config, "head")
        if connection.dialect.name == "sqlite":
            connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION_ID}")
            broken = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchone()
            if broken is not None:
                raise DatabaseError(
                    f"the upgrade was undone: table {broken[0]} would have dangling references: "
                    "run  rbfrag db check  with the rbfrag that wrote the database"
                )


def create_if_missing(place: Path | str) -> None:
    """Create the database at `place` unless it exists.

    An SQLite file is built under another name in the same folder and given its own name when
    it is complete, so that neither a killed process nor two at once leave half a database.
    On PostgreSQL one transaction does the same.

    Args:
        place: what :func:`rbfrag.db.location.locate` returned.
    """
    if isinstance(place, str):
        engine = unchecked_engine(place)
        try:
            with engine.connect() as connection:
                present = inspect(connection).has_table(VERSION_TABLE)
            if not present:
                migrate(engine)
        finally:
            engine.dispose()
        return
    try:
        folder = place.absolute().parent
        _remove_abandoned_drafts(place, folder)
        if place.is_symlink() or place.exists():
            return
        if not folder.is_dir():
            raise DatabaseNotFoundError(
                f"cannot create the database {place}: create the folder {folder} first"
            )
        draft = _draft_file(place, folder)
        try:
            _build(draft)
            _give_name(draft, place)
        finally:
            for tail in ("", "-wal", "-shm", "-journal"):
                Path(f"{draft}{tail}").unlink(missing_ok=True)
    except OSError as error:
        raise DatabaseError(
            f"cannot create the database {place}: {error.strerror or error}"
        ) from error


def _draft_prefix(place: Path, pid: int | str) -> str:
    return f".{place.name}.{platform.node()}-{pid}."


def _remove_abandoned_drafts(place: Path, folder: Path) -> None:
    """Remove draft files of processes of this computer that were killed while creating the
    database.
    """
    if os.name != "posix":
        return  # elsewhere no harmless call shows whether a process lives
    before, after = _draft_prefix(place, "*").split("*")
    for draft in folder.glob(f"{glob.escape(before)}*{glob.escape(after)}*.new*"):
        pid = draft.name.removeprefix(before).partition(".")[0]
        if not pid.isdecimal():
            continue
        try:
            os.kill(int(pid), 0)
        except ProcessLookupError:
            with suppress(OSError):
                draft.unlink()
        except (OSError, OverflowError):
            pass  # a process of another user, or nothing that can be said


def _draft_file(place: Path, folder: Path) -> Path:
    try:
        handle, name = tempfile.mkstemp(
            prefix=_draft_prefix(place, os.getpid()), suffix=".new", dir=folder
        )
    except OSError as error:
        raise DatabaseReadOnlyError(
            f"cannot create the database {place}: {error.strerror or error}; choose a writable "
            "folder",
            fields=("db",),
        ) from error
    os.close(handle)
    draft = Path(name)
    # mkstemp keeps others out; the database is to have the rights of any file made here.
    if os.name == "posix":
        mask = os.umask(0)
        os.umask(mask)
        draft.chmod(0o666 & ~mask)
    return draft


def _build(draft: Path) -> None:
    try:
        with closing(sqlite3.connect(draft, isolation_level=None)) as raw:
            # Kept in the file's header from now on; writing it also makes the file SQLite's.
            raw.execute("PRAGMA journal_mode = WAL")
    except sqlite3.Error as error:
        raise explained_sqlite_error(error, draft) from error
    engine = unchecked_engine(draft, foreign_keys=False)
    try:
        migrate(engine)
    finally:
        engine.dispose()


def _give_name(draft: Path, place: Path) -> None:
    try:
        # A link, unlike a rename, never overwrites what another process made meanwhile.
        place.hardlink_to(draft)
    except FileExistsError:
        return
    except OSError:
        # File systems without hard links (FAT): the name was free a moment ago.
        if not place.exists():
            draft.rename(place)
