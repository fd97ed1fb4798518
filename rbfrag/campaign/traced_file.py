"""A record's file read together with what a metadata table states about its traces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.metadata import MotionMetadata, TraceMetadata
from rbfrag.motions.recognise import read_motions
from rbfrag.motions.units import acceleration_unit

NOTHING_STATED = TraceMetadata(file="", line=0)


@dataclass(frozen=True)
class Trace:
    """One trace as its file has it, and what the metadata state of it, empty where nothing."""

    motion: GroundMotion
    stated: TraceMetadata

    @property
    def is_vertical(self) -> bool | None:
        """Whether it is a vertical component; None when neither file nor metadata say."""
        stated = self.stated.is_vertical
        return self.motion.is_vertical if stated is None else stated


def read_traces(
    file: Path,
    metadata: MotionMetadata | None,
    units: str | None,
    dt_s: float | None,
    allow_partial: bool = False,
) -> list[Trace]:
    """Return every trace of a file with its row of the metadata.

    Args:
        file: the file.
        metadata: the table, or None.
        units: unit that the caller states; else that of the table is used.
        dt_s: sampling interval that the caller states [s]; likewise.
        allow_partial: as for :func:`rbfrag.motions.recognise.read_motions`.

    Raises:
        MotionFileError: the file cannot be read, or the metadata contradict it or themselves.
    """
    rows = [] if metadata is None else metadata.file(file)
    if rows:
        _refuse_rows_apart(file, rows)
        units = units or _known_unit(rows[0].units)
        dt_s = dt_s or rows[0].dt_s
    motions = read_motions(file, units=units, dt_s=dt_s, allow_partial=allow_partial)
    by_index = {row.trace_index: row for row in rows}
    for index, row in by_index.items():
        if index >= len(motions):
            raise MotionFileError(
                file,
                f"line {row.line} of the metadata names trace {index}, but the file holds "
                f"{len(motions)}, counted from 0: correct trace_index",
            )
    traces = [Trace(motion, by_index.get(motion.trace_index, NOTHING_STATED)) for motion in motions]
    for trace in traces:
        _refuse_other_direction(file, trace)
    return traces


def missing_files(
    metadata: MotionMetadata, paths: list[Path]
) -> Iterator[tuple[str, TraceMetadata]]:
    """Yield the files at or below some paths that the metadata name but that are not there.

    Args:
        metadata: the table.
        paths: files and folders that are being read; rows that point elsewhere are passed over.
    """
    folder = Path(metadata.path).absolute().parent
    places = [path.absolute().resolve() for path in paths]
    seen: set[Path] = set()
    for row in metadata.rows:
        named = folder / row.file
        place = named.resolve()
        if place in seen or place.exists():
            continue
        seen.add(place)
        if any(place == searched or searched in place.parents for searched in places):
            yield str(named), row


def _refuse_rows_apart(file: Path, rows: list[TraceMetadata]) -> None:
    """The traces of one file are in one unit; one statement holds for all."""
    for name in ("units", "dt_s"):
        values = {getattr(row, name) for row in rows} - {None}
        if len(values) > 1:
            lines = ", ".join(str(row.line) for row in rows)
            shown = " and ".join(sorted(map(str, values)))
            raise MotionFileError(
                file,
                f"lines {lines} of the metadata state {name} {shown} for this one file: correct "
                "the metadata",
            )


def _refuse_other_direction(file: Path, trace: Trace) -> None:
    stated, in_file = trace.stated.is_vertical, trace.motion.is_vertical
    if stated is not None and in_file is not None and stated != in_file:
        says = {True: "vertical", False: "horizontal"}
        raise MotionFileError(
            file,
            f"trace {trace.motion.trace_index} ({trace.motion.component}) is {says[in_file]}, but "
            f"line {trace.stated.line} of the metadata says {says[stated]}: correct the metadata",
        )


def _known_unit(text: str | None) -> str | None:
    """Metadata may name the native unit of a format (counts, g/10) that its reader converts."""
    if text is None:
        return None
    try:
        return acceleration_unit(text)
    except InputError:
        return None
