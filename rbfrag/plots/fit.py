"""Figure of a fitted model: critical blocks against intensity, with the failure lines."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.straight_line import mean_m_s, variance_m2_s2
from rbfrag.plots.canvas import new_figure, plot_path, save_figure

_LINES = (
    (1.959963984540054, "--", "#b2182b", "2.5 % probability of failure"),
    (0.0, "-", "black", "mean critical velocity"),
    (-1.959963984540054, "-.", "#2166ac", "97.5 % probability of failure"),
)


def plot_fit(table: CombinationTable, model: FragilityModel, path: str | PathLike[str]) -> Path:
    """Draw critical toppling velocities against intensity with the lines of a model.

    A block above the upper line fails with less than 2.5 % probability, one below the lower
    line with more than 97.5 %.

    Args:
        table: the critical values.
        model: a model of method ``wls``.
        path: file to write: .png, .pdf or .svg.

    Returns:
        The path.

    Raises:
        InputError: nothing to draw, a model of another method, or a path that cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    plot_path(path)
    if model.row.method != "wls":
        raise InputError(
            f"model {model.name!r} is fitted by {model.row.method!r}: the figure of a fit draws "
            "models of method 'wls'"
        )
    term = model.term
    x = np.asarray(
        term.intensity_m_s({name: getattr(table, name) for name in term.inputs}), dtype=np.float64
    )
    shown = (table.status == "found") & np.isfinite(x) & np.isfinite(table.y_m_s)
    if not shown.any():
        raise InputError(
            f"there is no critical value with the term {term.name} to draw: run  rbfrag simulate"
        )
    figure = new_figure(7.6, 5.6)
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    x, y = x[shown], table.y_m_s[shown]
    right = 1.03 * float(x.max())
    line_x = np.linspace(0.0, right, 400)
    mean, sigma = (
        mean_m_s(model.parameters, line_x),
        np.sqrt(variance_m2_s2(model.parameters, line_x)),
    )
    # The data fill the sheet; a line far above them may leave it.
    highest = float((mean + _LINES[0][0] * sigma).max())
    top = max(float(y.max()), min(highest, 1.3 * float(y.max()))) * 1.05

    axes = figure.add_subplot()
    # Neither white for a single block nor so dark that a line disappears.
    greys = ListedColormap(colormaps["Greys"](np.linspace(0.18, 0.72, 256)))
    # As many cells upwards as make the hexagons regular on the sheet.
    cells = axes.hexbin(
        x,
        y,
        gridsize=(60, 25),
        extent=(0.0, right, 0.0, top),
        mincnt=1,
        cmap=greys,
        linewidths=0.2,
    )
    most = max(int(np.asarray(cells.get_array()).max()), 2)
    cells.set_norm(LogNorm(1, most))
    for factor, style, colour, words in _LINES:
        line = mean + factor * sigma
        label = words if line.max() > 0.01 * top else f"{words}\n(near or below zero)"
        axes.plot(line_x, line, style, color=colour, linewidth=1.8, label=label)
    axes.set_xlim(0.0, right)
    axes.set_ylim(0.0, top)
    axes.set_xlabel(term.label)
    axes.set_ylabel("critical toppling velocity of the block, $y = k_r\\,g/p$ [m/s]")
    n_events = len(set(table.event_id[shown].tolist()))
    n_censored = int(np.isin(table.status.astype(str), ("below_limit", "no_motion")).sum())
    axes.set_title(
        f"{model.name}: {x.size} critical blocks of {n_events} earthquakes\n"
        f"not shown: {n_censored} whose critical block lies below the search limit",
        fontsize=10,
    )
    figure.legend(loc="outside lower center", ncols=len(_LINES), fontsize=8.5, frameon=False)
    bar = figure.colorbar(cells, ax=axes, label="critical blocks per cell")
    ticks = [t * 10**k for k in range(7) for t in (1, 2, 5) if t * 10**k <= most]
    bar.ax.yaxis.set_major_locator(FixedLocator(ticks))
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    return save_figure(figure, path)
