"""Figure of the exceedance curves of failures and losses under an event set."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.hazards.loss_answer import Exceedance, LossAnswer
from rbfrag.hazards.uncertainty import LOGIC_TREE_LEVEL, SOURCES
from rbfrag.plots import canvas
from rbfrag.results.numbers import exact_percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = (canvas.BLUE, canvas.RED)
_LOWEST = 0.05  # of one event in the effective time


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
    scenario = answer.events.is_scenario
    for axes, (title, curves) in zip(all_axes, panels, strict=True):
        _draw(axes, answer, curves)
        axes.set_xlabel(f"{title}, at least")
        axes.set_ylabel(
            "probability given the event" if scenario else "annual rate of exceedance [yr⁻¹]"
        )
        canvas.open_corner(axes)
    canvas.light_grid(*all_axes)
    canvas.legend_below(figure, 4)
    return canvas.save_figure(figure, out)


_BANDS: Mapping[str, Mapping[str, Any]] = {
    "event_set_sampling": {"fc": "#00000014", "ec": "#777777", "ls": ":"},
    "logic_tree": {"fc": "#c2410c30", "ec": "none"},
    "fragility": {"fc": "#2b6cac66", "ec": "none"},
}
"""How the bands of the sources of uncertainty are drawn, the widest first."""


def _draw(axes: Axes, answer: LossAnswer, curves: Mapping[str, Sequence[Exceedance]]) -> None:
    axes.set_yscale("log")
    drawn = [curve for curve in curves.values() if curve]
    values = [point.value for curve in drawn for point in curve]
    if drawn and max(values) > 30.0:
        axes.set_xscale("log")
        digits = (1.0,) if max(values) > 30.0 * min(values) else (1.0, 2.0, 5.0)
        canvas.written_numbers(axes.xaxis, *digits)
    place = axes.get_subplotspec()
    assert place is not None  # it was made as one of a row
    first = not place.colspan.start
    several = len(curves) > 1
    for colour, (law, curve) in zip(_COLOURS, curves.items(), strict=False):
        if not curve:
            continue
        x = [point.value for point in curve]
        of = f" ({law})" if several else ""
        for source, style in _BANDS.items():
            ends = [getattr(point, source) or (math.nan, math.nan) for point in curve]
            low, high = zip(*ends, strict=True)
            if not all(map(math.isnan, low)):
                level = LOGIC_TREE_LEVEL if source == "logic_tree" else answer.level
                axes.fill_between(
                    x, low, high, lw=0.9, **style,
                    label=f"{exact_percent(level)} {SOURCES[source]}"
                    if first and law == next(iter(curves)) else None,
                )  # fmt: skip
        axes.plot(
            x, [point.annual_rate for point in curve], "o-", color=colour, ms=3.0, lw=1.5,
            label=f"events{of}" if first else None,
        )  # fmt: skip
        sums = [point.sum_of_year for point in curve if point.sum_of_year is not None]
        if sums:
            axes.plot(
                x, sums, "--", color=colour, lw=1.1,
                label=f"sum of a year{of}, probability" if first else None,
            )  # fmt: skip
    effective = answer.events.effective_years
    if drawn and effective is not None:
        years = f"{effective:,.0f}" if effective >= 100.0 else f"{effective:.3g}"
        lowest = 0.3 * min(curve[-1].annual_rate for curve in drawn)
        highest = 2.0 * max(max(x[0].event_set_sampling[1], x[0].fragility[1]) for x in drawn)
        axes.set_ylim(min(max(lowest, _LOWEST / effective), 0.5 / effective), highest)
        axes.axhspan(
            axes.get_ylim()[0], 1.0 / effective, color="#dddddd", alpha=0.6, lw=0.0,
            label=f"less than once in {years} years" if first else None,
        )  # fmt: skip
