"""Detection of rows deleted or added by another program, by means of the ledger."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress

from sqlalchemy import Connection

from rbfrag.db.check.damage import ACCEPT, Damage
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import keep_writers_out
from rbfrag.db.ledger import (
    has_ledger,
    note_sound,
    renew_ledger,
    stored_tallies,
    written_tallies,
)
from rbfrag.db.sqlite_file import LONGEST_WAIT_S
from rbfrag.errors import DatabaseError


def check_ledger(connection: Connection) -> Iterator[Damage]:
    """Yield the tables whose rows differ from those rbfrag wrote, by campaign."""
    if not has_ledger(connection):
        return
    written, stored = written_tallies(connection), stored_tallies(connection)
    for key in sorted(written.keys() | stored.keys()):
        (number, digests), (there, stored_digests) = (
            written.get(key, (0, 0)),
            stored.get(key, (0, 0)),
        )
        if (number, digests) == (there, stored_digests):
            continue
        table, campaign = key
        if there < number:
            problem = "rows were deleted by another program"
        elif there > number:
            problem = "rows were added by another program"
        else:
            problem = "rows were replaced, or altered together with their digests"
        problem += f": {number} were written, {there} are there"
        yield Damage(table, f"campaign {campaign}" if campaign else "-", problem, ACCEPT)


def accept_rows(db: str | os.PathLike[str] | None = None) -> list[Damage]:
    """Accept the present rows as complete; return the differences.

    Args:
        db: the database (path, URL, or None for the default).

    Raises:
        DatabaseError: it cannot be written.
    """
    with opened_database(db) as engine, engine.begin() as connection:
        keep_writers_out(connection)
        differed = list(check_ledger(connection))
        renew_ledger(connection)
    return differed


def mark_sound(db: str | os.PathLike[str] | None, time: str) -> None:
    """Record that a check found nothing; skipped if the database is not writable."""
    token = LONGEST_WAIT_S.set(1.0)
    try:
        with suppress(DatabaseError), opened_database(db) as engine, engine.begin() as connection:
            note_sound(connection, time)
    finally:
        LONGEST_WAIT_S.reset(token)
