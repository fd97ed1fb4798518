"""Bringing accelerogram files into the database."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection, Engine

from rbfrag.db.engine import opened_database
from rbfrag.db.motion_store import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.dt_index import INDEX
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.metadata import MotionMetadata, TraceMetadata, read_metadata
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.recognise import read_motions
from rbfrag.motions.units import acceleration_unit

AS_SUPPLIED = "as supplied"


@dataclass(frozen=True)
class FailedFile:
    """A file that was left out.

    Args:
        path: the file.
        reason: one sentence: what is wrong, and what to do.
    """

    path: str
    reason: str


@dataclass(frozen=True)
class AddReport:
    """What :func:`add_motions` did.

    Args:
        added: ids of the motions that are new.
        known: ids of those whose samples were stored before.
        failed: files that were left out, each with its reason.
    """

    added: tuple[int, ...]
    known: tuple[int, ...]
    failed: tuple[FailedFile, ...]

    def as_dict(self) -> dict[str, object]:
        """Return the report under the keys of the JSON contract."""
        return {
            "added": list(self.added),
            "known": list(self.known),
            "failed": [{"file": bad.path, "reason": bad.reason} for bad in self.failed],
        }


def add_motions(
    paths: Sequence[str | os.PathLike[str]],
    *,
    db: str | os.PathLike[str] | None = None,
    suite: str | None = None,
    metadata: str | os.PathLike[str] | None = None,
    units: str | None = None,
    dt_s: float | None = None,
    on_file: Callable[[int, int], None] | None = None,
) -> AddReport:
    """Read accelerogram files and store their motions as supplied.

    Each file is stored whole or not at all. A file that cannot be read does not stop the
    others; it is reported with its reason. The database is made when the first file has
    been read.

    Args:
        paths: files, or folders that are searched with all folders below them.
        db: the database (path, URL, or None for the default).
        suite: suite to put the motions into.
        metadata: CSV that states, by file and trace, earthquake, units and direction.
        units: unit of text files that do not state it.
        dt_s: sampling interval [s] of text files that hold accelerations only.
        on_file: called after each file with (files done, files in all).

    Raises:
        InputError: a path that does not exist, no file at all, metadata that cannot be used.
        DatabaseError: the database cannot be used.
    """
    if suite is not None and not suite.strip():
        raise InputError("--suite: the name is empty; give one or leave it out")
    stated = None if metadata is None else read_metadata(metadata)
    files = list(_files(paths, leave_out=metadata))
    added: list[int] = []
    known: list[int] = []
    failed: list[FailedFile] = []
    with ExitStack() as stack:
        engine: Engine | None = None
        for number, file in enumerate(files, 1):
            try:
                motions = _read(file, stated, units, dt_s)
                if engine is None:
                    engine = stack.enter_context(opened_database(db, create=True))
                with engine.begin() as connection:
                    stored = [
                        _store(connection, motion, traced, suite) for motion, traced in motions
                    ]
            except InputError as error:
                failed.append(FailedFile(str(file), _reason(error)))
            else:
                for motion_id, new in stored:
                    (added if new else known).append(motion_id)
            if on_file is not None:
                on_file(number, len(files))
    return AddReport(tuple(added), tuple(known), tuple(failed))


def _files(
    paths: Sequence[str | os.PathLike[str]], leave_out: str | os.PathLike[str] | None
) -> Iterator[Path]:
    skipped = None if leave_out is None else Path(leave_out).resolve()
    found = False
    for path in map(Path, paths):
        if path.is_dir():
            below = sorted(
                file
                for file in path.rglob("*")
                if file.is_file() and not file.name.startswith(".") and file.name != INDEX
            )
        elif path.exists():
            below = [path]
        else:
            raise InputError(f"there is no file or folder {path}: check the path")
        for file in below:
            if file.resolve() != skipped:
                found = True
                yield file
    if not found:
        raise InputError(f"there is no file in {', '.join(map(str, paths))}")


def _read(
    file: Path, stated: MotionMetadata | None, units: str | None, dt_s: float | None
) -> list[tuple[GroundMotion, TraceMetadata | None]]:
    of_file = [] if stated is None else stated.file(file)
    if of_file:
        units = units or _known_unit(of_file[0].units)
        dt_s = dt_s or of_file[0].dt_s
    motions = read_motions(file, units=units, dt_s=dt_s)
    by_index = [
        None if stated is None else stated.trace(file, motion.trace_index) for motion in motions
    ]
    for motion, traced in zip(motions, by_index, strict=True):
        if (
            traced is not None
            and traced.is_vertical is not None
            and motion.is_vertical is not None
            and traced.is_vertical != motion.is_vertical
        ):
            says = {True: "vertical", False: "horizontal"}
            raise MotionFileError(
                file,
                f"trace {motion.trace_index} ({motion.component}) is "
                f"{says[motion.is_vertical]}, but line {traced.line} of the metadata says "
                f"{says[traced.is_vertical]}: correct the metadata",
            )
    return list(zip(motions, by_index, strict=True))


def _known_unit(text: str | None) -> str | None:
    """Metadata may name the native unit of a format (counts, g/10) that its reader converts."""
    if text is None:
        return None
    try:
        return acceleration_unit(text)
    except InputError:
        return None


def _store(
    connection: Connection,
    motion: GroundMotion,
    traced: TraceMetadata | None,
    suite: str | None,
) -> tuple[int, bool]:
    flags = [flag.code for flag in quality_flags(motion)]
    if traced is not None and traced.event_id:
        earthquake = EarthquakeInfo(
            event_id=traced.event_id,
            name=traced.earthquake,
            magnitude=traced.magnitude,
            time=traced.year,
            guessed=False,
        )
    else:
        earthquake = EarthquakeInfo(event_id=motion.event, name=motion.event)
        flags.append("event_guessed")
    is_vertical = motion.is_vertical
    if traced is not None and traced.is_vertical is not None:
        is_vertical = traced.is_vertical
    if is_vertical is None:
        flags.append("direction_guessed")
    return add_motion(
        connection,
        motion,
        earthquake=earthquake,
        is_vertical=bool(is_vertical),
        recording=traced.companion_group if traced is not None else "",
        station=traced.station if traced is not None else "",
        component=traced.component if traced is not None else "",
        processing=(traced.processing if traced is not None else "") or AS_SUPPLIED,
        flags=flags,
        suite=suite,
    )


def _reason(error: InputError) -> str:
    if isinstance(error, MotionFileError):
        return error.reason if error.line is None else f"line {error.line}: {error.reason}"
    return str(error)
