"""The coast behind maps lies where coasts are."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from rbfrag.plots.shakemap import draw_coast, world


@pytest.mark.parametrize(
    ("lon", "lat", "border"),
    [
        (18.473, -34.357, False),  # Cape of Good Hope
        (-9.500, 38.780, False),  # Cabo da Roca
        (-70.0, 49.0, None),  # land or sea far from any line, see below
        (172.68, -34.43, False),  # Cape Reinga
        (-117.123, 32.534, True),  # where the border of the United States and Mexico meets the sea
    ],
)
def test_known_places_lie_on_a_line(lon: float, lat: float, border: bool | None) -> None:
    lines = world()
    of = np.repeat(lines.is_border, np.diff(lines.starts))
    off = np.hypot((lines.lonlat[:, 0] - lon) * np.cos(np.radians(lat)), lines.lonlat[:, 1] - lat)
    if border is None:
        assert off.min() > 0.2
    else:
        assert off[of == border].min() < 0.05


def test_no_line_runs_along_the_seam_or_jumps_across_the_world() -> None:
    lines = world()
    steps = np.diff(lines.lonlat, axis=0)
    inside = np.ones(len(steps), dtype=bool)
    inside[lines.starts[1:-1] - 1] = False
    seam = (np.abs(lines.lonlat[1:, 0]) > 179.99) & (np.abs(lines.lonlat[:-1, 0]) > 179.99)
    assert not (seam & inside).any()
    assert np.abs(steps[inside]).max() < 30.0  # along the 49th parallel
    assert np.abs(lines.lonlat).max(axis=0) == pytest.approx([180.0, 83.6], abs=0.2)


def test_a_map_across_the_date_line_has_both_sides() -> None:
    axes = Figure().add_subplot()
    west = draw_coast(axes, 177.0, 179.9, -20.0, -15.0)
    east = draw_coast(axes, 180.1, 183.0, -20.0, -15.0)
    both = draw_coast(axes, 177.0, 183.0, -20.0, -15.0)
    assert min(west, east) > 0
    assert max(west, east) < both
    assert draw_coast(axes, -40.0, -35.0, 20.0, 25.0) == 0  # the open Atlantic
