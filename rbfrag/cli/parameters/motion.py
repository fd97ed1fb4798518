"""The MOTION argument of the command line: a file, one trace of a file, or a database id."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbfrag.db.rows import MotionRow
    from rbfrag.db.vertical_pairs import VerticalPair
    from rbfrag.motions.ground_motion import GroundMotion


def find_motion(
    text: str,
    *,
    db: str | None,
    units: str | None = None,
    dt_s: float | None = None,
    allow_partial: bool = False,
) -> GroundMotion:
    """Return the motion that a MOTION argument means.

    Args:
        text: a path, ``path#index``, or the id of a stored motion. A number that is also the
            name of an existing file means the file.
        db: where ids are looked up.
        units: unit of a text file that does not state it.
        dt_s: sampling interval [s] of a text file without a time column.
        allow_partial: read a file whose header states another number of samples than follow.
    """
    if _is_id(text):
        from rbfrag.db.engine import opened_database
        from rbfrag.db.motions import load_motion

        with opened_database(db, read_only=True) as engine, engine.connect() as connection:
            return load_motion(connection, int(text))
    from rbfrag.motions.recognise import read_motion

    return read_motion(text, units=units, dt_s=dt_s, allow_partial=allow_partial)


def stored_row(text: str, *, db: str | None) -> tuple[MotionRow, VerticalPair | None] | None:
    """Return what the database knows of the motion that a MOTION argument means by its id.

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


def find_vertical(
    text: str | None,
    horizontal: GroundMotion,
    *,
    db: str | None,
    units: str | None = None,
    dt_s: float | None = None,
) -> tuple[GroundMotion | None, list[str]]:
    """Return the vertical motion that `--vertical` means, upward, and what to warn of.

    Args:
        text: as for :func:`find_motion`, or None.
        horizontal: the motion it is to go with.
        db: as for :func:`find_motion`.
        units: likewise.
        dt_s: likewise.
    """
    if text is None:
        return None, []
    from rbfrag.motions.direction import companion

    found = find_motion(text, db=db, units=units, dt_s=dt_s)
    warnings = []
    if found.is_vertical is False:
        warnings.append(f"{text} is the horizontal component {found.component} by its own header")
    vertical = companion(horizontal, found)
    if vertical is not found:
        warnings.append(vertical.remarks[-1])
    return vertical, warnings
