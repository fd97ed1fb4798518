"""Text of one component a file (``.000``, ``.090``, ``.ver``), as ucgmsim and EMOD3D write it.

Line 1 names station and component, line 2 has npts, dt and six numbers more, then 6 values a
line. Observed records are in g and simulated ones often in cm/s², and no file says which.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import free_numbers, sample_count
from rbfrag.motions.text.header import (
    Field,
    agreed_dt,
    other_count,
    positive_number,
    stated_unit_in_g,
)

FORMAT = "GeoNet text (.000/.090/.ver)"

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_HEAD = re.compile(
    r"[ \t]*(?P<station>\S+)[ \t]+(?P<component>[^\W_]{1,8})(?:[ \t][^\n]*)?\n"
    rf"[ \t]*(?P<npts>\d+)[ \t]+(?P<dt>{_NUMBER})(?:[ \t]+[+-]?\d+){{2}}"
    rf"(?:[ \t]+{_NUMBER}){{4}}[ \t]*(?:\n|$)",
    re.ASCII,
)


def recognises(head: str) -> bool:
    """Return whether two names stand above a line of eight numbers."""
    return bool(_HEAD.match(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the one motion of a file.

    Args:
        path: for labels and messages; its stem, which the three components share, is the
            recording id, as the file names no event.
        text: the file's text.
        units: unit of acceleration, which the file does not state.
        dt_s: sampling interval that the caller states [s]; refused when the file has another.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: no unit is stated, or a header or value cannot be used.
    """
    head = _HEAD.match(text)
    assert head is not None, "read() is called for recognised text only"
    npts = sample_count(path, head["npts"], 2, "number of points")
    dt = agreed_dt(path, positive_number(path, Field(head["dt"], 2), "dt"), 2, dt_s)
    factor = stated_unit_in_g(path, units)
    values = free_numbers(path, text.split("\n")[2:], 3, "acceleration")
    remarks = other_count(path, npts, values.size, 2, allow_partial=allow_partial)
    return [
        GroundMotion(
            values * factor,
            dt,
            station=head["station"],
            component=head["component"],
            orientation_deg=azimuth_deg(head["component"]),
            is_vertical=is_vertical_name(head["component"]),
            recording=path.stem,
            source_file=path.name,
            file_format=FORMAT,
            remarks=remarks,
            is_partial=bool(remarks),
        )
    ]
