"""Figure of a rock mass: how many blocks yield below which acceleration, mode by mode."""

from __future__ import annotations

import math
from os import PathLike
from pathlib import Path

import numpy as np

from rbfrag.plots.canvas import new_figure, plot_path, save_figure
from rbfrag.plots.mode_style import COLOURS, LINES, words
from rbfrag.rockmasses.counts import (
    Crossing,
    crossings,
    cumulative_counts,
    mode_counts,
    sorted_yields,
)
from rbfrag.rockmasses.joint_sets import Realisations

_POINTS = 600
_SHOWN = 0.997
_HIGHEST_PGA_G = 2.0


def plot_rockmass(made: Realisations, path: str | PathLike[str], *, title: str = "") -> Path:
    """Draw the cumulative counts of blocks against PGA by mode, and the shares of the modes.

    The counts are not divided by the number of blocks in the mode, so that curves may be
    compared; where two of them cross is marked.

    Args:
        made: the realisations.
        path: file to write: .png, .pdf or .svg.
        title: title of the figure; a count of the blocks if empty.

    Raises:
        InputError: a path that cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    plot_path(path)
    counts = mode_counts(made)
    present = [mode for mode, found in counts.items() if found.count]
    # Every bar takes the room that the name of its mode needs.
    width_in = 0.45 + 0.62 * len(present)
    figure = new_figure(5.7 + width_in, 4.6)
    yields = {mode: sorted_yields(made, mode) for mode in present}
    finite = np.concatenate(list(yields.values()))
    # A few blocks that hardly any earthquake moves would squeeze all the others to the left.
    right = float(np.quantile(finite, _SHOWN)) if finite.size else 1.0
    right = min(max(1.02 * right, 0.01), _HIGHEST_PGA_G)
    pga_g = np.linspace(0.0, right, _POINTS)

    axes, bars = figure.subplots(1, 2, width_ratios=[5.7, width_in])
    for mode in present:
        axes.plot(
            pga_g,
            cumulative_counts(made, mode, pga_g),
            LINES[mode],
            color=COLOURS[mode],
            lw=1.8,
            label=words(mode),
        )
    shown = [crossing for crossing in crossings(made) if crossing.pga_g <= right]
    for crossing in shown:
        axes.plot(crossing.pga_g, crossing.count, "o", ms=6, mfc="white", mec="black", zorder=5)
        axes.plot([crossing.pga_g] * 2, [0.0, crossing.count], color="black", lw=0.7, ls=":")
        axes.annotate(
            _with_error(crossing),
            (crossing.pga_g, crossing.count),
            xytext=(9, -12),
            textcoords="offset points",
            fontsize=9,
            va="top",
        )
    axes.set_xlim(0.0, right)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("peak ground acceleration, PGA [g]")
    axes.set_ylabel("blocks with a yield acceleration below PGA")
    axes.grid(visible=True, lw=0.3, alpha=0.6)
    # Above the axes, because the curves may run anywhere.
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(present), fontsize=9, frameon=False
    )

    at = range(len(present))
    shares = [100.0 * counts[mode].share for mode in present]
    bars.bar(at, shares, width=0.7, color=[COLOURS[mode] for mode in present])
    for place, share in zip(at, shares, strict=True):
        bars.annotate(
            f"{share:.1f} %",
            (place, share),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=8.5,
        )
    bars.set_xticks(list(at), [words(mode).replace(" ", "\n") for mode in present], fontsize=9)
    bars.set_xlim(-0.6, len(present) - 0.4)
    bars.set_ylim(0.0, 1.12 * max(shares))
    bars.set_ylabel("share of the blocks [%]")
    for side in ("top", "right"):
        bars.spines[side].set_visible(False)
    figure.suptitle(title or _title(made), fontsize=10)
    return save_figure(figure, path)


def _with_error(crossing: Crossing) -> str:
    error = crossing.standard_error_g
    return f"{crossing.pga_g:.3f}{f' ± {error:.3f}' if math.isfinite(error) else ''} g"


def _title(made: Realisations) -> str:
    text = f"{made.n_blocks} blocks of a rock mass"
    if made.n_blocks < made.n:
        text += f"; {made.n - made.n_blocks} of {made.n} realisations are no block"
    return text
