"""One thing that is wrong with a database, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

RESTORE = "restore the database from a backup"
COMPUTE_AGAIN = (
    "restore the database from a backup, or add the motions to a new database and run  rbfrag "
    "simulate  there"
)
ACCEPT = "restore the database from a backup, or take it as known, by rbfrag db check with accept"
FIT_AGAIN = "fit it again in its place, by rbfrag fit"


@dataclass(frozen=True)
class Damage:
    """One thing that is wrong, the row as the database numbers or names it, and what to do next."""

    table: str
    row: str
    problem: str
    advice: str = RESTORE
