"""The MOTION argument of the command line: a file, one trace of a file, or a database id."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion


def find_motion(
    text: str, *, db: str | None, units: str | None = None, dt_s: float | None = None
) -> GroundMotion:
    """Return the motion that a MOTION argument means.

    Args:
        text: a path, ``path#index``, or the id of a stored motion. A number that is also the
            name of an existing file means the file.
        db: where ids are looked up.
        units: unit of a text file that does not state it.
        dt_s: sampling interval [s] of a text file without a time column.

    Raises:
        InputError: no such file, trace or id.
    """
    if text.isascii() and text.isdigit() and not Path(text).exists():
        from rbfrag.db.engine import opened_database
        from rbfrag.db.motion_store import load_motion

        with opened_database(db, read_only=True) as engine, engine.connect() as connection:
            return load_motion(connection, int(text))
    from rbfrag.motions.recognise import read_motion

    return read_motion(text, units=units, dt_s=dt_s)
