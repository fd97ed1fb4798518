"""Map of the probability of toppling in one earthquake, with coasts and borders.

Coasts and borders are those of Natural Earth 1:10m, simplified (benchmarks/coastline.py).
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written, write_near
from rbfrag.solver.results import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable


LEAST = 1e-3
"""Smaller probabilities are left white."""

_KM_PER_DEGREE = 111.195


@canvas.in_own_style
def plot_shakemap(
    lon: FloatArray,
    lat: FloatArray,
    probability: FloatArray,
    path: canvas.Out,
    *,
    title: str,
    epicentre: tuple[float, float] | None = None,
    shape: tuple[int, int] | None = None,
) -> canvas.Picture:
    """Draw probabilities at nodes or blocks on a map with coast, colour bar, epicentre and scale.

    Args:
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).
        probability: probabilities, NaN where there is none, shape (n,).
        epicentre: longitude and latitude of the epicentre [deg].
        shape: rows and columns if the places are the nodes of a whole grid; points otherwise.
    """
    canvas.plot_path(path)
    if not np.isfinite(probability).any():
        raise InputError("no probability to draw")
    if shape is None:
        lon, lat, probability = (
            column[np.isfinite(probability)] for column in (lon, lat, probability)
        )
    west, east, south, north = _frame(lon, lat, probability, epicentre)
    middle = math.cos(math.radians(0.5 * (south + north)))
    wide = max((east - west) * middle, 1e-3)
    tall = max(north - south, 1e-3)
    height = min(max(6.0 * tall / wide, 3.2), 8.0)
    figure = canvas.new_figure(7.2, height + 0.6)
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import FuncFormatter

    axes = figure.add_subplot()
    colours = colormaps["YlOrRd"].with_extremes(under="white")
    norm = LogNorm(LEAST, 1.0)
    shown = np.where(np.isfinite(probability), np.maximum(probability, 1e-12), np.nan)
    drawn: ScalarMappable
    if shape is not None:
        drawn = axes.pcolormesh(
            lon.reshape(shape), lat.reshape(shape), np.ma.masked_invalid(shown.reshape(shape)),
            cmap=colours, norm=norm, shading="nearest", rasterized=True,
        )  # fmt: skip
    else:
        drawn = axes.scatter(
            lon, lat, c=shown, cmap=colours, norm=norm, s=22, edgecolors="#555555", linewidths=0.4
        )
    if epicentre is not None:
        axes.plot(*epicentre, marker="*", ms=15, mfc="white", mec="black", mew=1.2, ls="none",
                  label="epicentre")  # fmt: skip
        inside = west <= epicentre[0] <= east and south <= epicentre[1] <= north
        if inside:
            axes.legend(loc="upper right", fontsize=9, framealpha=0.9)
    axes.set(xlim=(west, east), ylim=(south, north), aspect=1.0 / middle)
    draw_coast(axes, west, east, south, north)
    width_km = (east - west) * middle * _KM_PER_DEGREE
    if width_km > 0.0:  # a scale bar of about a quarter of the map
        unit = 10.0 ** math.floor(math.log10(0.25 * width_km))
        length = max(step * unit for step in (1.0, 2.0, 5.0) if step * unit <= 0.25 * width_km)
        width = length / (_KM_PER_DEGREE * middle)
        x, y = west + 0.05 * (east - west), south + 0.06 * (north - south)
        axes.plot([x, x + width], [y, y], color="black", lw=3.0, solid_capstyle="butt", zorder=5)
        write_near(axes, f"{length:g} km", (x + 0.5 * width, y), (0, 4), movable=False, fontsize=9)
    axes.set(xlabel="longitude [°]", ylabel="latitude [°]")
    lines = (as_written(line, 65) for line in title.splitlines())
    axes.set_title("\n".join(lines), fontsize=10)
    bar = figure.colorbar(drawn, ax=axes, extend="min", label="probability of toppling", shrink=0.9)
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    return canvas.save_figure(figure, path)


def _frame(
    lon: FloatArray, lat: FloatArray, probability: FloatArray, epicentre: tuple[float, float] | None
) -> tuple[float, float, float, float]:
    """Return west, east, south and north limits of all coloured locations, within the data."""
    shown = probability >= LEAST
    if not shown.any():
        shown = np.ones(lon.shape, dtype=bool)
    x, y = lon[shown], lat[shown]
    if epicentre is not None:
        near = lon.min() <= epicentre[0] <= lon.max() and lat.min() <= epicentre[1] <= lat.max()
        if near:
            x, y = np.append(x, epicentre[0]), np.append(y, epicentre[1])
    margin = max(0.2 * float(np.ptp(x)), 0.2 * float(np.ptp(y)), 0.05)
    rim = 0.02 * max(float(np.ptp(lon)), float(np.ptp(lat)), 0.1)
    return (
        max(float(x.min()) - margin, float(lon.min()) - rim),
        min(float(x.max()) + margin, float(lon.max()) + rim),
        max(float(y.min()) - margin, float(lat.min()) - rim),
        min(float(y.max()) + margin, float(lat.max()) + rim),
    )


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
