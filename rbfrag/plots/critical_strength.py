"""Critical strengths: against frequency, with vertical motion, and the islands of one motion.

In the linear model a pulse of amplitude A and duration t_p topples blocks of critical angle up
to c·A, c a function of f = p t_p alone (docs/theory/toppling-spectrum.md, properties). Against
the records a pulse stands for half a mean period, t_p = T_m/2, so that f = π/(ω_m/p): the lines of
figure 4.20 of Gibson's dissertation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize.elementwise import find_root

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written, write_near
from rbfrag.results.numbers import percent
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.results import FloatArray
from rbfrag.solver.toppling_run import runner

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray


def rectangular_pulse(f: ArrayLike) -> FloatArray:
    """Return the critical angle over the amplitude of a rectangular pulse, f = p t_p > 0."""
    line: FloatArray = -np.expm1(-np.asarray(f, dtype=np.float64))
    return line


def triangular_pulse(f: ArrayLike) -> FloatArray:
    """Return the critical angle over the amplitude of a symmetric triangle, f = p t_p > 0."""
    of = np.asarray(f, dtype=np.float64)
    # ln(2 - e) as ln(1 + (1 - e)): no cancellation for short pulses; the rest of it by series
    half = 0.5 * of
    exact = 1.0 - np.log1p(-np.expm1(-half)) / half
    series = half * (1.0 - half + 13.0 / 12.0 * half * half)
    line: FloatArray = np.where(half < 1e-5, series, exact)
    return line


def half_sine_pulse(f: ArrayLike) -> FloatArray:
    """Return the critical angle over the amplitude of a half-sine, f = p t_p > 0.

    sin s with x sin s − cos s = exp(−(π − s)/x), x = π/f.
    """
    x = np.pi / np.asarray(f, dtype=np.float64)

    def balance(s: FloatArray, x: FloatArray) -> FloatArray:
        return np.asarray(x * np.sin(s) - np.cos(s) - np.exp(-(np.pi - s) / x))

    root = find_root(balance, (0.0, 0.5 * np.pi), args=(x,))
    return np.asarray(np.sin(root.x), dtype=np.float64)


PULSES: Mapping[str, Callable[[ArrayLike], FloatArray]] = {
    "rectangular": rectangular_pulse,
    "half-sine": half_sine_pulse,
    "triangular": triangular_pulse,
}
"""The pulses by name, the one that topples most first."""


def pulse_line(name: str, frequency_ratio: ArrayLike) -> FloatArray:
    """Return the k_r/PGA of a pulse of half a mean period over ω_m/p, > 0.

    Args:
        name: one of :data:`PULSES`.
        frequency_ratio: ω_m/p = 2π/(T_m p).
    """
    return PULSES[name](np.pi / np.asarray(frequency_ratio, dtype=np.float64))


STYLES = {
    "rectangular": ("-", canvas.RED),
    "half-sine": ("--", canvas.BLUE),
    "triangular": ("-.", "#2e7d32"),
}


@canvas.in_own_style
def plot_critical(table: CombinationTable, path: canvas.Out, *, data: str = "") -> canvas.Picture:
    """Draw critical k_r/PGA against ω_m/p with the lines of pulses half a mean period long.

    The legend says how many of the critical values lie above each line.

    Args:
        data: what the data are, for the title.

    Raises:
        InputError: no critical value of a motion with a mean period, or a path that cannot
            be written.
    """
    canvas.plot_path(path)
    ratio = 2.0 * np.pi / (table.tm_s * np.sqrt(table.p2))
    shown = (table.status == "found") & np.isfinite(ratio) & np.isfinite(table.kr_over_pga)
    if not shown.any():
        raise InputError("no critical values of motions with a mean period: run  rbfrag simulate")
    x, y = ratio[shown], table.kr_over_pga[shown]
    censored = np.isin(table.status.astype(str), ("below_limit", "no_motion"))
    below = int(censored.sum())
    limit = float(table.search_limit[shown | censored].min())
    figure = canvas.new_figure(7.4, 5.6)
    axes = figure.add_subplot()
    x_left, x_right = 0.8 * float(x.min()), 1.25 * float(x.max())
    bottom, top = 0.8 * min(limit, float(y.min())), 1.25 * max(1.0, float(y.max()))
    canvas.logarithmic(axes)
    canvas.density(figure, axes, x, y, (x_left, x_right), (bottom, top))
    line_x = np.geomspace(x_left, x_right, 300)
    for name in PULSES:
        style, colour = STYLES[name]
        above = int(np.sum(y > pulse_line(name, x)))
        label = f"{name} pulse: {above} above ({percent(above / x.size)})"
        axes.plot(line_x, pulse_line(name, line_x), style, color=colour, lw=1.8, label=label)
    if below:
        axes.axhline(limit, color="black", lw=1.0, ls=":", label=f"search limit: {below} below it")
    axes.set_xlabel(r"frequency of the motion over that of the block, $\omega_m/p$")
    axes.set_ylabel(r"critical strength, $k_r/\mathrm{PGA}$")
    events = len(set(table.event_id[shown].tolist()))
    motions = len(set(table.motion_id[shown].tolist()))
    axes.set_title(
        f"{x.size} critical blocks, {motions} motions of {events} earthquakes"
        + (f"\n{as_written(data, 85)}" if data else ""),
        fontsize=10,
    )
    canvas.light_grid(axes)
    canvas.logarithmic(axes, (1.0, 2.0, 5.0), (1.0, 2.0, 5.0))
    canvas.legend_below(figure, 2)
    return canvas.save_figure(figure, path)


_NARROWEST, _WIDEST = 0.05, 0.5
"""Least and greatest change of strength, in ln, that the histogram reaches to."""


@dataclass(frozen=True, eq=False)
class VerticalPairs:
    """Critical values of the same motion, polarity and p², found with and without vertical motion.

    Args:
        ln_ratio: ln of the critical value with over that without, shape (n,).
        without: k_r/PGA without vertical motion, shape (n,).
        with_vertical: k_r/PGA with it, shape (n,).
        p2: frequency parameters [1/s²], shape (n,).
        event_id: earthquakes, shape (n,).
        one_sided: pairs of which only one was found, and that are left out.
    """

    ln_ratio: FloatArray
    without: FloatArray
    with_vertical: FloatArray
    p2: FloatArray
    event_id: NDArray[np.object_]
    one_sided: int


def vertical_pairs(without: CombinationTable, with_vertical: CombinationTable) -> VerticalPairs:
    """Return the pairs of two tables; values in only one of them have no pair."""

    import pandas as pd  # the map of islands does without

    def combinations(table: CombinationTable) -> pd.DataFrame:
        columns = {name: getattr(table, name) for name in ("motion_id", "polarity", "p2")}
        return pd.DataFrame({**columns, "row": np.arange(table.p2.size)})

    keys = ["motion_id", "polarity", "p2"]
    vertical = combinations(with_vertical)
    pairs = vertical.merge(combinations(without), on=keys, suffixes=("_with", ""))
    first, second = pairs["row"].to_numpy(), pairs["row_with"].to_numpy()
    first_has_value, second_has_value = (
        without.status[first] == "found",
        with_vertical.status[second] == "found",
    )
    both = first_has_value & second_has_value
    a = without.kr_over_pga[first[both]]
    b = with_vertical.kr_over_pga[second[both]]
    return VerticalPairs(
        ln_ratio=np.log(b / a),
        without=a,
        with_vertical=b,
        p2=without.p2[first[both]],
        event_id=without.event_id[first[both]],
        one_sided=int(np.sum(first_has_value != second_has_value)),
    )


@canvas.in_own_style
def plot_vertical(pairs: VerticalPairs, path: canvas.Out) -> canvas.Picture:
    """Draw the critical k_r/PGA with against without vertical motion, and their ratio.

    Ratios beyond the edges of the histogram are counted in its outermost bars.

    Args:
        pairs: critical values of the same motion, polarity and p².
    """
    canvas.plot_path(path)
    if not pairs.ln_ratio.size:
        raise InputError(
            "no critical values both with and without vertical motion: run  rbfrag simulate  for "
            "both"
        )
    figure = canvas.new_figure(9.2, 4.6)
    axes, right_axes = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    values = np.concatenate([pairs.without, pairs.with_vertical])
    edges = 0.85 * float(values.min()), 1.2 * float(values.max())
    canvas.logarithmic(axes)
    canvas.density(figure, axes, pairs.without, pairs.with_vertical, edges, edges)
    axes.plot(edges, edges, color=canvas.RED, lw=1.2, label="no change")
    canvas.logarithmic(axes, (1.0, 2.0, 5.0), (1.0, 2.0, 5.0))
    axes.set_xlabel(r"critical $k_r/\mathrm{PGA}$ without vertical motion")
    axes.set_ylabel(r"critical $k_r/\mathrm{PGA}$ with it")
    axes.legend(loc="upper left", fontsize=8.5, frameon=False)

    d = pairs.ln_ratio
    reach = float(np.clip(1.3 * np.quantile(np.abs(d), 0.995), _NARROWEST, _WIDEST))
    canvas.grey_bars(right_axes, np.clip(d, -reach, reach), np.linspace(-reach, reach, 58))
    right_axes.axvline(0.0, color=canvas.RED, lw=1.2)
    right_axes.set_xlim(-reach, reach)
    right_axes.set_xlabel("ln (with / without)")
    right_axes.set_ylabel("critical blocks")
    mean = round(float(d.mean()), 3) + 0.0  # not -0.000
    right_axes.set_title(f"mean {mean:+.3f}, standard deviation {d.std():.3f}", fontsize=9)
    events = len(set(pairs.event_id.tolist()))
    figure.suptitle(
        f"{d.size} critical blocks of {events} earthquakes, the same motion, polarity and $p^2$",
        fontsize=10,
    )
    return canvas.save_figure(figure, path)


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
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

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
    overview.legend(
        handles=handles, fontsize=8, ncols=len(handles), loc="lower center",
        bbox_to_anchor=(0.5, 1.08), frameon=False,
    )  # fmt: skip
    name = f"{title}{', reversed' if result.polarity == 'reverse' else ''}"
    name += ", with vertical motion" if vertical is not None else ""
    if result.lower is None or result.upper is None:
        verdict = f"no block down to $k_r$/PGA = {result.search_limit:g} topples"
    elif not result.certified:
        verdict = (
            f"critical $k_r$/PGA between {result.lower:.6g} and $K_{{up}}$ = "
            f"{result.upper:.6g}, not certified"
        )
    else:
        width = (result.upper - result.lower) / result.upper
        bound = f", $K_{{up}}$ = {result.k_up_over_pga:.6g}" if result.k_up_over_pga else ""
        verdict = (
            f"critical $k_r$/PGA = {result.lower:.6g} (certified, bracket {width:.0e}){bound} PGA"
        )
    verdict = f"$p^2$ = {result.p2:g} s$^{{-2}}$: {verdict}"
    figure.suptitle(f"{as_written(name, 85)}\n{verdict}", fontsize=10)
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
    near_borders = np.concatenate(
        [np.outer(edges, 1.0 - offsets).ravel(), np.outer(edges, 1.0 + offsets).ravel()]
    )
    ratios = np.sort(
        np.concatenate([spread, near_borders[(near_borders > low) & (near_borders < high)]])
    )
    run = runner(excited, p2=result.p2)
    kr = ratios * excited.pga_g
    theta_c = np.arctan(kr)
    return ratios, np.array([run(k).peak_rad for k in kr.tolist()]) / theta_c
