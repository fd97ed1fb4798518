"""Design chart for kinds of failure other than toppling: P against shaking and yield."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots import canvas
from rbfrag.plots.chart import CONTOURS
from rbfrag.plots.labels import as_written
from rbfrag.results.numbers import exact_percent
from rbfrag.vocabulary.quantities import QUANTITIES

_NODES = 241
_PERIODS_S = {"sa03_g": ("sa03_over_pga", 0.0), "sa10_g": ("v10_over_pgv", 1.0),
              "sa30_g": ("v30_over_pgv", 3.0)}  # fmt: skip


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
    first, *other_names = model.term.inputs
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
            inputs[name], words = _in_proportion(name, first, xs, model)
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
    label_points = list(_label_points(x, y, answers.probability))
    axes.clabel(lines, fmt=exact_percent, fontsize=8, manual=label_points)
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


def _in_proportion(
    name: str, first: str, x: np.ndarray, model: FragilityModel
) -> tuple[np.ndarray, str]:
    """Return a measure at the middle fitted ratio to the first one, and the ratio as text."""
    domain, g = model.row.domain, STANDARD_GRAVITY_M_S2

    def middle(ratio: str) -> float:
        return math.sqrt(math.prod(domain[ratio]))

    seconds = middle("pgv_over_pga_s")
    pgv = x if first == "pgv_m_s" else x * seconds * g if first == "pga_g" else None
    if first == "sa10_g":
        pgv = x * g / (2.0 * math.pi * middle("v10_over_pgv"))
    if pgv is not None and name == "pga_g":
        return pgv / (seconds * g), f"PGV/(PGA g) = {seconds:.3g} s"
    if pgv is not None and name in _PERIODS_S:
        ratio, period_s = _PERIODS_S[name]
        of = middle(ratio)
        sa = of * pgv * 2.0 * math.pi / (period_s * g) if period_s else of * pgv / (seconds * g)
        return sa, f"{ratio.replace('_over_', '/')} = {of:.3g}"
    if pgv is not None and name == "arias_m_s" and name in domain:
        # twice the acceleration is four times the intensity
        of = middle(name) / math.prod(domain["pgv_m_s"])
        return of * pgv**2, f"Arias/PGV² = {of:.3g} s/m"
    raise InputError(
        f"model {model.name!r} uses {' and '.join(model.term.inputs)}, and {name} is not "
        f"proportional to {first}: give it, or choose another model",
        fields=(name,),
    )
