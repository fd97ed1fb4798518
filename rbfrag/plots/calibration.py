"""Calibration plot: predicted probabilities and observed fractions for held-out earthquakes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility.fit.scores import CalibrationBins
from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written

COLOURS = ("#1f4e79", "#d98c1f", "#4c9a6a", "#8c2d4f")
MARKERS = ("o", "s", "^", "D")

MOST_MODELS = len(COLOURS)


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
        colour = COLOURS[number]
        # beside each other, so that their intervals can be told apart
        x = bins.predicted + 0.006 * (number - 0.5 * (len(models) - 1))
        axes.errorbar(
            x, bins.observed,
            yerr=np.clip([bins.observed - bins.low, bins.high - bins.observed], 0.0, None),
            fmt=MARKERS[number] + "-", ms=4.5, lw=1.0, elinewidth=0.9, capsize=2.0, color=colour,
            label=as_written(name, 50) + _scores((scores or {}).get(name, {})),
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


def _scores(scores: Mapping[str, float]) -> str:
    labels = (
        ("log loss", "log_loss_held_out"),
        (r"for $k_r \geq 0.05$:", "log_loss_held_out_kr05"),
        ("Brier", "brier_held_out"),
    )
    texts = [f"{name} {scores[key]:.3f}" for name, key in labels if key in scores]
    return f" ({', '.join(texts)})" if texts else ""
