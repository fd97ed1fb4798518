"""Clouds of points as shaded cells: thousands of critical blocks stay readable in print."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CELLS_ACROSS = 60
_CELLS_UP = 25
"""As many as make the hexagons regular on a sheet of ordinary shape."""


def density(
    figure: Figure,
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    across: tuple[float, float],
    up: tuple[float, float],
    *,
    beside: Sequence[Axes] = (),
) -> None:
    """Shade hexagons by the number of points in each, on linear or logarithmic axes.

    Args:
        figure: the sheet.
        axes: where to draw; their scales are set before.
        x: abscissae, shape (n,).
        y: ordinates, shape (n,).
        across: limits of the abscissa, which the axes get.
        up: limits of the ordinate.
        beside: other axes that the key of the shades stands to the right of.
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    # Neither white for a single block nor so dark that a line disappears.
    greys = ListedColormap(colormaps["Greys"](np.linspace(0.18, 0.72, 256)))
    scales = axes.get_xscale(), axes.get_yscale()
    extent = [
        float(np.log10(edge)) if scale == "log" else edge
        for edges, scale in ((across, scales[0]), (up, scales[1]))
        for edge in edges
    ]
    cells = axes.hexbin(
        x,
        y,
        gridsize=(_CELLS_ACROSS, _CELLS_UP),
        extent=(extent[0], extent[1], extent[2], extent[3]),
        xscale="log" if scales[0] == "log" else "linear",
        yscale="log" if scales[1] == "log" else "linear",
        mincnt=1,
        cmap=greys,
        linewidths=0.2,
    )
    axes.set_xlim(*across)
    axes.set_ylim(*up)
    most = max(int(np.asarray(cells.get_array()).max(initial=1)), 2)
    cells.set_norm(LogNorm(1, most))
    key = figure.colorbar(cells, ax=[axes, *beside], label="critical blocks per cell")
    ticks = [t * 10**k for k in range(7) for t in (1, 2, 5) if t * 10**k <= most]
    key.ax.yaxis.set_major_locator(FixedLocator(ticks))
    key.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
    key.ax.yaxis.set_minor_locator(NullLocator())
