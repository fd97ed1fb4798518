"""Coasts and borders behind a map: Natural Earth 1:10m, simplified (benchmarks/coastline.py)."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FILE = Path(__file__).with_name("world") / "coast.npz"

_TURN_DEG = 360.0


class Lines(NamedTuple):
    """Polylines on the globe, one after the other.

    Args:
        lonlat: their points [deg], shape (n, 2).
        starts: where each line begins, and n at the end, shape (m + 1,).
        is_border: whether a line parts two countries, and not land from sea, shape (m,).
    """

    lonlat: NDArray[np.float64]
    starts: NDArray[np.int64]
    is_border: NDArray[np.bool_]


@cache
def world() -> Lines:
    """Return all coasts north of Antarctica, and all borders, to 450 m."""
    with np.load(_FILE) as file:
        starts = np.concatenate([[0], np.cumsum(file["lengths"])])
        # the first step of each line is its own beginning
        points = np.cumsum(file["steps"].T, axis=0)
        before = np.concatenate([[[0, 0]], points[starts[1:-1] - 1]])
        points -= np.repeat(before, file["lengths"], axis=0)
        lonlat = points * file["scale"] + file["translate"]
        return Lines(lonlat, starts, file["is_border"])


def draw_coast(axes: Axes, west: float, east: float, south: float, north: float) -> int:
    """Draw the coasts, and with thinner lines the borders, of a region.

    Args:
        axes: axes of longitude and latitude.
        west: western edge [deg]; longitudes beyond 180 or below -180 are taken round the globe.
        east: eastern edge [deg].
        south: southern edge [deg].
        north: northern edge [deg].

    Returns:
        How many lines there are.
    """
    from matplotlib.collections import LineCollection

    lines = world()
    drawn = 0
    for border, style in (
        (False, {"colors": "#222222", "linewidths": 0.9}),
        (True, {"colors": "#555555", "linewidths": 0.6, "linestyles": (0, (5, 3))}),
    ):
        shown = []
        for turn in (-_TURN_DEG, 0.0, _TURN_DEG):
            at = lines.lonlat + np.array([turn, 0.0])
            low = np.minimum.reduceat(at, lines.starts[:-1])
            high = np.maximum.reduceat(at, lines.starts[:-1])
            near = (lines.is_border == border) & (low <= [east, north]).all(axis=1)
            near &= (high >= [west, south]).all(axis=1)
            shown += [at[lines.starts[i] : lines.starts[i + 1]] for i in near.nonzero()[0]]
        if shown:
            axes.add_collection(LineCollection(shown, zorder=3, **style), autolim=False)
        drawn += len(shown)
    return drawn
