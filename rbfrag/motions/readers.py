"""Reading of accelerograms, whose format is identified by content, and their export."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias

from rbfrag.errors import InputError, MissingExtraError, MotionFileError, UnknownFormatError
from rbfrag.files import as_path, written_whole
from rbfrag.motions.archive import archive_of, is_archive, member_bytes, members_of
from rbfrag.motions.direction import azimuth_deg, bare_name, is_vertical_name
from rbfrag.motions.formats import (
    bhrc_v1,
    cdmg_v1,
    cosmos,
    csmip_v2,
    csmnc,
    cwb,
    delimited_text,
    esm_asc,
    geonet_v2a,
    knet,
    knet_csv,
    miniseed,
    nsmn,
    peer_at2,
    rbfrag_csv,
    scec_bbp,
    simcenter_event,
    ucgmsim_text,
    unam,
    usgs_smc,
)
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.header_check import agreed
from rbfrag.motions.record_file import ParsedTrace, RecordFile
from rbfrag.motions.text import cut_number, decoded, first_sample_time, read_bytes
from rbfrag.motions.units import acceleration_unit

MotionLike: TypeAlias = GroundMotion | str | os.PathLike[str]
"""What an argument that is a motion may be: a motion, or ``FILE`` or ``FILE#trace_index``."""

READERS: tuple[ModuleType, ...] = (
    rbfrag_csv,
    peer_at2,
    geonet_v2a,
    csmip_v2,
    cosmos,
    cdmg_v1,
    bhrc_v1,
    knet,
    knet_csv,
    esm_asc,
    csmnc,
    scec_bbp,
    cwb,
    unam,
    nsmn,
    usgs_smc,
    simcenter_event,
    ucgmsim_text,
    miniseed,
    delimited_text,
)
"""One module a format, asked in this order; text without a mark of its own last.

Each has `FORMAT`, its name; `recognises`, whether the first characters of a text are of it; and
`parse`, which yields a file's traces; `COMPONENTS` is how many a file always holds.
"""

HEAD_CHARACTERS = 4096


def read_motions(
    path: str | os.PathLike[str],
    *,
    units: str | None = None,
    dt_s: float | None = None,
    allow_partial: bool = False,
    gain: float | Mapping[int, float] | None = None,
    channel: str | None = None,
) -> list[GroundMotion]:
    """Return every acceleration trace of a file, unprocessed.

    Args:
        path: a file in any of the formats of :data:`READERS`; a member of a zip, as
            ``records.zip/chan001.v2``; or a zip, for the traces of all its records.
        units: unit of acceleration, for text files that do not state it: ``g``, ``m/s2``,
            ``cm/s2`` or ``mm/s2``. Rejected where the file has another, unless the file
            contradicts itself and agrees with this.
        dt_s: sampling interval [s], for text files that hold accelerations only; likewise.
        allow_partial: True to read a file whose header states another number of samples than
            follow, or that is cut off. Its motions have `is_partial` and a remark; a last line
            that is cut short is left out.
        gain: counts/(m/s²) of a file in counts (miniSEED), of all its traces or of each by its
            trace index. Rejected for other files.
        channel: the channels of a miniSEED file to read, such as ``HN?`` or ``10.HNE,10.HNN``
            (location and channel; ? and * as in file names); None for all of acceleration.

    Raises:
        MotionFileError: the file cannot be read; the message names the line.
        UnknownFormatError: no reader recognises its content.
        InputError: an unknown unit, or a dt or gain that is not positive.
    """
    file = as_path(path, "path", "a file of an accelerogram")
    _check_stated(units, dt_s, gain)
    archive = archive_of(file)
    members = members_of(file) if archive is None and is_archive(file) else [file]
    motions: list[GroundMotion] = []
    for member in members:
        within = archive_of(member)
        raw = read_bytes(member) if within is None else member_bytes(within, member)
        record = RecordFile(member, _text(member, raw), units, dt_s, allow_partial, gain, channel)
        motions += _read_whole(record)
    return motions


def motions_in(
    raw: bytes,
    name: str,
    *,
    units: str | None = None,
    dt_s: float | None = None,
    gain: float | None = None,
) -> list[GroundMotion]:
    """Return every acceleration trace of content without a local file, such as an upload.

    Args:
        raw: what the file holds.
        name: what messages call it; nothing of that name is looked for.
    """
    _check_stated(units, dt_s, gain)
    # readers look for an index next to a file, and next to this one there is none
    file = Path(os.devnull) / Path(name).name
    return _read_whole(RecordFile(file, _text(file, raw), units, dt_s, gain=gain))


def _text(file: Path, raw: bytes) -> str:
    # each byte of a binary file is one character
    text = raw[:HEAD_CHARACTERS].decode("latin-1")
    return raw.decode("latin-1") if miniseed.recognises(text) else decoded(file, raw)


def _check_stated(
    units: str | None, dt_s: float | None, gain: float | Mapping[int, float] | None
) -> None:
    if units is not None:
        acceleration_unit(units)
    for value in gain.values() if isinstance(gain, Mapping) else [gain]:
        if value is not None and not 0.0 < value < math.inf:
            raise InputError(
                f"gain must be a positive number of counts/(m/s2), not {value:g}", fields=("gain",)
            )
    if dt_s is not None and not 0.0 < dt_s < float("inf"):
        raise InputError(
            f"dt_s must be a positive number of seconds, not {dt_s:g}", fields=("dt_s",)
        )


def _read_whole(record: RecordFile) -> list[GroundMotion]:
    text, complete = record.text, replace(record, allow_partial=False)
    motions: list[GroundMotion]
    try:
        if word := cut_number(text):
            raise record.error(
                f"the file is truncated within the number {word!r}: export the record again, or "
                "use allow_partial",
                line=text.count("\n") + 1,
                fields=("allow_partial",),
            )
        motions = _read(complete)
    except UnknownFormatError:
        raise
    except MotionFileError:
        if not record.allow_partial:
            raise
    else:
        return motions
    remark = ""
    lines, newline, cut = text.rpartition("\n")
    if cut and newline and not cut.rstrip().endswith("}") and not miniseed.recognises(text):
        # its last number may lack digits
        record = replace(record, text=lines + newline)
        remark = f"the file ends within a line, which is left out: {cut[:40].strip()!r}"
    motions = _read(record)
    if remark:
        motions[-1] = replace(motions[-1], is_partial=True, remarks=(*motions[-1].remarks, remark))
    return motions


def _read(record: RecordFile) -> list[GroundMotion]:
    file, head = record.path, record.text[:HEAD_CHARACTERS]
    reader = next((reader for reader in READERS if reader.recognises(head)), None)
    if reader is None:
        formats = ", ".join(reader.FORMAT for reader in READERS)
        raise UnknownFormatError(file, f"unknown format; supported are {formats}")
    for name, trouble in (("gain", "is not in counts"), ("channel", "has no channel codes")):
        if getattr(record, name) is not None and reader is not miniseed:
            raise record.error(
                f"the file is {reader.FORMAT}, which {trouble}: omit {name}", fields=(name,)
            )
    try:
        traces = list(reader.parse(record))
        traces = agreed(record, traces, getattr(reader, "COMPONENTS", None))
        return [
            _motion(file, trace, file_format=reader.FORMAT, trace_index=index)
            for index, trace in enumerate(traces)
        ]
    except (MotionFileError, MissingExtraError):
        raise
    except InputError as error:
        # values that no motion can have, which the reader itself has no reason to doubt
        raise MotionFileError(file, f"{error}; export the record again") from None


def _motion(file: Path, trace: ParsedTrace, **place: Any) -> GroundMotion:
    name = trace.component if trace.axis is None else trace.axis
    recording = trace.recording
    if recording is None:
        recording = f"{trace.event} {trace.station}".strip()
    labels: dict[str, Any] = {
        "station": trace.station,
        "event": trace.event,
        "component": bare_name(trace.component),
        "recording": recording,
        "orientation_deg": azimuth_deg(name),
        "is_vertical": is_vertical_name(name),
        "start_time": first_sample_time(trace.start),
        "is_corrected": trace.is_corrected,
        **trace.labels,
    }
    archive = archive_of(file)
    return GroundMotion(
        trace.values * trace.scale,
        trace.dt_s,
        source_file=file.name if archive is None else file.relative_to(archive.parent).as_posix(),
        remarks=trace.remarks,
        is_partial=trace.is_partial,
        stated_unit=trace.unit.text if trace.unit else "",
        **labels,
        **place,
    )


def read_motion(
    text: str | os.PathLike[str],
    *,
    units: str | None = None,
    dt_s: float | None = None,
    allow_partial: bool = False,
    gain: float | None = None,
    channel: str | None = None,
) -> GroundMotion:
    """Return one trace, named as ``FILE`` or ``FILE#trace_index``.

    Args:
        text: a path; for a file of several traces with ``#`` and the index, from 0.
    """
    name, index = _name_and_index(text)
    if is_archive(file := Path(name)):
        members = members_of(file)
        listed = ", ".join(str(member.relative_to(file.parent)) for member in members[:5])
        raise MotionFileError(
            file, f"the zip archive has {len(members)} records: give one, such as {listed}"
        )
    motions = read_motions(
        name, units=units, dt_s=dt_s, allow_partial=allow_partial, gain=gain, channel=channel
    )
    if index is None and len(motions) == 1:
        return motions[0]
    if index is not None and index < len(motions):
        return motions[index]
    listed = ", ".join(f"#{motion.trace_index} {motion.component}" for motion in motions)
    trouble = f"holds {len(motions)} traces" if index is None else f"has no trace #{index}"
    raise MotionFileError(name, f"the file {trouble}: give one of  {listed}, for example {name}#0")


def _name_and_index(text: str | os.PathLike[str]) -> tuple[str, int | None]:
    """Return the file of ``FILE#trace_index`` and the index, None without one."""
    name = os.fspath(text)
    stem, mark, tail = name.rpartition("#")
    # int() rejects thousands of digits; no name is too long for os.path
    is_index = mark and tail.isascii() and tail.isdigit() and len(tail) < 10
    if is_index and not os.path.exists(name):  # noqa: PTH110
        return stem, int(tail)
    return name, None


def read_horizontals(
    text: str | os.PathLike[str], **reading: Any
) -> tuple[GroundMotion, GroundMotion]:
    """Return the two horizontal components of a recording in one file.

    Args:
        text: a path, or ``FILE#trace_index`` of one of them; the first of the file without it.
        reading: options of :func:`read_motions`.

    Raises:
        MotionFileError: the file does not hold two horizontal components of the recording.
    """
    name, index = _name_and_index(text)
    motions = read_motions(name, **reading)
    horizontals = [motion for motion in motions if not motion.is_vertical]
    first = next((m for m in horizontals if index in (None, m.trace_index)), None)
    partners = [
        motion
        for motion in horizontals
        if first is not None and motion is not first and motion.recording == first.recording
    ]
    if first is None or len(partners) != 1:
        listed = ", ".join(f"#{motion.trace_index} {motion.component}" for motion in motions)
        raise MotionFileError(
            name,
            f"the file must hold two horizontal components of one recording, it has {listed}: add "
            "the files of both to a database, with companion_group in the metadata",
        )
    return first, partners[0]


def as_motion(motion: MotionLike, name: str = "motion") -> GroundMotion:
    """Return the motion of an argument, read from a file if it is a path.

    Args:
        motion: a motion, or a file of one as for :func:`read_motion`.
        name: of the argument, for the message.

    Raises:
        InputError: something else; the list of :func:`read_motions` is of several motions.
    """
    if isinstance(motion, GroundMotion):
        return motion
    if isinstance(motion, str | os.PathLike):
        return read_motion(motion)
    raise InputError(
        f"{name} is of type {type(motion).__name__}: give a GroundMotion, or the path of a file "
        "(rbfrag.read_motions returns a list, with one motion for each trace)"
    )


FORMATS = ("csv", "at2")
"""What a motion can be written as."""


def export_motions(
    motions: Sequence[GroundMotion], path: str | os.PathLike[str], *, file_format: str | None = None
) -> str:
    """Write motions into one file, completely or not at all; samples are read back bit for bit.

    Args:
        motions: equally spaced motions; a CSV takes several, an AT2 file one.
        path: the file to write.
        file_format: ``csv`` or ``at2``; None for what the name ends in.

    Returns:
        The format written.

    Raises:
        InputError: no motion, an unknown format, several motions for an AT2 file, a motion from
            nodes, or a file that cannot be written.
    """
    target = Path(path)
    chosen = (file_format or target.suffix.lstrip(".")).lower()
    if chosen not in FORMATS:
        raise InputError(
            f"{target.name}: unsupported format {chosen!r}: use the suffix .csv or .at2, or format",
            fields=("format",),
        )
    if not motions:
        raise InputError("no motion to export: give at least one")
    if chosen == "at2" and len(motions) > 1:
        raise InputError(f"an AT2 file has one motion, not {len(motions)}: use .csv")
    lines = peer_at2.write(motions[0]) if chosen == "at2" else rbfrag_csv.write(motions)
    with written_whole(target) as draft, draft.open("w", newline="\n", encoding="utf-8") as file:
        file.writelines(f"{line}\n" for line in lines)
    return chosen
