"""Figures of annual rates: hazard and its contributions, survival, and exceedance of losses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.hazards.standing_blocks import Standing
from rbfrag.hazards.survival import SurvivalAnswer
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written, write_near
from rbfrag.plots.curve import AXIS
from rbfrag.results.numbers import exact_percent, relative

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rbfrag.hazards.loss_answer import LossAnswer

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


_COLOURS = (
    canvas.BLUE, "#d98c1f", "#4c8f4c", "#8c2d4f", "#2c9fad", "#7a6fae", "#6b6b6b", "#b59a2e",
)  # fmt: skip
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
    drawn = as_curves(curves, imt=imt, site=site)
    for i, (curve, branch) in enumerate(zip(drawn, answer.branches, strict=True)):
        label = _short(branch.name)
        if len(drawn) > _MOST_NAMED:
            label = "_named by none" if i else f"each of {len(drawn)} curves"
        panels[0].loglog(curve.levels, curve.annual_rate, label=label, **_style(i, len(drawn)))
    highest = max(float(curve.annual_rate.max()) for curve in drawn)
    lowest = min(float(curve.annual_rate.min()) for curve in drawn)
    panels[0].set_ylim(max(lowest, _LEAST_RATE), 2.0 * highest)
    panels[0].set_xlabel(measure_title(drawn[0]))
    panels[0].set_ylabel("annual rate of exceedance, λ [yr⁻¹]")
    panels[0].set_title("hazard curves", fontsize=10)
    _draw_survival(panels[1], answer)
    if weighted:
        title = "branches"
        if len(weighted) > _MOST_NAMED:
            title = f"{_MOST_NAMED} of {len(weighted)} branches"
            weighted.sort(key=lambda branch: -(branch.weight_given_standing or 0.0))
            del weighted[_MOST_NAMED:]
        at = np.arange(len(weighted))
        before = [100.0 * (branch.weight or 0.0) for branch in weighted]
        after = [100.0 * (branch.weight_given_standing or 0.0) for branch in weighted]
        panels[2].barh(at - 0.2, before, 0.38, color="#bbbbbb", label="weight before")
        panels[2].barh(at + 0.2, after, 0.38, color=canvas.RED, label="weight given standing")
        size = 10.0 if len(weighted) <= 5 else 8.0
        panels[2].set_yticks(at, [_short(branch.name) for branch in weighted], fontsize=size)
        panels[2].invert_yaxis()
        panels[2].set_xlabel("weight [%]")
        panels[2].set_title(title, fontsize=10)
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


def _draw_survival(axes: Axes, answer: SurvivalAnswer) -> None:
    for i, branch in enumerate(answer.branches):
        axes.semilogx(_FACTORS, _percent(branch.standing), **_style(i, len(answer.branches)))
    if len(answer.branches) > 1:
        axes.semilogx(
            _FACTORS, _percent(answer.standing), color="black", lw=2.2, label=answer.hazard
        )
    axes.axvline(1.0, color="#333333", lw=0.8)
    near = []
    for percent, factor in ((5.0, answer.factor_5_percent), (50.0, answer.factor_50_percent)):
        axes.axhline(percent, color="#888888", lw=0.7, ls=":")
        if factor is not None:
            near.append(factor)
            axes.plot([factor], [percent], "o", color=canvas.RED, ms=6, zorder=3)
            write_near(
                axes, f"{factor:.3g}", (factor, percent), (6, 5), color=canvas.RED, fontsize=9
            )
    axes.set_ylim(0.0, 100.0)
    canvas.written_numbers(axes.xaxis, 1.0)
    axes.set_xlim(max(min([0.1, *near]) / 3.0, 0.001), min(max([3.0, *near]) * 3.0, 1000.0))
    axes.set_xlabel("factor on all hazard rates")
    axes.set_ylabel("probability of standing [%]")
    axes.set_title("survival", fontsize=10)


def _percent(standing: Standing) -> NDArray[np.float64]:
    logs = [standing.log_probability(factor) for factor in _FACTORS.tolist()]
    return np.asarray(100.0 * np.exp(logs))


_BANDS: Mapping[str, Mapping[str, Any]] = {
    "event_set_sampling": {"fc": "#00000014", "ec": "#777777", "ls": ":"},
    "logic_tree": {"fc": "#c2410c30", "ec": "none"},
    "fragility": {"fc": "#2b6cac66", "ec": "none"},
}
"""How the bands of the sources of uncertainty are drawn, the widest first."""

_LEAST_OF_EVENT = 0.05  # of one event in the effective time


@canvas.in_own_style
def plot_losses(answer: LossAnswer, out: canvas.Out = None) -> canvas.Picture:
    """Draw the exceedance curves of failures and, if there are losses, of the loss.

    Bands are those of event-set sampling, of the parameters of the fragility and of the logic tree,
    each by itself. Of years, the sum is drawn next to the events; what happens less than once in
    the time that the events cover is shaded.

    Args:
        answer: of :func:`rbfrag.losses`, with samples.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.

    Raises:
        InputError: the answer has no curve.
    """
    canvas.plot_path(out)
    panels = [("blocks that fail", answer.exceedance)]
    if answer.has_losses:
        panels.append(("loss", answer.loss_exceedance))
    if not any(answer.exceedance.values()):
        raise InputError("no curve to draw: no failures in any sample, or no samples")
    figure = canvas.new_figure(5.2 * len(panels), 4.4)
    all_axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for axes, (title, curves) in zip(all_axes, panels, strict=True):
        _draw_exceedance(axes, answer, curves, in_legend=axes is all_axes[0])
        axes.set_xlabel(f"{title}, at least")
        axes.set_ylabel(
            "probability given the event"
            if answer.events.is_scenario
            else "annual rate of exceedance [yr⁻¹]"
        )
        canvas.open_corner(axes)
    canvas.light_grid(*all_axes)
    canvas.legend_below(figure, 4)
    return canvas.save_figure(figure, out)


def _draw_exceedance(
    axes: Axes, answer: LossAnswer, curves: Mapping[str, Sequence[Any]], *, in_legend: bool
) -> None:
    """Draw the exceedance curves of the dependence models with their bands of uncertainty."""
    # loaded by the answer: a report of a hazard has no use for it, which takes scipy.stats
    from rbfrag.hazards.event_set import LOGIC_TREE_LEVEL, SOURCES

    axes.set_yscale("log")
    drawn = [curve for curve in curves.values() if curve]
    values = [point.value for curve in drawn for point in curve]
    if drawn and max(values) > 30.0:
        axes.set_xscale("log")
        digits = (1.0,) if max(values) > 30.0 * min(values) else (1.0, 2.0, 5.0)
        canvas.written_numbers(axes.xaxis, *digits)
    for colour, (law, curve) in zip((canvas.BLUE, canvas.RED), curves.items(), strict=False):
        if not curve:
            continue
        x = [point.value for point in curve]
        of = f" ({law})" if len(curves) > 1 else ""
        for source, style in _BANDS.items():
            ends = [getattr(point, source) or (math.nan, math.nan) for point in curve]
            low, high = zip(*ends, strict=True)
            if not all(map(math.isnan, low)):
                level = LOGIC_TREE_LEVEL if source == "logic_tree" else answer.level
                label = f"{exact_percent(level)} {SOURCES[source]}"
                is_first = in_legend and law == next(iter(curves))
                axes.fill_between(
                    x, low, high, lw=0.9, label=label if is_first else None, **style
                )  # fmt: skip
        axes.plot(
            x, [point.annual_rate for point in curve], "o-", color=colour, ms=3.0, lw=1.5,
            label=f"events{of}" if in_legend else None,
        )  # fmt: skip
        sums = [point.sum_of_year for point in curve if point.sum_of_year is not None]
        if sums:
            axes.plot(
                x, sums, "--", color=colour, lw=1.1,
                label=f"sum of a year{of}, probability" if in_legend else None,
            )  # fmt: skip
    effective = answer.events.effective_years
    if drawn and effective is not None:
        years = f"{effective:,.0f}" if effective >= 100.0 else f"{effective:.3g}"
        lowest = 0.3 * min(curve[-1].annual_rate for curve in drawn)
        highest = 2.0 * max(max(x[0].event_set_sampling[1], x[0].fragility[1]) for x in drawn)
        axes.set_ylim(min(max(lowest, _LEAST_OF_EVENT / effective), 0.5 / effective), highest)
        axes.axhspan(
            axes.get_ylim()[0], 1.0 / effective, color="#dddddd", alpha=0.6, lw=0.0,
            label=f"less than once in {years} years" if in_legend else None,
        )  # fmt: skip
