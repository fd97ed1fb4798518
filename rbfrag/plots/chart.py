"""Design chart: the probability that a block topples, to be read by hand."""

from __future__ import annotations

import math
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.canvas import BLUE, logarithmic, new_figure, plot_path, save_figure, spread_out
from rbfrag.plots.model_lines import (
    MORE_TERMS,
    HeldMeasures,
    failure_line,
    held_measures,
    model_answers,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONTOURS = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99)

_BOLD = (0.05, 0.5, 0.95)

_LABEL_AT = 1.035
"""Abscissa of the labels, of the width of the sheet."""

_LABEL_APART = 0.026
"""Least distance of labels, of the height of the sheet."""

_POINTS = 300
_NODES = 241
"""Values along each axis at which the chart asks whether it was fitted there."""

_SPAN = 1.6
"""Factor by which the sheet goes beyond the fitted range."""

_DEFAULT_RANGE = (0.01, 2.0)


def plot_chart(
    model: FragilityModel, path: str | PathLike[str], held: HeldMeasures | None = None
) -> Path:
    """Draw lines of equal probability of toppling over intensity and block.

    The ordinate is the block's toppling velocity k_r g/p. What the model reads beside it and the
    intensity is held: the size of the block, and PGA and Tm of a model of PGV with PGA, which is
    drawn over PGV; the caption says at what. Outside the ranges that were fitted the sheet is
    shaded.

    Args:
        model: a model of one number, pgv_pga or pgv_pga_tm.
        path: file to write: .png, .pdf or .svg.
        held: what is held; None for the middle of the fitted ranges.
    """
    plot_path(path)
    held = held_measures(model) if held is None else held
    domain = model.row.domain
    fitted_x = domain.get("intensity_m_s") or domain.get(model.term.inputs[0]) or _DEFAULT_RANGE
    low, high = (max(float(edge), 1e-4) for edge in fitted_x)
    x = np.geomspace(low / _SPAN, _SPAN * high, _POINTS)
    lines = {p: failure_line(model, x, p, held) for p in CONTOURS}
    figure = new_figure(7.0, 7.0)
    axes = figure.add_subplot()
    logarithmic(axes, (1.0, 2.0, 5.0), (1.0, 2.0, 5.0))
    bottom, top = _vertical_range(x, lines[0.99], lines[0.01])
    axes.set(xlim=(x[0], x[-1]), ylim=(bottom, top), aspect="equal")
    for probability, y in lines.items():
        axes.plot(x, y, color=BLUE, lw=1.9 if probability in _BOLD else 0.9)
    _write_beside(axes, x, lines)
    if held.words:
        _shade_where_not_fitted(axes, model, held)
    else:
        _shade_outside(axes, (low, high), domain.get("y_m_s"))
    axes.set_xlabel(TERMS["pgv"].label if model.term.name in MORE_TERMS else model.term.label)
    axes.set_ylabel("toppling velocity of the block, $y = k_r\\,g/p$ [m/s]")
    axes.grid(visible=True, which="major", lw=0.6, color="#9a9a9a")
    axes.grid(visible=True, which="minor", lw=0.3, color="#c8c8c8")
    axes.set_axisbelow(True)
    axes.set_title(_caption(model, held), fontsize=10)
    return save_figure(figure, path)


def _vertical_range(x: np.ndarray, weak: np.ndarray, strong: np.ndarray) -> tuple[float, float]:
    top = 1.3 * float(np.nanmax(strong))
    known = weak[np.isfinite(weak)]
    bottom = float(known.min()) if known.size else 0.1 * float(x[0])
    # a straight line of a model without a bound falls to zero within the sheet
    return 0.8 * max(bottom, 0.1 * float(x[0])), top


def _write_beside(axes: Axes, x: np.ndarray, lines: dict[float, np.ndarray]) -> None:
    """Write the probabilities right of the sheet, each joined to the end of its line."""
    left, right = np.log(axes.get_xlim())
    bottom, top = np.log(axes.get_ylim())
    ends = []
    for probability, y in lines.items():
        inside = np.flatnonzero(np.isfinite(y) & (y > np.exp(bottom)) & (y < np.exp(top)))
        if inside.size:
            at = inside[-1]
            across = float((np.log(x[at]) - left) / (right - left))
            ends.append((float((np.log(y[at]) - bottom) / (top - bottom)), across, probability))
    ends.sort()
    places = spread_out([up for up, *_ in ends], _LABEL_APART, 0.01, 0.99)
    for place, (up, across, probability) in zip(places, ends, strict=True):
        text = f"{100.0 * probability:g} %"
        axes.plot(
            [across, _LABEL_AT - 0.005], [up, place], color=BLUE, lw=0.5,
            transform=axes.transAxes, clip_on=False, label=f"_{text}",
        )  # fmt: skip
        axes.text(
            _LABEL_AT, place, text, fontsize=8, va="center", color=BLUE, transform=axes.transAxes,
            fontweight="bold" if probability in _BOLD else "normal",
        )  # fmt: skip


def _shade_outside(axes: Axes, across: tuple[float, float], up: tuple[float, float] | None) -> None:
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    shade: dict[str, Any] = {"facecolor": "#8a8a8a", "alpha": 0.25, "lw": 0.0, "zorder": 0.5}
    axes.axvspan(left, across[0], **shade)
    axes.axvspan(across[1], right, **shade)
    if up is not None:
        axes.axhspan(bottom, max(float(up[0]), bottom), **shade)
        axes.axhspan(min(float(up[1]), top), top, **shade)


def _shade_where_not_fitted(axes: Axes, model: FragilityModel, held: HeldMeasures) -> None:
    """Shade where block and motion, with what is held, are not of the fitted ones together."""
    x, y = (np.geomspace(*ends, _NODES) for ends in (axes.get_xlim(), axes.get_ylim()))
    across, up = np.meshgrid(x, y)
    kr = up * math.sqrt(held.p2) / STANDARD_GRAVITY_M_S2
    inside = model_answers(model, held.p2, kr, held.measures(model, across)).in_domain
    outside = np.where(inside, 0.0, 1.0)
    axes.contourf(x, y, outside, [0.5, 1.5], colors="#8a8a8a", alpha=0.25, zorder=0.5)


def _caption(model: FragilityModel, held: HeldMeasures) -> str:
    about = model.row.diagnostics
    n, events = about.get("n"), about.get("events")
    counts = f"fitted on {n} critical blocks of {events} earthquakes; " if n and events else ""
    return (
        f"Probability that the block topples: model {model.name}\n"
        f"{held.words + chr(10) if held.words else ''}"
        f"{counts}shaded: outside the fitted range"
    )
