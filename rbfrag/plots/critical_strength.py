"""Figures of critical strengths: over frequency, and with vertical motion over that without."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.fragility.claims_of_vertical import VerticalPairs
from rbfrag.fragility.lobes import LOBES, lobe_line
from rbfrag.plots.canvas import density, new_figure, plain_numbers, plot_path, save_figure

STYLES = {
    "rectangular": ("-", "#b2182b"),
    "half-sine": ("--", "#1f4e79"),
    "triangular": ("-.", "#2e7d32"),
}


def plot_sensitivity(table: CombinationTable, path: str | PathLike[str], *, data: str = "") -> Path:
    """Draw critical k_r/PGA against ω_m/p with the lines of lobes half a mean period long.

    The legend says how many of the critical values lie above each line.

    Args:
        table: the critical values.
        path: file to write: .png, .pdf or .svg.
        data: what the data are, for the title.

    Returns:
        The path.

    Raises:
        InputError: no critical value of a motion with a mean period, or a path that cannot
            be written.
        MissingExtraError: matplotlib is not installed.
    """
    plot_path(path)
    ratio = 2.0 * np.pi / (table.tm_s * np.sqrt(table.p2))
    shown = (table.status == "found") & np.isfinite(ratio) & np.isfinite(table.kr_over_pga)
    if not shown.any():
        raise InputError(
            "there is no critical value of a motion with a mean period to draw: run  "
            "rbfrag simulate"
        )
    x, y = ratio[shown], table.kr_over_pga[shown]
    censored = np.isin(table.status.astype(str), ("below_limit", "no_motion"))
    limit = float(table.search_limit[shown | censored].min())
    figure = new_figure(7.4, 5.6)
    axes = figure.add_subplot()
    left, right = 0.8 * float(x.min()), 1.25 * float(x.max())
    bottom, top = 0.8 * min(limit, float(y.min())), 1.25 * max(1.0, float(y.max()))
    axes.set_xscale("log")
    axes.set_yscale("log")
    density(figure, axes, x, y, (left, right), (bottom, top))
    line_x = np.geomspace(left, right, 300)
    for name in LOBES:
        style, colour = STYLES[name]
        above = int(np.sum(y > lobe_line(name, x)))
        axes.plot(
            line_x,
            lobe_line(name, line_x),
            style,
            color=colour,
            lw=1.8,
            label=f"{name} lobe: {above} above ({100.0 * above / x.size:.1f} %)",
        )
    if censored.any():
        axes.axhline(limit, color="black", lw=0.8, ls=":")
        axes.annotate(
            f"search limit; {int(censored.sum())} critical values lie below it",
            (0.01, limit),
            xycoords=("axes fraction", "data"),
            xytext=(0, 4),
            textcoords="offset points",
            fontsize=8,
        )
    axes.set_xlabel(r"frequency of the motion over that of the block, $\omega_m/p$")
    axes.set_ylabel(r"critical strength, $k_r/\mathrm{PGA}$")
    events = len(set(table.event_id[shown].tolist()))
    motions = len(set(table.motion_id[shown].tolist()))
    axes.set_title(
        f"{x.size} critical blocks, {motions} motions of {events} earthquakes"
        + (f"\n{data}" if data else ""),
        fontsize=10,
    )
    axes.grid(visible=True, which="major", lw=0.3, alpha=0.5)
    plain_numbers(axes.xaxis, 1.0, 2.0, 5.0)
    plain_numbers(axes.yaxis, 1.0, 2.0, 5.0)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.09), fontsize=8.5, frameon=False)
    return save_figure(figure, path)


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
