"""K-NET and KiK-net ASCII (NIED, Japan): counts of one component below named header lines.

Acceleration in gal = count x numerator / denominator of ``Scale Factor``, less the mean of the
record, which is the instrument's offset. KiK-net gives a channel number as direction: 1 to 3 in
the borehole, 4 to 6 at the surface, each north-south, east-west, up-down.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from rbfrag.motions.polarity import FloatArray
from rbfrag.motions.record_file import Count, HeaderField, ParsedTrace, RecordFile, peak_of

FORMAT = "K-NET/KiK-net ASCII"

NAME_CHARACTERS = 18
"""Width of the field names at the left of the header."""

LAST_FIELD = "Memo."

LARGEST_COUNT = 2.0**31

LARGEST_SCALE = 1e3
"""Gal a count; digitisers resolve thousandths."""

_CHANNELS = {
    "1": "NS1", "2": "EW1", "3": "UD1", "4": "NS2", "5": "EW2", "6": "UD2",
}  # fmt: skip
_BOREHOLE = frozenset({"1", "2", "3"})

_HEAD = re.compile(r"Origin Time\b(?s:.)*^Sampling Freq\(Hz\)", re.MULTILINE)
_SCALE = re.compile(r"([\d.]+)\s*\(\s*([^)\s]+)\s*\)\s*/\s*([\d.]+)", re.ASCII)

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the only trace of a file."""
    fields, first = _header(file)

    def field(name: str) -> HeaderField:
        if name not in fields:
            raise file.error(f"the header has no {name!r}: export the record again", 1)
        return fields[name]

    rate = field("Sampling Freq(Hz)")
    rate = HeaderField(rate.text.removesuffix("Hz").strip(), rate.line)
    frequency_hz = file.positive(rate, "sampling frequency")
    dt = file.possible_dt(1.0 / frequency_hz, rate.line)
    scale, unit = _scale(file, field("Scale Factor"))
    counts = file.free_numbers(file.lines[first:], first + 1, "count")
    duration = field("Duration Time(s)")
    seconds = file.positive(duration, "duration")
    _reject_large(file, counts, first)
    # a file without any is rejected by its number of samples
    offset = float(counts.mean()) if counts.size else 0.0

    direction = field("Dir.").text
    component = _CHANNELS.get(direction, direction)
    station = field("Station Code").text
    remarks = [
        f"the mean of {offset:.6g} counts, the offset of the instrument, was subtracted as the "
        "format asks; this is no baseline correction"
    ]
    if direction in _BOREHOLE:
        remarks.append("this is the borehole sensor, below the surface")
    recorded = fields.get("Record Time", field("Origin Time")).text
    yield ParsedTrace(
        counts - offset,
        dt,
        unit,
        Count(seconds * frequency_hz, duration.line, seconds=seconds),
        component,
        scale,
        station=station,
        event=f"{field('Origin Time').text} JST",
        recording=f"{station} {recorded}{' borehole' if direction in _BOREHOLE else ''}",
        start=recorded,
        is_corrected=False,
        remarks=tuple(remarks),
        peak=peak_of(fields.get("Max. Acc. (gal)"), "gal"),
    )


def _reject_large(file: RecordFile, counts: FloatArray, first: int) -> None:
    if np.abs(counts).max(initial=0.0) <= LARGEST_COUNT:
        return
    for at in range(first, len(file.lines)):
        for token in file.lines[at].split():
            if abs(float(token)) > LARGEST_COUNT:
                raise file.error(
                    f"a count of {token} is beyond 32 bits: repair the line or download the "
                    "record again",
                    at + 1,
                )


def _header(file: RecordFile) -> tuple[dict[str, HeaderField], int]:
    """Fields by name, and the index of the first line of counts."""
    fields: dict[str, HeaderField] = {}
    for at, line in enumerate(file.lines):
        name = line[:NAME_CHARACTERS].strip()
        fields[name] = HeaderField(line[NAME_CHARACTERS:].strip(), at + 1)
        if name == LAST_FIELD:
            return fields, at + 1
    raise file.error(f"the header does not end with {LAST_FIELD!r}: export the record again", 1)


def _scale(file: RecordFile, field: HeaderField) -> tuple[float, HeaderField]:
    """Units of acceleration a count, and the unit."""
    match = _SCALE.fullmatch(field.text)
    if not match:
        raise file.error(
            f"the scale factor {field.text!r} is not of the form 7845(gal)/8223790", field.line
        )
    numerator = file.positive(HeaderField(match[1], field.line), "scale factor's numerator")
    denominator = file.positive(HeaderField(match[3], field.line), "scale factor's denominator")
    if numerator > LARGEST_SCALE * denominator:
        raise file.error(
            f"the scale factor {field.text!r} is more than {LARGEST_SCALE:g} a count", field.line
        )
    return numerator / denominator, HeaderField(match[2], field.line)
