"""ESM ASC (DYNA 1.2 header): lines ``KEY: value``, then one value a line, one component a file."""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.clock import first_sample_time
from rbfrag.motions.text.file import sample_count, table_numbers, without_blank_end
from rbfrag.motions.text.header import (
    NamedFields,
    agreed_dt,
    agreed_unit_in_g,
    other_count,
    positive_number,
)

FORMAT = "ESM ASC"

_HEAD = re.compile(r"EVENT_NAME:(?s:.)*^SAMPLING_INTERVAL_S:", re.MULTILINE)
_KEY = re.compile(r"[A-Z][^:\s]*:")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of an ESM file."""
    return bool(_HEAD.match(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the one motion of a file.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused when the file states another.
        dt_s: sampling interval that the caller states [s]; likewise.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    first = next((at for at, line in enumerate(lines) if not _KEY.match(line)), len(lines))
    fields = NamedFields(path, lines, range(first))
    kind = fields.text("DATA_TYPE")
    if kind and kind.upper() != "ACCELERATION":
        raise MotionFileError(
            path,
            f"this is a record of {kind.lower()}: the acceleration is needed",
            line=fields["DATA_TYPE"].line,
        )
    interval = fields["SAMPLING_INTERVAL_S"]
    dt = agreed_dt(path, positive_number(path, interval, "dt"), interval.line, dt_s)
    factor = agreed_unit_in_g(path, fields["UNITS"], units)
    stated = fields["NDATA"]
    npts = sample_count(path, stated.text, stated.line, "NDATA")
    rows = without_blank_end(lines[first:])
    values = table_numbers(path, rows, first + 1, 1, "acceleration")[:, 0]
    remarks = other_count(path, npts, values.size, stated.line, allow_partial=allow_partial)
    component = fields["STREAM"].text
    network = fields.text("NETWORK")
    station = f"{network}.{fields['STATION_CODE'].text}".lstrip(".")
    event = fields.text("EVENT_NAME") or fields.text("EVENT_ID")
    return [
        GroundMotion(
            values * factor,
            dt,
            station=station,
            event=event,
            component=component,
            orientation_deg=azimuth_deg(component),
            is_vertical=is_vertical_name(component),
            recording=f"{event} {station}".strip(),
            source_file=path.name,
            file_format=FORMAT,
            remarks=remarks,
            is_partial=bool(remarks),
            is_corrected=_is_corrected(fields.text("BASELINE_CORRECTION")),
            start_time=first_sample_time(fields.text("DATE_TIME_FIRST_SAMPLE_YYYYMMDD")),
        )
    ]


def _is_corrected(baseline: str) -> bool | None:
    """`BASELINE REMOVED` or `BASELINE NOT REMOVED`; None where the header does not say."""
    words = baseline.upper().split()
    return None if "REMOVED" not in words else "NOT" not in words
