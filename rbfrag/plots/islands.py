"""Islands of one motion: toppling and safe ranges of k_r/PGA, with the peak rotations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written, write_near
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.toppling_run import runner

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

BANDS = {"topples": "#e8b4b0", "safe": "#dce9f5", "undecided": "#8c8c8c"}
NAMES = {"topples": "all topple", "safe": "all stay", "undecided": "undecided"}
ROTATION = canvas.BLUE
CRITICAL = "#8b1a1a"
BOUND = "#5b3a86"

RUNS = 600
"""Blocks run for the curve of one panel."""

AROUND = 2.5
"""Widths of the widest safe island shown on both sides of it."""

LEAST_DRAWN = 3e-4
"""Part of a panel's width below which an undecided interval is not drawn: a border."""

NEAR_CRITICAL = 0.03
"""Relative distance shown on both sides of the critical value where there is no island."""


@canvas.in_own_style
def plot_islands(
    motion: GroundMotion,
    result: CriticalResult,
    path: canvas.Out,
    *,
    vertical: GroundMotion | None = None,
    title: str = "",
) -> canvas.Picture:
    """Draw the map of outcomes over k_r/PGA with the peak rotations, and an enlarged part.

    The bands are what the search proved for whole intervals; the curve is peak rotations of
    single blocks, broken where they topple.

    Args:
        motion: the horizontal motion that was searched.
        result: its critical search, made with ``full_map=True``.
        vertical: the vertical motion of that search.
    """
    if not result.intervals.outcome:
        why = f"no map of outcomes (status {result.status})"
        raise InputError(f"nothing to draw: {why}; islands need a motion that lifts blocks")
    excited = excitation(motion, vertical, result.polarity)
    figure = canvas.new_figure(width_in=7.5, height_in=6.2)
    overview, part = figure.subplots(2, 1)
    bottom = float(result.intervals.k_lo[0])
    upper = result.k_up_over_pga or bottom
    top = min(max(1.25 * upper, 2.0 * bottom), float(result.intervals.k_hi[-1]))
    low, high, caption = enlarged_range(result)
    _panel(overview, excited, result, bottom, top, logarithmic=True)
    _panel(part, excited, result, low, high, logarithmic=False)
    for edge in (low, high):
        overview.axvline(edge, color="black", lw=0.8, ls=":")
    write_near(
        overview, "enlarged below", (np.sqrt(low * high), 1.0), (0, 1), movable=False,
        xycoords=("data", "axes fraction"), fontsize=8, annotation_clip=False,
    )  # fmt: skip
    part.set_xlabel(f"$k_r$/PGA, {caption}")
    overview.set_xlabel("$k_r$/PGA")
    _legend(overview, result)
    name = f"{title}{', reversed' if result.polarity == 'reverse' else ''}"
    name += ", with vertical motion" if vertical is not None else ""
    figure.suptitle(f"{as_written(name, 85)}\n{_verdict(result)}", fontsize=10)
    return canvas.save_figure(figure, path)


def enlarged_range(result: CriticalResult) -> tuple[float, float, str]:
    """Return the range of k_r/PGA to enlarge, and its description.

    Around the widest safe island below the critical value, or around that value itself.
    """
    bottom = float(result.intervals.k_lo[0])
    top = float(result.intervals.k_hi[-1])
    if result.lower is None:
        return bottom, min(2.0 * bottom, top), "just above the search limit"
    toppling = [w == "topples" for w in result.intervals.outcome]
    first = toppling.index(True) if any(toppling) else len(toppling)
    intervals = result.intervals
    islands = [
        (float(high - low), float(low), float(high))
        for low, high, outcome in zip(
            intervals.k_lo[first:], intervals.k_hi[first:], intervals.outcome[first:], strict=True
        )
        if outcome == "safe" and high < result.lower
    ]
    if not islands:
        away = NEAR_CRITICAL * result.lower
        return (
            max(result.lower - away, bottom),
            min(result.lower + away, top),
            "at the critical value",
        )
    width, low, high = max(islands)
    low, high = max(low - AROUND * width, bottom), min(high + AROUND * width, top)
    return low, high, "around the widest safe island"


def _panel(
    axes: Axes,
    excited: Excitation,
    result: CriticalResult,
    low: float,
    high: float,
    *,
    logarithmic: bool,
) -> None:
    all_of = result.intervals
    for k_lo, k_hi, outcome in zip(all_of.k_lo, all_of.k_hi, all_of.outcome, strict=True):
        drawn = min(k_hi, high) - max(k_lo, low)
        if drawn > (LEAST_DRAWN * (high - low) if outcome == "undecided" else 0.0):
            axes.axvspan(k_lo, k_hi, color=BANDS[outcome], lw=0.0)
    ratios, theta_n = rotations(excited, result, low, high, logarithmic=logarithmic)
    axes.plot(ratios, theta_n, color=ROTATION, lw=1.0)
    axes.axhline(1.0, color="black", lw=0.6, ls="--")
    if result.k_up_over_pga is not None and low <= result.k_up_over_pga <= high:
        axes.axvline(result.k_up_over_pga, color=BOUND, lw=1.4, ls="--")
    if result.lower is not None and low <= result.lower <= high:
        axes.axvline(result.lower, color=CRITICAL, lw=1.4)
    if logarithmic:
        axes.set_xscale("log")
        canvas.written_numbers(axes.xaxis, 1.0, 2.0, 3.0, 5.0)
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, max(1.15, 1.08 * float(np.nanmax(theta_n, initial=0.0))))
    axes.set_ylabel(r"peak rotation $\theta/\theta_c$")


def rotations(
    excited: Excitation, result: CriticalResult, low: float, high: float, *, logarithmic: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return peak rotations of blocks from `low` to `high`, with extra blocks near the borders.

    Returns:
        k_r/PGA, rising, and peak rotations over the critical angle, NaN where blocks topple.
    """
    spread = np.geomspace(low, high, RUNS) if logarithmic else np.linspace(low, high, RUNS)
    # closer and closer to each border, where rotations change steeply and islands are narrow
    edges = np.concatenate([result.intervals.k_lo, result.intervals.k_hi])
    edges = edges[(edges >= low) & (edges <= high)]
    offsets = np.geomspace(1e-9, 1e-3, 7)
    beside = np.concatenate(
        [np.outer(edges, 1.0 - offsets).ravel(), np.outer(edges, 1.0 + offsets).ravel()]
    )
    ratios = np.sort(np.concatenate([spread, beside[(beside > low) & (beside < high)]]))
    run = runner(excited, p2=result.p2)
    kr = ratios * excited.pga_g
    theta_c = np.arctan(kr)
    return ratios, np.array([run(k).peak_rad for k in kr.tolist()]) / theta_c


def _legend(axes: Axes, result: CriticalResult) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = [
        Patch(color=BANDS[outcome], label=NAMES[outcome])
        for outcome in ("topples", "safe", "undecided")
        if outcome != "undecided" or result.intervals.outcome[0] == "undecided"
    ]
    handles.append(Line2D([], [], color=ROTATION, lw=1.0, label="peak rotation"))
    if result.lower is not None:
        handles.append(Line2D([], [], color=CRITICAL, lw=1.4, label="critical value"))
    if result.k_up_over_pga is not None:
        handles.append(Line2D([], [], color=BOUND, lw=1.4, ls="--", label="$K_{up}$"))
    axes.legend(
        handles=handles, fontsize=8, ncols=len(handles), loc="lower center",
        bbox_to_anchor=(0.5, 1.08), frameon=False,
    )  # fmt: skip


def _verdict(result: CriticalResult) -> str:
    block = f"$p^2$ = {result.p2:g} s$^{{-2}}$"
    if result.lower is None or result.upper is None:
        return f"{block}: no block down to $k_r$/PGA = {result.search_limit:g} topples"
    if not result.certified:
        return (
            f"{block}: critical $k_r$/PGA between {result.lower:.6g} and $K_{{up}}$ = "
            f"{result.upper:.6g}, not certified"
        )
    width = (result.upper - result.lower) / result.upper
    upper = f", $K_{{up}}$ = {result.k_up_over_pga:.6g}" if result.k_up_over_pga else ""
    return (
        f"{block}: critical $k_r$/PGA = {result.lower:.6g} (certified, bracket {width:.0e})"
        f"{upper} PGA"
    )
