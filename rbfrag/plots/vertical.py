"""Figure of critical strength with vertical motion over that without."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.plots.canvas import new_figure, plot_path, save_figure
from rbfrag.plots.density import density
from rbfrag.plots.numbers import plain_numbers

FloatArray = NDArray[np.float64]

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
    """Return the pairs of two tables; what is in one of them alone has no pair."""
    place = {
        key: i
        for i, key in enumerate(
            zip(
                without.motion_id.tolist(),
                without.polarity.tolist(),
                without.p2.tolist(),
                strict=True,
            )
        )
    }
    keys = zip(
        with_vertical.motion_id.tolist(),
        with_vertical.polarity.tolist(),
        with_vertical.p2.tolist(),
        strict=True,
    )
    pairs = np.array(
        [(place[key], j) for j, key in enumerate(keys) if key in place], dtype=np.intp
    ).reshape(-1, 2)
    first, second = pairs[:, 0], pairs[:, 1]
    one, other = without.status[first] == "found", with_vertical.status[second] == "found"
    both = one & other
    a = without.kr_over_pga[first[both]]
    b = with_vertical.kr_over_pga[second[both]]
    return VerticalPairs(
        ln_ratio=np.log(b / a),
        without=a,
        with_vertical=b,
        p2=without.p2[first[both]],
        event_id=without.event_id[first[both]],
        one_sided=int(np.sum(one != other)),
    )


def plot_vertical(pairs: VerticalPairs, path: str | PathLike[str]) -> Path:
    """Draw the critical k_r/PGA with vertical motion against that without, and their ratio.

    Args:
        pairs: critical values of the same motion, polarity and p².
        path: file to write: .png, .pdf or .svg.

    Returns:
        The path.

    Raises:
        InputError: no pair, or a path that cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    plot_path(path)
    if not pairs.ln_ratio.size:
        raise InputError(
            "no critical value is known both with and without vertical motion: run  "
            "rbfrag simulate --vertical both"
        )
    figure = new_figure(9.2, 4.6)
    axes, beside = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    values = np.concatenate([pairs.without, pairs.with_vertical])
    edges = 0.85 * float(values.min()), 1.2 * float(values.max())
    axes.set_xscale("log")
    axes.set_yscale("log")
    density(figure, axes, pairs.without, pairs.with_vertical, edges, edges)
    axes.plot(edges, edges, color="#b2182b", lw=1.2, label="no change")
    plain_numbers(axes.xaxis, 1.0, 2.0, 5.0)
    plain_numbers(axes.yaxis, 1.0, 2.0, 5.0)
    axes.set_xlabel(r"critical $k_r/\mathrm{PGA}$ without vertical motion")
    axes.set_ylabel(r"critical $k_r/\mathrm{PGA}$ with it")
    axes.legend(loc="upper left", fontsize=8.5, frameon=False)

    d = pairs.ln_ratio
    reach = float(np.clip(1.3 * np.quantile(np.abs(d), 0.995), _NARROWEST, _WIDEST))
    beside.hist(
        np.clip(d, -reach, reach),
        bins=np.linspace(-reach, reach, 58).tolist(),
        color="#8a8a8a",
        edgecolor="white",
        linewidth=0.3,
    )
    beside.axvline(0.0, color="#b2182b", lw=1.2)
    beside.set_xlim(-reach, reach)
    beside.set_xlabel("ln (with / without)")
    beside.set_ylabel("critical blocks")
    outside = int(np.sum(np.abs(d) > reach))
    beside.set_title(
        f"mean {d.mean():+.3f}, standard deviation {d.std():.3f}\n"
        f"{outside} beyond the edges are counted there",
        fontsize=9,
    )
    events = len(set(pairs.event_id.tolist()))
    figure.suptitle(
        f"{d.size} critical blocks of {events} earthquakes, the same motion, polarity and $p^2$",
        fontsize=10,
    )
    return save_figure(figure, path)
