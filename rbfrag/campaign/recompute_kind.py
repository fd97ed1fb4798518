"""A stored critical value of a block that slumps or slides, found again."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection

from rbfrag.campaign.kind_plan import KindCase
from rbfrag.campaign.kind_worker import KindWork, run_kind_work
from rbfrag.db.motions import load_motion
from rbfrag.db.stored_combination import StoredCombination
from rbfrag.solver.results import CriticalResult


def recompute_kind(connection: Connection, stored: StoredCombination) -> CriticalResult:
    """Return what the present solver answers for a stored combination of another kind.

    Raises:
        InputError: the stored block is none of this rbfrag's.
    """
    kind = str(stored.values["kind"])
    block: dict[str, Any] = dict(stored.block or {})
    vertical = None
    if stored.vertical_motion_id is not None:
        vertical = load_motion(connection, stored.vertical_motion_id)
    case = KindCase(
        natural_key=str(stored.values["natural_key"]),
        kind=kind,
        polarity=stored.values["polarity"],
        vertical_id=stored.vertical_motion_id,
        block=block,
        settings=stored.settings,
    )
    motion = load_motion(connection, stored.motion_id)
    answer = run_kind_work(KindWork(stored.motion_id, motion, vertical, (case,)))
    return answer.results[0][1]
