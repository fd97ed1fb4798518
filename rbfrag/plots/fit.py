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
    figure = new_figure(7.2, 5.4)
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    x, y = x[shown], table.y_m_s[shown]
    right = 1.03 * float(x.max())
    line_x = np.linspace(0.0, right, 400)
    mean, sigma = (
        mean_m_s(model.parameters, line_x),
        np.sqrt(variance_m2_s2(model.parameters, line_x)),
    )
    top = 1.05 * max(float(y.max()), float((mean + _LINES[0][0] * sigma)[-1]))

    axes = figure.add_subplot()
    # Hexagons of the same height as width on the sheet.
    cells = axes.hexbin(
        x,
        y,
        gridsize=(48, 20),
        extent=(0.0, right, 0.0, top),
        mincnt=1,
        cmap="Greys",
        linewidths=0.2,
    )
    counts = np.asarray(cells.get_array())
    most = max(int(counts.max()), 2)
    # From half a block, so that a single one is not white.
    cells.set_norm(LogNorm(0.5, most))
    for factor, style, colour, words in _LINES:
        axes.plot(line_x, mean + factor * sigma, style, color=colour, linewidth=1.8, label=words)
    axes.set_xlim(0.0, right)
    axes.set_ylim(0.0, top)
    axes.set_xlabel(term.label)
    axes.set_ylabel("critical toppling velocity of the block, $y = k_r\\,g/p$ [m/s]")
    n_events = len(set(table.event_id[shown].tolist()))
    n_censored = int(np.isin(table.status.astype(str), ("below_limit", "no_motion")).sum())
    axes.set_title(
        f"{model.name}: {x.size} critical blocks of {n_events} earthquakes\n"
        f"{n_censored} more lie below the search limit and are not shown",
        fontsize=10,
    )
    axes.legend(loc="upper left", framealpha=0.95, fontsize=9)
    bar = figure.colorbar(cells, ax=axes, label="critical blocks per cell")
    ticks = [t * 10**k for k in range(7) for t in (1, 2, 5) if t * 10**k <= most]
    bar.ax.yaxis.set_major_locator(FixedLocator(ticks))
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.set_ylim(1.0 if most > 2 else 0.5, most)
    return save_figure(figure, path)
