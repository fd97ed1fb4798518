"""Import of accelerogram files into the database."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Engine

from rbfrag.campaign.record_metadata import Trace, missing_files, read_traces
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion, motion_row, same_source
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.db.vertical_pairs import recordings_of_mixed_dt
from rbfrag.errors import InputError, MotionFileError, checked_name
from rbfrag.motions.archive import archive_of, is_archive, members_of, records_among
from rbfrag.motions.direction import upward
from rbfrag.motions.formats.delimited_text import INDEX
from rbfrag.motions.metadata import read_metadata
from rbfrag.motions.processing import (
    DEFAULT_HIGH_PASS,
    HighPass,
    counts_as_uncorrected,
    processed,
    says_corrected,
)
from rbfrag.motions.quality import DIRECTION_GUESSED, STRUCTURE, is_on_structure, quality_flags
from rbfrag.motions.text.header_check import doubts
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.result import Result, TextLine

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
        not_read: columns of the metadata that nothing is read from.
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
            yield TextLine("Ignored", f"columns of the metadata: {', '.join(self.not_read)}")

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


@dataclass(frozen=True)
class _Stored:
    """One stored trace."""

    motion_id: int
    new: bool
    processed: bool
    place: str
    doubt: str


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
            the records (archive.DOCUMENTS) and spectra (V3) beside their record (V2).
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
                traces = read_traces(file, table, units, dt_s, allow_partial, gain)
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
            except InputError as error:
                run.failed.append(FailedFile(str(file), _reason(error)))
            else:
                _take_note(run, stored)
                _take_note_of_sensors(run, file, traces)
                remarks = [remark for trace in traces for remark in trace.motion.remarks]
                run.warnings += (
                    Diagnostic(f"{file}: {text}", "header_check")
                    for text in dict.fromkeys(doubts(remarks))
                )
            if on_file is not None:
                on_file(number, len(files))
        if engine is not None:
            with engine.connect() as connection:
                run.warnings += _mixed_intervals(connection, run.place)
    for code, names in run.doubts.items():
        listed = f"{', '.join(names[:5])}{', …' if len(names) > 5 else ''}"
        run.warnings.append(Diagnostic(f"{len(names)} traces {DOUBTS[code]}: {listed}", code))
    return AddReport(*(tuple(getattr(run, item.name)) for item in fields(AddReport)))


def _take_note(run: _Additions, stored: list[_Stored]) -> None:
    for trace in stored:
        (run.added if trace.new else run.already_stored).append(trace.motion_id)
        if trace.new and trace.processed:
            run.processed.append(trace.motion_id)
        first = run.place.setdefault(trace.motion_id, trace.place)
        if first != trace.place:
            text = (
                f"{trace.place} holds the same samples as {first}: stored once, as motion "
                f"{trace.motion_id}"
            )
            run.warnings.append(Diagnostic(text, "duplicate_record"))
        elif trace.doubt:
            run.warnings.append(Diagnostic(trace.doubt, "duplicate_record"))


def _take_note_of_sensors(run: _Additions, file: Path, traces: list[Trace]) -> None:
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


def _mixed_intervals(connection: Connection, touched: dict[int, str]) -> list[Diagnostic]:
    return [
        Diagnostic(
            f"recording {mixed.name!r} has components of dt = "
            f"{' and '.join(f'{dt:g}' for dt in mixed.dt_s)} s: those that differ are not used "
            "together",
            "components_differ",
        )
        for mixed in recordings_of_mixed_dt(connection)
        if not touched.keys().isdisjoint(mixed.motion_ids)
    ]


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
            for record in _records(file) if file.resolve() != skipped else ():
                any_file = True
                yield record
    if not any_file:
        raise InputError(f"no files in {', '.join(map(str, paths))}")


def _records(file: Path) -> list[Path]:
    try:
        return members_of(file) if is_archive(file) else [file]
    except MotionFileError:
        # rejected with the reason when it is read
        return [file]


def _store(connection: Connection, file: Path, trace: Trace, run: _Additions) -> _Stored:
    motion, metadata = trace.motion, trace.metadata
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


def _reason(error: InputError) -> str:
    if isinstance(error, MotionFileError):
        return error.reason if error.line is None else f"line {error.line}: {error.reason}"
    return str(error)
