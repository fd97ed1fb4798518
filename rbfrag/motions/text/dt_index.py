"""The sampling interval of lists of bare accelerations, from ``dt_index.txt`` beside them.

FEMA P-695 sets give one acceleration a line and name the interval of each file in an index::

    120111.th   0.01
    120621.th   0.005
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.text.file import read_text
from rbfrag.motions.text.header import Field, positive_number

INDEX = "dt_index.txt"


@dataclass(frozen=True)
class IndexedInterval:
    """What an index says of a file.

    Args:
        dt_s: sampling interval [s].
        source: the index and its line, for messages and remarks.
    """

    dt_s: float
    source: str


def indexed_interval(path: Path) -> IndexedInterval | None:
    """Return the interval that the index beside a file gives it; None if there is none.

    Args:
        path: the file of accelerations; it is looked up by its name.

    Raises:
        MotionFileError: the index cannot be read, or gives the file two intervals.
    """
    index = path.parent / INDEX
    if not index.is_file():
        return None
    found: IndexedInterval | None = None
    for number, line in enumerate(read_text(index).split("\n"), 1):
        fields = line.split()
        if len(fields) != 2 or fields[0] != path.name:
            continue
        dt = positive_number(index, Field(fields[1], number), "dt")
        if found is not None and found.dt_s != dt:
            raise MotionFileError(
                index,
                f"{path.name} has dt = {dt:g} s here, but {found.dt_s:g} s in {found.source}: "
                "keep one line",
                line=number,
            )
        found = found or IndexedInterval(dt, f"{INDEX}, line {number}")
    return found
