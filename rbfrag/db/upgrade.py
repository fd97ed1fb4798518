"""Creation of a database, and its upgrade to the current schema."""

from __future__ import annotations

import glob
import os
import platform
import sqlite3
import tempfile
from contextlib import suppress
from os import PathLike
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection, Engine, inspect, text

import rbfrag.migrations
from rbfrag.db.connect import database_label, raw_sqlite, unchecked_engine
from rbfrag.db.location import (
    APPLICATION_ID,
    REVISIONS,
    SCHEMA_REVISION,
    VERSION_TABLE,
    check_revision,
    locate,
    sole_revision,
)
from rbfrag.db.schema import ledger, metadata
from rbfrag.db.sqlite_file import explained_sqlite_error
from rbfrag.errors import (
    DatabaseError,
    DatabaseNotFoundError,
    DatabaseReadOnlyError,
    NotADatabaseError,
)

_LOCK = APPLICATION_ID  # any number that is ours: two upgrades of one server take turns


def upgrade_database(db: str | PathLike[str] | None = None) -> tuple[str, str]:
    """Upgrade a database to the current schema, in one transaction.

    Args:
        db: a path or an SQLAlchemy URL; None as for :func:`rbfrag.db.engine.open_database`.

    Returns:
        The revision before and after; they are equal when there was nothing to do.
    """
    engine = unchecked_engine(locate(db), foreign_keys=False)
    label = database_label(engine.url)
    try:
        with engine.connect() as connection:
            before = _revision_of_ours(connection)
        if before is None:
            raise NotADatabaseError(f"{label} is not an rbfrag database: give another")
        if before not in REVISIONS:
            check_revision(before, label)
        if before != SCHEMA_REVISION:
            migrate(engine)
        return before, SCHEMA_REVISION
    finally:
        engine.dispose()


def migrate(engine: Engine) -> None:
    """Create the tables, or upgrade the existing ones to the current schema.

    Args:
        engine: of :func:`rbfrag.db.engine.unchecked_engine`, opened for writing and, on SQLite,
            with foreign keys off: making a table anew drops it, and with them on that would
            delete what points to it.
    """
    with engine.begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})
        config = Config()
        folder = Path(rbfrag.migrations.__file__).parent
        config.set_main_option("script_location", str(folder).replace("%", "%%"))
        config.attributes["connection"] = connection
        if _revision_of_ours(connection) is None:
            metadata.create_all(connection, checkfirst=False)
            ledger.create(connection)
            command.stamp(config, "head", purge=True)
        else:
            command.upgrade(config, "head")
        if connection.dialect.name == "sqlite":
            connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION_ID}")
            _require_sound_references(connection)


def _revision_of_ours(connection: Connection) -> str | None:
    if connection.dialect.name == "sqlite":
        (application,) = raw_sqlite(connection).execute("PRAGMA application_id").fetchone()
        if application != APPLICATION_ID:
            return None
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    context = MigrationContext.configure(connection, opts={"version_table": VERSION_TABLE})
    return sole_revision(context.get_current_heads(), database_label(connection.engine.url))


def _require_sound_references(connection: Connection) -> None:
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchone()
    if broken is not None:
        raise DatabaseError(
            f"the upgrade was undone: table {broken[0]} would have dangling references: run  "
            "rbfrag db check  with the rbfrag that wrote the database"
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
        _create_on_server(place)
        return
    try:
        folder = place.absolute().parent
        _remove_drafts_of_the_dead(place, folder)
        if place.is_symlink() or place.exists():
            return
        if not folder.is_dir():
            raise DatabaseNotFoundError(
                f"cannot create the database {place}: create the folder {folder} first"
            )
    except OSError as error:
        raise DatabaseError(
            f"cannot create the database {place}: {error.strerror or error}"
        ) from error
    draft = _draft_file(place, folder)
    try:
        _build(draft)
        _give_name(draft, place)
    except OSError as error:
        raise DatabaseError(
            f"cannot create the database {place}: {error.strerror or error}"
        ) from error
    finally:
        for tail in ("", "-wal", "-shm", "-journal"):
            Path(f"{draft}{tail}").unlink(missing_ok=True)


def _draft_prefix(place: Path, pid: int | str) -> str:
    return f".{place.name}.{platform.node()}-{pid}."


def _remove_drafts_of_the_dead(place: Path, folder: Path) -> None:
    """Remove draft files of processes of this computer that were killed while creating the
    database.
    """
    if os.name != "posix":
        return  # where nothing tells, without harm, whether a process lives
    before, after = _draft_prefix(place, "*").split("*")
    for draft in folder.glob(f"{glob.escape(before)}*{glob.escape(after)}*.new*"):
        pid = draft.name.removeprefix(before).partition(".")[0]
        if pid.isdecimal() and not _lives(int(pid)):
            with suppress(OSError):
                draft.unlink()


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True  # of another user, or nothing that can be said
    return True


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
        raw = sqlite3.connect(draft, isolation_level=None)
        try:
            # Kept in the file's header from now on; writing it also makes the file SQLite's.
            raw.execute("PRAGMA journal_mode = WAL")
        finally:
            raw.close()
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


def _create_on_server(place: str) -> None:
    engine = unchecked_engine(place)
    try:
        with engine.connect() as connection:
            present = inspect(connection).has_table(VERSION_TABLE)
        if not present:
            migrate(engine)
    finally:
        engine.dispose()
