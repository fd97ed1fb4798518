"""What counts as failure of a stored combination, and its displacements."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Sequence
from typing import Any

from sqlalchemy import Row, RowMapping

# What summing the displacements of thousands of samples rounds by, over the greatest of them.
_ROUNDING = 1e-9


def fails_by_outcome(settings: str) -> bool:
    """Return whether failure is the outcome itself, not a stated rotation or displacement."""
    try:
        stated = json.loads(settings)
        return stated.get("rotation_deg") is None and stated.get("displacement_m") is None
    except (ValueError, AttributeError):
        return True  # its own finding


def displacement_problems(row: RowMapping, points: Sequence[Row[Any]]) -> Iterator[str]:
    """Yield what cannot be of blocks that slide: displacements fall with strength.

    Args:
        row: the combination.
        points: its rows of `simulation`, by rising k_y/PGA.
    """
    slid = [(p.kr_over_pga, p.displacement_m) for p in points if p.displacement_m is not None]
    most = max((d for _, d in slid), default=0.0)
    for (weak, far), (strong, near) in itertools.pairwise(slid):
        if near > far + _ROUNDING * most:
            yield (
                f"a block of ky/PGA {strong!r} slides {near!r} m, further than the {far!r} m of a "
                f"weaker one, ky/PGA {weak!r}"
            )
    if (
        slid
        and row["status"] == "found"
        and json.loads(row["settings"]).get("displacement_m") == 0.0
    ):
        for k, d in slid:
            if d > 0.0 and k >= row["kr_over_pga"]:
                yield f"a block of ky/PGA {k!r} slides, yet none moves from {row['kr_over_pga']!r}"
