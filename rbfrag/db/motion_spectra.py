"""Storage of response spectra of motions, and of RotD50 and RotD100 of recordings."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any, NamedTuple

import numpy as np
from sqlalchemy import Connection, or_, select

from rbfrag.db.insert import delete_rows, insert_if_new
from rbfrag.db.keys import canonical_json
from rbfrag.db.rows import stored_json
from rbfrag.db.schema import ORDINATES, motion, motion_spectrum, recording_spectrum
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.response_spectrum import DirectionalPeaks
from rbfrag.motions.rotation import ROTATED, rotd, treatment

_READ = (
    "id", "component", "orientation_deg", "is_vertical", "dt_s", "start_time",
    "processing_applied", "samples",
)  # fmt: skip
"""Columns of a motion of revision 0002, which the migration to it reads as well."""


PEAKS_ERROR = 1e-9
"""Relative error up to which percentiles over directions are equal: they converge to 1e-13."""


class HorizontalPair(NamedTuple):
    """The two horizontal motions of a recording, in an order that is the same everywhere."""

    motion_id: int
    other_motion_id: int


def store_spectrum(connection: Connection, motion_id: int, ground: GroundMotion) -> None:
    """Store the response spectrum of a motion."""
    ordinates = zip(ORDINATES, ground.spectrum_g, strict=True)
    insert_if_new(connection, motion_spectrum, {"motion_id": motion_id, **dict(ordinates)})


def stored_spectra(connection: Connection) -> dict[int, tuple[float, ...]]:
    """Return the stored ordinates [g] of each motion, by id."""
    columns = (motion_spectrum.c[name] for name in ORDINATES)
    rows = connection.execute(select(motion_spectrum.c.motion_id, *columns))
    return {int(number): tuple(ordinates) for number, *ordinates in rows}


def horizontal_pairs(connection: Connection, recording_id: int) -> dict[str, list[int]]:
    """Return the horizontal motions of a recording that were processed alike, by processing.

    Rotated components are left out. The order is that of the samples in their files.
    """
    alike = defaultdict(list)
    column = motion.c
    query = select(column.id, column.processing_applied).where(
        column.recording_id == recording_id, ~column.is_vertical
    )
    for row in connection.execute(query.order_by(column.source_sha256, column.samples_sha256)):
        where = f"processing_applied of motion {row.id}"
        applied = stored_json(row.processing_applied, dict, where) or {}
        if ROTATED not in applied:
            alike[canonical_json(treatment(applied))].append(row.id)
    return alike


def other_horizontal(connection: Connection, motion_id: int) -> int:
    """Return the id of the other horizontal motion of the recording of a horizontal motion.

    Raises:
        InputError: there is no motion of that id, or not exactly one other.
    """
    recording_id = select(motion.c.recording_id).where(motion.c.id == motion_id).scalar_subquery()
    number = connection.scalar(select(recording_id))
    for ids in horizontal_pairs(connection, number or 0).values():
        if motion_id in ids:
            partners = [number for number in ids if number != motion_id]
            if len(partners) == 1:
                return partners[0]
            listed = f"several: {', '.join(map(str, partners))}" if partners else "none"
            raise InputError(
                f"motion {motion_id}: another horizontal motion of its recording is required, "
                f"there are {listed}; set companion_group in the metadata"
            )
    raise InputError(
        f"motion {motion_id} is not a recorded horizontal motion: see  rbfrag motions list"
    )


def renew_recording_spectra(connection: Connection, recording_id: int) -> None:
    """Store RotD50 and RotD100 of the pairs of a recording, and delete those of former pairs."""
    pairs = {
        HorizontalPair(*ids)
        for ids in horizontal_pairs(connection, recording_id).values()
        if len(ids) == 2
    }
    of_recording = select(motion.c.id).where(motion.c.recording_id == recording_id)
    column = recording_spectrum.c
    query = select(column.motion_id, column.other_motion_id).where(
        or_(column.motion_id.in_(of_recording), column.other_motion_id.in_(of_recording))
    )
    stored = {HorizontalPair(*ids) for ids in connection.execute(query.distinct())}
    for pair in stored - pairs:
        where = column.motion_id == pair.motion_id, column.other_motion_id == pair.other_motion_id
        delete_rows(connection, recording_spectrum, *where)
    for pair in sorted(pairs - stored):
        motions = dict(motions_with_samples(connection, pair))
        for values in pair_rows(pair, *(motions[number] for number in pair if number in motions)):
            insert_if_new(connection, recording_spectrum, values)


def recording_peaks(connection: Connection, motion_id: int) -> list[DirectionalPeaks]:
    """Return RotD50 and RotD100 of the recording of a horizontal motion; empty without them."""
    column = recording_spectrum.c
    query = select(recording_spectrum).where(
        or_(column.motion_id == motion_id, column.other_motion_id == motion_id)
    )
    return [
        DirectionalPeaks(
            row["percentile"], row["pga_g"], row["pgv_m_s"], tuple(row[n] for n in ORDINATES)
        )
        for row in connection.execute(query.order_by(column.percentile)).mappings()
    ]


def pair_rows(pair: HorizontalPair, *motions: GroundMotion) -> list[dict[str, Any]]:
    """Return the rows of a pair of motions; none where they do not match or are not there."""
    if len(motions) < 2:
        return []
    rows = []
    for peaks in rotd(*motions) or ():
        values = peaks._asdict()
        ordinates = zip(ORDINATES, values.pop("sa_g"), strict=True)
        rows.append({**pair._asdict(), **values, **dict(ordinates)})
    return rows


def motions_with_samples(
    connection: Connection, ids: Sequence[int] | None = None
) -> Iterator[tuple[int, GroundMotion]]:
    """Yield the motions that have samples, with all that a rotation needs, by id.

    Args:
        ids: ids of the motions; None for all.
    """
    if ids is None:
        has_samples = motion.c.samples.is_not(None)
        ids = connection.scalars(select(motion.c.id).where(has_samples).order_by(motion.c.id)).all()
    columns = [motion.c[name] for name in _READ]
    for number in ids:  # one at a time: the samples of all may not fit into memory
        row = connection.execute(select(*columns).where(motion.c.id == number)).mappings().one()
        if row["samples"] is not None:
            yield number, _ground_motion(row)


def _ground_motion(row: Any) -> GroundMotion:
    start, where = row["start_time"], f"processing_applied of motion {row['id']}"
    return GroundMotion(
        np.frombuffer(row["samples"], dtype="<f8").astype(np.float64),
        row["dt_s"],
        component=row["component"],
        orientation_deg=row["orientation_deg"],
        is_vertical=row["is_vertical"],
        start_time=start and datetime.fromisoformat(start),
        processing_applied=stored_json(row["processing_applied"], dict, where),
    )
