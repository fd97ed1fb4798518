"""Text of one component a file (``.000``, ``.090``, ``.ver``), as ucgmsim and EMOD3D write it.

Line 1 names station and component, line 2 has npts, dt and six numbers more, then 6 values a
line. Observed records are in g and simulated ones often in cm/s², and no file says which.
"""

from __future__ import annotations

import re

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.record_file import Field, RecordFile

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


def read(file: RecordFile) -> list[GroundMotion]:
    """Return the one motion of a file.

    The stem of its name, which the three components share, is the recording id: the file names
    no event.
    """
    head = _HEAD.match(file.text)
    assert head is not None, "read() is called for recognised text only"
    npts = file.count(Field(head["npts"], 2), "number of points")
    dt = file.dt(Field(head["dt"], 2))
    factor = file.stated_unit_in_g()
    values = file.free_numbers(file.lines[2:], 3, "acceleration")
    return [
        file.motion(
            values * factor,
            dt,
            station=head["station"],
            component=head["component"],
            recording=file.path.stem,
            remarks=file.remarks(npts, values.size, 2),
        )
    ]
