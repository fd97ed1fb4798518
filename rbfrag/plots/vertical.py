"""Figure of critical strength with vertical motion over that without."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility.claims_of_vertical import VerticalPairs
from rbfrag.plots.canvas import new_figure, plot_path, save_figure
from rbfrag.plots.density import density
from rbfrag.plots.numbers import plain_numbers

_NARROWEST, _WIDEST = 0.05, 0.5
"""Least and greatest change of strength, in ln, that the histogram reaches to."""


def plot_vertical(pairs: VerticalPairs, path: str | PathLike[str]) -> Path:
    """Draw the critical k_r/PGA with vertical motion against that without, and their ratio.

    Args:
        pairs: critical values of the same motion, polarity and p².
        path: file to write: .png, .pdf or .svg.

    Returns:
        The path.

    Raises:
        InputError: no pair, or a path that cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    plot_path(path)
    if not pairs.ln_ratio.size:
        raise InputError(
            "no critical value is known both with and without vertical motion: run  "
            "rbfrag simulate --vertical both"
        )
    figure = new_figure(9.2, 4.6)
    axes, beside = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    values = np.concatenate([pairs.without, pairs.with_vertical])
    edges = 0.85 * float(values.min()), 1.2 * float(values.max())
    axes.set_xscale("log")
    axes.set_yscale("log")
    density(figure, axes, pairs.without, pairs.with_vertical, edges, edges)
    axes.plot(edges, edges, color="#b2182b", lw=1.2, label="no change")
    plain_numbers(axes.xaxis, 1.0, 2.0, 5.0)
    plain_numbers(axes.yaxis, 1.0, 2.0, 5.0)
    axes.set_xlabel(r"critical $k_r/\mathrm{PGA}$ without vertical motion")
    axes.set_ylabel(r"critical $k_r/\mathrm{PGA}$ with it")
    axes.legend(loc="upper left", fontsize=8.5, frameon=False)

    d = pairs.ln_ratio
    reach = float(np.clip(1.3 * np.quantile(np.abs(d), 0.995), _NARROWEST, _WIDEST))
    beside.hist(
        np.clip(d, -reach, reach),
        bins=np.linspace(-reach, reach, 58).tolist(),
        color="#8a8a8a",
        edgecolor="white",
        linewidth=0.3,
    )
    beside.axvline(0.0, color="#b2182b", lw=1.2)
    beside.set_xlim(-reach, reach)
    beside.set_xlabel("ln (with / without)")
    beside.set_ylabel("critical blocks")
    outside = int(np.sum(np.abs(d) > reach))
    beside.set_title(
        f"mean {d.mean():+.3f}, standard deviation {d.std():.3f}\n"
        f"{outside} beyond the edges are counted there",
        fontsize=9,
    )
    events = len(set(pairs.event_id.tolist()))
    figure.suptitle(
        f"{d.size} critical blocks of {events} earthquakes, the same motion, polarity and $p^2$",
        fontsize=10,
    )
    return save_figure(figure, path)
