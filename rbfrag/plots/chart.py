"""Design chart of the probability of toppling, for reading by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.fragility import describe
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written
from rbfrag.plots.model_lines import (
    MORE_TERMS,
    HeldMeasures,
    failure_line,
    held_measures,
)
from rbfrag.results.numbers import exact_percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONTOURS = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99)

_BOLD = (0.05, 0.5, 0.95)

_LABEL_OFF_PT = 14.0
"""From the sheet to the labels [points]."""

_LABEL_APART_PT = 9.5
"""Least distance of labels [points]."""

_POINTS = 300
_NODES = 241
"""Values along each axis at which the chart asks whether it was fitted there."""

_SPAN = 1.25
"""Factor by which the sheet goes beyond the fitted range."""

_KR_AXIS_OFF_PT = 52.0
"""From the sheet to the axis of k_r, beyond the labels [points]."""

_USUAL_WIDTH_PT = 350.0
"""Of axes whose lines are as thick as usual; on narrower ones they would run together [points]."""

_DEFAULT_RANGE = (0.01, 2.0)


@canvas.in_own_style
def plot_chart(
    model: FragilityModel, path: canvas.Out, held: HeldMeasures | None = None
) -> canvas.Picture:
    """Draw lines of equal probability of toppling over intensity and block.

    The ordinate is the block's toppling velocity k_r g/p, and of blocks of a given size k_r. What
    the model reads beside it and the intensity is held: the size of the block, and PGA and Tm of a
    model of PGV with PGA, which is drawn over PGV; the caption says at what. The sheet reaches
    little beyond the ranges that were fitted, and is shaded there.

    Args:
        model: a model of one number, pgv_pga or pgv_pga_tm.
        held: what is held; None for the middle of the fitted ranges.
    """
    canvas.plot_path(path)
    held = held_measures(model) if held is None else held
    figure = canvas.new_figure(7.4, 6.6)
    axes = figure.add_subplot()
    draw_chart(axes, model, held)
    axes.set_title(_caption(model, held), fontsize=10)
    return canvas.save_figure(figure, path)


def draw_chart(
    axes: Axes,
    model: FragilityModel,
    held: HeldMeasures,
    *,
    point: tuple[float, float] | None = None,
) -> None:
    """Draw the chart of :func:`plot_chart` into axes.

    Args:
        axes: empty axes.
        point: intensity and toppling velocity of a block to show [m/s], or measure in its unit.
    """
    across, up = _known_ranges(model, held)
    ends = [*across, *([] if point is None else [point[0]])]
    x = np.geomspace(min(ends) / _SPAN, _SPAN * max(ends), _POINTS)
    lines = {p: failure_line(model, x, p, held) for p in CONTOURS}
    bottom, top = _vertical_range(lines, up)
    if point is not None:
        bottom, top = min(bottom, point[1] / _SPAN), max(top, _SPAN * point[1])
    width_pt, height_pt = _size_pt(axes)
    digits = _digits(x[-1] / x[0], width_pt, 30.0), _digits(top / bottom, height_pt, 14.0)
    canvas.logarithmic(axes, *digits)
    axes.set(xlim=(x[0], x[-1]), ylim=(bottom, top))
    thin = min(max(width_pt / _USUAL_WIDTH_PT, 0.5), 1.0)
    for probability, y in lines.items():
        axes.plot(x, y, color=canvas.BLUE, lw=thin * (1.9 if probability in _BOLD else 0.9))
    _write_beside(axes, x, lines)
    if held.words:
        _shade_where_not_fitted(axes, model, held)
    else:
        _shade_outside(axes, across, up)
    axes.set_xlabel(TERMS["pgv"].label if model.term.name in MORE_TERMS else model.term.label)
    axes.set_ylabel("toppling velocity of the block, $y = k_r\\,g/p$ [m/s]")
    axes.grid(visible=True, which="major", lw=0.6, color="#9a9a9a")
    axes.grid(visible=True, which="minor", lw=0.3, color="#c8c8c8")
    axes.set_axisbelow(True)
    if held.size_is_given:
        _draw_kr_axis(axes, held.p2, digits[1])
    if point is not None:
        axes.plot(
            *point, "o", ms=8, color=canvas.RED, mec="white", mew=1.2, zorder=9, label="_point"
        )
        for xs, ys in (([point[0]] * 2, [bottom, point[1]]), ([x[0], point[0]], [point[1]] * 2)):
            axes.plot(xs, ys, color=canvas.RED, lw=0.9, ls="--", zorder=3, label="_guide")


def _known_ranges(
    model: FragilityModel, held: HeldMeasures
) -> tuple[tuple[float, float], tuple[float, float] | None]:
    """Return the fitted ranges of the intensity and of y, for the held variables."""
    domain = model.row.domain
    fitted_x = domain.get("intensity_m_s") or domain.get(model.term.inputs[0]) or _DEFAULT_RANGE
    low, high = (max(float(edge), 1e-4) for edge in fitted_x)
    fitted_y = domain.get("y_m_s")
    up = None if fitted_y is None else (float(fitted_y[0]), float(fitted_y[1]))
    if not held.words:
        return (low, high), up
    # blocks beyond all lines never fail or always do, which is known of any motion
    x = np.geomspace(low, high, _NODES)
    y = np.array([failure_line(model, x, p, held) for p in CONTOURS])
    inside = _is_fitted(model, held, np.broadcast_to(x, y.shape), y)
    if not inside.any():
        return (low, high), up
    x = x[inside.any(axis=0)]
    return (float(x[0]), float(x[-1])), (float(y[inside].min()), float(y[inside].max()))


def _vertical_range(
    lines: dict[float, np.ndarray], fitted: tuple[float, float] | None
) -> tuple[float, float]:
    """Return the ordinate range that shows the lines, limited near the fitted range."""
    drawn = np.concatenate(list(lines.values()))
    drawn = drawn[np.isfinite(drawn)]
    bottom, top = 0.8 * float(drawn.min()), 1.25 * float(drawn.max())
    if fitted is None:
        return max(bottom, 1e-4 * top), top
    return max(bottom, fitted[0] / _SPAN), min(top, max(_SPAN * fitted[1], 2.0 * bottom))


def _digits(ratio: float, size_pt: float, apart_pt: float) -> tuple[float, ...]:
    """Return the leading digits of axis labels that fit the available space."""
    usual = (1.0, 2.0, 5.0)
    return usual if size_pt > len(usual) * apart_pt * math.log10(ratio) else usual[:1]


def _draw_kr_axis(axes: Axes, p2: float, digits: Sequence[float]) -> None:
    """Add an axis of k_r for blocks of one size, right of the probabilities."""
    from matplotlib.ticker import NullLocator

    per_kr = STANDARD_GRAVITY_M_S2 / math.sqrt(p2)
    beside = axes.secondary_yaxis(
        1.0 + _KR_AXIS_OFF_PT / _size_pt(axes)[0],
        functions=(lambda y: np.asarray(y) / per_kr, lambda kr: np.asarray(kr) * per_kr),
    )
    canvas.written_numbers(beside.yaxis, *digits)
    beside.yaxis.set_minor_locator(NullLocator())
    beside.set_ylabel(f"$k_r$ at $p^2$ = {p2:.3g} s$^{{-2}}$")


def _write_beside(axes: Axes, x: np.ndarray, lines: dict[float, np.ndarray]) -> None:
    """Write the probabilities right of the axes, each joined to the end of its line."""
    x_left, x_right = np.log(axes.get_xlim())
    bottom, top = np.log(axes.get_ylim())
    ends = []
    for probability, y in lines.items():
        inside = np.flatnonzero(np.isfinite(y) & (y > np.exp(bottom)) & (y < np.exp(top)))
        if inside.size:
            at = inside[-1]
            across = float((np.log(x[at]) - x_left) / (x_right - x_left))
            ends.append((float((np.log(y[at]) - bottom) / (top - bottom)), across, probability))
    ends.sort()
    width_pt, height_pt = _size_pt(axes)
    beside = 1.0 + _LABEL_OFF_PT / width_pt
    positions = canvas.spread_out([up for up, *_ in ends], _LABEL_APART_PT / height_pt, 0.01, 0.99)
    for position, (up, across, probability) in zip(positions, ends, strict=True):
        text = exact_percent(probability)
        axes.plot(
            [across, beside - 0.005], [up, position], color=canvas.BLUE, lw=0.5,
            transform=axes.transAxes, clip_on=False, label=f"_{text}",
        )  # fmt: skip
        axes.text(
            beside, position, text, fontsize=8, va="center", color=canvas.BLUE,
            transform=axes.transAxes, fontweight="bold" if probability in _BOLD else "normal",
        )  # fmt: skip


def _size_pt(axes: Axes) -> tuple[float, float]:
    """Return width and height of axes before the layout of the figure [points]."""
    box = axes.get_window_extent()
    return 72.0 * box.width / axes.figure.dpi, 72.0 * box.height / axes.figure.dpi


def _shade_outside(axes: Axes, across: tuple[float, float], up: tuple[float, float] | None) -> None:
    x_left, x_right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    shade: dict[str, Any] = {"facecolor": "#8a8a8a", "alpha": 0.25, "lw": 0.0, "zorder": 0.5}
    axes.axvspan(x_left, across[0], **shade)
    axes.axvspan(across[1], x_right, **shade)
    if up is not None:
        axes.axhspan(bottom, max(float(up[0]), bottom), **shade)
        axes.axhspan(min(float(up[1]), top), top, **shade)


def _shade_where_not_fitted(axes: Axes, model: FragilityModel, held: HeldMeasures) -> None:
    """Shade where the combination of block and motion lies outside the fitted range."""
    x, y = (np.geomspace(*ends, _NODES) for ends in (axes.get_xlim(), axes.get_ylim()))
    outside = np.where(_is_fitted(model, held, *np.meshgrid(x, y)), 0.0, 1.0)
    axes.contourf(x, y, outside, [0.5, 1.5], colors="#8a8a8a", alpha=0.25, zorder=0.5)


def _is_fitted(
    model: FragilityModel, held: HeldMeasures, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return where intensities x and velocities y, of one shape, lie within the fitted range."""
    kr = np.nan_to_num(y) * math.sqrt(held.p2) / STANDARD_GRAVITY_M_S2
    answers = array_answer(model, held.values(model, x, kr))
    fitted: np.ndarray = answers.in_domain & np.isfinite(y)
    return fitted


def _caption(model: FragilityModel, held: HeldMeasures) -> str:
    fitted = describe.fitted_data(model.row.diagnostics)
    return (
        f"{as_written(f'Probability that the block topples: model {model.name}', 85)}\n"
        f"{held.words + chr(10) if held.words else ''}"
        f"{fitted + '; ' if fitted else ''}shaded: outside the fitted range"
    )
