"""Which vertical motion goes with which horizontal one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rbfrag.db.rows import MotionRow


@dataclass(frozen=True)
class Companions:
    """The verticals of some horizontal motions.

    Args:
        vertical: the vertical motion by the id of the horizontal one.
        reasons: a sentence by the id of each horizontal motion that has none.
    """

    vertical: dict[int, MotionRow]
    reasons: dict[int, str]


def companions_of(horizontal: Sequence[MotionRow], all_motions: Iterable[MotionRow]) -> Companions:
    """Find the vertical motion of the same recording for each horizontal one.

    It must be the only vertical one of that recording (of the same earthquake and station) and
    have the same sampling interval. Different lengths are allowed: the shorter component is at
    rest after its end, and the result says so.

    Args:
        horizontal: the motions that drive the blocks.
        all_motions: every motion of the database.
    """
    verticals: dict[tuple[object, ...], list[MotionRow]] = defaultdict(list)
    for row in all_motions:
        if row.is_vertical:
            verticals[_recording(row)].append(row)
    found: dict[int, MotionRow] = {}
    reasons: dict[int, str] = {}
    for row in horizontal:
        there = verticals[_recording(row)]
        fitting = [up for up in there if up.dt_s == row.dt_s]
        if len(fitting) == 1:
            found[row.id] = fitting[0]
        elif fitting:
            names = ", ".join(up.name for up in fitting)
            reasons[row.id] = f"{row.name} has several vertical components ({names})"
        elif there:
            reasons[row.id] = (
                f"the vertical component of {row.name} has dt = {there[0].dt_s:g} s instead of "
                f"{row.dt_s:g} s"
            )
        else:
            reasons[row.id] = f"{row.name} has no vertical component in the database"
    return Companions(found, reasons)


def _recording(row: MotionRow) -> tuple[object, ...]:
    return row.event_id, row.event_guessed, row.recording, row.station
