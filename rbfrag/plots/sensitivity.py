"""Figure of a prediction: P at usual errors of measurement, and its distribution over draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.prediction import Prediction
from rbfrag.plots import canvas
from rbfrag.results.numbers import exact_percent, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BINS = 40


@canvas.in_own_style
def plot_sensitivity(
    answer: Prediction, measured: Prediction | None = None, out: canvas.Out = None
) -> canvas.Picture:
    """Draw P at usual errors of measurement, and the distribution of P over the draws.

    Args:
        answer: the prediction of the stated block, with its sensitivity.
        measured: that with standard deviations; None for no distribution.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.

    Raises:
        InputError: no field changes P.
    """
    canvas.plot_path(out)
    if not answer.sensitivity:
        raise InputError("no sensitivity to draw: no measured field changes P")
    panels = 1 if measured is None else 2
    figure = canvas.new_figure(5.2 * panels, 3.4)
    all_axes = figure.subplots(1, panels, squeeze=False)[0]
    draw_sensitivity(all_axes[0], answer)
    if measured is not None:
        draw_distribution(all_axes[1], answer, measured)
    return canvas.save_figure(figure, out)


def draw_sensitivity(axes: Axes, answer: Prediction) -> None:
    """Draw a bar from the lowest to the highest P of each field, the longest at the top."""
    rows = answer.sensitivity[::-1]
    low, high = (100.0 * np.array([row[end] for row in rows]) for end in ("low", "high"))
    axes.barh(range(len(rows)), high - low, left=low, height=0.55, color=canvas.BLUE, alpha=0.75)
    axes.axvline(100.0 * answer.probability, color=canvas.RED, lw=1.2)
    labels = [
        describe.measured(row["field"], row["step"], relative=row["step"] < 1.0) for row in rows
    ]
    axes.set_yticks(range(len(rows)), labels)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_xlim(0.0, min(100.0, 1.15 * max(float(high.max()), 100.0 * answer.probability)))
    axes.set_xlabel(f"P({answer.failure.replace('_', ' ')}) [%]")
    axes.set_title(f"As stated {percent(answer.probability)} (line)", fontsize=9)
    canvas.open_corner(axes)


def draw_distribution(axes: Axes, answer: Prediction, measured: Prediction) -> None:
    """Draw the histogram of P over the draws that stand, with the mean and the interval."""
    axes.hist(
        100.0 * np.array(measured.drawn), bins=_BINS, range=(0.0, 100.0), color=canvas.BLUE,
        alpha=0.75, weights=np.full(len(measured.drawn), 100.0 / len(measured.drawn)),
    )  # fmt: skip
    level = f"{exact_percent(measured.level)} uncertainty interval"
    ends = 100.0 * measured.ci_low, 100.0 * measured.ci_high
    axes.axvspan(*ends, color="#00000012", lw=0.0, label=level)
    axes.axvline(100.0 * answer.probability, color=canvas.RED, lw=1.2, label="as stated")
    axes.axvline(100.0 * measured.probability, color="black", lw=1.2, ls="--", label="mean")
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel(f"P({answer.failure.replace('_', ' ')}) of a draw [%]")
    axes.set_ylabel("fraction of the draws [%]")
    axes.legend(fontsize=8, frameon=False)
    canvas.open_corner(axes)
