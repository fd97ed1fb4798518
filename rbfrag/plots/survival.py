"""Figure of the survival of standing blocks: hazard curves, survival by factor, weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.hazards.survival import BranchSurvival, SurvivalAnswer
from rbfrag.hazards.survival_probability import Standing
from rbfrag.plots import canvas
from rbfrag.plots.hazard import measure_title
from rbfrag.plots.labels import as_written, write_near

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = (
    canvas.BLUE,
    "#d98c1f",
    "#4c8f4c",
    "#8c2d4f",
    "#2c9fad",
    "#7a6fae",
    "#6b6b6b",
    "#b59a2e",
)
_LINES = ("-", "--", "-.", ":")
_MOST_NAMED = 10
"""More curves are drawn alike, and of their branches those of most weight are named."""

_FACTORS = np.geomspace(1e-4, 1e4, 401)
_LEAST_RATE = 1e-7


@canvas.in_own_style
def plot_survival(
    curves: CurveLike | Sequence[CurveLike],
    answer: SurvivalAnswer,
    out: canvas.Out = None,
    *,
    imt: str | None = None,
    site: str | None = None,
) -> canvas.Picture:
    """Draw hazard curves, the survival of the blocks against a factor on their rates, and weights.

    Args:
        curves: hazard curves, or their files.
        answer: of :func:`rbfrag.survival` under them.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        imt: as for :func:`rbfrag.hazard`.
        site: as for :func:`rbfrag.hazard`.
    """
    canvas.plot_path(out)
    weighted = [branch for branch in answer.branches if branch.weight is not None]
    figure = canvas.new_figure(11.0 if weighted else 9.0, 4.6)
    ratios = (1.0, 1.0, 0.7) if weighted else (1.0, 1.0)
    panels = figure.subplots(1, len(ratios), width_ratios=ratios)
    _draw_curves(panels[0], as_curves(curves, imt=imt, site=site), answer)
    _draw_survival(panels[1], answer)
    if weighted:
        _draw_weights(panels[2], weighted)
    for axes in panels:
        canvas.open_corner(axes)
    canvas.light_grid(*panels[:2])
    figure.suptitle(answer.headline(), fontsize=11)
    canvas.legend_below(figure, 4)
    return canvas.save_figure(figure, out)


def _style(i: int, curves: int) -> dict[str, Any]:
    if curves > _MOST_NAMED:
        return {"color": "#8a8a8a", "lw": 0.6, "alpha": 0.7}
    n = len(_COLOURS)
    return {"color": _COLOURS[i % n], "linestyle": _LINES[i // n], "lw": 1.4}


def _short(name: str) -> str:
    """Return a name without folders."""
    return as_written(name.rpartition("/")[2], 24, lines=2)


def _draw_curves(axes: Axes, curves: Sequence[HazardCurve], answer: SurvivalAnswer) -> None:
    for i, (curve, branch) in enumerate(zip(curves, answer.branches, strict=True)):
        label = _short(branch.name)
        if len(curves) > _MOST_NAMED:
            label = "_named by none" if i else f"each of {len(curves)} curves"
        axes.loglog(curve.levels, curve.annual_rate, label=label, **_style(i, len(curves)))
    highest = max(float(curve.annual_rate.max()) for curve in curves)
    lowest = min(float(curve.annual_rate.min()) for curve in curves)
    axes.set_ylim(max(lowest, _LEAST_RATE), 2.0 * highest)
    axes.set_xlabel(measure_title(curves[0]))
    axes.set_ylabel("annual rate of exceedance, λ [yr⁻¹]")
    axes.set_title("hazard curves", fontsize=10)


def _draw_survival(axes: Axes, answer: SurvivalAnswer) -> None:
    for i, branch in enumerate(answer.branches):
        style = _style(i, len(answer.branches))
        axes.semilogx(_FACTORS, _percent(branch.standing), **style)
    if len(answer.branches) > 1:
        axes.semilogx(
            _FACTORS, _percent(answer.standing), color="black", lw=2.2, label=answer.hazard
        )
    axes.axvline(1.0, color="#333333", lw=0.8)
    for percent, factor in ((5.0, answer.factor_5_percent), (50.0, answer.factor_50_percent)):
        axes.axhline(percent, color="#888888", lw=0.7, ls=":")
        if factor is not None:
            axes.plot([factor], [percent], "o", color=canvas.RED, ms=6, zorder=3)
            write_near(
                axes, f"{factor:.3g}", (factor, percent), (6, 5), color=canvas.RED, fontsize=9
            )
    axes.set_ylim(0.0, 100.0)
    canvas.written_numbers(axes.xaxis, 1.0)
    near = [
        factor
        for factor in (answer.factor_5_percent, answer.factor_50_percent)
        if factor is not None
    ]
    axes.set_xlim(max(min([0.1, *near]) / 3.0, 0.001), min(max([3.0, *near]) * 3.0, 1000.0))
    axes.set_xlabel("factor on all hazard rates")
    axes.set_ylabel("probability of standing [%]")
    axes.set_title("survival", fontsize=10)


def _percent(standing: Standing) -> NDArray[np.float64]:
    logs = [standing.log_probability(factor) for factor in _FACTORS.tolist()]
    return np.asarray(100.0 * np.exp(logs))


def _draw_weights(axes: Axes, branches: Sequence[BranchSurvival]) -> None:
    named = sorted(branches, key=lambda branch: -(branch.weight_given_standing or 0.0))[
        :_MOST_NAMED
    ]
    title = "branches"
    if len(named) < len(branches):
        branches, title = named, f"{_MOST_NAMED} of {len(branches)} branches"
    at = np.arange(len(branches))
    before = [100.0 * (branch.weight or 0.0) for branch in branches]
    after = [100.0 * (branch.weight_given_standing or 0.0) for branch in branches]
    axes.barh(at - 0.2, before, 0.38, color="#bbbbbb", label="weight before")
    axes.barh(at + 0.2, after, 0.38, color=canvas.RED, label="weight given standing")
    size = 10.0 if len(branches) <= 5 else 8.0
    axes.set_yticks(at, [_short(branch.name) for branch in branches], fontsize=size)
    axes.invert_yaxis()
    axes.set_xlabel("weight [%]")
    axes.set_title(title, fontsize=10)
