"""The MOTION argument of the command line: a file, one trace of a file, or a database id."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rbfrag.cli.parameters.options import Direction, ReadingOptions

if TYPE_CHECKING:
    from rbfrag.db.rows import MotionRow
    from rbfrag.db.vertical_pairs import VerticalPair
    from rbfrag.motions.ground_motion import GroundMotion

AS_STATED = ReadingOptions()


def find_motion(
    text: str, *, db: str | None, reading: ReadingOptions = AS_STATED, allow_partial: bool = False
) -> GroundMotion:
    """Return the ground motion of a MOTION argument.

    Args:
        text: a path, ``path#index``, or the id of a stored motion. A number that is also the
            name of an existing file means the file.
        db: where ids are looked up.
        reading: what a text file leaves open.
        allow_partial: read a file whose header states another number of samples than follow.
    """
    if _is_id(text):
        from rbfrag.db.engine import opened_database
        from rbfrag.db.motions import load_motion

        with opened_database(db, read_only=True) as engine, engine.connect() as connection:
            return load_motion(connection, int(text))
    from rbfrag.motions.readers import read_motion

    return read_motion(
        text,
        units=reading.units,
        dt_s=reading.dt,
        allow_partial=allow_partial,
        gain=reading.gain,
    )


def stored_row(text: str, *, db: str | None) -> tuple[MotionRow, VerticalPair | None] | None:
    """Return the database row of a MOTION argument that is an id.

    Args:
        text: as for :func:`find_motion`.
        db: where ids are looked up.

    Returns:
        The stored row and, for a horizontal motion, its vertical companion or why there is
        none; None where the argument means a file.
    """
    if not _is_id(text):
        return None
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motions import motion_row
    from rbfrag.db.vertical_pairs import vertical_pair

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        row = motion_row(connection, int(text))
        return row, None if row.is_vertical else vertical_pair(connection, row.id)


def _is_id(text: str) -> bool:
    return text.isascii() and text.isdigit() and not Path(text).exists()


def find_shaking(
    text: str, direction: Direction, *, db: str | None, reading: ReadingOptions
) -> tuple[GroundMotion, GroundMotion | None, list[str]]:
    """Return the ground motion of a MOTION argument, its vertical component, and warnings.

    Args:
        text: as for :func:`find_motion`.
        direction: names the vertical motion, upward positive.
        db: as for :func:`find_motion`.
        reading: likewise.
    """
    horizontal = find_motion(text, db=db, reading=reading)
    if direction.vertical is None:
        return horizontal, None, []
    from rbfrag.motions.direction import companion

    upward = find_motion(direction.vertical, db=db, reading=reading)
    warnings = []
    if upward.is_vertical is False:
        warnings.append(
            f"{direction.vertical} is the horizontal component {upward.component} by its own header"
        )
    vertical = companion(horizontal, upward)
    if vertical is not upward:
        warnings.append(vertical.remarks[-1])
    return horizontal, vertical, warnings
