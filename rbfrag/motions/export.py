"""Motions as files: rbfrag's own CSV, which keeps every label, or PEER AT2."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rbfrag.errors import InputError
from rbfrag.files import written_whole
from rbfrag.motions.formats import peer_at2, rbfrag_csv
from rbfrag.motions.ground_motion import GroundMotion

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
