"""Fragility curve of one block: probability of failure against an intensity measure."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.measures import AMPLIFIED
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots import canvas
from rbfrag.plots.canvas import BLUE, RED, as_written
from rbfrag.question.keywords import LEVEL
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.kinds import mode_of_kind
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import MEASURES, QUANTITIES
from rbfrag.vocabulary.spectral import SpectralMapping

if TYPE_CHECKING:
    from matplotlib.axes import Axes


AXIS = SpectralMapping(
    {
        name: f"{measure.axis} [{QUANTITIES[name].unit}]"
        for name, measure in MEASURES.items()
        if measure.axis
    },
    lambda name: f"{MEASURES[name].axis} [{QUANTITIES[name].unit}]", "sa_g",
)  # fmt: skip
"""What a curve may run over."""

EVENT = "#b8b8b8"
_COLOURS = (RED, "#4d9221", "#e08214", "#762a83", "#636363")
_STYLES = ("-", "--", "-.", ":")
MOST_COMPARED = len(_COLOURS) * len(_STYLES)
_LETTERS, _LINE_IN = 45, 0.18
"""Of a line of the legend: how many it holds, and its height [inch]."""
_POINTS = 241
_START = 1e-6


FAILS = {"topple": "topples", "slide": "slides too far", "slump": "slumps"}
"""What a block does, by its mode."""

_SUBSCRIPT = re.compile(r"([kp])_([a-z])")


@canvas.in_own_style
def plot_curve(
    model: FragilityModel,
    block: Mapping[str, float],
    path: canvas.Out,
    *,
    over: str | None = None,
    fixed: Mapping[str, float] | None = None,
    level: float = LEVEL,
    compared: Mapping[str, Callable[[FloatArray], FloatArray]] | None = None,
    sites: float | None = None,
) -> canvas.Picture:
    """Draw the fragility curve of one block with its confidence interval.

    P is the share of such blocks that fail over all earthquakes and sites with this shaking, its
    interval how well the data tell it. With `sites` a wide band is the share of like blocks that
    fails at so many sites of one earthquake. Outside the fitted ranges the curve is dashed.

    Args:
        over: the measure along the abscissa, by name; None for the one that the model's term
            names first.
        fixed: the other measures that the term reads, by name, held at one value.
        compared: other fragilities of the same measure to be drawn for comparison, by name:
            probabilities at levels of it.
        sites: number of sites of one earthquake; None for no band.

    Raises:
        InputError: a value that cannot be used, a measure that is missing, too many to compare
            with, or a path that cannot be written.
    """
    canvas.plot_path(path)
    compared = compared or {}
    varied = model.term.inputs[0] if over is None else over
    if varied not in model.term.inputs or varied not in AXIS:
        raise InputError(
            f"model {model.name!r} uses {' and '.join(model.term.inputs)}, not {varied}"
        )
    fixed_names = [name for name in model.term.inputs if name != varied]
    missing = [name for name in fixed_names if name not in (fixed or {})]
    if missing:
        raise InputError(
            f"model {model.name!r} uses {' and '.join(model.term.inputs)}: give "
            f"{' and '.join(missing)} for the curve"
        )
    held = {name: float((fixed or {})[name]) for name in fixed_names}
    if len(compared) > MOST_COMPARED:
        raise InputError(
            f"{len(compared)} fragility functions for comparison: the maximum is {MOST_COMPARED}"
        )
    lines = max((as_written(name, _LETTERS).count("\n") + 1 for name in compared), default=0)
    figure = canvas.new_figure(7.0, 4.6 + _LINE_IN * lines * math.ceil(len(compared) / 2))
    axes = figure.add_subplot()
    draw_curve(axes, model, block, varied, held, level=level, compared=compared, sites=sites)
    y_m_s = _velocity_m_s(model, block)
    about_block = _SUBSCRIPT.sub(r"$\1_\2$", describe.labelled_values(block, 3))
    about_block += "" if y_m_s is None else f", $y$ = {y_m_s:.3g} m/s"
    about_block += f"; {describe.shaking({}, held)}" if held else ""
    fitted = describe.fitted_data(model.row.diagnostics)
    axes.set_title(
        "\n".join(wrap(f"block {about_block}", 85))
        + "\n"
        + as_written(", ".join(filter(None, (f"model {model.name}", fitted))), 85),
        fontsize=10,
    )
    canvas.legend_below(figure, 2)
    return canvas.save_figure(figure, path)


def draw_curve(
    axes: Axes,
    model: FragilityModel,
    block: Mapping[str, float],
    varied: str,
    held: Mapping[str, float],
    *,
    level: float = LEVEL,
    compared: Mapping[str, Callable[[FloatArray], FloatArray]] | None = None,
    at: float = 0.0,
    sites: float | None = None,
) -> None:
    """Draw the curve of :func:`plot_curve` into axes.

    Args:
        at: a value of the measure to point out, to which the held measures belong: those that grow
            with the amplitude of the shaking are in proportion to it; 0 for none.
        sites: number of sites of one earthquake; None for no band.
    """
    scaled = [name for name in held if at > 0.0 and name in AMPLIFIED]

    def inputs_at(x: FloatArray) -> dict[str, Any]:
        amplified = {name: held[name] * (x / at) ** AMPLIFIED[name] for name in scaled}
        return {**block, varied: x, **held, **amplified}

    end = max(_right_end(model, block, varied, inputs_at), 1.15 * at)
    x = np.linspace(0.0, end, _POINTS)
    x[0] = _START * end
    answer = array_answer(model, inputs_at(x), level, sites=sites)
    in_range = answer.in_domain
    percent = exact_percent(level)
    if sites is not None and not np.isnan(answer.event_low).all():
        axes.fill_between(
            x, answer.event_low, answer.event_high, color=EVENT, alpha=0.35, lw=0.0,
            label=f"{percent} prediction interval, {describe.at_sites(sites)}",
        )  # fmt: skip
    axes.fill_between(
        x, answer.ci_low, answer.ci_high, color=BLUE, alpha=0.35, lw=0.0,
        label=f"{percent} confidence interval",
    )  # fmt: skip
    if not in_range.all():
        axes.plot(
            x, answer.probability, "--", color=BLUE, lw=1.2, label="outside the fitted range"
        )  # fmt: skip
    fitted = np.where(in_range, answer.probability, np.nan)
    axes.plot(x, fitted, color=BLUE, lw=2.0, label="P: fraction over all earthquakes and sites")
    for i, (name, other) in enumerate((compared or {}).items()):
        colour, style = _COLOURS[i % len(_COLOURS)], _STYLES[i // len(_COLOURS)]
        axes.plot(x, other(x), style, color=colour, lw=1.4, label=as_written(name, _LETTERS))
    axes.set(xlim=(0.0, end), ylim=(0.0, 1.0))
    fails = FAILS.get(mode_of_kind(model.row.kind), "fails")
    axes.set(xlabel=AXIS[varied], ylabel=f"probability that the block {fails}")
    canvas.light_grid(axes)
    if scaled:
        axes.set_title("other measures in proportion", fontsize=8)
    if at > 0.0:
        pointed = array_answer(model, inputs_at(np.array([at])), level)
        p = float(pointed.probability[0])
        axes.plot([at, at, 0.0], [0.0, p, p], color=RED, lw=0.9, ls="--")
        axes.plot(at, p, "o", ms=8, color=RED, mec="white", mew=1.2, zorder=9)


def _velocity_m_s(model: FragilityModel, block: Mapping[str, float]) -> float | None:
    """Return the velocity k g/p of a block [m/s]; None for a block without a size."""
    of = model.method.block
    if of.size is None:
        return None
    return block[of.strength] * STANDARD_GRAVITY_M_S2 / math.sqrt(block[of.size])


def _right_end(
    model: FragilityModel,
    block: Mapping[str, float],
    varied: str,
    inputs_at: Callable[[FloatArray], Mapping[str, Any]],
) -> float:
    """Return the intensity at which the curve nearly reaches its maximum, found by doubling."""
    k, y_m_s = block[model.method.block.strength], _velocity_m_s(model, block)
    if y_m_s is None:
        y_m_s = 0.1 * k
    unit = y_m_s if varied in ("pgv_m_s", "xp_m_s") else 0.1 * y_m_s if varied == "pgd_m" else k
    x = unit * 2.0 ** np.arange(0.0, 12.0, 0.5)
    answer = array_answer(model, inputs_at(x))
    top = float(np.nanmax(answer.probability))
    return float(x[int(np.argmax(answer.probability >= 0.97 * top))])
