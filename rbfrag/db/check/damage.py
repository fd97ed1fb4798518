"""Damage record of a database check: problem and remedy."""

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
    """One problem: table, row, description and remedy."""

    table: str
    row: str
    problem: str
    advice: str = RESTORE
