"""Making a database: it appears complete or not at all."""

from __future__ import annotations

import os
import sqlite3
import tempfile
from pathlib import Path

from sqlalchemy import inspect

from rbfrag.db.engine import unchecked_engine
from rbfrag.db.revision import VERSION_TABLE
from rbfrag.db.sqlite_file import sqlite_error_in_words
from rbfrag.db.upgrade import migrate
from rbfrag.errors import DatabaseError, DatabaseNotFoundError, DatabaseReadOnlyError


def create_if_missing(place: Path | str, *, busy_timeout_s: float) -> None:
    """Make the database at `place` unless something is there already.

    An SQLite file is built under another name in the same folder and given its own name when
    it is complete, so that neither a killed process nor two at once leave half a database.
    On PostgreSQL one transaction does the same.

    Args:
        place: what :func:`rbfrag.db.location.locate` returned.
        busy_timeout_s: how long to wait for another process's lock [s].

    Raises:
        DatabaseNotFoundError: the folder does not exist.
        DatabaseReadOnlyError: the folder cannot be written.
    """
    if isinstance(place, str):
        _create_on_server(place)
        return
    try:
        if place.is_symlink() or place.exists():
            return
        folder = place.absolute().parent
        if not folder.is_dir():
            raise DatabaseNotFoundError(
                f"cannot make the database {place}: there is no folder {folder}; make it first"
            )
    except OSError as error:
        raise DatabaseError(
            f"cannot make the database {place}: {error.strerror or error}"
        ) from error
    draft = _draft_file(place, folder)
    try:
        _build(draft, busy_timeout_s)
        _give_name(draft, place)
    except OSError as error:
        raise DatabaseError(
            f"cannot make the database {place}: {error.strerror or error}"
        ) from error
    finally:
        for leftover in (draft, *(Path(f"{draft}{tail}") for tail in ("-wal", "-shm", "-journal"))):
            leftover.unlink(missing_ok=True)


def _draft_file(place: Path, folder: Path) -> Path:
    try:
        handle, name = tempfile.mkstemp(prefix=f".{place.name}.", suffix=".new", dir=folder)
    except OSError as error:
        raise DatabaseReadOnlyError(
            f"cannot make the database {place}: {error.strerror or error}; name a folder that can "
            "be written with --db"
        ) from error
    os.close(handle)
    draft = Path(name)
    # mkstemp keeps others out; the database is to have the rights of any file made here.
    if os.name == "posix":
        mask = os.umask(0)
        os.umask(mask)
        draft.chmod(0o666 & ~mask)
    return draft


def _build(draft: Path, busy_timeout_s: float) -> None:
    try:
        raw = sqlite3.connect(draft, isolation_level=None)
        try:
            # Kept in the file's header from now on; writing it also makes the file SQLite's.
            raw.execute("PRAGMA journal_mode = WAL")
        finally:
            raw.close()
    except sqlite3.Error as error:
        raise sqlite_error_in_words(error, draft) from error
    engine = unchecked_engine(draft, foreign_keys=False, busy_timeout_s=busy_timeout_s)
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
