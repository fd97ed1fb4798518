"""Rotated components of stored recordings."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rbfrag.db.engine import opened_database
from rbfrag.db.motion_spectra import other_horizontal
from rbfrag.db.motions import add_motion, load_motion, motion_row
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.rotation import rotate
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import count_of
from rbfrag.results.result import Result, TextTable


@dataclass(frozen=True, repr=False)
class RotationReport(Result):
    """Result of :func:`rotate_motions`.

    Args:
        azimuth_deg: azimuth of the positive direction [deg].
        motion_ids: ids of the rotated motions, in the order of the motions that were given.
        pairs: ids of the two components of each.
        warnings: a note on campaigns that would count a recording again.
    """

    azimuth_deg: float
    motion_ids: list[int]
    pairs: list[tuple[int, int]]
    warnings: tuple[str, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the number of motions and the azimuth."""
        number = count_of(len(self.motion_ids), "motion")
        yield f"{number} stored with azimuth {self.azimuth_deg:g}°"

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield each motion with its two components."""
        rows = zip(self.motion_ids, self.pairs, strict=True)
        yield TextTable(("id", "first", "other"), [(number, *pair) for number, pair in rows])

    def as_dict(self) -> dict[str, Any]:
        """Return the report under the keys of the JSON contract."""
        return {**asdict(self), "warnings": list(self.warnings)}


def rotate_motions(
    motions: Sequence[int | str],
    azimuth_deg: float,
    *,
    db: str | os.PathLike[str] | None = None,
    suite: str | None = None,
) -> RotationReport:
    """Store the components of recordings toward an azimuth, as motions of the same recordings.

    Args:
        motions: ids of one horizontal motion of each recording.
        azimuth_deg: azimuth of the positive direction [deg], clockwise from north.
        db: the database (path, URL, or None for the default).
        suite: suite to put the motions into.

    Raises:
        InputError: a motion without a second horizontal that matches it.
        DatabaseError: the database cannot be used.
    """
    names = [str(text) for text in motions]
    files = [text for text in names if not (text.isascii() and text.isdigit())]
    if files:
        raise InputError(f"{files[0]} is not a database id: give out", fields=("out",))
    ids, pairs = [], []
    with opened_database(db) as engine, engine.begin() as connection:
        for number in map(int, names):
            other = other_horizontal(connection, number)
            motion = rotate(
                load_motion(connection, number), load_motion(connection, other), azimuth_deg
            )
            row = motion_row(connection, number)
            carried = [flag for flag in row.flags if flag in ("uncorrected", "event_guessed")]
            codes = [flag.code for flag in quality_flags(motion)]
            stored, _ = add_motion(
                connection,
                motion,
                earthquake=EarthquakeInfo(row.event_id, guessed=row.event_guessed),
                is_vertical=False,
                recording=row.recording,
                station=row.station,
                processing=row.processing,
                flags=[*codes, *carried],
                suite=suite,
            )
            azimuth_deg = motion.orientation_deg or 0.0  # 400° is 40°
            ids.append(stored)
            pairs.append((number, other))
    text = (
        "a campaign over all motions counts the recordings again: simulate the suite of the "
        "rotated motions"
    )
    return RotationReport(azimuth_deg, ids, pairs, (Diagnostic(text, "duplicate_record"),))
