"""Reading accelerograms: the format is recognised by content, never by the file's name."""

from __future__ import annotations

import os
from pathlib import Path
from types import ModuleType

from rbfrag.errors import InputError, MotionFileError, UnknownFormatError
from rbfrag.motions import (
    bhrc_v1,
    cdmg_v1,
    cosmos,
    csmip_v2,
    cwb,
    delimited_text,
    esm_asc,
    geonet_v2a,
    knet,
    nsmn,
    peer_at2,
    simcenter_event,
    ucgmsim_text,
    unam,
    usgs_smc,
)
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text_file import read_text
from rbfrag.motions.units import acceleration_unit

READERS: tuple[ModuleType, ...] = (
    peer_at2,
    geonet_v2a,
    csmip_v2,
    cosmos,
    cdmg_v1,
    bhrc_v1,
    knet,
    esm_asc,
    cwb,
    unam,
    nsmn,
    usgs_smc,
    simcenter_event,
    ucgmsim_text,
    delimited_text,
)
"""One module a format, asked in this order; plain text, which has no mark of its own, last."""

HEAD_CHARACTERS = 4096


def read_motions(
    path: str | os.PathLike[str], *, units: str | None = None, dt_s: float | None = None
) -> list[GroundMotion]:
    """Return every acceleration trace of a file, as the file has it.

    Args:
        path: a file in any of the formats of :data:`READERS`.
        units: unit of acceleration, for text files that do not state it: ``g``, ``m/s2``,
            ``cm/s2`` or ``mm/s2``. Refused where the file states another.
        dt_s: sampling interval [s], for text files that hold accelerations only.

    Raises:
        MotionFileError: the file cannot be read; the message names the line.
        UnknownFormatError: no reader recognises its content.
        InputError: an unknown unit, or a dt that is not positive.
    """
    file = Path(path)
    if units is not None:
        acceleration_unit(units)
    if dt_s is not None and not 0.0 < dt_s < float("inf"):
        raise InputError(f"--dt must be a positive number of seconds, not {dt_s:g}")
    text = read_text(file)
    head = text[:HEAD_CHARACTERS]
    for reader in READERS:
        if reader.recognises(head):
            motions: list[GroundMotion] = reader.read(file, text, units=units, dt_s=dt_s)
            return motions
    formats = ", ".join(reader.FORMAT for reader in READERS)
    raise UnknownFormatError(
        file, f"no known format of accelerogram: known are {formats}; convert the record to one"
    )


def read_motion(
    text: str | os.PathLike[str], *, units: str | None = None, dt_s: float | None = None
) -> GroundMotion:
    """Return one trace, named as ``FILE`` or ``FILE#trace_index``.

    Args:
        text: a path; for a file of several traces with ``#`` and the index, from 0.
        units: as for :func:`read_motions`.
        dt_s: as for :func:`read_motions`.

    Raises:
        MotionFileError: the file cannot be read, has several traces and no index is given,
            or has no trace of that index.
    """
    name = os.fspath(text)
    index: int | None = None
    stem, mark, tail = name.rpartition("#")
    # int() refuses thousands of digits, and exists() names that are too long
    if mark and tail.isascii() and tail.isdigit() and len(tail) < 10 and not _is_file(name):
        name, index = stem, int(tail)
    motions = read_motions(name, units=units, dt_s=dt_s)
    if index is None and len(motions) == 1:
        return motions[0]
    if index is not None and index < len(motions):
        return motions[index]
    listed = ", ".join(f"#{motion.trace_index} {motion.component}" for motion in motions)
    trouble = f"holds {len(motions)} traces" if index is None else f"has no trace #{index}"
    raise MotionFileError(
        name, f"the file {trouble}: name one of  {listed}  as {name}#0, for example"
    )


def _is_file(name: str) -> bool:
    try:
        return Path(name).exists()
    except OSError:
        return False
