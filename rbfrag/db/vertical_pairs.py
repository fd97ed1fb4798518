"""Pairing of horizontal motions with their vertical component."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, func, select

from rbfrag.db.motions import motion_row, motion_rows
from rbfrag.db.queries import recordings_of_motions
from rbfrag.db.rows import MotionRow
from rbfrag.db.schema import motion, recording
from rbfrag.errors import InputError
from rbfrag.motions.direction import is_downward_name, lead_in_of, why_not_together
from rbfrag.motions.rotation import treatment


@dataclass(frozen=True)
class VerticalPair:
    """A horizontal motion and the vertical component of the same recording.

    Args:
        vertical_id: the vertical motion; None where there is none to use.
        vertical_sha256: hash of its samples, as natural keys need it.
        reason: why there is none; empty where there is one.
        remark: what a user should know of the pair (different lengths); mostly empty.
    """

    motion_id: int
    vertical_id: int | None = None
    vertical_sha256: str | None = None
    reason: str = ""
    remark: str = ""


def vertical_pairs(connection: Connection, *, suite: str | None = None) -> dict[int, VerticalPair]:
    """Return the vertical component of every horizontal motion, by id of the horizontal one.

    A companion is the one vertical motion of the same recording, whether or not it is in the
    suite, with the same sampling interval, start and processing, upward positive. Components
    of different lengths are companions: the shorter is followed by rest, and a remark says so.
    """
    horizontals = [row for row in motion_rows(connection, suite=suite) if not row.is_vertical]
    recording_of = recordings_of_motions(connection)
    verticals: dict[int, list[MotionRow]] = defaultdict(list)
    for row in motion_rows(connection):
        if row.is_vertical:
            verticals[recording_of[row.id]].append(row)
    return {row.id: _pair(row, verticals[recording_of[row.id]]) for row in horizontals}


def vertical_pair(connection: Connection, motion_id: int) -> VerticalPair:
    """Return the vertical component of one horizontal motion.

    Raises:
        InputError: there is no motion of that id, or it is a vertical one.
    """
    row = motion_row(connection, motion_id)
    if row.is_vertical:
        raise InputError(f"motion {motion_id} is a vertical component: give a horizontal one")
    recording_id = select(motion.c.recording_id).where(motion.c.id == motion_id).scalar_subquery()
    query = (
        select(motion.c.id)
        .where(motion.c.is_vertical, motion.c.recording_id == recording_id)
        .order_by(motion.c.id)
    )
    return _pair(
        row, [motion_row(connection, vertical_id) for vertical_id in connection.scalars(query)]
    )


def recordings_of_mixed_dt(connection: Connection) -> list[tuple[str, list[float], list[int]]]:
    """Return the recordings whose components differ in sampling interval.

    Returns:
        Name, sampling intervals [s] in increasing order, and motion ids of each.
    """
    mixed = (
        select(motion.c.recording_id)
        .group_by(motion.c.recording_id)
        .having(func.min(motion.c.dt_s) < func.max(motion.c.dt_s))
    )
    query = (
        select(recording.c.id, recording.c.name, motion.c.id.label("motion_id"), motion.c.dt_s)
        .join(motion, motion.c.recording_id == recording.c.id)
        .where(recording.c.id.in_(mixed))
        .order_by(recording.c.id, motion.c.id)
    )
    by_recording: dict[int, list[Any]] = defaultdict(list)
    for row in connection.execute(query):
        by_recording[row.id].append(row)
    return [
        (rows[0].name, sorted({row.dt_s for row in rows}), [row.motion_id for row in rows])
        for rows in by_recording.values()
    ]


def _pair(row: MotionRow, verticals: Sequence[MotionRow]) -> VerticalPair:
    if not verticals:
        return VerticalPair(
            row.id, reason=f"no vertical motion of recording {row.recording!r} is stored"
        )
    # of a recording stored raw and processed, the one that was treated like the horizontal
    processing = treatment(row.processing_applied)
    alike = [v for v in verticals if treatment(v.processing_applied) == processing] or [*verticals]
    if len(alike) > 1:
        ids = ", ".join(str(vertical.id) for vertical in alike)
        return VerticalPair(
            row.id,
            reason=f"recording {row.recording!r} has several vertical motions ({ids}), and which "
            "one belongs to it is not known: give them companion_group in the metadata",
        )
    (vertical,) = alike
    if is_downward_name(vertical.component):
        return VerticalPair(
            row.id,
            reason=f"motion {vertical.id} was stored raw with downward positive: add it processed",
        )
    reason = why_not_together(
        dt_s=(row.dt_s, vertical.dt_s),
        start_time=(_time(row), _time(vertical)),
        lead_in_samples=(
            lead_in_of(row.processing_applied),
            lead_in_of(vertical.processing_applied),
        ),
    )
    if reason:
        return VerticalPair(row.id, reason=f"motion {vertical.id}: {reason}")
    remark = ""
    if row.npts != vertical.npts:
        shorter = "vertical" if vertical.npts < row.npts else "horizontal"
        remark = (
            f"the {shorter} component has {min(row.npts, vertical.npts)} samples, the other "
            f"{max(row.npts, vertical.npts)}: it is followed by rest"
        )
    return VerticalPair(
        row.id,
        vertical_id=vertical.id,
        vertical_sha256=vertical.sha256,
        remark=remark,
    )


def _time(row: MotionRow) -> datetime | None:
    return None if row.start_time is None else datetime.fromisoformat(row.start_time)
