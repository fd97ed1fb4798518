"""CSMNC (China): 15 or so header lines, a blank one, then 8 values a line, one component a file.

The header states unit, number of samples, interval, duration and peak in its text::

    UNCORRECTED ACCELERATION          UNIT: CM/SEC/SEC
    NO. OF POINTS:  8008  EQUALLY SPACED INTERVALS OF:  0.005  SEC
    PEAK VALUE:    -2.014   AT   20.01 SEC    DURATION:  40.04 SEC

The offset of the instrument is part of an uncorrected record.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import HeaderField, ParsedTrace, PeakField, RecordFile

FORMAT = "CSMNC text"

_HEAD = re.compile(r"(?s:.)*^NO\. OF POINTS:.*EQUALLY SPACED INTERVALS OF:", re.MULTILINE)
_QUANTITY = re.compile(r"^\s*(\S.*?)\s+UNIT:")
_UNIT = re.compile(r"\bUNIT:\s*(\S+)")
_POINTS = re.compile(r"^NO\. OF POINTS:\s*(\S+)")
_INTERVAL = re.compile(r"INTERVALS OF:\s*(\S+)\s+SEC")
_PEAK = re.compile(r"^PEAK VALUE:\s*(\S+)")
_DURATION = re.compile(r"\bDURATION:\s*(\S+)\s+SEC")
_COMPONENT = re.compile(r"^COMP\.\s*(\S+)")
_STATION = re.compile(r"^STATION:\s*(\S+)")
_ORIGIN = re.compile(r"^\d{10,}\s+(\d{4}-.*)")
_EARTHQUAKE = re.compile(r"^(.*\bEARTHQUAKE\b.*)")

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the only trace of a file.

    The time of the recorder is no start of the samples: files differ in the zone and in whether
    it is the trigger's. Components go together by earthquake and station.
    """
    lines = file.lines
    first = next((at for at, line in enumerate(lines) if not line.strip()), len(lines))
    header = range(first)
    quantity = file.find(header, _QUANTITY, "line with 'UNIT:'")
    words = quantity.text.upper().split()
    if "ACCELERATION" not in words:
        raise file.error(
            f"this is a record of {quantity.text.lower()}: the acceleration is required",
            quantity.line,
        )
    unit = file.find(header, _UNIT, "unit of acceleration")
    peak = file.optional(header, _PEAK) or HeaderField("", unit.line)
    origin, name = file.label(header, _ORIGIN), file.label(header, _EARTHQUAKE)
    yield ParsedTrace(
        file.free_numbers(file.lines[first:], first + 1, "acceleration"),
        file.dt(file.find(header, _INTERVAL, "sampling interval")),
        unit,
        file.count(file.find(header, _POINTS, "number of points"), "number of points"),
        component=file.find(header, _COMPONENT, "line 'COMP.'").text,
        station=file.label(header, _STATION),
        event=f"{name} {origin}".strip(),
        is_corrected={"UNCORRECTED": False, "CORRECTED": True}.get(words[0]),
        durations=(file.optional(header, _DURATION),),
        peak=PeakField(peak.text, unit.text, peak.line),
    )
