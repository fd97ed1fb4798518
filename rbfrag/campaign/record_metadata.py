"""Traces of a record file combined with their metadata table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.archive import is_there
from rbfrag.motions.direction import is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.metadata import MotionMetadata, TraceMetadata
from rbfrag.motions.readers import read_motions
from rbfrag.motions.units import acceleration_unit, stated_in_g, unit_in_g

NOTHING_STATED = TraceMetadata(file="", line=0)


@dataclass(frozen=True)
class Trace:
    """One trace of a file with its metadata, empty where not given.

    `other_unit` is what file or metadata state where the caller stated another unit; else empty.
    `by_gain`: it was in counts, and read by the gain that the caller stated.
    """

    motion: GroundMotion
    metadata: TraceMetadata
    other_unit: str = ""
    by_gain: bool = False

    @property
    def is_vertical(self) -> bool | None:
        """True if the component is vertical; None if neither file nor metadata give it.

        Metadata take precedence: what they state, then the name that they give the component.
        """
        vertical, named = self.metadata.is_vertical, is_vertical_name(self.metadata.component)
        by_metadata = named if vertical is None else vertical
        return self.motion.is_vertical if by_metadata is None else by_metadata

    @property
    def other_direction(self) -> str:
        """Warning that metadata and file disagree on the direction; empty if they agree."""
        if self.motion.is_vertical in (None, self.is_vertical):
            return ""
        return (
            f"line {self.metadata.line} of the metadata says "
            f"{'vertical' if self.is_vertical else 'horizontal'} of trace "
            f"{self.motion.trace_index} ({self.motion.component}), which the file's own header "
            "does not"
        )


def read_traces(
    file: Path,
    metadata: MotionMetadata | None,
    units: str | None,
    dt_s: float | None,
    allow_partial: bool = False,
    gain: float | None = None,
) -> list[Trace]:
    """Return every trace of a file with its row of the metadata.

    Args:
        metadata: the table, or None.
        units: unit that the caller states for files that state none, neither by themselves nor
            by the table, or whose samples contradict it; :attr:`Trace.other_unit` names one that
            does state another.
        dt_s: sampling interval that the caller states [s]; likewise.
        allow_partial: as for :func:`rbfrag.motions.readers.read_motions`.
        gain: counts/(m/s²) of files in counts of which the table states none.

    Raises:
        MotionFileError: the file cannot be read, or the metadata contradict it or themselves.
    """
    rows = [] if metadata is None else metadata.file(file)
    if rows:
        _reject_rows_apart(file, rows)
        dt_s = dt_s or rows[0].dt_s
    by_table = _known_unit(rows[0].units) if rows else None
    read = partial(read_motions, file, dt_s=dt_s, allow_partial=allow_partial)
    gains = {row.trace_index: row.gain for row in rows if row.gain is not None}
    file_gain = gains.get(None)
    by_index = {index: value for index, value in gains.items() if index is not None}
    by_gain = False
    try:
        motions = read(
            units=by_table, gain=file_gain if file_gain is not None else by_index or None
        )
    except MotionFileError as error:
        # stated by neither, or contradicted by the samples
        if units is not None and by_table is None and "units" in error.fields:
            motions = read(units=units)
        elif by_gain := gain is not None and not gains and "gain" in error.fields:
            motions = read(gain=gain)
        else:
            raise
    rows_by_index = _rows_of_traces(file, rows, motions)
    for index, row in rows_by_index.items():
        if index >= len(motions):
            raise MotionFileError(
                file,
                f"line {row.line} of the metadata has trace_index {index}, but the file has "
                f"{len(motions)} traces, counted from 0: correct trace_index",
            )
    traces = [
        Trace(
            motion,
            rows_by_index.get(motion.trace_index, NOTHING_STATED),
            _other_unit(units, motion.stated_unit or by_table),
            by_gain,
        )
        for motion in motions
    ]
    for trace in traces:
        if trace.metadata.trace_index is None and len(traces) > 1 and trace.other_direction:
            # a row about a whole file says nothing about the direction of one of its traces
            raise MotionFileError(file, f"{trace.other_direction}: give each trace a row")
    return traces


def missing_files(
    metadata: MotionMetadata, paths: list[Path]
) -> Iterator[tuple[str, TraceMetadata]]:
    """Yield the files named in the metadata that are missing below the given paths.

    Args:
        paths: files and folders that are being read; rows that point elsewhere are passed over.
    """
    folder = Path(metadata.path).absolute().parent
    roots = [path.absolute().resolve() for path in paths]
    seen: set[Path] = set()
    for row in metadata.rows:
        named = folder / row.file
        place = named.resolve()
        if place in seen or is_there(place):
            continue
        seen.add(place)
        if any(place == searched or searched in place.parents for searched in roots):
            yield str(named), row


def _rows_of_traces(
    file: Path, rows: list[TraceMetadata], motions: list[GroundMotion]
) -> dict[int, TraceMetadata]:
    """Rows by trace index; a row without an index applies to every trace of the file."""
    file_row = next((row for row in rows if row.trace_index is None), None)
    if file_row is None:
        return {row.trace_index: row for row in rows if row.trace_index is not None}
    if len(motions) > 1 and file_row.component:
        raise MotionFileError(
            file,
            f"line {file_row.line} of the metadata calls all {len(motions)} traces of the file "
            f"{file_row.component}: give each a row with its trace_index, from 0",
        )
    return dict.fromkeys(range(len(motions)), file_row)


def _other_unit(units: str | None, file_unit: str | None) -> str:
    if units is None or not file_unit or stated_in_g(file_unit) == unit_in_g(units):
        return ""
    return file_unit


def _reject_rows_apart(file: Path, rows: list[TraceMetadata]) -> None:
    """Reject metadata with different units for the traces of one file."""
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


def _known_unit(text: str | None) -> str | None:
    """Return the unit in the metadata, unless its format converts it (counts, g/10)."""
    if text is None:
        return None
    try:
        return acceleration_unit(text)
    except InputError:
        return None
