"""Figures of critical strengths: against frequency, and with against without vertical motion.

In the linear model a pulse of amplitude A and duration t_p topples blocks of critical angle up
to c·A, c a function of f = p t_p alone (docs/theory/toppling-spectrum.md, properties). Against
the records a pulse stands for half a mean period, t_p = T_m/2, so that f = π/(ω_m/p): the lines of
figure 4.20 of Gibson's dissertation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.optimize.elementwise import find_root

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written
from rbfrag.results.numbers import percent
from rbfrag.solver.results import FloatArray


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
def plot_sensitivity(
    table: CombinationTable, path: canvas.Out, *, data: str = ""
) -> canvas.Picture:
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
    axes, beside = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
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
    canvas.grey_bars(beside, np.clip(d, -reach, reach), np.linspace(-reach, reach, 58))
    beside.axvline(0.0, color=canvas.RED, lw=1.2)
    beside.set_xlim(-reach, reach)
    beside.set_xlabel("ln (with / without)")
    beside.set_ylabel("critical blocks")
    mean = round(float(d.mean()), 3) + 0.0  # not -0.000
    beside.set_title(f"mean {mean:+.3f}, standard deviation {d.std():.3f}", fontsize=9)
    events = len(set(pairs.event_id.tolist()))
    figure.suptitle(
        f"{d.size} critical blocks of {events} earthquakes, the same motion, polarity and $p^2$",
        fontsize=10,
    )
    return canvas.save_figure(figure, path)
