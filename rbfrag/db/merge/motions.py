"""Bringing the motions of another database in: earthquakes, recordings, samples, labels, suites."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, RowMapping, Select, func, select

from rbfrag.db.insert import insert_if_new, insert_row, update_rows
from rbfrag.db.merge.ledger import Ledger, Merge
from rbfrag.db.motions import LATER_MEASURES, MEASURES, delete_orphans, same_measure
from rbfrag.db.schema import earthquake, motion, recording, suite, suite_motion

_OWN = ("id", "recording_id", "dt_s", "npts", "samples_sha256", "samples", "added", "digest")
_LABELS = tuple(c.name for c in motion.c if c.name not in (*_OWN, *MEASURES))

UNKNOWN_EVENT = "unknown event of "
"""How the id of an event begins of which nothing at all is known."""


def merge_motions(merge: Merge) -> None:
    """Bring motions in; what makes a motion is its samples and their interval.

    The same samples of a file, processed alike, are one motion too (as for `motions add`).
    """
    source, target, ledger = merge.source, merge.target, merge.ledger
    ids = merge.motions
    left: set[int] = set()
    in_order = _motions().order_by(motion.c.samples_sha256, motion.c.dt_s)
    for theirs in list(source.execute(in_order).mappings()):
        ours = _find(target, theirs)
        if ours is None:
            ids[theirs["id"]] = _add(source, target, theirs, ledger)
            ledger.added["motion"] += 1
            continue
        ids[theirs["id"]] = ours["id"]
        if ours["samples_sha256"] != theirs["samples_sha256"]:
            merge.other_bits[theirs["id"]] = ours["samples_sha256"]
        _compare_measures(ours, theirs, ledger)
        missing = {
            name: theirs[name]
            for name in LATER_MEASURES
            if ours[name] is None and theirs[name] is not None
        }
        if missing:
            update_rows(target, motion, motion.c.id == ours["id"], missing)
        same_bits = theirs["id"] not in merge.other_bits
        if same_bits and ours["no_samples"] and not theirs["no_samples"]:
            samples = {"samples": _samples(source, theirs["id"])}
            update_rows(target, motion, motion.c.id == ours["id"], samples)
        if ours["guessed"] and not theirs["guessed"]:
            values = {name: theirs[name] for name in _LABELS}
            values["recording_id"] = _recording_id(target, theirs, ledger)
            update_rows(target, motion, motion.c.id == ours["id"], values)
            left.add(ours["recording_id"])
            ledger.restated += 1
        else:
            ledger.same["motion"] += 1
            _compare_labels(target, ours, theirs, ledger)
    for recording_id in left:
        delete_orphans(target, recording_id)


def merge_suites(merge: Merge) -> None:
    """Bring suites in: a suite of the same name becomes the union of both."""
    source, target, ledger = merge.source, merge.target, merge.ledger
    rows = source.execute(select(suite.c.id, suite.c.name).order_by(suite.c.name)).all()
    for their_id, name in rows:
        new = insert_if_new(target, suite, {"name": name})
        (ledger.added if new else ledger.same)["suite"] += 1
        our_id = target.execute(select(suite.c.id).where(suite.c.name == name)).scalar_one()
        members = select(suite_motion.c.motion_id).where(suite_motion.c.suite_id == their_id)
        for motion_id in source.scalars(members):
            values = {"suite_id": our_id, "motion_id": merge.motions[motion_id]}
            new = insert_if_new(target, suite_motion, values)
            (ledger.added if new else ledger.same)["suite_motion"] += 1


def _motions() -> Select[Any]:
    own = [column for column in motion.c if column.name != "samples"]
    return select(
        *own,
        motion.c.samples.is_(None).label("no_samples"),
        recording.c.name.label("recording"),
        recording.c.station,
        earthquake.c.id.label("earthquake_id"),
        earthquake.c.event_id,
        earthquake.c.guessed,
        earthquake.c.name.label("event_name"),
        earthquake.c.magnitude,
        earthquake.c.time,
    ).select_from(motion.join(recording).join(earthquake))


def _find(target: Connection, theirs: RowMapping) -> RowMapping | None:
    query = _motions().where(motion.c.dt_s == theirs["dt_s"])
    same = query.where(motion.c.samples_sha256 == theirs["samples_sha256"])
    ours = target.execute(same).mappings().one_or_none()
    if ours is None and theirs["processing_applied"] is not None:
        origin = query.where(
            motion.c.source_sha256 == theirs["source_sha256"],
            motion.c.processing_applied == theirs["processing_applied"],
        )
        ours = target.execute(origin.order_by(motion.c.id)).mappings().first()
    return ours


def _samples(source: Connection, motion_id: int) -> bytes | None:
    return source.scalar(select(motion.c.samples).where(motion.c.id == motion_id))


def _name(row: RowMapping) -> str:
    return f"{row['source_file'] or row['recording']}#{row['trace_index']}"


def _add(source: Connection, target: Connection, theirs: RowMapping, ledger: Ledger) -> int:
    copied = ("dt_s", "npts", "samples_sha256", "added", *MEASURES, *_LABELS)
    values = {name: theirs[name] for name in copied}
    values["samples"] = _samples(source, theirs["id"])
    values["recording_id"] = _recording_id(target, theirs, ledger)
    return insert_row(target, motion, values)


def _recording_id(target: Connection, theirs: RowMapping, ledger: Ledger) -> int:
    event_id, name = theirs["event_id"], theirs["recording"]
    if theirs["guessed"] and event_id.startswith(UNKNOWN_EVENT) and _is_taken(target, theirs):
        # Files of one name in two folders are no companions: nothing says they are.
        name = theirs["samples_sha256"][:12]
        event_id = UNKNOWN_EVENT + name
        ledger.keep(
            "recording",
            repr(theirs["recording"]),
            "the record of this name, of no known event,",
            "one motion",
            f"another, stored as recording {name}",
        )
    earthquake_id = _earthquake_id(target, theirs, event_id, ledger)
    values = {"earthquake_id": earthquake_id, "name": name, "station": theirs["station"]}
    if insert_if_new(target, recording, values):
        ledger.added["recording"] += 1
    row_id: int = target.execute(select(recording.c.id).filter_by(**values)).scalar_one()
    return row_id


def _is_taken(target: Connection, theirs: RowMapping) -> bool:
    query = (
        select(func.count())
        .select_from(motion.join(recording).join(earthquake))
        .where(
            earthquake.c.event_id == theirs["event_id"],
            earthquake.c.guessed,
            recording.c.name == theirs["recording"],
            recording.c.station == theirs["station"],
            motion.c.source_file == theirs["source_file"],
            motion.c.trace_index == theirs["trace_index"],
        )
    )
    return bool(target.scalar(query))


def _earthquake_id(target: Connection, theirs: RowMapping, event_id: str, ledger: Ledger) -> int:
    key = {"event_id": event_id, "guessed": theirs["guessed"]}
    known = {"name": theirs["event_name"], "magnitude": theirs["magnitude"], "time": theirs["time"]}
    if insert_if_new(target, earthquake, {**key, **known}):
        ledger.added["earthquake"] += 1
    ours = target.execute(select(earthquake).filter_by(**key)).mappings().one()
    missing = {}
    for column, there in known.items():
        here = ours[column]
        if there in (None, "") or here == there:
            continue
        if here in (None, ""):
            missing[column] = there
        elif column == "magnitude" and not theirs["guessed"]:
            ledger.conflict("earthquake", event_id, column, here, there)
        else:
            ledger.keep("earthquake", event_id, column, here, there)
    if missing:
        update_rows(target, earthquake, earthquake.c.id == ours["id"], missing)
    return int(ours["id"])


def _compare_measures(ours: RowMapping, theirs: RowMapping, ledger: Ledger) -> None:
    peaks = (ours["pgv_m_s"], ours["pgd_m"])
    if ours["npts"] != theirs["npts"]:
        ledger.conflict("motion", _name(ours), "npts", ours["npts"], theirs["npts"])
    for column in MEASURES:
        unknown = column in LATER_MEASURES and None in (ours[column], theirs[column])
        if not unknown and not same_measure(column, ours[column], theirs[column], *peaks):
            ledger.conflict("motion", _name(ours), column, ours[column], theirs[column])


def _compare_labels(
    target: Connection, ours: RowMapping, theirs: RowMapping, ledger: Ledger
) -> None:
    if theirs["guessed"] and not ours["guessed"]:
        return  # what is stated stays, whatever a file header lets one guess
    stated = not ours["guessed"]
    if ours["event_id"] != theirs["event_id"]:
        say = ledger.conflict if stated else ledger.keep
        say("motion", _name(ours), "event_id", ours["event_id"], theirs["event_id"])
    else:
        _earthquake_id(target, theirs, theirs["event_id"], ledger)
    for column in ("recording", "station", *_LABELS):
        if ours[column] != theirs[column]:
            say = ledger.conflict if stated and column == "is_vertical" else ledger.keep
            say("motion", _name(ours), column, ours[column], theirs[column])
