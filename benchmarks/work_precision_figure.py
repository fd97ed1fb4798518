"""The work-precision plot: time of a run against its error, both logarithmic."""

from __future__ import annotations

from collections.abc import Sequence

from rbfrag.bench.work_precision import WorkPrecision
from rbfrag.plots import canvas
from rbfrag.plots.labels import write_near

ROUNDING = 1e-16
"""Errors below are drawn here: nothing smaller can be told apart."""

OURS = ("#08306b", "#2171b5", "#6baed6")
PEERS = ("#7f7f7f", "#e08214", "#b35806", "#8c6d31", "#c44e52", "#7b3294")
MARKERS = ("s", "D", "^", "v", "P", "X")


@canvas.in_own_style
def plot_work_precision(points: Sequence[WorkPrecision], path: canvas.Out) -> canvas.Picture:
    """Draw time against error, a marker per method and setting, and write it to `path`.

    The marker is at the median error, a thin bar reaches to the worst. Open markers had
    wrong outcomes, which no error tells of.

    Args:
        points: measured methods; those of a family in the order of their settings.
    """
    figure = canvas.new_figure(width_in=8.0, height_in=5.4)
    axes = figure.subplots()
    families = list(dict.fromkeys(point.family for point in points))
    ours = peers = 0
    for family in families:
        if family.startswith("rbfrag"):
            color, marker = OURS[ours % len(OURS)], "o"
            ours += 1
        else:
            color = PEERS[peers % len(PEERS)]
            marker = MARKERS[peers % len(MARKERS)]
            peers += 1
        line = [p for p in points if p.family == family and p.error_median is not None]
        error = [max(p.error_median or 0.0, ROUNDING) for p in line]
        worst = [max(p.error_worst or 0.0, ROUNDING) for p in line]
        time_s = [p.time_s for p in line]
        axes.plot(error, time_s, color=color, lw=1.0, zorder=2)
        axes.hlines(time_s, error, worst, color=color, lw=0.8, alpha=0.4, zorder=1)
        axes.scatter(
            error, time_s, marker=marker, s=30, edgecolors=color, zorder=3, label=family,
            c=["white" if p.wrong else color for p in line],
        )  # fmt: skip
        for p, x, y in zip(line, error, time_s, strict=True):
            label = p.setting.removeprefix("order ").removeprefix("rtol ")
            write_near(axes, label, (x, y), (4, 4), fontsize=6.5, color=color)
            if p.of_use:
                axes.scatter([x], [y], s=150, facecolors="none", edgecolors="black", zorder=4)
                write_near(axes, "as used", (x, y), (0, -15), fontsize=8)
    canvas.logarithmic(axes)
    axes.invert_xaxis()
    axes.set_xlabel("relative error of the peak rotation: median (marker) to worst (bar)")
    axes.set_ylabel("median time of one run [s]")
    canvas.light_grid(axes)
    axes.legend(fontsize=7.5, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return canvas.save_figure(figure, path)
