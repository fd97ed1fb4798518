"""The check of a database with a sample computed again: `rbfrag db check`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rbfrag.campaign.resimulate import Resimulation, resimulate
from rbfrag.db.check.damage import Damage
from rbfrag.db.check.database import check_database, coverage
from rbfrag.db.check.ledger import accept_rows, mark_sound
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import utc_now
from rbfrag.results.numbers import count_of
from rbfrag.results.result import Result, TextLine


@dataclass(frozen=True, eq=False, repr=False)
class DatabaseCheck(Result):
    """The damage of a database.

    Args:
        findings: damage that was found.
        accepted: rows that were accepted as complete.
        resimulated: the sample that was computed again; None without one.
        covered: a sentence on what the check covers.
    """

    findings: Sequence[Damage]
    accepted: Sequence[Damage]
    resimulated: Resimulation | None
    covered: str
    warnings: tuple[str, ...] = ()

    @property
    def is_sound(self) -> bool:
        """True if no damage was found."""
        return not self.findings

    def sentences(self) -> Iterator[str]:
        """Yield the number of damaged rows."""
        number = count_of(len(self.findings), "problem")
        yield "no damage found" if self.is_sound else f"{number} found"

    def lines(self) -> Iterator[TextLine]:
        """Yield the damage with advice, the sample that was computed again, and the coverage."""
        for label, rows in (("Damage", self.findings), ("Accepted", self.accepted)):
            for row in rows:
                yield TextLine(label, f"{row.table} {row.row}: {row.problem}")
        for advice in dict.fromkeys(finding.advice for finding in self.findings):
            yield TextLine("Advice", advice)
        if (sample := self.resimulated) is not None:
            yield TextLine(
                "Sample",
                f"{sample.sampled:,} of {count_of(sample.eligible, 'combination')} computed again: "
                f"{sample.exact:,} equal, {sample.within_error:,} within the error of the solver",
            )
        yield TextLine("Covered", self.covered)

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        sample = None if self.resimulated is None else asdict(self.resimulated)
        if sample is not None:
            del sample["findings"]
        return {
            "sound": self.is_sound,
            "findings": [asdict(finding) for finding in self.findings],
            "accepted": [asdict(row) for row in self.accepted],
            "resimulated": sample,
            "covered": self.covered,
            "warnings": list(self.warnings),
        }


def check_with_sample(
    db: str | os.PathLike[str] | None, *, sample: int, seed: int, accept: bool
) -> DatabaseCheck:
    """Check a database, and compute a random sample of its combinations again.

    A database without damage is marked as sound.

    Args:
        db: the database (path, URL, or None for the default).
        sample: number of combinations; 0 for none.
        seed: seed of the random sample.
        accept: accept the rows present as complete, after a loss.
    """
    begun, again = utc_now(), None
    accepted = accept_rows(db) if accept else []
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
        covered = coverage(connection)
        if sample:
            try:
                again = resimulate(connection, sample=sample, seed=seed)
                findings += again.findings
            except Exception as error:
                if not findings:
                    raise
                # a damaged row can raise any error there, and is among the findings already
                why = f"{type(error).__name__}: {error}"
                findings.append(Damage("database", "-", f"computing again broke off ({why})"))
    if not findings:
        mark_sound(db, begun)
    return DatabaseCheck(findings, accepted, again, covered)
