"""Figure of an annual failure rate: which shaking it comes from."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from rbfrag.hazards.answer import HazardAnswer
from rbfrag.hazards.curve import HazardCurve
from rbfrag.plots.canvas import new_figure, plot_path, save_figure

_SHOWN = 1e-4
_NAMES = {
    "pga_g": "peak ground acceleration, PGA [g]",
    "pgv_m_s": "peak ground velocity, PGV [m/s]",
}


def plot_contribution(curve: HazardCurve, found: HazardAnswer, path: str | PathLike[str]) -> Path:
    """Draw a hazard curve and, below it, where the failures of the first block come from.

    Args:
        curve: the hazard curve.
        found: the answer; its first block is drawn.
        path: file to write: .png, .pdf or .svg.
    """
    plot_path(path)
    figure = new_figure(6.4, 6.4)
    top, bottom = figure.subplots(2, 1, sharex=True)
    top.loglog(curve.levels, curve.annual_rate, "o-", color="black", ms=3.5, lw=1.4)
    top.set_ylabel("exceedances a year, λ [1/a]")
    place = f" at {curve.place}" if curve.place else ""
    top.set_title(
        f"hazard of {curve.imt}{place}: the block topples {found.annual_rate[0]:.3g} times a year\n"
        f"({100 * found.level:g} % interval {found.ci_low[0]:.3g} to {found.ci_high[0]:.3g}, "
        f"model {found.model}; {100 * found.probability[0]:.3g} % in {found.years:g} years)",
        fontsize=10,
    )
    width = np.diff(np.log10(found.edges))
    share = 100.0 * found.contribution[0] / max(found.annual_rate[0], np.finfo(float).tiny)
    bottom.bar(
        found.edges[:-1],
        share / width,
        width=np.diff(found.edges),
        align="edge",
        color="#2b6cac",
        edgecolor="white",
        linewidth=0.3,
    )
    bottom.set_ylabel("share of the rate\n[% per decade of shaking]")
    name = _NAMES.get(curve.measure, f"spectral acceleration, {curve.imt} [g]")
    bottom.set_xlabel(name)
    seen = share > _SHOWN * max(float(share.max()), np.finfo(float).tiny)
    if seen.any():
        places = np.flatnonzero(seen)
        bottom.set_xlim(found.edges[places[0]], found.edges[places[-1] + 1])
        inside = (curve.levels >= found.edges[places[0]]) & (
            curve.levels <= found.edges[places[-1] + 1]
        )
        if inside.sum() > 1:
            rates = curve.annual_rate[inside]
            top.set_ylim(0.5 * rates.min(), 2.0 * rates.max())
    beyond = 100.0 * found.above[0] / max(found.annual_rate[0], np.finfo(float).tiny)
    if beyond >= 0.05:
        bottom.set_title(
            f"{beyond:.2g} % more from beyond the end of the curve", fontsize=9, loc="right"
        )
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    bottom.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bottom.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    bottom.xaxis.set_minor_formatter(NullFormatter())
    for axes in (top, bottom):
        axes.grid(True, which="major", color="#dddddd", lw=0.6)
        axes.set_axisbelow(True)
    return save_figure(figure, path)
