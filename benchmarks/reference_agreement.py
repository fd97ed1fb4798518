"""Whether a database holds the critical values of the reference that is shipped."""

from __future__ import annotations

import math

from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.motions import motion_rows
from rbfrag.db.queries import combination_table
from rbfrag.db.rows import Vertical

AGREES = 1e-9
"""Relative difference of critical values that processors may make."""


def agreement_with_reference(db: str) -> str:
    """Return a sentence: how many of the reference's critical values the database has too."""
    same = other = missing = 0
    for vertical in ("without", "with"):
        here, shipped = _critical_values(db, vertical), _critical_values(str(REFERENCE), vertical)
        for key, (status, k) in shipped.items():
            if key not in here:
                missing += 1
            elif here[key][0] == status and (
                math.isclose(here[key][1], k, rel_tol=AGREES) or math.isnan(k)
            ):
                same += 1
            else:
                other += 1
    return (
        f"Of the {same + other + missing:,} combinations of the shipped reference, {same:,} have "
        f"the same status and critical value (to {AGREES:g}) here, {other:,} another one, and "
        f"{missing:,} are not here."
    )


def _critical_values(
    db: str, vertical: Vertical
) -> dict[tuple[str, str, float], tuple[str, float]]:
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection, vertical=vertical)
        sha256 = {row.id: row.sha256 for row in motion_rows(connection)}
    return {
        (sha256[int(motion)], str(polarity), float(p2)): (str(status), float(k))
        for motion, polarity, p2, status, k in zip(
            table.motion_id, table.polarity, table.p2, table.status, table.kr_over_pga, strict=True
        )
    }
