"""Figures of a rock mass: cumulative counts against PGA, and failures under a motion, by mode."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written, write_near
from rbfrag.results.numbers import exact_percent, percent
from rbfrag.rockmasses.counts import (
    ModeFailures,
    ScaleFailures,
    crossings,
    cumulative_counts,
    failures,
    mode_counts,
    sorted_yields,
)
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.shaking import ShakenMass
from rbfrag.solver.stability.modes import ModeName

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 600
_SHOWN = 0.997
_HIGHEST_PGA_G = 2.0

_LETTERS_AN_INCH = 11.0

TITLE_WIDTH = 90
"""Letters of a line of the title, so that the label of a record is not cut at the edges."""


@canvas.in_own_style
def plot_rockmass(realisations: Realisations, path: canvas.Out) -> canvas.Picture:
    """Draw the cumulative counts of blocks against PGA by mode, and the fractions of the modes.

    The counts are not divided by the number of blocks in the mode, so that curves may be
    compared; where two of them cross is marked.
    """
    canvas.plot_path(path)
    counts = mode_counts(realisations)
    present = [mode for mode, count in counts.items() if count.count]
    # Every bar is as wide as the name of its mode.
    width_in = 0.45 + 0.62 * len(present)
    figure = canvas.new_figure(5.7 + width_in, 4.6)
    yields = {mode: sorted_yields(realisations, mode) for mode in present}
    finite = np.concatenate(list(yields.values()))
    # A few blocks that hardly any earthquake moves would squeeze all the others to the left.
    right = float(np.quantile(finite, _SHOWN)) if finite.size else 1.0
    right = min(max(1.02 * right, 0.01), _HIGHEST_PGA_G)
    pga_g = np.linspace(0.0, right, _POINTS)

    axes, bars = figure.subplots(1, 2, width_ratios=[5.7, width_in])
    for mode in present:
        counted = cumulative_counts(realisations, mode, pga_g)
        axes.plot(pga_g, counted, canvas.MODE_LINES[mode], color=canvas.MODE_COLOURS[mode], lw=1.8,
                  label=canvas.mode_title(mode))  # fmt: skip
    shown = [crossing for crossing in crossings(realisations) if crossing.pga_g <= right]
    for crossing in shown:
        axes.plot(crossing.pga_g, crossing.count, "o", ms=6, mfc="white", mec="black", zorder=5)
        axes.plot([crossing.pga_g] * 2, [0.0, crossing.count], color="black", lw=0.7, ls=":")
        at = (crossing.pga_g, crossing.count)
        error = crossing.standard_error_g
        text = f"{crossing.pga_g:.3f}{f' ± {error:.3f}' if math.isfinite(error) else ''} g"
        write_near(axes, text, at, (9, -12), fontsize=9)
    axes.set_xlim(0.0, right)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("peak ground acceleration, PGA [g]")
    axes.set_ylabel("blocks with a yield acceleration below PGA")
    canvas.light_grid(axes)
    # Above the axes, because the curves may run anywhere.
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(present), fontsize=9, frameon=False
    )

    shares = [100.0 * counts[mode].share for mode in present]
    bars.bar(
        range(len(shares)), shares, width=0.7, color=[canvas.MODE_COLOURS[mode] for mode in present]
    )
    for place, share in enumerate(shares):
        write_near(
            bars, percent(share / 100.0), (place, share), (0, 2), movable=False, fontsize=8.5
        )
    _name_bars(bars, present)
    bars.set_ylim(0.0, 1.12 * max(shares))
    bars.set_ylabel("share of the blocks [%]")
    n, blocks = realisations.n, realisations.n_blocks
    missing = "" if blocks == n else f"; {n - blocks} of {n} realisations are no block"
    figure.suptitle(f"{blocks} blocks of a rock mass{missing}", fontsize=10)
    return canvas.save_figure(figure, path)


def _name_bars(axes: Axes, modes: Sequence[ModeName | None]) -> None:
    names = [
        "all" if mode is None else canvas.mode_title(mode).replace(" ", "\n") for mode in modes
    ]
    axes.set_xticks(range(len(names)), names, fontsize=9)
    axes.set_xlim(-0.6, len(names) - 0.4)
    canvas.open_corner(axes)


_UNKNOWN = "#c9a227"

PARTS: tuple[tuple[str, str, Callable[[ModeFailures], int]], ...] = (
    ("fails", "#a3262a", lambda result: result.outcomes["fails"]),
    ("fails at rest", "#5b1a4e", lambda result: result.outcomes["unstable"]),
    ("not known", _UNKNOWN, lambda result: result.open),
    ("moves, and stays", "#8fb3d1", lambda result: result.outcomes["stays"]),
    ("does not move", "#d9dde0",
     lambda result: result.outcomes["at_rest"] + result.outcomes["locked"]),
)  # fmt: skip
"""Parts of a bar: their labels, colours, and numbers of blocks."""


@canvas.in_own_style
def plot_failures(shaken: ShakenMass, path: canvas.Out, *, level: float = 0.95) -> canvas.Picture:
    """Draw the fraction of blocks that fail against the scale of the motion, by mode.

    Beside it, what becomes of the blocks of every mode under the motion as it was recorded, or at
    the scale nearest to that. With one scale there is that alone.

    Args:
        shaken: the outcomes of the blocks.
    """
    canvas.plot_path(path)
    by_scale = failures(shaken, level)
    bars_of = min(by_scale, key=lambda result: abs(np.log(result.scale)))
    width_in = 1.9 + 0.75 * (1 + len(bars_of.modes))
    if len(by_scale) > 1:
        figure = canvas.new_figure(5.4 + width_in, 4.6)
        curves, bars = figure.subplots(1, 2, width_ratios=[5.4, width_in])
        _draw_curves(curves, by_scale, level)
    else:
        figure = canvas.new_figure(width_in + 1.2, 4.6)
        bars = figure.subplots()
    _draw_bars(bars, bars_of)
    letters = min(TITLE_WIDTH, int(_LETTERS_AN_INCH * figure.get_figwidth()))
    limits = shaken.limits
    turned = "" if limits.rotation_deg is None else f"by more than {limits.rotation_deg:g}° or "
    about = f"{shaken.shaking.motion.label}: {shaken.realisations.n_blocks:,} blocks of a rock mass"
    rule = (
        f"a slide fails beyond {limits.displacement_m:g} m, "
        f"a block that turns {turned}past recovery"
    )
    figure.suptitle(f"{as_written(about, letters)}\n{as_written(rule, letters)}", fontsize=10)
    return canvas.save_figure(figure, path)


def _draw_curves(axes: Axes, by_scale: Sequence[ScaleFailures], level: float) -> None:
    scales = [result.scale for result in by_scale]
    # broad and below the others, because a mode alone may make up the whole of it
    _draw_share(
        axes, scales, [result.total for result in by_scale], "all blocks", "-", "#404040", 4.0
    )
    for mode in by_scale[0].modes:
        of_mode = [result.modes[mode] for result in by_scale]
        line, colour = canvas.MODE_LINES[mode], canvas.MODE_COLOURS[mode]
        _draw_share(axes, scales, of_mode, canvas.mode_title(mode), line, colour, 1.8)
    unknown = np.array([result.total.open_of_all for result in by_scale])
    if unknown.any():
        fails = np.array([result.total.of_all.value for result in by_scale])
        axes.fill_between(scales, 100.0 * fails, 100.0 * (fails + unknown), color=_UNKNOWN,
                          alpha=0.3, lw=0, label="not known")  # fmt: skip
    axes.set_xlim(0.0, 1.02 * scales[-1])
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("factor on the motion")
    axes.set_ylabel(f"share of all blocks that fail [%], {exact_percent(level)} interval")
    canvas.light_grid(axes)
    axes.legend(loc="upper left", fontsize=9, frameon=False)
    above = axes.twiny()
    above.set_xlim(0.0, 1.02 * by_scale[-1].pga_g)
    above.set_xlabel("peak ground acceleration, PGA [g]")


def _draw_share(
    axes: Axes, scales: list[float], failures: list[ModeFailures], label: str, line: str,
    colour: str, width: float,
) -> None:  # fmt: skip
    share, low, high = (
        [100.0 * getattr(result.of_all, name) for result in failures]
        for name in ("value", "low", "high")
    )
    axes.plot(scales, share, line, color=colour, lw=width, marker="o", ms=3.5, label=label)
    axes.fill_between(scales, low, high, color=colour, alpha=0.18, lw=0)


def _draw_bars(axes: Axes, of_scale: ScaleFailures) -> None:
    rows: list[tuple[ModeName | None, ModeFailures]] = [
        (None, of_scale.total),
        *of_scale.modes.items(),
    ]
    at = np.arange(len(rows))
    bottom = np.zeros(len(rows))
    for label, colour, number_of in PARTS:
        heights = np.array([100.0 * number_of(result) / result.count for _, result in rows])
        if not heights.any():
            continue
        axes.bar(at, heights, width=0.7, bottom=bottom, color=colour, label=label)
        bottom += heights
    for place, (_, result) in zip(at, rows, strict=True):
        assert result.of_mode is not None
        text = f"{percent(result.of_mode.value)}\nof {result.count}"
        write_near(axes, text, (float(place), 100.0), (0, 3), movable=False, fontsize=8.5)
    _name_bars(axes, [mode for mode, _ in rows])
    axes.set_ylim(0.0, 113.0)
    axes.set_yticks([0, 20, 40, 60, 80, 100])
    axes.set_ylabel("share of the blocks of a mode [%]")
    axes.set_title(f"motion times {of_scale.scale:g}, PGA {of_scale.pga_g:.3g} g", fontsize=9)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=8, frameon=False)
