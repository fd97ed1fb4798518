"""Storage of accelerograms, with their earthquakes and suites."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from sqlalchemy import Connection, RowMapping, Select, and_, case, exists, or_, select

from rbfrag.db import schema
from rbfrag.db.conditions import condition_of_motions
from rbfrag.db.insert import delete_rows, insert_if_new, storable, update_rows, utc_now
from rbfrag.db.keys import canonical_json
from rbfrag.db.motion_spectra import renew_recording_spectra, store_spectrum
from rbfrag.db.rows import EarthquakeInfo, MotionRow, stored_json, stored_number
from rbfrag.db.schema import MEASURES, SITE_COLUMNS, earthquake, suite, suite_motion
from rbfrag.errors import DatabaseError, InputError
from rbfrag.motions.ground_motion import GroundMotion

COMPUTED = (*MEASURES, "final_velocity_m_s", "final_displacement_m")
"""Columns of a motion that are calculated from its samples."""

UNKNOWN_EVENT = "unknown event of "
"""How the id of an event begins of which nothing at all is known."""

NOTHING: Mapping[str, object] = MappingProxyType({})

_OF_ROWS = (
    "id", "component", "orientation_deg", "is_vertical", "dt_s", "npts", *COMPUTED, "source_file",
    "trace_index", "file_format", "processing", "source_sha256", "start_time",
)  # fmt: skip
_OF_RECORDING = ("station", "network", *SITE_COLUMNS)
_LABELS = (
    "station", "component", "orientation_deg", "is_vertical", "recording", "source_file",
    "trace_index", "file_format",
)  # fmt: skip
_NUMBERS = ("orientation_deg", "dt_s", "npts", *COMPUTED, "trace_index", *SITE_COLUMNS, "depth_km")
# Sums over some 1e5 samples, in another order on another processor.
_ROUNDING = 1e-9
_ID_LIMIT = 2**31  # drivers reject larger integers in words of their own


def add_motion(
    connection: Connection,
    motion: GroundMotion,
    *,
    earthquake: EarthquakeInfo,
    is_vertical: bool,
    recording: str = "",
    station: str = "",
    component: str = "",
    processing: str = "",
    flags: Sequence[str] = (),
    suite: str | None = None,
    site: Mapping[str, object] = NOTHING,
) -> tuple[int, bool]:
    """Store a motion, or find the stored one with the same samples.

    A motion is its samples and their interval; labels do not make another one. Nor does a
    filter that rounds otherwise: the same samples of a file, processed alike, are one motion
    even where another machine's arithmetic differs in the last bits.

    Where it is there already, a stated earthquake replaces a guessed one together with all
    labels (recording, station, component, vertical or not, processing, flags); a guess replaces
    nothing; what was stated before stays, and stating another earthquake, direction or site is
    rejected. Missing values of its recording and earthquake are filled in.

    Args:
        motion: equally spaced samples [g].
        earthquake: where it belongs; without an event_id it stands for itself alone.
        is_vertical: True for a vertical component.
        recording: what all components of one recording share; when empty, the motion's own,
            or else file and trace, so that strangers never become companions.
        station: station; when empty, the motion's own.
        component: component; when empty, the motion's own.
        processing: what was done to the samples, in words.
        flags: quality signs, such as ``event_guessed``.
        suite: suite to put the motion into; made when new.
        site: columns of the recording by name: network, place, distances, Vs30, attributes.

    Returns:
        The motion's id, and True when it was not there before.

    Raises:
        InputError: a motion from nodes; another earthquake, direction or site was stated before.
    """
    if motion.dt_s is None:
        raise InputError(
            f"{motion.label}: equally spaced samples are required: resample the motion"
        )
    own_name = motion.sha256[:12]
    if motion.source_file:
        own_name = f"{motion.source_file}#{motion.trace_index}"
    recording = storable(recording or motion.recording or own_name)
    labels: dict[str, Any] = {
        "component": storable(component or motion.component),
        "orientation_deg": motion.orientation_deg,
        "is_vertical": is_vertical,
        "processing": storable(processing),
        "flags": json.dumps(list(flags)),
        "remarks": json.dumps(list(motion.remarks)),
        "source_file": storable(motion.source_file),
        "trace_index": motion.trace_index,
        "file_format": motion.file_format,
    }
    place = (earthquake, recording, storable(station or motion.station))
    stored = _find(connection, motion)
    if stored is None:
        labels["recording_id"] = recording_id_for(connection, *place)
        values = {**_measured(motion), **labels, "added": utc_now()}
        new = insert_if_new(connection, schema.motion, values)
        stored = _find(connection, motion)
        assert stored is not None
        if new:
            store_spectrum(connection, stored["id"], motion)
            renew_recording_spectra(connection, labels["recording_id"])
    else:
        new = False
        if stored["guessed"] and not earthquake.guessed:
            labels["recording_id"] = recording_id_for(connection, *place)
            update_rows(connection, schema.motion, schema.motion.c.id == stored["id"], labels)
            for recording_id in (stored["recording_id"], labels["recording_id"]):
                renew_recording_spectra(connection, recording_id)
            delete_orphans(connection, stored["recording_id"])
        elif not earthquake.guessed:
            _reject_contradiction(motion, stored, earthquake, is_vertical)
            earthquake_id_for(connection, earthquake, recording=recording)
    (recording_id,) = connection.scalars(
        select(schema.motion.c.recording_id).where(schema.motion.c.id == stored["id"])
    )
    complete_recording(connection, recording_id, site)
    if suite is not None:
        add_to_suite(connection, suite, stored["id"])
    return stored["id"], new


def motion_rows(
    connection: Connection, *, suite: str | None = None, where: str | None = None
) -> list[MotionRow]:
    """Return the stored motions without their samples, by id.

    Args:
        suite: only the motions of this suite.
        where: only those that meet this condition.
    """
    query = _row_query()
    if where is not None:
        query = query.where(condition_of_motions(where))
    if suite is not None:
        suite_id = require_suite(connection, suite)
        query = query.join(
            schema.suite_motion,
            and_(
                schema.suite_motion.c.motion_id == schema.motion.c.id,
                schema.suite_motion.c.suite_id == suite_id,
            ),
        )
    return [
        _motion_row(row)
        for row in connection.execute(query.order_by(schema.motion.c.id)).mappings()
    ]


def samples_of_motions(connection: Connection) -> dict[int, tuple[str, float]]:
    """Return the SHA-256 of the samples and their interval [s] of all motions, by row id."""
    column = schema.motion.c
    rows = connection.execute(select(column.id, column.samples_sha256, column.dt_s))
    return {row_id: (sha256, dt_s) for row_id, sha256, dt_s in rows}


def times_of_earthquakes(connection: Connection) -> dict[str, str]:
    """Return origin times or years from metadata, by event id."""
    column = schema.earthquake.c
    query = select(column.event_id, column.time).where(~column.guessed, column.time.is_not(None))
    return {row.event_id: row.time for row in connection.execute(query)}


def motion_row(connection: Connection, motion_id: int) -> MotionRow:
    """Return one stored motion without its samples."""
    return _motion_row(_row_of(connection, _row_query(), motion_id))


def load_motion(connection: Connection, motion_id: int) -> GroundMotion:
    """Return a stored motion with its samples, bit-identical to the stored ones.

    Raises:
        InputError: there is no motion of that id, or a reference file left its samples out.
        DatabaseError: the samples are not those that were stored.
    """
    query = _row_query().add_columns(schema.motion.c.samples, schema.motion.c.remarks)
    row = _row_of(connection, query, motion_id)
    if row["samples"] is None:
        raise InputError(
            f"motion {motion_id}: the database has no samples: add the file of the record"
        )
    blob = bytes(row["samples"])
    if hashlib.sha256(blob).hexdigest() != row["sha256"] or len(blob) != 8 * row["npts"]:
        raise DatabaseError(
            f"motion {motion_id}: the stored samples are damaged (their sha256 differs): restore "
            "the database from a backup; rbfrag db check lists what else is wrong"
        )
    flags, applied = _listed(row, "flags"), _parameters(row)
    is_corrected = True if "filter" in (applied or {}) else None
    if "uncorrected" in flags:
        is_corrected = False
    return GroundMotion(
        np.frombuffer(blob, dtype="<f8").astype(np.float64),
        row["dt_s"],
        **{name: row[name] for name in _LABELS},
        event=row["event_name"] or row["event_id"],
        remarks=tuple(_listed(row, "remarks")),
        is_corrected=is_corrected,
        is_partial="partial" in flags,
        start_time=row["start_time"] and datetime.fromisoformat(row["start_time"]),
        processing_applied=applied,
        source_sha256="" if row["processing_applied"] is None else row["source_sha256"],
    )


def same_source(connection: Connection, motion_id: int) -> list[int]:
    """Return the ids of other motions made from the same samples of a file."""
    source = select(schema.motion.c.source_sha256).where(schema.motion.c.id == motion_id)
    interval = select(schema.motion.c.dt_s).where(schema.motion.c.id == motion_id)
    query = (
        select(schema.motion.c.id)
        .where(
            schema.motion.c.source_sha256 == source.scalar_subquery(),
            schema.motion.c.dt_s == interval.scalar_subquery(),
            schema.motion.c.id != motion_id,
        )
        .order_by(schema.motion.c.id)
    )
    return list(connection.scalars(query))


def measures_of(motion: GroundMotion) -> dict[str, float | None]:
    """Return the :data:`COMPUTED` measures of a motion, by column."""
    values = {
        **asdict(motion.measures), **motion.spectral_accelerations, "housner_m": motion.housner_m
    }  # fmt: skip
    return {name: values[name] for name in COMPUTED}


def same_measure(
    name: str, first: float | None, other: float | None, pgv_m_s: float, pgd_m: float
) -> bool:
    """Return whether a measure is equal except for the order of summation on another processor.

    Args:
        name: one of :data:`COMPUTED`.
        pgv_m_s: PGV of the motion [m/s], which a final velocity is what is left of.
        pgd_m: PGD of the motion [m].
    """
    if first is None or other is None:
        return first is other
    scale = {"final_velocity_m_s": pgv_m_s, "final_displacement_m": pgd_m}.get(name, 0.0)
    return math.isclose(first, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING * scale)


def _applied(motion: GroundMotion) -> str | None:
    return None if motion.processing_applied is None else canonical_json(motion.processing_applied)


def _find(connection: Connection, motion: GroundMotion) -> RowMapping | None:
    same_samples = schema.motion.c.samples_sha256 == motion.sha256
    same_origin = and_(
        schema.motion.c.source_sha256 == motion.source_sha256,
        schema.motion.c.processing_applied == _applied(motion),
    )
    return (
        connection.execute(
            select(
                schema.motion.c.id,
                schema.motion.c.recording_id,
                schema.motion.c.is_vertical,
                schema.motion.c.source_file,
                schema.earthquake.c.event_id,
                schema.earthquake.c.guessed,
            )
            .select_from(schema.motion.join(schema.recording).join(schema.earthquake))
            .where(schema.motion.c.dt_s == motion.dt_s, or_(same_samples, same_origin))
            .order_by(case((same_samples, 0), else_=1), schema.motion.c.id)
        )
        .mappings()
        .first()
    )


def _measured(motion: GroundMotion) -> dict[str, Any]:
    values = {"dt_s": motion.dt_s, "npts": motion.npts, **measures_of(motion)}
    for name, value in values.items():
        if value is not None and not math.isfinite(value):
            raise InputError(
                f"{motion.label}: {name} is {value}: samples of up to "
                f"{np.max(np.abs(motion.acceleration_g)):g} g are not an accelerogram: check the "
                "units"
            )
    return {
        **values,
        "processing_applied": _applied(motion),
        "source_sha256": motion.source_sha256 or motion.sha256,
        "start_time": None if motion.start_time is None else motion.start_time.isoformat(),
        "samples_sha256": motion.sha256,
        "samples": motion.acceleration_g.astype("<f8").tobytes(),
    }


def _parameters(row: RowMapping) -> dict[str, object] | None:
    where = f"processing_applied of motion {row['id']}"
    parameters: dict[str, object] | None = stored_json(row["processing_applied"], dict, where)
    return parameters


def _listed(row: RowMapping, name: str) -> list[Any]:
    listed: list[Any] = stored_json(row[name], list, f"{name} of motion {row['id']}") or []
    return listed


def recording_id_for(connection: Connection, event: EarthquakeInfo, name: str, station: str) -> int:
    """Return the row id of a recording of an earthquake; create both if new."""
    earthquake_id = earthquake_id_for(connection, event, recording=name)
    values = {"earthquake_id": earthquake_id, "name": name, "station": station}
    insert_if_new(connection, schema.recording, values)
    row_id: int = connection.execute(select(schema.recording.c.id).filter_by(**values)).scalar_one()
    return row_id


def complete_recording(
    connection: Connection, recording_id: int, site: Mapping[str, object]
) -> None:
    """Fill in missing columns of a recording.

    Args:
        site: values by column; None and empty ones say nothing. Those of ``attributes`` are texts
            by name.

    Raises:
        InputError: another value is stored; the message has both.
    """
    values = {name: value for name, value in site.items() if value not in (None, "", {})}
    if not values:
        return
    table = schema.recording
    row = connection.execute(select(table).where(table.c.id == recording_id)).mappings().one()
    where = f"attributes of recording {recording_id}"
    attributes = stored_json(row["attributes"], dict, where) or {}
    stored = {**row, "attributes": attributes}
    added = dict(cast("Mapping[str, str]", values.pop("attributes", {})))
    for before, after in ((stored, values), (attributes, added)):
        for name, value in after.items():
            if before.get(name) not in (None, value):
                raise InputError(
                    f"recording {row['name']!r} has {name} {before[name]}, not {value}: correct "
                    "the metadata"
                )
    changed = {name: value for name, value in values.items() if row[name] is None}
    if not added.items() <= attributes.items():
        changed["attributes"] = canonical_json({**attributes, **added})
    if changed:
        update_rows(connection, table, table.c.id == recording_id, changed)


def delete_orphans(connection: Connection, recording_id: int) -> None:
    """Delete a recording without motions, and a guessed earthquake without references.

    Args:
        recording_id: the recording that a motion was moved away from.
    """
    recording, event = schema.recording, schema.earthquake
    event_id = connection.scalar(
        select(recording.c.earthquake_id).where(recording.c.id == recording_id)
    )
    used = exists().where(schema.motion.c.recording_id == recording.c.id)
    delete_rows(connection, recording, recording.c.id == recording_id, ~used)
    used = exists().where(recording.c.earthquake_id == event.c.id)
    delete_rows(connection, event, event.c.id == event_id, event.c.guessed, ~used)


def _reject_contradiction(
    motion: GroundMotion, stored: RowMapping, info: EarthquakeInfo, is_vertical: bool
) -> None:
    name = motion.source_file or motion.label
    prefix = f"the same samples are stored as motion {stored['id']} (from {stored['source_file']})"
    if stored["event_id"] != info.event_id:
        raise InputError(
            f"{name}: {prefix} of event {stored['event_id']!r}, not {info.event_id!r}: "
            "correct the metadata"
        )
    if stored["is_vertical"] != is_vertical:
        direction = "vertical" if stored["is_vertical"] else "horizontal"
        raise InputError(f"{name}: {prefix}, a {direction} component: correct the metadata")


def _row_query() -> Select[Any]:
    return select(
        schema.earthquake.c.event_id,
        schema.earthquake.c.guessed.label("event_guessed"),
        schema.earthquake.c.name.label("event_name"),
        *(schema.earthquake.c[name] for name in ("magnitude", "mechanism", "depth_km")),
        schema.recording.c.name.label("recording"),
        *(schema.recording.c[name] for name in (*_OF_RECORDING, "attributes")),
        *(schema.motion.c[name] for name in _OF_ROWS),
        schema.motion.c.processing_applied,
        schema.motion.c.samples_sha256.label("sha256"),
        schema.motion.c.flags,
    ).select_from(schema.motion.join(schema.recording).join(schema.earthquake))


def _motion_row(row: RowMapping) -> MotionRow:
    label = " ".join(part for part in (row["station"], row["component"]) if part)
    names = (
        "event_id", "event_guessed", "magnitude", "mechanism", "depth_km", "recording",
        *_OF_RECORDING, "sha256", *_OF_ROWS,
    )  # fmt: skip
    where = f"attributes of the recording of motion {row['id']}"
    return MotionRow(
        name=label or f"{row['source_file']}#{row['trace_index']}",
        processing_applied=_parameters(row),
        flags=tuple(_listed(row, "flags")),
        attributes=stored_json(row["attributes"], dict, where) or {},
        **{name: row[name] for name in names if name not in _NUMBERS},
        **{name: stored_number(row[name], f"{name} of motion {row['id']}") for name in _NUMBERS},
    )


def _row_of(connection: Connection, query: Select[Any], motion_id: int) -> RowMapping:
    row = None
    if 0 < motion_id < _ID_LIMIT:
        result = connection.execute(query.where(schema.motion.c.id == motion_id))
        row = result.mappings().one_or_none()
    if row is None:
        raise InputError(f"unknown motion {motion_id}: see  rbfrag motions list")
    return row


def earthquake_id_for(connection: Connection, info: EarthquakeInfo, *, recording: str) -> int:
    """Return the row id of an earthquake; create it if new.

    A guessed event never becomes a stated one of the same id: both stand side by side. What
    is said first about an event stays (sources give one event several names and
    magnitudes); what was not known is filled in.

    Args:
        info: the earthquake. Without an event_id nothing is known, and the recording
            stands for an event of its own.
    """
    if info.magnitude is not None and not -5.0 < info.magnitude < 11.0:
        raise InputError(f"event {info.event_id}: {info.magnitude} is not a valid magnitude")
    event_id = storable(info.event_id) or UNKNOWN_EVENT + recording
    guessed = info.guessed or not info.event_id
    columns = {
        "name": storable(info.name),
        "magnitude": info.magnitude,
        "time": None if info.time is None else storable(info.time),
        "mechanism": info.mechanism,
        "depth_km": info.depth_km,
    }
    insert_if_new(connection, earthquake, {"event_id": event_id, "guessed": guessed, **columns})
    row = connection.execute(
        select(earthquake).where(
            earthquake.c.event_id == event_id, earthquake.c.guessed.is_(guessed)
        )
    ).one()
    missing = {
        key: value
        for key, value in columns.items()
        if value not in (None, "") and row._mapping[key] in (None, "")
    }
    if missing:
        update_rows(connection, earthquake, earthquake.c.id == row.id, missing)
    return int(row.id)


def add_to_suite(connection: Connection, name: str, motion_id: int) -> None:
    """Add a motion to a suite; create the suite if new."""
    if not name.strip():
        raise InputError("the name of a suite must not be empty")
    name = storable(name)
    insert_if_new(connection, suite, {"name": name})
    suite_id = connection.execute(select(suite.c.id).where(suite.c.name == name)).scalar_one()
    insert_if_new(connection, suite_motion, {"suite_id": suite_id, "motion_id": motion_id})


def suite_names(connection: Connection) -> list[str]:
    """Return the names of all suites, sorted."""
    return sorted(connection.scalars(select(suite.c.name)))


def require_suite(connection: Connection, name: str) -> int:
    """Return the row id of a suite.

    Raises:
        InputError: there is no such suite; the message lists those there are.
    """
    suite_id = connection.scalar(select(suite.c.id).where(suite.c.name == storable(name)))
    if suite_id is None:
        names = ", ".join(suite_names(connection)) or "none"
        raise InputError(f"unknown suite {name!r}; the suites are {names}")
    return int(suite_id)
