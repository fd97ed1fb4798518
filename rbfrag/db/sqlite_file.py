"""SQLite file on disk: opening, identification and error messages.

Standard library only: `rbfrag predict` reads its model through this module.
"""

from __future__ import annotations

import sqlite3
import stat
from contextvars import ContextVar
from pathlib import Path

from rbfrag.db.location import APPLICATION_ID, VERSION_TABLE, check_revision, sole_revision
from rbfrag.errors import (
    DatabaseBusyError,
    DatabaseError,
    DatabaseFailedError,
    DatabaseNotFoundError,
    DatabaseReadOnlyError,
    NotADatabaseError,
)

_MAGIC = b"SQLite format 3\x00"
# Primary result codes; extended codes hold them in the low byte (sqlite.org/rescode.html).
_BUSY, _LOCKED, _READONLY, _IOERR, _CORRUPT, _FULL, _CANTOPEN, _NOTADB = 5, 6, 8, 10, 11, 13, 14, 26

BUSY_TIMEOUT_S = 30.0
"""How long a connection waits for another process's lock [s]."""

LONGEST_WAIT_S: ContextVar[float | None] = ContextVar("LONGEST_WAIT_S", default=None)
"""How long whoever asks waits for a database [s]; None for what each connection waits by itself."""


def require_sqlite_file(path: Path) -> None:
    """Check from outside that a file can be an SQLite database.

    Raises:
        DatabaseNotFoundError: there is no such file.
        NotADatabaseError: a folder, an empty file, or content that is not SQLite's.
        DatabaseError: the file may not be read.
    """
    try:
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise NotADatabaseError(
                f"{path} is a folder: give the database file as db", fields=("db",)
            )
        if not stat.S_ISREG(kind):
            raise NotADatabaseError(
                f"{path} is not a regular file: give the database file as db", fields=("db",)
            )
        with path.open("rb") as stream:
            head = stream.read(len(_MAGIC))
    except FileNotFoundError:
        raise DatabaseNotFoundError(
            f"no database at {path}: give another path as db, or create it with  rbfrag motions "
            "add",
            fields=("db",),
        ) from None
    except NotADirectoryError:
        raise DatabaseNotFoundError(
            f"no database at {path}: a part of the path is a file, not a folder"
        ) from None
    except OSError as error:
        raise DatabaseError(f"cannot read the database {path}: {error.strerror or error}") from None
    if not head:
        raise NotADatabaseError(
            f"{path} is empty: delete it, or give another database as db", fields=("db",)
        )
    if head != _MAGIC:
        raise NotADatabaseError(
            f"{path} is not an SQLite database: give another file as db",
            fields=("db",),
        )


def connect_sqlite(
    path: Path, *, read_only: bool, check_same_thread: bool = True
) -> sqlite3.Connection:
    """Open an existing SQLite file with rbfrag's settings.

    A read-only connection still opens the file for writing where it may and forbids writes
    by `query_only`: only so does SQLite tidy up its -wal and -shm files behind the last
    reader. Where file or folder cannot be written, a file in WAL mode can only be read as
    `immutable`, which is safe as long as no -wal file with content lies next to it.

    Args:
        check_same_thread: as for :func:`sqlite3.connect`.
    """
    require_sqlite_file(path)
    try:
        try:
            return _connect(path, "mode=rw", read_only, check_same_thread)
        except sqlite3.Error as error:
            if not read_only or _primary_code(error) not in (_READONLY, _CANTOPEN):
                raise
            log = path.with_name(path.name + "-wal")
            if log.exists() and log.stat().st_size > 0:
                raise DatabaseReadOnlyError(
                    f"{path}: newer rows are still in {log.name}, which is not usable in a "
                    "read-only folder: copy both files to another folder"
                ) from error
            return _connect(path, "mode=ro&immutable=1", True, check_same_thread)
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise explained_sqlite_error(error, path) from error


def _connect(path: Path, mode: str, read_only: bool, check_same_thread: bool) -> sqlite3.Connection:
    connection = sqlite3.connect(
        f"{path.absolute().as_uri()}?{mode}",
        uri=True,
        timeout=min(BUSY_TIMEOUT_S, LONGEST_WAIT_S.get() or BUSY_TIMEOUT_S),
        isolation_level=None,  # transactions are begun by hand: the module's own are half of them
        check_same_thread=check_same_thread,
    )
    try:
        # The first statement that really reads the file, and so the one that finds it unusable.
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA synchronous = FULL")
        if read_only:
            connection.execute("PRAGMA query_only = ON")
    except BaseException:
        connection.close()
        raise
    return connection


def check_sqlite_database(connection: sqlite3.Connection, path: Path) -> None:
    """Check from inside that an SQLite file is an rbfrag database of this schema."""
    try:
        (application,) = connection.execute("PRAGMA application_id").fetchone()
        if application != APPLICATION_ID:
            raise NotADatabaseError(
                f"{path} is an SQLite database, but not of rbfrag: give another database as db",
                fields=("db",),
            )
        (tables,) = connection.execute(
            "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?", (VERSION_TABLE,)
        ).fetchone()
        rows = (
            connection.execute(f"SELECT version_num FROM {VERSION_TABLE}").fetchall()
            if tables
            else ()
        )
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise explained_sqlite_error(error, path) from error
    revision = sole_revision([row[0] for row in rows], str(path))
    if revision is None:
        raise NotADatabaseError(
            f"{path} is marked as an rbfrag database but has no schema: restore it from a backup"
        )
    check_revision(revision, str(path))


def explained_sqlite_error(
    error: sqlite3.Error | UnicodeDecodeError, path: Path | str
) -> DatabaseError:
    """Return the rbfrag error for an SQLite error, or for text that cannot be decoded."""
    if isinstance(error, UnicodeDecodeError):
        return DatabaseError(
            f"{path} is damaged (a text in it is not UTF-8): run  rbfrag db check  and restore it "
            "from a backup"
        )
    code = _primary_code(error)
    if code in (_BUSY, _LOCKED):
        return DatabaseBusyError(
            f"{path} is locked by another process; what was finished is kept: wait for the other "
            "to end and run the same command again"
        )
    if code == _READONLY:
        return DatabaseReadOnlyError(
            f"{path} cannot be written: make the file and its folder writable, or copy the "
            "database elsewhere and name it with db",
            fields=("db",),
        )
    if code == _CANTOPEN:
        return DatabaseReadOnlyError(
            f"{path} cannot be opened: its folder must be writable and hold the file ({error})"
        )
    if code == _FULL:
        return DatabaseFailedError(
            f"{path} cannot grow: the disk is full; what was finished is kept: make room and run "
            "the same command again"
        )
    if code == _NOTADB:
        return NotADatabaseError(
            f"{path} is no SQLite database: name another with db", fields=("db",)
        )
    if code == _CORRUPT:
        return DatabaseError(
            f"{path} is damaged ({error}): run  rbfrag db check  and restore it from a backup"
        )
    if code == _IOERR:
        return DatabaseFailedError(
            f"{path} cannot be read or written: {error}; what was finished is kept: check disk and "
            "quota and run the same command again"
        )
    return DatabaseError(f"{path}: the database rejected: {error}")


def _primary_code(error: sqlite3.Error) -> int | None:
    # Errors that the sqlite3 module raises by itself carry no code.
    code: int | None = getattr(error, "sqlite_errorcode", None)
    return None if code is None else code & 0xFF
