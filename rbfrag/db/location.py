"""Where the database is, without loading SQLAlchemy."""

from __future__ import annotations

import os
from os import PathLike
from pathlib import Path

from rbfrag.errors import InputError

DEFAULT_NAME = "rbfrag.db"
"""File name of the database in the current folder when nothing else is said."""


def locate(db: str | PathLike[str] | None) -> Path | str:
    """Return the SQLite file, or the URL of another database, that `db` means.

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
    text = os.fspath(db)
    if not text:
        raise InputError("the database name is empty: give --db a path or an SQLAlchemy URL")
    if "\0" in text:
        raise InputError(f"the database name {text!r} holds a NUL character")
    if "://" not in text:
        return Path(text)
    scheme, _, rest = text.partition("://")
    dialect = scheme.partition("+")[0].lower()
    if dialect in ("postgresql", "postgres"):
        return text
    if dialect != "sqlite":
        raise InputError(
            f"--db {scheme}://…: rbfrag stores in SQLite (a path) or PostgreSQL (postgresql://…)"
        )
    name = rest.removeprefix("/")
    if not name or name == ":memory:" or "?" in name or not rest.startswith("/"):
        raise InputError(
            f"--db {text}: give an SQLite database as a path, or as sqlite:///path without options"
        )
    return Path(name)


REFERENCE = Path(__file__).parents[1] / "reference" / "reference.db"
"""The database that is shipped with rbfrag, read-only and without samples, if there is one."""


def reference_file() -> Path | None:
    """Return the shipped reference database, or None where none is shipped."""
    return REFERENCE if REFERENCE.is_file() else None
