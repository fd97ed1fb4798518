"""Design charts for reading by hand: of toppling, and of the other kinds of failure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written
from rbfrag.plots.curve import AXIS
from rbfrag.plots.equation import equation_lines
from rbfrag.plots.model_lines import HeldMeasures, failure_line, held_measures
from rbfrag.results.numbers import exact_percent
from rbfrag.vocabulary.quantities import QUANTITIES

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

_DEFAULT_RANGE, _WIDEST = (0.01, 2.0), (1e-3, 10.0)
"""Range of the abscissa [m/s or g] where none is fitted, and where the fitted one is looked for."""


@canvas.in_own_style
def plot_chart(
    model: FragilityModel, path: canvas.Out, held: HeldMeasures | None = None
) -> canvas.Picture:
    """Draw lines of equal probability of toppling over intensity and block.

    The ordinate is the block's toppling velocity k_r g/p, and of blocks of a given size k_r.
    Further predictors are held constant, as the caption says: the size of the block, T_m, and PGA
    of a model of PGV with PGA, which is drawn over PGV. The sheet reaches little beyond the ranges
    that were fitted, and is shaded there. The equation of the model stands below.

    Args:
        model: a model with a chart (:func:`rbfrag.plots.model_lines.chart_axis`).
        held: what is held; None for the middle of the fitted ranges.
    """
    canvas.plot_path(path)
    held = held_measures(model) if held is None else held
    figure = canvas.new_figure(7.4, 7.4)
    axes = figure.add_subplot()
    draw_chart(axes, model, held)
    fitted = describe.fitted_data(model.row.diagnostics)
    axes.set_title(
        f"{as_written(f'Probability that the block topples: model {model.name}', 85)}\n"
        f"{held.words + chr(10) if held.words else ''}"
        f"{fitted + '; ' if fitted else ''}shaded: outside the fitted range",
        fontsize=10,
    )
    figure.supxlabel("\n".join(equation_lines(model, held.p2)), fontsize=8)
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
        point: abscissa and toppling velocity [m/s] of a block to show.
    """
    from matplotlib.ticker import NullLocator

    across, up = _known_ranges(model, held)
    ends = [*across, *([] if point is None else [point[0]])]
    x = np.geomspace(min(ends) / _SPAN, _SPAN * max(ends), _POINTS)
    lines = {p: failure_line(model, x, p, held) for p in CONTOURS}
    drawn = np.concatenate(list(lines.values()))
    drawn = drawn[np.isfinite(drawn)]
    bottom, top = 0.8 * float(drawn.min()), 1.25 * float(drawn.max())
    if up is None:
        bottom = max(bottom, 1e-4 * top)
    else:
        bottom, top = max(bottom, up[0] / _SPAN), min(top, max(_SPAN * up[1], 2.0 * bottom))
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
        # where the combination of block and motion lies outside the fitted range
        nodes = [np.geomspace(*ends, _NODES) for ends in (axes.get_xlim(), axes.get_ylim())]
        outside = np.where(_is_fitted(model, held, *np.meshgrid(*nodes)), 0.0, 1.0)
        axes.contourf(*nodes, outside, [0.5, 1.5], colors="#8a8a8a", alpha=0.25, zorder=0.5)
    else:
        shade: dict[str, Any] = {"facecolor": "#8a8a8a", "alpha": 0.25, "lw": 0.0, "zorder": 0.5}
        axes.axvspan(x[0], across[0], **shade)
        axes.axvspan(across[1], x[-1], **shade)
        if up is not None:
            axes.axhspan(bottom, max(up[0], bottom), **shade)
            axes.axhspan(min(up[1], top), top, **shade)
    of_term = held.across == "intensity_m_s"
    axes.set_xlabel(model.term.label if of_term else AXIS[held.across])
    axes.set_ylabel("toppling velocity of the block, $y = k_r\\,g/p$ [m/s]")
    axes.grid(visible=True, which="major", lw=0.6, color="#9a9a9a")
    axes.grid(visible=True, which="minor", lw=0.3, color="#c8c8c8")
    axes.set_axisbelow(True)
    if held.size_is_given:
        # an axis of k_r for blocks of one size, right of the probabilities
        per_kr = STANDARD_GRAVITY_M_S2 / math.sqrt(held.p2)
        kr_axis = axes.secondary_yaxis(
            1.0 + _KR_AXIS_OFF_PT / width_pt,
            functions=(lambda y: np.asarray(y) / per_kr, lambda kr: np.asarray(kr) * per_kr),
        )
        canvas.written_numbers(kr_axis.yaxis, *digits[1])
        kr_axis.yaxis.set_minor_locator(NullLocator())
        kr_axis.set_ylabel(f"$k_r$ at $p^2$ = {held.p2:.3g} s$^{{-2}}$")
    if point is not None:
        axes.plot(
            *point, "o", ms=8, color=canvas.RED, mec="white", mew=1.2, zorder=9, label="_point"
        )
        for xs, ys in (([point[0]] * 2, [bottom, point[1]]), ([x[0], point[0]], [point[1]] * 2)):
            axes.plot(xs, ys, color=canvas.RED, lw=0.9, ls="--", zorder=3, label="_guide")


def _known_ranges(
    model: FragilityModel, held: HeldMeasures
) -> tuple[tuple[float, float], tuple[float, float] | None]:
    """Return the fitted ranges of the abscissa and of y, for the held variables."""
    domain = model.row.domain
    fitted_x = domain.get(held.across) or (_WIDEST if held.words else _DEFAULT_RANGE)
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
        return _DEFAULT_RANGE, up
    x = x[inside.any(axis=0)]
    return (float(x[0]), float(x[-1])), (float(y[inside].min()), float(y[inside].max()))


def _digits(ratio: float, size_pt: float, apart_pt: float) -> tuple[float, ...]:
    """Return the leading digits of axis labels that fit the available space."""
    usual = (1.0, 2.0, 5.0)
    return usual if size_pt > len(usual) * apart_pt * math.log10(ratio) else usual[:1]


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
    label_x = 1.0 + _LABEL_OFF_PT / width_pt
    positions = canvas.spread_out([up for up, *_ in ends], _LABEL_APART_PT / height_pt, 0.01, 0.99)
    for position, (up, across, probability) in zip(positions, ends, strict=True):
        text = exact_percent(probability)
        axes.plot(
            [across, label_x - 0.005], [up, position], color=canvas.BLUE, lw=0.5,
            transform=axes.transAxes, clip_on=False, label=f"_{text}",
        )  # fmt: skip
        axes.text(
            label_x, position, text, fontsize=8, va="center", color=canvas.BLUE,
            transform=axes.transAxes, fontweight="bold" if probability in _BOLD else "normal",
        )  # fmt: skip


def _size_pt(axes: Axes) -> tuple[float, float]:
    """Return width and height of axes before the layout of the figure [points]."""
    box = axes.get_window_extent()
    return 72.0 * box.width / axes.figure.dpi, 72.0 * box.height / axes.figure.dpi


def _is_fitted(
    model: FragilityModel, held: HeldMeasures, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return where intensities x and velocities y, of one shape, lie within the fitted range."""
    kr = np.nan_to_num(y) * math.sqrt(held.p2) / STANDARD_GRAVITY_M_S2
    answers = array_answer(model, held.values(model, x, kr))
    fitted: np.ndarray = answers.in_domain & np.isfinite(y)
    return fitted


@canvas.in_own_style
def plot_kind_chart(
    model: FragilityModel, path: canvas.Out, options: Mapping[str, float]
) -> canvas.Picture:
    """Draw lines of equal probability against a model's first measure and the yield.

    What else the model reads is held at the middle of its fitted range; measures keep the middle
    ratio to the first. The caption says at what; what was not fitted is shaded.

    Args:
        model: a model of any kind.
        path: file to write.
        options: what is held at other values, by field.

    Raises:
        InputError: a value that is not above zero or not read, or a measure that does not go in
            proportion to the first.
    """
    canvas.plot_path(path)
    names, domain = model.method.block.names, model.row.domain
    strength = next(name for name in names if name.startswith("k"))
    first = "pgv_m_s" if "pgv_m_s" in model.term.inputs else model.term.inputs[0]
    other_names = [name for name in model.term.inputs if name != first]
    held = {name: math.sqrt(math.prod(domain[name])) for name in names if name != strength}
    held |= {"beta_deg": 0.0} if "beta_deg" in model.method.block.options else {}
    if "magnitude" in other_names:
        held["magnitude"] = sum(domain["magnitude"]) / 2.0
    for name, value in options.items():
        if name not in held and name not in other_names:
            raise InputError(
                f"{name} = {value:g} has no effect: model {model.name!r} does not use it, or it "
                "is an axis; omit it",
                fields=(name,),
            )
        if not 0.0 < value < math.inf:
            raise InputError(f"{name} = {value:g} is not above zero", fields=(name,))
    held |= options
    across = domain.get(first) or (0.02, 2.0)
    x = np.geomspace(max(across[0], 0.02), across[1], _NODES)
    y = np.geomspace(*(domain.get(strength) or (0.02, 1.0)), _NODES)
    xs, ys = np.meshgrid(x, y)
    inputs: dict[str, Any] = {first: xs, strength: ys, **held}
    ratios = []
    for name in other_names:
        if name not in inputs:
            inputs[name], words = _in_proportion(name, xs, model)
            ratios.append(words)
    answers = array_answer(
        model, {name: np.broadcast_to(v, xs.shape) for name, v in inputs.items()}
    )
    figure = canvas.new_figure(7.4, 6.6)
    axes = figure.add_subplot()
    canvas.logarithmic(axes, (1.0, 2.0, 5.0), (1.0, 2.0, 5.0))
    outside = np.where(answers.in_domain, 0.0, 1.0)
    axes.contourf(x, y, outside, [0.5, 1.5], colors="#8a8a8a", alpha=0.25)
    lines = axes.contour(x, y, answers.probability, CONTOURS, colors=canvas.BLUE, linewidths=1.1)
    label_points = _label_points(x, y, answers.probability)
    axes.clabel(lines, fmt=exact_percent, fontsize=8, manual=[*label_points])
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    about = QUANTITIES[first]
    axes.set_xlabel(f"{about.noun} [{about.unit}]")
    axes.set_ylabel(f"yield acceleration coefficient, $k_{{{strength[1:]}}}$")
    axes.grid(visible=True, which="both", lw=0.4, color="#c0c0c0")
    at = [" = ".join(describe.labelled_value(name, value, 3)) for name, value in held.items()]
    kind = model.method.block.kind.replace("_", " ")
    title = as_written(f"Probability of failure, {kind}: model {model.name}", 85)
    conditions = as_written(f"at {', '.join([*at, *ratios])}", 85)
    axes.set_title(f"{title}\n{conditions}\nshaded: outside the fitted range", fontsize=10)
    return canvas.save_figure(figure, path)


def _label_points(x: np.ndarray, y: np.ndarray, p: np.ndarray) -> Iterator[tuple[float, float]]:
    """Yield a label position on each line of the chart, staggered and away from the frame."""
    margin = _NODES // 12
    for level, height in zip(CONTOURS, np.linspace(0.85, 0.15, len(CONTOURS)), strict=True):
        column = (p < level).sum(axis=1)
        inside = np.flatnonzero((column > margin) & (column < _NODES - margin))
        inside = inside[(inside > margin) & (inside < _NODES - margin)]
        if inside.size:
            row = inside[np.abs(inside - height * _NODES).argmin()]
            yield float(x[column[row]]), float(y[row])


def _in_proportion(name: str, pgv: np.ndarray, model: FragilityModel) -> tuple[np.ndarray, str]:
    """Return a measure at the middle fitted ratio to PGV [m/s], and the ratio as text."""
    domain, g = model.row.domain, STANDARD_GRAVITY_M_S2
    if name == "pga_g":
        seconds = math.sqrt(math.prod(domain["pgv_over_pga_s"]))
        return pgv / (seconds * g), f"PGV/(PGA g) = {seconds:.3g} s"
    if name == "arias_m_s" and name in domain:
        # twice the acceleration is four times the intensity
        of = math.sqrt(math.prod(domain[name])) / math.prod(domain["pgv_m_s"])
        return of * pgv**2, f"Arias/PGV² = {of:.3g} s/m"
    raise InputError(
        f"model {model.name!r} uses {' and '.join(model.term.inputs)}, and {name} is not "
        "proportional to PGV: give it, or choose another model",
        fields=(name,),
    )
