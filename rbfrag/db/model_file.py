"""The fast way to a fitted model: straight from the SQLite file.

`rbfrag predict` loads nothing heavier than `sqlite3` for it.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from os import PathLike
from pathlib import Path

from rbfrag.db.model_record import COLUMNS, decode_model, unknown_model
from rbfrag.db.rows import ModelRow
from rbfrag.db.sqlite_file import check_sqlite_database, connect_sqlite, sqlite_error_in_words
from rbfrag.errors import UnknownModelError

_SELECT = f"SELECT {', '.join(COLUMNS)} FROM fragility_model"


def read_model(
    path: str | PathLike[str], name: str | None = None, *, kind: str = "toppling"
) -> ModelRow:
    """Return one model of an SQLite database.

    Works while another process writes to it, and in a folder that cannot be written.

    Args:
        path: the database file.
        name: the model's name; None for the default of a kind.
        kind: the kind whose default is meant.

    Raises:
        DatabaseError: one of its kinds, as for :func:`rbfrag.db.engine.open_database`.
        UnknownModelError: there is no such model; the message lists the names there are.
    """
    file = Path(path)
    with _opened(file) as connection:
        if name is None:
            default = f"{_SELECT} WHERE is_default AND kind = ?"
            row = connection.execute(default, (kind,)).fetchone()
        else:
            row = connection.execute(f"{_SELECT} WHERE name = ?", (name,)).fetchone()
        if row is not None:
            return decode_model(row)
        names = connection.execute("SELECT name FROM fragility_model").fetchall()
    known = sorted(found for (found,) in names)
    raise UnknownModelError(unknown_model(name, known, str(file)))


def read_models(path: str | PathLike[str]) -> list[ModelRow]:
    """Return all models of an SQLite database, sorted by name.

    Args:
        path: the database file.

    Raises:
        DatabaseError: one of its kinds, as for :func:`rbfrag.db.engine.open_database`.
    """
    with _opened(Path(path)) as connection:
        rows = [decode_model(row) for row in connection.execute(_SELECT)]
    return sorted(rows, key=lambda model: model.name)


@contextmanager
def _opened(file: Path) -> Iterator[sqlite3.Connection]:
    with closing(connect_sqlite(file, read_only=True)) as connection:
        check_sqlite_database(connection, file)
        try:
            yield connection
        except sqlite3.Error as error:
            raise sqlite_error_in_words(error, file) from error
