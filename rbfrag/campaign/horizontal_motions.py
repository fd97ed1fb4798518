"""Selection of the horizontal motions of a campaign, with warnings about their sensors."""

from __future__ import annotations

from typing import TypedDict

from sqlalchemy import Connection

from rbfrag.db.motions import motion_rows
from rbfrag.db.rows import MotionRow
from rbfrag.errors import InputError
from rbfrag.motions.quality import DIRECTION_GUESSED, STRUCTURE
from rbfrag.results.diagnostic import Diagnostic


class MotionChoice(TypedDict):
    """Selection of the motions of a campaign."""

    suite: str | None
    include_structures: bool


def horizontal_motions(
    connection: Connection, *, suite: str | None = None, include_structures: bool = False
) -> tuple[list[MotionRow], list[str]]:
    """Return the horizontal motions of a campaign by id, and warnings about their sensors.

    Args:
        suite: only the motions of this suite.
        include_structures: use motions of sensors on structures, too.

    Raises:
        InputError: no such suite, or no horizontal motion.
    """
    every = [row for row in motion_rows(connection, suite=suite) if not row.is_vertical]
    where = "the database" if suite is None else f"suite {suite!r}"
    if not every:
        raise InputError(
            f"no horizontal motions in {where}: add some with  rbfrag motions add PATH"
        )
    rows = [row for row in every if include_structures or STRUCTURE not in row.flags]
    if not rows:
        raise InputError(
            f"all {len(every)} horizontal motions in {where} were recorded on structures: add "
            "others, or set include_structures",
            fields=("include_structures",),
        )
    warnings: list[str] = []
    if len(rows) < len(every):
        text = (
            f"{len(every) - len(rows)} of {len(every)} horizontal motions were recorded on "
            "structures and are excluded: they are not ground motion"
        )
        warnings.append(Diagnostic(text, "structure"))
    if guessed := sum(DIRECTION_GUESSED in row.flags for row in rows):
        text = (
            f"the direction of {guessed} of {len(rows)} motions is guessed: a vertical one among "
            "them is simulated as a horizontal; give is_vertical in a table of metadata"
        )
        warnings.append(Diagnostic(text, "direction_guessed"))
    return rows, warnings
