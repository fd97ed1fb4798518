"""Import of accelerogram files into the database."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Engine

from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion, motion_row, same_source
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.db.vertical_pairs import recordings_of_mixed_dt
from rbfrag.errors import InputError, MotionFileError, checked_name
from rbfrag.motions.archive import archive_of, is_archive, is_there, members_of, records_among
from rbfrag.motions.direction import azimuth_deg, is_vertical_name, upward
from rbfrag.motions.formats.delimited_text import INDEX
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.header_check import doubts
from rbfrag.motions.metadata import MotionMetadata, TraceMetadata, read_metadata
from rbfrag.motions.processing import (
    DEFAULT_HIGH_PASS,
    HighPass,
    counts_as_uncorrected,
    processed,
    says_corrected,
)
from rbfrag.motions.quality import DIRECTION_GUESSED, STRUCTURE, is_on_structure, quality_flags
from rbfrag.motions.readers import read_motions
from rbfrag.motions.units import acceleration_unit, stated_in_g, unit_in_g
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.result import Result, TextLine
from rbfrag.threads import with_one_thread

AS_SUPPLIED = "as supplied"

DOUBTS = {
    DIRECTION_GUESSED: (
        f"are assumed horizontal though their names state no direction (flag {DIRECTION_GUESSED}): "
        "a vertical one would be simulated as a horizontal; give is_vertical in a table of metadata"
    ),
    STRUCTURE: (
        f"were recorded on a structure (flag {STRUCTURE}) and stay out of campaigns and fits"
    ),
}
"""Warnings about the sensors of traces, by their code."""


@dataclass(frozen=True)
class FailedFile:
    """A file that could not be added; `reason` gives the problem and the remedy."""

    path: str
    reason: str


@dataclass(frozen=True)
class AddReport(Result):
    """Result of :func:`add_motions`.

    Args:
        added: ids of the motions that are new.
        already_stored: ids of those that were stored before.
        processed: ids of the new ones that were uncorrected and have been processed.
        failed: files that were left out, each with its reason.
        warnings: sentences about what was added: the same samples in two files, one trace
            stored with two kinds of processing, a recording with several sampling intervals, a
            header that disagrees with its samples, a direction that is guessed, a sensor on a
            structure.
        not_read: columns of the metadata that are ignored, because the components of a recording
            differ in them.
    """

    added: tuple[int, ...]
    already_stored: tuple[int, ...]
    processed: tuple[int, ...]
    failed: tuple[FailedFile, ...]
    warnings: tuple[str, ...]
    not_read: tuple[str, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the number of added motions."""
        processed = f", {len(self.processed):,} of them processed" if self.processed else ""
        parts = [
            f"{len(self.added):,} motion{'' if len(self.added) == 1 else 's'} added{processed}"
        ]
        parts += [f"{len(self.already_stored):,} stored before"] if self.already_stored else []
        parts += [f"{len(self.failed):,} rejected"] if self.failed else []
        yield "; ".join(parts)

    def lines(self) -> Iterator[TextLine]:
        """Yield the ignored columns of the metadata."""
        if self.not_read:
            names = ", ".join(self.not_read)
            yield TextLine("Ignored", f"columns that differ between components: {names}")

    def table_columns(self) -> dict[str, NDArray[Any]]:
        """Return id and state of every motion, and the file and reason of each that failed."""
        states = [
            *(
                (number, "processed" if number in self.processed else "added", "", "")
                for number in self.added
            ),
            *((number, "already stored", "", "") for number in self.already_stored),
            *((None, "failed", bad.path, bad.reason) for bad in self.failed),
        ]
        names = ("motion_id", "state", "file", "reason")
        rows = np.array(states, dtype=object).reshape(-1, len(names))
        return dict(zip(names, rows.T, strict=True))

    def as_dict(self) -> dict[str, Any]:
        """Return the report under the keys of the JSON contract."""
        lists = {item.name: list(getattr(self, item.name)) for item in fields(self)}
        return {**lists, "failed": [{"file": f.path, "reason": f.reason} for f in self.failed]}


@dataclass
class _Additions:
    """Motions, warnings and errors so far."""

    suite: str | None
    high_pass: HighPass | None
    processing: str
    not_read: tuple[str, ...]
    added: list[int] = field(default_factory=list)
    already_stored: list[int] = field(default_factory=list)
    processed: list[int] = field(default_factory=list)
    failed: list[FailedFile] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    place: dict[int, str] = field(default_factory=dict)
    doubts: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))


class _Stored(NamedTuple):
    """One stored trace."""

    motion_id: int
    new: bool
    processed: bool
    place: str
    doubt: str


@with_one_thread
def add_motions(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    db: str | os.PathLike[str] | None = None,
    suite: str | None = None,
    metadata: str | os.PathLike[str] | None = None,
    units: str | None = None,
    dt_s: float | None = None,
    processing: str = "",
    raw: bool = False,
    allow_partial: bool = False,
    gain: float | None = None,
    channel: str | None = None,
    high_pass: HighPass = DEFAULT_HIGH_PASS,
    on_file: Callable[[int, int], None] | None = None,
) -> AddReport:
    """Read accelerogram files and store their motions; uncorrected ones are processed.

    Each file is stored whole or not at all. A file that cannot be read does not stop the
    others; it is reported with its reason. The database is made when the first file has
    been read.

    Args:
        paths: a file, member of a zip (``records.zip/chan001.v2``), zip or folder, or several;
            folders are searched with all folders and zips below them. Passed over are texts about
            the records (archive.DOCUMENTS) and spectra (V3) next to their record (V2).
        db: the database (path, URL, or None for the default).
        suite: suite to put the motions into.
        metadata: CSV that states, by file and trace, earthquake, units and direction.
        units: unit of files that do not state it; one that states another is read by what it
            states, with a warning, and rejected where it is the only file; it overrides a unit
            that the file's own peak contradicts.
        dt_s: sampling interval [s] of text files that hold accelerations only; it overrides one
            that the file's own duration contradicts.
        processing: what was done to records of which no metadata say it, ``corrected`` or
            ``uncorrected``; it may say otherwise than their format, and metadata that do need it.
        raw: store every record as its file has it; uncorrected ones are flagged.
        allow_partial: read files whose header states another number of samples than follow;
            their motions are flagged `partial`.
        gain: counts/(m/s²) of files in counts (miniSEED) of which the metadata state none.
        channel: channels of miniSEED files to read, as for :func:`rbfrag.read_motions`; other
            files are rejected.
        high_pass: what is applied to uncorrected records.
        on_file: called after each file with (files done, files in all).

    Raises:
        InputError: a path that does not exist, no file at all, metadata that cannot be used.
        DatabaseError: the database cannot be used.
    """
    if isinstance(paths, str | os.PathLike):
        paths = [paths]
    elif not isinstance(paths, Sequence):
        raise InputError(
            f"paths is of type {type(paths).__name__}: give a file or folder, or a list of them"
        )
    if suite is not None and not suite.strip():
        raise InputError("suite: the name is empty; give one or omit it", fields=("suite",))
    checked_name(suite or "", "the suite")
    table = None if metadata is None else read_metadata(metadata)
    files = list(_files(paths, leave_out=metadata))
    says_corrected(processing)
    not_read = () if table is None else table.not_read
    run = _Additions(suite, None if raw else high_pass, processing, not_read)
    if table is not None:
        run.failed += [
            FailedFile(
                name,
                f"line {row.line} of the metadata names this file, but it is not there: correct "
                "the metadata or bring the file",
            )
            for name, row in missing_files(table, list(map(Path, paths)))
        ]
    with ExitStack() as stack:
        engine: Engine | None = None
        for number, file in enumerate(files, 1):
            try:
                traces = read_traces(file, table, units, dt_s, allow_partial, gain, channel)
                _take_note_of_units(run, file, traces, units, alone=len(files) == 1)
                if gain is not None and len(files) == 1 and not traces[0].by_gain:
                    raise MotionFileError(
                        file,
                        "it is not in counts, or its gain is in the metadata: omit gain",
                        fields=("gain",),
                    )
                if engine is None:
                    engine = stack.enter_context(opened_database(db, create=True))
                with engine.begin() as connection:
                    stored = [_store(connection, file, trace, run) for trace in traces]
            except MotionFileError as error:
                line = "" if error.line is None else f"line {error.line}: "
                run.failed.append(FailedFile(str(file), line + error.reason))
            except InputError as error:
                run.failed.append(FailedFile(str(file), str(error)))
            else:
                _take_note(run, file, traces, stored)
            if on_file is not None:
                on_file(number, len(files))
        if engine is not None:
            with engine.connect() as connection:
                mixed_recordings = recordings_of_mixed_dt(connection)
            for name, intervals, motion_ids in mixed_recordings:
                if not run.place.keys().isdisjoint(motion_ids):
                    text = (
                        f"recording {name!r} has components of dt = "
                        f"{' and '.join(f'{dt:g}' for dt in intervals)} s: those that differ are "
                        "not used together"
                    )
                    run.warnings.append(Diagnostic(text, "components_differ"))
    for code, names in run.doubts.items():
        listed = f"{', '.join(names[:5])}{', …' if len(names) > 5 else ''}"
        run.warnings.append(Diagnostic(f"{len(names)} traces {DOUBTS[code]}: {listed}", code))
    return AddReport(*(tuple(getattr(run, item.name)) for item in fields(AddReport)))


def _take_note(
    run: _Additions, file: Path, traces: list[Trace], stored_traces: list[_Stored]
) -> None:
    """Count the stored traces of a file, and collect warnings about them."""
    for stored in stored_traces:
        (run.added if stored.new else run.already_stored).append(stored.motion_id)
        if stored.new and stored.processed:
            run.processed.append(stored.motion_id)
        first = run.place.setdefault(stored.motion_id, stored.place)
        if first != stored.place:
            text = (
                f"{stored.place} holds the same samples as {first}: stored once, as motion "
                f"{stored.motion_id}"
            )
            run.warnings.append(Diagnostic(text, "duplicate_record"))
        elif stored.doubt:
            run.warnings.append(Diagnostic(stored.doubt, "duplicate_record"))
    for trace in traces:
        motion = trace.motion
        name = f"{file.name}#{motion.trace_index} {motion.component}".rstrip()
        if trace.other_direction:
            text = f"{file}: {trace.other_direction}: the metadata are used"
            run.warnings.append(Diagnostic(text, "direction_guessed"))
        if trace.is_vertical is None:
            run.doubts[DIRECTION_GUESSED].append(name)
        if is_on_structure(motion):
            run.doubts[STRUCTURE].append(f"{name} at {motion.location}")
    remarks = [remark for trace in traces for remark in trace.motion.remarks]
    run.warnings += (
        Diagnostic(f"{file}: {text}", "header_check") for text in dict.fromkeys(doubts(remarks))
    )


def _take_note_of_units(
    run: _Additions, file: Path, traces: list[Trace], units: str | None, *, alone: bool
) -> None:
    other = next((trace.other_unit for trace in traces if trace.other_unit), "")
    if other and alone:
        raise MotionFileError(
            file, f"its unit is {other}, not {units}: omit units", fields=("units",)
        )
    if other:
        text = (
            f"{file} is in {other}, as is stated for it, not in {units}, which is for the files "
            "that state none"
        )
        run.warnings.append(Diagnostic(text, "unit_in_file"))


def _files(
    paths: Sequence[str | os.PathLike[str]], leave_out: str | os.PathLike[str] | None
) -> Iterator[Path]:
    skipped = None if leave_out is None else Path(leave_out).resolve()
    any_file = False
    for path in map(Path, paths):
        if path.is_dir():
            inside = (file for file in path.rglob("*") if file.is_file() and file.name != INDEX)
            below = records_among(inside)
        elif path.exists() or archive_of(path) is not None:
            below = [path]
        else:
            raise InputError(f"file or folder not found: {path}")
        for file in below:
            if file.resolve() == skipped:
                continue
            try:
                records = members_of(file) if is_archive(file) else [file]
            except MotionFileError:
                records = [file]  # rejected with the reason when it is read
            any_file = any_file or bool(records)
            yield from records
    if not any_file:
        raise InputError(f"no files in {', '.join(map(str, paths))}")


def _store(connection: Connection, file: Path, trace: Trace, run: _Additions) -> _Stored:
    motion, metadata = trace.motion, trace.metadata
    if motion.orientation_deg is None and metadata.component:
        motion = replace(motion, orientation_deg=azimuth_deg(metadata.component))
    flags: list[str] = []
    uncorrected = counts_as_uncorrected(motion, metadata.processing, run.processing)
    filtered = uncorrected and run.high_pass is not None
    if uncorrected and run.high_pass is not None:
        motion = processed(motion, run.high_pass)
    elif uncorrected:
        flags.append("uncorrected")
    component = metadata.component
    if trace.is_vertical and run.high_pass is not None:
        turned = upward(replace(motion, component=component or motion.component))
        # a component that was turned is no longer called as the metadata have it
        motion, component = turned, turned.component
    flags = [flag.code for flag in quality_flags(motion)] + flags
    if metadata.event_id:
        earthquake = EarthquakeInfo(
            event_id=metadata.event_id,
            name=metadata.earthquake,
            magnitude=metadata.magnitude,
            time=metadata.year,
            guessed=False,
            mechanism=metadata.mechanism,
            depth_km=metadata.depth_km,
        )
    else:
        earthquake = EarthquakeInfo(event_id=motion.event, name=motion.event)
        flags.append("event_guessed")
    if trace.is_vertical is None:
        flags.append(DIRECTION_GUESSED)
    words = (
        metadata.processing
        or run.processing
        or {None: AS_SUPPLIED, True: "corrected", False: "uncorrected"}[trace.motion.is_corrected]
    )
    motion_id, new = add_motion(
        connection,
        motion,
        earthquake=earthquake,
        is_vertical=bool(trace.is_vertical),
        recording=metadata.companion_group,
        station=metadata.station,
        component=component,
        processing=words,
        flags=flags,
        suite=run.suite,
        site={**metadata.site, "attributes": metadata.attributes},
    )
    name = f"{file}#{motion.trace_index}"
    if not new and motion_id not in run.place:
        row = motion_row(connection, motion_id)
        run.place[motion_id] = name
        if (row.source_file, row.trace_index) != (motion.source_file, motion.trace_index):
            run.place[motion_id] = f"{row.source_file}#{row.trace_index}"
    doubt = ""
    duplicates = same_source(connection, motion_id)
    if new and duplicates:
        doubt = (
            f"{name} is stored as motion {motion_id}, and the same samples with other processing "
            f"as motion {', '.join(map(str, duplicates))}: a campaign would count the trace twice; "
            "use one suite for each kind of processing"
        )
    return _Stored(motion_id, new, filtered, name, doubt)


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
    channel: str | None = None,
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
        channel: as for :func:`rbfrag.motions.readers.read_motions`.

    Raises:
        MotionFileError: the file cannot be read, or the metadata contradict it or themselves.
    """
    rows = [] if metadata is None else metadata.file(file)
    if rows:
        _reject_rows_apart(file, rows)
        dt_s = dt_s or rows[0].dt_s
    by_table = _known_unit(rows[0].units) if rows else None
    read = partial(read_motions, file, dt_s=dt_s, allow_partial=allow_partial, channel=channel)
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
    traces = []
    for motion in motions:
        unit = motion.stated_unit or by_table or ""
        agrees = units is None or not unit or stated_in_g(unit) == unit_in_g(units)
        row = rows_by_index.get(motion.trace_index, NOTHING_STATED)
        trace = Trace(motion, row, "" if agrees else unit, by_gain)
        traces.append(trace)
        if trace.metadata.trace_index is None and len(motions) > 1 and trace.other_direction:
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
