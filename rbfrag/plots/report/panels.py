"""Figures of a report, each drawn into a figure or a part of one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from rbfrag.fragility import describe
from rbfrag.plots.blocks.block import draw_block
from rbfrag.plots.chart import draw_chart
from rbfrag.plots.curve import AXIS, draw_curve
from rbfrag.plots.hazard import draw_contribution
from rbfrag.plots.model_lines import MORE_TERMS
from rbfrag.plots.report.contents import Contents, Drawing

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase


class Panel(NamedTuple):
    """One figure of a report."""

    name: str
    title: str
    draw: Callable[[FigureBase], None]


def panels_of(contents: Contents) -> list[Panel]:
    """Return the figures of a report, in order."""
    panels = []
    if (drawing := contents.drawing) is not None:
        panels.append(Panel("block", drawing.title, lambda part: _block(part, drawing)))
    if contents.is_unstable:
        return panels
    if contents.model.term.inputs[0] in AXIS:
        title = "Probability of failure of this block"
        panels.append(Panel("curve", title, lambda part: _curve(part, contents)))
    if contents.held is not None:
        title = f"Design chart, model {describe.model(vars(contents.prediction))}"
        panels.append(Panel("chart", title, lambda part: _chart(part, contents)))
    if contents.hazard is not None:
        title = "Hazard, and the shaking that the rate comes from"
        panels.append(Panel("rate", title, lambda part: _rate(part, contents)))
    return panels


def _block(part: FigureBase, drawing: Drawing) -> None:
    axes = part.subplots()
    draw_block(axes, drawing.block, drawing.stability)
    axes.set_xlabel("out of the slope, from the centroid [m]")
    axes.set_ylabel("above the centroid [m]")


def _chart(part: FigureBase, contents: Contents) -> None:
    assert contents.held is not None
    by_pgv = contents.model.term.name in MORE_TERMS
    x = contents.measures["pgv_m_s"] if by_pgv else contents.prediction.intensity_m_s
    y_m_s = contents.prediction.y_m_s
    axes = part.subplots()
    draw_chart(axes, contents.model, contents.held, point=None if y_m_s is None else (x, y_m_s))
    axes.set_ylabel("toppling velocity, $y = k_r\\,g/p$ [m/s]")
    if contents.model.term.inputs == ("pgv_m_s",):
        axes.set_xlabel(AXIS["pgv_m_s"])
    if contents.held.words:
        axes.set_title(contents.held.words, fontsize=8)


def _curve(part: FigureBase, contents: Contents) -> None:
    first, *other_names = contents.model.term.inputs
    axes = part.subplots()
    draw_curve(
        axes, contents.model, contents.numbers, first,
        {name: contents.measures[name] for name in other_names}, level=contents.prediction.level,
        at=contents.measures[first], sites=contents.prediction.sites,
    )  # fmt: skip
    part.legend(loc="outside lower center", fontsize=7, frameon=False)


def _rate(part: FigureBase, contents: Contents) -> None:
    assert contents.hazard is not None
    top, bottom = part.subplots(2, 1, sharex=True)
    draw_contribution(top, bottom, contents.hazard.curves[0], contents.hazard)
    top.set_ylabel("exceedances [yr⁻¹]")
    bottom.set_ylabel("fraction of\nthe rate [%]")
