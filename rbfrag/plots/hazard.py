"""Figure of an annual failure rate: contributions of the levels of shaking."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from rbfrag.fragility import describe
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.plots import canvas
from rbfrag.plots.curve import AXIS
from rbfrag.plots.labels import as_written
from rbfrag.results.numbers import relative

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHOWN = 1e-3


def measure_title(curve: HazardCurve) -> str:
    """Return the measure of the levels of a curve, with its unit."""
    return AXIS.get(curve.measure, f"spectral acceleration, {curve.imt} [g]")


@canvas.in_own_style
def plot_contribution(
    curve: CurveLike,
    answer: HazardAnswer,
    out: canvas.Out = None,
    *,
    imt: str | None = None,
    site: str | None = None,
) -> canvas.Picture:
    """Draw a hazard curve and, below it, the contributions to the failure rate of the first block.

    Args:
        curve: hazard curve, or its file.
        answer: of :func:`rbfrag.hazard` under it.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        imt: as for :func:`rbfrag.hazard`.
        site: as for :func:`rbfrag.hazard`.
    """
    canvas.plot_path(out)
    (curve,) = as_curves(curve, imt=imt, site=site)
    figure = canvas.new_figure(6.4, 6.4)
    top, bottom = figure.subplots(2, 1, sharex=True)
    draw_contribution(top, bottom, curve, answer)
    place = f" at {curve.place}" if curve.place else ""
    model = as_written(f"hazard of {curve.imt}{place}, model {describe.model(vars(answer))}", 75)
    sentences = (as_written(text, 85) for text in islice(answer.sentences(), 2))
    figure.suptitle("\n".join((model, *sentences)), fontsize=10)
    return canvas.save_figure(figure, out)


def draw_contribution(top: Axes, bottom: Axes, curve: HazardCurve, answer: HazardAnswer) -> None:
    """Draw both parts of :func:`plot_contribution` into axes with a common abscissa."""
    top.loglog(curve.levels, curve.annual_rate, "o-", color="black", ms=3.5, lw=1.4)
    top.set_ylabel("annual rate of exceedance, λ [yr⁻¹]")
    rate = max(float(answer.annual_rate[0]), np.finfo(float).tiny)
    edges = curve.levels
    fractions = 100.0 * answer.fractions_between(edges)
    bottom.bar(
        edges[:-1], fractions, width=np.diff(edges), align="edge",
        color="#2b6cac", edgecolor="white", linewidth=0.3,
    )  # fmt: skip
    bottom.set_ylabel("fraction of the rate [%]\nbetween levels of the curve")
    bottom.set_ylim(0.0, None if fractions.any() else 1.0)
    bottom.set_xlabel(measure_title(curve))
    seen = fractions > _SHOWN * max(float(fractions.max()), np.finfo(float).tiny)
    if seen.any():
        x_left, x_right = edges[:-1][seen][0], edges[1:][seen][-1]
        bottom.set_xlim(x_left, x_right)
        inside = (curve.levels >= x_left) & (curve.levels <= x_right)
        if inside.sum() > 1:
            rates = curve.annual_rate[inside]
            top.set_ylim(0.5 * rates.min(), 2.0 * rates.max())
    beyond = answer.above[0] / rate
    if beyond >= 0.0005:
        text = f"{relative(beyond)} more from beyond the end of the curve"
        bottom.set_title(text, fontsize=9, loc="right")
    canvas.written_numbers(bottom.xaxis, 1.0, 2.0, 5.0)
    for axes in (top, bottom):
        axes.grid(True, which="major", color="#dddddd", lw=0.6)
        axes.set_axisbelow(True)
