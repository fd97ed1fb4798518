"""Two databases that are merged: what was done, and what stands in the way."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from sqlalchemy import Connection

CONFLICTS_SHOWN = 5


@dataclass(frozen=True)
class Conflict:
    """One thing that two databases say differently; `row` means the same in both of them."""

    table: str
    row: str
    column: str
    here: object
    there: object

    def __str__(self) -> str:
        """Return one clause with both values."""
        return (
            f"{self.table} {self.row}: {self.column} is {self.here!r} here and {self.there!r} there"
        )


@dataclass
class Ledger:
    """Counts, notes and conflicts, gathered while a merge goes on.

    Args:
        added: rows added by table.
        same: rows that were there already by table.
        restated: motions whose guessed earthquake became a stated one.
        within_error: combinations and histories that differ by no more than the solver's error.
        notes: sentences about what was kept though the other database says it differently.
        conflicts: what cannot be merged.
    """

    added: Counter[str] = field(default_factory=Counter)
    same: Counter[str] = field(default_factory=Counter)
    restated: int = 0
    within_error: int = 0
    notes: list[str] = field(default_factory=list)
    conflicts: list[Conflict] = field(default_factory=list)

    def conflict(self, table: str, row: str, column: str, here: object, there: object) -> None:
        """Note, once, that two values cannot both be kept."""
        one = Conflict(table, row, column, here, there)
        if one not in self.conflicts:
            self.conflicts.append(one)

    def keep(self, table: str, row: str, column: str, here: object, there: object) -> None:
        """Note, once, that the value here stays, though the other differs."""
        note = f"kept: {Conflict(table, row, column, here, there)}"
        if note not in self.notes:
            self.notes.append(note)


@dataclass(frozen=True)
class Merge:
    """The two databases, and where the rows of the other are now.

    Args:
        target: the database that is merged into, inside the caller's transaction.
        motions: the row id here of each motion there.
        campaigns: the row id here of each campaign there.
        other_bits: of motions made from the same samples of a file by the same filter, whose
            last bits another machine rounded otherwise: the sha256 of the samples here, by the
            row id there.
    """

    source: Connection
    target: Connection
    ledger: Ledger = field(default_factory=Ledger)
    motions: dict[int, int] = field(default_factory=dict)
    campaigns: dict[int, int] = field(default_factory=dict)
    other_bits: dict[int, str] = field(default_factory=dict)
