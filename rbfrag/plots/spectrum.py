"""Figure of toppling spectra against the size of the block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.motions.polarity import POLARITIES, Polarity
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written

if TYPE_CHECKING:
    pass

# Told apart by people who do not see red and green alike.
COLOURS = ("#1f4e79", "#d98c1f", "#4c9a6a", "#8c2d4f", "#7f7f7f", "#56b4e9", "#c44e52", "#5e3c99")
LINES: dict[Polarity, str] = {"forward": "-", "reverse": "--"}

MOST_MOTIONS = len(COLOURS)
_POINTS = 161
_LOWEST_PART = 0.02
"""Part of the highest value shown below which a curve may leave the sheet."""


def block_size_m(p2: ArrayLike) -> NDArray[np.float64]:
    """Return the distance r3 from centroid to toe of a rectangular block of given p² [m]."""
    # the axis also asks for its two ends at zero and infinity
    with np.errstate(divide="ignore"):
        size: NDArray[np.float64] = 0.75 * STANDARD_GRAVITY_M_S2 / np.asarray(p2, dtype=np.float64)
    return size


@canvas.in_own_style
def plot_spectrum(
    motions: MotionLike | Sequence[MotionLike],
    out: canvas.Out = None,
    *,
    polarities: Sequence[Polarity] = POLARITIES,
    p2: Sequence[float] = (0.1, 30.0),
    names: Sequence[str] = (),
) -> canvas.Picture:
    """Draw the toppling spectra of several motions with their PGV.

    Args:
        motions: up to eight motions or their files.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        polarities: the polarities to draw, forward solid, reverse dashed.
        p2: the figure spans at least these frequency parameters [1/s²].
        names: names of the motions in the legend; their labels if empty.
    """
    canvas.plot_path(out)
    sources: Any = motions if isinstance(motions, list | tuple) else [motions]
    records = [as_motion(source) for source in sources]
    if not 1 <= len(records) <= MOST_MOTIONS:
        raise InputError(
            f"{len(records)} motions: a figure of spectra shows 1 to {MOST_MOTIONS} of them"
        )
    named = names or [motion.label for motion in records]
    low, high = min(p2), max(p2)
    if high < 4.0 * low:
        low, high = 0.5 * low, 2.0 * high
    sizes = np.geomspace(low, high, _POINTS)
    figure = canvas.new_figure(7.2, 5.0)
    axes = figure.add_subplot()
    highest = 0.0
    for motion, name, colour in zip(records, named, COLOURS, strict=False):
        for polarity in polarities:
            x = toppling_spectrum(motion, sizes, polarity)
            highest = max(highest, float(np.max(x)))
            first = polarity == polarities[0]
            label = as_written(name, 42) if first else None
            axes.plot(sizes, x, LINES[polarity], color=colour, lw=1.7, label=label)
        axes.axhline(motion.pgv_m_s, color=colour, lw=0.9, ls=":")
        highest = max(highest, motion.pgv_m_s)
    if highest <= 0.0:
        raise InputError("no block topples under these motions: nothing to draw")
    canvas.logarithmic(axes, (1.0, 3.0), (1.0, 2.0, 5.0))
    axes.set_xlim(low, high)
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines])
    bottom = max(_LOWEST_PART * highest, 0.8 * float(drawn[drawn > 0.0].min()))
    axes.set_ylim(bottom, 1.25 * highest)
    axes.set_xlabel("frequency parameter of the block, $p^2$ [1/s$^2$]")
    axes.set_ylabel("toppling spectrum $X(p)$ and PGV [m/s]")
    canvas.light_grid(axes, which="both")
    above = axes.secondary_xaxis("top", functions=(block_size_m, block_size_m))
    above.set_xlabel("size of a rectangular block, $r_3 = 3g/(4p^2)$ [m]", labelpad=7)
    canvas.written_numbers(above.xaxis, 1.0, 2.0, 5.0)
    key = [(f"$X(p)$, {name}", LINES[name]) for name in polarities]
    for label, style in (*key, ("PGV, either polarity", ":")):
        axes.plot([], [], style, color="black", lw=1.2, label=label)
    canvas.legend_below(figure, 2)
    return canvas.save_figure(figure, out)
