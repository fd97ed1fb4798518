"""Figures of a fitted model: its data with the failure lines and its equation, its calibration."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.fragility.fit.line import Bins, bin_variances
from rbfrag.fragility.fit.result import CalibrationBins
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.fragility.methods.wls import mean_m_s, variance_m2_s2
from rbfrag.fragility.model import FragilityModel
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written
from rbfrag.plots.equation import equation_lines
from rbfrag.plots.model_lines import depends_on_size, failure_line, predicted_strengths, smooth_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_LINES = (
    (0.025, "--", canvas.RED, "2.5 % probability of failure"),
    (0.5, "-", "black", "50 % probability of failure"),
    (0.975, "-.", "#2166ac", "97.5 % probability of failure"),
)

_BARS = 40


@canvas.in_own_style
def plot_fit(
    table: CombinationTable,
    model: FragilityModel,
    path: canvas.Out,
    *,
    log: bool = False,
    measures: Mapping[str, NDArray[np.float64]] = MappingProxyType({}),
) -> canvas.Picture:
    """Draw critical toppling velocities against intensity with the lines of a model.

    A block above the upper line fails with less than 2.5 % probability, one below the lower
    line with more than 97.5 %. Histograms at the edges show how the data are distributed. The
    equation of the model stands above. A method that fits a variance has a panel of it below, with
    the variances in the bins that it was fitted to.

    A model that reads more than one number is drawn over what it expects: the block that each
    motion topples with 50 % probability. Its other lines run smoothly through what it expects of
    each motion.

    Args:
        log: logarithmic axes.
        measures: columns by name that are not of the table: the toppling spectrum [m/s] and the
            spectral accelerations [g], of models that read them.

    Raises:
        InputError: nothing to draw, or a path that cannot be written.
    """
    canvas.plot_path(path)
    term, block = model.term, model.method.block
    if block.names != TOPPLING_BLOCK.names:
        raise InputError(
            f"model {model.name} is for blocks with {' and '.join(block.names)}: the figure is "
            f"for blocks with {' and '.join(TOPPLING_BLOCK.names)}"
        )
    if table.status.size and (table.status == "not_searched").all():
        raise InputError(
            f"blocks of kind {model.kind} have no critical values, which the figure is of: use  "
            "rbfrag plot calibration"
        )
    alone = not depends_on_size(model)
    if alone:
        x = np.asarray(term.intensity_m_s({name: table.measure(name) for name in term.inputs}))
    else:
        x = predicted_strengths(model, table, 0.5, measures)
    shown = (table.status == "found") & np.isfinite(x) & np.isfinite(table.y_m_s)
    if not shown.any():
        raise InputError(
            f"no critical values with the term {term.name} to draw: run  rbfrag simulate"
        )
    binned = alone and model.method.fit == "line"  # whose variance is fitted in bins
    figure = canvas.new_figure(7.6, 7.6 if binned else 6.2)
    expected = x
    x, y = x[shown], table.y_m_s[shown]
    x_left, x_right = (0.9 * float(x.min()), 1.1 * float(x.max())) if log else (0.0, 1.03 * x.max())
    spaced = np.geomspace if log else np.linspace
    lines = []
    for probability, *_ in _LINES:
        line_x = spaced(x_left or x_right / 400.0, x_right, 400)
        if alone:
            lines.append((line_x, failure_line(model, line_x, probability)))
        elif probability == 0.5:
            lines.append((line_x, line_x))
        else:
            strengths = predicted_strengths(model, table, probability, measures)
            there = np.isfinite(expected) & np.isfinite(strengths)
            reach = line_x[(line_x >= x.min()) & (line_x <= x.max())] if there.any() else line_x[:0]
            lines.append((reach, smooth_line(expected[there], strengths[there], reach)))
    # The data fill the sheet; a line far above them may leave it.
    highest = float(np.nanmax(lines[0][1], initial=0.0))
    top = max(float(y.max()), min(highest, 1.3 * float(y.max()))) * 1.05
    bottom = 0.8 * float(y.min()) if log else 0.0

    grid = figure.add_gridspec(
        3 if binned else 2, 2, width_ratios=[1.0, 0.16],
        height_ratios=[0.16, 1.0, 0.36] if binned else [0.16, 1.0],
    )  # fmt: skip
    axes = figure.add_subplot(grid[1, 0])
    above = figure.add_subplot(grid[0, 0], sharex=axes)
    right_axes = figure.add_subplot(grid[1, 1], sharey=axes)
    if log:
        canvas.logarithmic(axes)
    canvas.density(
        figure, axes, x, y, (x_left, x_right), (bottom, top), further_axes=[right_axes, above]
    )
    if log:
        canvas.logarithmic(axes, (1.0, 2.0, 5.0), (1.0, 2.0, 5.0))
    for (_, style, colour, label), (line_x, line) in zip(_LINES, lines, strict=True):
        label += "" if np.isfinite(line).any() else "\n(below zero)"
        axes.plot(line_x, line, style, color=colour, linewidth=1.8, label=label)
    if not binned:
        expected_label = "expected of the motion: $y$ at 50 % probability of failure [m/s]"
        axes.set_xlabel(term.label if alone else expected_label)
    axes.set_ylabel("critical toppling velocity of the block, $y = k_r\\,g/p$ [m/s]")
    canvas.grey_bars(above, x, spaced(x_left, x_right, _BARS + 1))
    above.set_ylabel("blocks", fontsize=8)
    above.tick_params(labelbottom=False, labelsize=8)
    canvas.grey_bars(right_axes, y, spaced(bottom, top, _BARS + 1), flat=True)
    right_axes.set_xlabel("blocks", fontsize=8)
    right_axes.tick_params(labelleft=False, labelsize=8)
    for edge in (above, right_axes):
        canvas.open_corner(edge)
    if binned:
        _draw_variance(figure.add_subplot(grid[2, 0], sharex=axes), model, x, y)
        axes.tick_params(labelbottom=False)
    n_events = len(set(table.event_id[shown].tolist()))
    n_censored = int(np.isin(table.status.astype(str), ("below_limit", "no_motion")).sum())
    figure.suptitle(
        f"{as_written(model.name, 60)}: {x.size} critical blocks of {n_events} earthquakes\n"
        f"not shown: {n_censored} critical blocks below the search limit\n"
        + "\n".join(equation_lines(model)),
        fontsize=10,
    )
    canvas.legend_below(figure, len(_LINES))
    return canvas.save_figure(figure, path)


def _draw_variance(
    axes: Axes,
    model: FragilityModel,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> None:
    """Draw the variances of y about the line in the bins of the fit, and the fitted variance."""
    order = np.argsort(x, kind="stable")
    bins = Bins.equal_count(x[order])
    residuals = y[order] - mean_m_s(model.parameters, bins.x)
    binned = bin_variances(bins, residuals**2, np.ones(x.size))
    log = axes.get_xscale() == "log"
    x_left, x_right = axes.get_xlim()
    line_x = np.geomspace(x_left, x_right, 400) if log else np.linspace(0.0, x_right, 400)
    line = np.asarray(variance_m2_s2(model.parameters, line_x))
    ratio = np.asarray(variance_m2_s2(model.parameters, binned.centre)) / binned.variance
    off = ~((ratio > 0.5) & (ratio < 2.0))
    (dots,) = axes.plot(binned.centre, binned.variance, "o", color="#555555", markersize=5.0)
    (missed,) = axes.plot(binned.centre[off], binned.variance[off], "s", color=canvas.RED)
    (curve,) = axes.plot(line_x, line, "-", color="black", linewidth=1.8)
    if log:
        canvas.logarithmic(axes, (1.0, 2.0, 5.0), (1.0,))
    else:
        axes.set_ylim(0.0, 1.15 * max(float(binned.variance.max()), float(line[-1])))
    axes.set_xlim(x_left, x_right)
    axes.set_xlabel(model.term.label)
    axes.set_ylabel("variance of $y$\nabout the line [m²/s²]")
    labels = [f"{off.size} bins", "fitted variance", f"{off.sum()} bins missed by a factor above 2"]
    above: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 3}
    axes.legend([dots, curve, missed], labels, **above, fontsize=8, frameon=False)


COLOURS = ("#1f4e79", "#d98c1f", "#4c9a6a", "#8c2d4f")
MARKERS = ("o", "s", "^", "D")

MOST_MODELS = len(COLOURS)

_SCORES = {
    "log loss": "log_loss_held_out",
    r"for $k_r \geq 0.05$:": "log_loss_held_out_kr05",
    "Brier": "brier_held_out",
}


@canvas.in_own_style
def plot_calibration(
    models: Mapping[str, CalibrationBins],
    path: canvas.Out,
    *,
    scores: Mapping[str, Mapping[str, float]] | None = None,
    data: str = "",
) -> canvas.Picture:
    """Draw the observed fraction of toppled blocks against the predicted probability.

    Each earthquake was predicted by a fit without it. On the diagonal a model is calibrated.

    Args:
        models: bins by name of the model, at most four.
        scores: held-out scores by name of the model, for the legend.
        data: what the outcomes are, for the title.
    """
    canvas.plot_path(path)
    if not 1 <= len(models) <= MOST_MODELS:
        raise InputError(f"{len(models)} models: a figure of calibration shows 1 to {MOST_MODELS}")
    figure = canvas.new_figure(6.2, 7.2)
    axes, below = figure.subplots(2, 1, sharex=True, height_ratios=[4.0, 1.0])
    axes.plot([0.0, 1.0], [0.0, 1.0], color="black", lw=0.8, ls=":")
    for number, (name, bins) in enumerate(models.items()):
        colour, of_model = COLOURS[number], (scores or {}).get(name, {})
        texts = [f"{text} {of_model[key]:.3f}" for text, key in _SCORES.items() if key in of_model]
        # next to each other, so that their intervals can be told apart
        x = bins.predicted + 0.006 * (number - 0.5 * (len(models) - 1))
        axes.errorbar(
            x, bins.observed,
            yerr=np.clip([bins.observed - bins.low, bins.high - bins.observed], 0.0, None),
            fmt=MARKERS[number] + "-", ms=4.5, lw=1.0, elinewidth=0.9, capsize=2.0, color=colour,
            label=as_written(name, 50) + (f" ({', '.join(texts)})" if texts else ""),
        )  # fmt: skip
        below.plot(bins.predicted, bins.blocks, MARKERS[number] + "-", ms=3.5, lw=0.9, color=colour)
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
    axes.set_ylabel("share of blocks that toppled, 95 % interval")
    below.set_yscale("log")
    below.set_ylabel("blocks per bin")
    below.set_xlabel("probability predicted for an earthquake that was left out")
    canvas.light_grid(axes, below)
    canvas.legend_below(figure, 1)
    first = next(iter(models.values()))
    axes.set_title(
        f"{int(first.blocks.sum())} blocks under motions of {first.events} earthquakes"
        + (f"\n{data}" if data else ""),
        fontsize=10,
    )
    return canvas.save_figure(figure, path)
