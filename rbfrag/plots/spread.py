"""Places of labels that would stand too close to each other."""

from __future__ import annotations

import math
from collections.abc import Sequence


def spread_out(
    places: Sequence[float], apart: float, lowest: float = -math.inf, highest: float = math.inf
) -> list[float]:
    """Return the places moved as little as keeps neighbours apart, in their order.

    Args:
        places: where the labels belong, rising.
        apart: least distance, in the unit of the places.
        lowest: no label stands below this, if there is room for all.
        highest: nor above this.
    """
    highest -= (len(places) - 1) * apart
    # labels that touch move as one group, to the mean of where its members belong
    groups: list[tuple[float, int]] = []
    for number, place in enumerate(places):
        start, count = place - number * apart, 1
        while groups and groups[-1][0] > start:
            before, members = groups.pop()
            start = (before * members + start * count) / (members + count)
            count += members
        groups.append((start, count))
    starts = [min(max(start, lowest), highest) for start, count in groups for _ in range(count)]
    return [start + number * apart for number, start in enumerate(starts)]
