"""Text of one component a file (``.000``, ``.090``, ``.ver``), as ucgmsim and EMOD3D write it.

Line 1 names station and component, line 2 has npts, dt and six numbers more, then 6 values a
line. Observed records are in g and simulated ones often in cm/s², and no file says which.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile

FORMAT = "GeoNet text (.000/.090/.ver)"

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_HEAD = re.compile(
    r"[ \t]*(?P<station>\S+)[ \t]+(?P<component>[^\W_]{1,8})(?:[ \t][^\n]*)?\n"
    rf"[ \t]*(?P<npts>\d+)[ \t]+(?P<dt>{_NUMBER})(?:[ \t]+[+-]?\d+){{2}}"
    rf"(?:[ \t]+{_NUMBER}){{4}}[ \t]*(?:\n|$)",
    re.ASCII,
)

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the only trace of a file.

    The stem of its name, which the three components share, is the recording id: the file names
    no event.
    """
    head = _HEAD.match(file.text)
    assert head is not None, "parse() is called for recognised text only"
    count = file.count(HeaderField(head["npts"], 2), "number of points")
    dt = file.dt(HeaderField(head["dt"], 2))
    file.require_units("files of this format have")
    yield ParsedTrace(
        file.free_numbers(file.lines[2:], 3, "acceleration"),
        dt,
        None,
        count,
        head["component"],
        station=head["station"],
        recording=file.path.stem,
    )
