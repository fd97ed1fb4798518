"""Writing earthquakes: told apart by their id, and guessed from stated."""

from __future__ import annotations

from sqlalchemy import Connection, select

from rbfrag.db.insert import insert_if_new, update_rows
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.db.schema import earthquake
from rbfrag.db.stored_text import storable
from rbfrag.errors import InputError


def earthquake_id_for(connection: Connection, info: EarthquakeInfo, *, recording: str) -> int:
    """Return the row id of an earthquake, made when new.

    A guessed event never becomes a stated one of the same id: both stand side by side. What
    is said first about an event stays (sources give one event several names and
    magnitudes); what was not known is filled in.

    Args:
        connection: inside the caller's transaction.
        info: the earthquake. Without an event_id nothing is known, and the recording
            stands for an event of its own.
        recording: name of the recording.

    Raises:
        InputError: a magnitude that no earthquake has.
    """
    if info.magnitude is not None and not -5.0 < info.magnitude < 11.0:
        raise InputError(
            f"event {info.event_id}: {info.magnitude} is no magnitude of an earthquake"
        )
    event_id = storable(info.event_id) or f"unknown event of {recording}"
    guessed = info.guessed or not info.event_id
    known = {
        "name": storable(info.name),
        "magnitude": info.magnitude,
        "time": None if info.time is None else storable(info.time),
    }
    insert_if_new(connection, earthquake, {"event_id": event_id, "guessed": guessed, **known})
    row = connection.execute(
        select(earthquake).where(
            earthquake.c.event_id == event_id, earthquake.c.guessed.is_(guessed)
        )
    ).one()
    missing = {key: value for key, value in known.items() if value and not row._mapping[key]}
    if missing:
        update_rows(connection, earthquake, earthquake.c.id == row.id, missing)
    return int(row.id)
