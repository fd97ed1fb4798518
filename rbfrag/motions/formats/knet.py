"""K-NET and KiK-net ASCII (NIED, Japan): counts of one component below named header lines.

Acceleration in gal = count x numerator / denominator of ``Scale Factor``, less the mean of the
record, which is the instrument's offset. KiK-net gives a channel number as direction: 1 to 3 in
the borehole, 4 to 6 at the surface, each north-south, east-west, up-down.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.clock import first_sample_time
from rbfrag.motions.text.file import free_numbers
from rbfrag.motions.text.header import (
    Field,
    agreed_dt,
    agreed_unit_in_g,
    other_count,
    positive_number,
)

FORMAT = "K-NET/KiK-net ASCII"

NAME_CHARACTERS = 18
"""Width of the field names at the left of the header."""

LAST_FIELD = "Memo."

LARGEST_COUNT = 2.0**31

LARGEST_SCALE = 1e3
"""Gal a count; digitisers resolve thousandths."""

_CHANNELS = {
    "1": ("NS1", "N-S"), "2": ("EW1", "E-W"), "3": ("UD1", "U-D"),
    "4": ("NS2", "N-S"), "5": ("EW2", "E-W"), "6": ("UD2", "U-D"),
}  # fmt: skip
_BOREHOLE = frozenset({"1", "2", "3"})

_HEAD = re.compile(r"Origin Time\b(?s:.)*^Sampling Freq\(Hz\)", re.MULTILINE)
_SCALE = re.compile(r"([\d.]+)\s*\(\s*([^)\s]+)\s*\)\s*/\s*([\d.]+)", re.ASCII)


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a K-NET or KiK-net file."""
    return bool(_HEAD.match(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the one motion of a file.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused unless it is that of the scale factor.
        dt_s: sampling interval that the caller states [s]; refused when the file has another.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    fields, first = _header(path, lines)

    def field(name: str) -> Field:
        if name not in fields:
            raise MotionFileError(
                path, f"the header has no {name!r}: export the record again", line=1
            )
        return fields[name]

    rate = field("Sampling Freq(Hz)")
    rate = Field(rate.text.removesuffix("Hz").strip(), rate.line)
    frequency_hz = positive_number(path, rate, "sampling frequency")
    dt = agreed_dt(path, 1.0 / frequency_hz, rate.line, dt_s)
    gal = _scale_in_g(path, field("Scale Factor"), units)
    counts = free_numbers(path, lines[first:], first + 1, "count")
    duration = field("Duration Time(s)")
    stated = positive_number(path, duration, "duration") * frequency_hz
    partial = other_count(path, stated, counts.size, duration.line, allow_partial=allow_partial)
    _refuse_large(path, lines, counts, first)
    offset = float(counts.mean())

    direction = field("Dir.").text
    component, axis = _CHANNELS.get(direction, (direction, direction))
    station = field("Station Code").text
    remarks = [
        f"the mean of {offset:.6g} counts, the offset of the instrument, was subtracted as the "
        "format asks; this is no baseline correction"
    ]
    if direction in _BOREHOLE:
        remarks.append("this is the borehole sensor, below the surface")
    recorded = fields.get("Record Time", field("Origin Time")).text
    return [
        GroundMotion(
            (counts - offset) * gal,
            dt,
            station=station,
            event=f"{field('Origin Time').text} JST",
            component=component,
            orientation_deg=azimuth_deg(axis),
            is_vertical=is_vertical_name(axis),
            recording=f"{station} {recorded}{' borehole' if direction in _BOREHOLE else ''}",
            source_file=path.name,
            file_format=FORMAT,
            is_corrected=False,
            start_time=first_sample_time(recorded),
            remarks=(*remarks, *partial),
            is_partial=bool(partial),
        )
    ]


def _refuse_large(path: Path, lines: list[str], counts: NDArray[np.float64], first: int) -> None:
    if np.abs(counts).max() <= LARGEST_COUNT:
        return
    for at in range(first, len(lines)):
        for token in lines[at].split():
            if abs(float(token)) > LARGEST_COUNT:
                raise MotionFileError(
                    path,
                    f"a count of {token} is beyond 32 bits: repair the line or download the "
                    "record again",
                    line=at + 1,
                )


def _header(path: Path, lines: list[str]) -> tuple[dict[str, Field], int]:
    """Fields by name, and the index of the first line of counts."""
    fields: dict[str, Field] = {}
    for at, line in enumerate(lines):
        name = line[:NAME_CHARACTERS].strip()
        fields[name] = Field(line[NAME_CHARACTERS:].strip(), at + 1)
        if name == LAST_FIELD:
            return fields, at + 1
    raise MotionFileError(
        path, f"the header does not end with {LAST_FIELD!r}: export the record again", line=1
    )


def _scale_in_g(path: Path, field: Field, units: str | None) -> float:
    found = _SCALE.fullmatch(field.text)
    if not found:
        raise MotionFileError(
            path,
            f"the scale factor {field.text!r} is not of the form 7845(gal)/8223790",
            line=field.line,
        )
    unit_in_g = agreed_unit_in_g(path, Field(found[2], field.line), units)
    numerator = positive_number(path, Field(found[1], field.line), "scale factor's numerator")
    denominator = positive_number(path, Field(found[3], field.line), "scale factor's denominator")
    if numerator > LARGEST_SCALE * denominator:
        raise MotionFileError(
            path,
            f"the scale factor {field.text!r} is more than {LARGEST_SCALE:g} a count",
            line=field.line,
        )
    return numerator / denominator * unit_in_g
