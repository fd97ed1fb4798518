"""Bringing two teams' results together: `rbfrag db merge`."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from pathlib import Path

from sqlalchemy import Connection, text

from rbfrag.db.check.database import check_database
from rbfrag.db.connect import database_label
from rbfrag.db.engine import opened_database
from rbfrag.db.location import locate
from rbfrag.db.merge.ledger import CONFLICTS_SHOWN, Ledger, Merge
from rbfrag.db.merge.motions import merge_motions, merge_suites
from rbfrag.db.merge.results import (
    merge_campaigns,
    merge_combinations,
    merge_models,
    merge_responses,
    merge_shock_pairs,
    merge_spectra,
)
from rbfrag.db.schema import metadata
from rbfrag.errors import DatabaseError, InputError, MergeConflictError


@dataclass(frozen=True)
class MergeReport:
    """What :func:`merge_databases` did.

    Args:
        added: rows added by table.
        same: rows of the other that were here already, by table.
        restated: motions whose guessed earthquake became the stated one of the other.
        within_error: results that differ from those here by no more than the solver's error
            (made on another processor): those here stay.
        notes: sentences about everything else that is said differently, and what was kept.
    """

    added: dict[str, int]
    same: dict[str, int]
    restated: int
    within_error: int
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, object]:
        """Return the report under the keys of the JSON contract."""
        return {**asdict(self), "notes": list(self.notes)}


def merge_databases(
    other: str | os.PathLike[str], *, db: str | os.PathLike[str] | None = None
) -> MergeReport:
    """Add everything that another database holds, in one transaction.

    Rows are the same when their natural keys are: samples and interval of a motion, id of an
    earthquake (guessed and stated apart), name of a suite, hash over all inputs of a
    combination. Merging twice changes nothing. Where the values of one key differ by more than
    rounding, nothing is written.

    Args:
        other: the database to read (path or URL); it is checked first and not changed.
        db: the database to add to (path, URL, or None for the default); made when there is none.

    Raises:
        InputError: both are the same database.
        MergeConflictError: the databases contradict each other; the message has both values.
        DatabaseError: one of them cannot be used, or the other is damaged.
    """
    if _is_same(locate(other), locate(db)):
        raise InputError("both are the same database: name another one to merge")
    ledger = Ledger()
    with opened_database(other, read_only=True) as theirs, theirs.connect() as source:
        label = database_label(theirs.url)
        findings = check_database(source)
        if findings:
            first = findings[0]
            raise DatabaseError(
                f"{label} is damaged in {len(findings)} places and was not merged, first "
                f"{first.table} {first.row}: {first.problem}; rbfrag db check tells of it"
            )
        with opened_database(db, create=True) as ours, ours.begin() as target:
            _keep_writers_out(target)
            merge = Merge(source, target, ledger)
            merge_motions(merge)
            merge_suites(merge)
            merge_campaigns(merge)
            merge_spectra(merge)
            merge_combinations(merge)
            merge_responses(merge)
            merge_shock_pairs(merge)
            merge_models(merge)
            if ledger.conflicts:
                raise _refusal(ledger, database_label(ours.url), label)
    return MergeReport(
        added={name: n for name, n in sorted(ledger.added.items()) if n},
        same={name: n for name, n in sorted(ledger.same.items()) if n},
        restated=ledger.restated,
        within_error=ledger.within_error,
        notes=tuple(ledger.notes),
    )


def _is_same(one: Path | str, other: Path | str) -> bool:
    if isinstance(one, Path) and isinstance(other, Path):
        return one.resolve() == other.resolve() or (
            one.exists() and other.exists() and one.samefile(other)
        )
    return one == other


def _keep_writers_out(target: Connection) -> None:
    # SQLite's transactions do so by themselves; readers go on in both.
    if target.dialect.name == "postgresql":
        names = ", ".join(sorted(metadata.tables))
        target.execute(text(f"LOCK TABLE {names} IN SHARE ROW EXCLUSIVE MODE"))


def _refusal(ledger: Ledger, here: str, there: str) -> MergeConflictError:
    shown = "; ".join(map(str, ledger.conflicts[:CONFLICTS_SHOWN]))
    more = len(ledger.conflicts) - CONFLICTS_SHOWN
    rest = f"; and {more} more" if more > 0 else ""
    return MergeConflictError(
        f"{here} (here) and {there} (there) contradict each other: {shown}{rest}. Nothing was "
        "written: correct one of them"
    )
