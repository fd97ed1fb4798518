"""Figure creation and saving, axis numbers, point clouds, labels, and colours of modes.

Every figure rejects a path that cannot be written before it draws (InputError), and says which
extra brings matplotlib where it is missing (MissingExtraError).

A label is written next to its data point. When the figure is saved, where all is laid out,
each label takes the first of the places around its point where it covers no line, no point and no
other text, or the one where it covers least.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import wraps
from io import BytesIO
from os import PathLike
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MissingExtraError
from rbfrag.files import output_path, written_whole
from rbfrag.solver.stability.modes import ModeName

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.path import Path as LinePath
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox


SUFFIXES = (".png", ".pdf", ".svg")
"""File types that a figure can be saved as."""


_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def in_own_style(draw: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Return a function that draws with matplotlib's defaults, independent of the user's settings.

    Places and sizes of labels belong to these defaults; TeX, or a dark sheet under halos of
    white, would spoil them. A letter that the font lacks (Chinese names of stations) is an empty
    box, without a warning for each.
    """

    @wraps(draw)
    def drawn(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        try:
            from matplotlib import style
        except ImportError:
            return draw(*args, **kwargs)  # and let it say what is missing
        with style.context("default"), warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"Glyph \d+ .* missing", UserWarning)
            return draw(*args, **kwargs)

    return drawn


def new_figure(width_in: float = 7.0, height_in: float = 5.0) -> Figure:
    """Return an empty figure with a layout that avoids overlap.

    Args:
        width_in: width [inch].
        height_in: height [inch].
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtraError("Plots require matplotlib", "plot") from None
    return Figure(figsize=(width_in, height_in), layout="constrained")


Out = str | PathLike[str] | None
"""File to write (.png, .pdf, .svg); None for a picture in memory, which a notebook shows."""


@dataclass(frozen=True)
class Picture:
    """A figure, saved or shown in a notebook.

    Args:
        path: its file; None of one in memory.
        png: the image of one in memory.
        warnings: what to know about it.
    """

    path: Path | None
    png: bytes | None = field(default=None, repr=False)
    warnings: tuple[str, ...] = ()

    def _repr_png_(self) -> bytes | None:
        """Return the PNG image for a notebook."""
        return self.png


def plot_path(path: Out) -> Path | None:
    """Return the path after checking that a figure can be saved there; call it before long work."""
    return None if path is None else output_path(path, SUFFIXES, "plot file")


def save_figure(figure: Figure, path: Out) -> Picture:
    """Write a figure as PNG, PDF or SVG by the suffix of the path, completely or not at all.

    Args:
        path: file to write; an existing file is replaced. None for a picture in memory.
    """
    target = plot_path(path)
    settle_labels(figure)
    if target is None:
        image = BytesIO()
        figure.savefig(image, format="png", dpi=160)
        return Picture(None, image.getvalue())
    with written_whole(target, "plot file") as partial, partial.open("wb") as stream:
        figure.savefig(stream, format=target.suffix.lower()[1:], dpi=160)
    return Picture(target)


_LAYOUT_DIGITS = 6
"""Of places on the sheet, of its width and height."""

_LIMIT_DIGITS = 9
"""Of the limits of axes [m]."""


def freeze_layout(figure: Figure) -> None:
    """Fix the layout of a figure reproducibly.

    What arranges them solves equations in an order that changes from run to run, and differs in
    the last digits.
    """

    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    parts = list(figure.subfigs)
    for part in parts:
        parts += part.subfigs
        box = part.bbox_relative
        box.p0, box.p1 = (np.round(place, _LAYOUT_DIGITS) + 0.0 for place in (box.p0, box.p1))
    for figure_part in (figure, *parts):
        if figure_part.get_suptitle():
            for text in figure_part.texts:
                x, y = (round(float(place), _LAYOUT_DIGITS) for place in text.get_position())
                text.set_position((x, y))
    for axes in figure.axes:
        axes.set_position(np.round(axes.get_position().bounds, _LAYOUT_DIGITS).tolist())
        if axes.get_adjustable() == "datalim":  # an equal scale has taken its limits from there
            axes.set_xlim(*np.round(axes.get_xlim(), _LIMIT_DIGITS), auto=None)
            axes.set_ylim(*np.round(axes.get_ylim(), _LIMIT_DIGITS), auto=None)


_MOST_DECADES = 1e5
"""Ratio of the ends of an axis that holds more digits than one a decade."""


def written_numbers(axis: Axis, *digits: float) -> None:
    """Label a logarithmic axis at given leading digits, with powers of ten where needed."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    class LeadingDigits(LogLocator):
        """Locator with only powers of ten for many decades, as matplotlib shows no others."""

        def tick_values(self, vmin: float, vmax: float) -> Any:
            low, high = sorted((vmin, vmax))
            self.set_params(subs=digits if high < _MOST_DECADES * low else (1.0,))
            return super().tick_values(low, high)

    axis.set_major_locator(LeadingDigits())

    def as_text(value: float, _: object) -> str:
        digits, power, exponent = f"{value:g}".partition("e")
        if not power:
            return digits
        factor = "" if digits == "1" else rf"{digits}\times"
        return f"${factor}10^{{{int(exponent)}}}$"

    axis.set_major_formatter(FuncFormatter(as_text))
    axis.set_minor_formatter(NullFormatter())


def spread_out(
    positions: Sequence[float], apart: float, lowest: float = -math.inf, highest: float = math.inf
) -> list[float]:
    """Return increasing positions moved as little as possible to keep a minimum distance, in order.

    None lies below `lowest` or above `highest`, if there is space for all between.
    """
    from scipy.optimize import isotonic_regression

    steps = apart * np.arange(len(positions))
    # labels that touch move as one group, to the mean of where its members belong
    starts = isotonic_regression(np.asarray(positions) - steps).x if len(positions) else steps
    highest -= (len(positions) - 1) * apart
    moved: list[float] = (np.minimum(np.maximum(starts, lowest), highest) + steps).tolist()
    return moved


def logarithmic(axes: Axes, x: Sequence[float] = (), y: Sequence[float] = ()) -> None:
    """Make both axes logarithmic, with labels at given leading digits."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis, digits in ((axes.xaxis, x), (axes.yaxis, y)):
        if digits:
            written_numbers(axis, *digits)


def light_grid(*axes: Axes, which: Literal["major", "both"] = "major") -> None:
    """Draw a thin grid behind the data."""
    for panel in axes:
        panel.grid(visible=True, which=which, lw=0.3, alpha=0.6)


def open_corner(axes: Axes) -> None:
    """Hide the upper and right spines."""
    axes.spines[["top", "right"]].set_visible(False)


def grey_bars(
    axes: Axes, values: NDArray[np.float64], edges: NDArray[np.float64], *, flat: bool = False
) -> None:
    """Draw a histogram with vertical or horizontal bars."""
    axes.hist(
        values, bins=edges.tolist(), orientation="horizontal" if flat else "vertical",
        color="#8a8a8a", edgecolor="white", linewidth=0.3,
    )  # fmt: skip


def legend_below(figure: Figure, columns: int) -> None:
    """Draw one legend for all axes below them."""
    figure.legend(loc="outside lower center", ncols=columns, fontsize=8.5, frameon=False)


MOST_DOTS = 500
"""More points are counted in cells, because dots would cover each other."""

_CELLS_ACROSS = 60
_CELLS_UP = 25
"""As many as make the hexagons regular on a sheet of ordinary shape."""


def density(
    figure: Figure,
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    across: tuple[float, float],
    up: tuple[float, float],
    *,
    further_axes: Sequence[Axes] = (),
) -> None:
    """Draw points, or for many points hexagons shaded by count; axes linear or logarithmic.

    Args:
        axes: where to draw; their scales are set before.
        x: abscissae, shape (n,).
        y: ordinates, shape (n,).
        across: limits of the abscissa, which the axes get.
        up: limits of the ordinate.
        further_axes: other axes that the key of the shades stands to the right of.
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    axes.set_xlim(*across)
    axes.set_ylim(*up)
    if x.size <= MOST_DOTS:
        axes.scatter(x, y, s=14, color="#555555", alpha=0.6, linewidths=0.0)
        return
    # Neither white for a single block nor so dark that a line disappears.
    greys = ListedColormap(colormaps["Greys"](np.linspace(0.18, 0.72, 256)))
    log = axes.get_xscale() == "log"
    x_left, x_right, bottom, top = np.log10([*across, *up]) if log else (*across, *up)
    scale: Literal["log", "linear"] = "log" if log else "linear"
    cells = axes.hexbin(
        x, y, gridsize=(_CELLS_ACROSS, _CELLS_UP), extent=(x_left, x_right, bottom, top),
        xscale=scale, yscale=scale, mincnt=1, cmap=greys, linewidths=0.2,
    )  # fmt: skip
    axes.set_xlim(*across)
    axes.set_ylim(*up)  # which the cells have widened
    most = max(int(np.asarray(cells.get_array()).max(initial=1)), 2)
    cells.set_norm(LogNorm(1, most))
    key = figure.colorbar(cells, ax=[axes, *further_axes], label="critical blocks per cell")
    ticks = [t * 10**k for k in range(7) for t in (1, 2, 5) if t * 10**k <= most]
    key.ax.yaxis.set_major_locator(FixedLocator(ticks))
    key.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
    key.ax.yaxis.set_minor_locator(NullLocator())


ROCK, BLUE, RED = "#8a8378", "#1f4e79", "#b2182b"

# Told apart by people who do not see red and green alike, and in grey.
MODE_COLOURS: dict[ModeName, str] = {
    "slide": "#2c6fad",
    "topple": "#d98c1f",
    "slump": "#8c2d4f",
    "confined_topple": "#4c9a6a",
}

MODE_LINES: dict[ModeName, str] = {
    "slide": "-", "topple": "-.", "slump": "--", "confined_topple": ":",
}  # fmt: skip


def mode_title(mode: str) -> str:
    """Return the display name of a mode or kind."""
    return mode.replace("_", " ")


_MOVABLE = "_movable label"
"""What matplotlib calls labels that may be moved; a name with a dash before it is in no legend."""

_OFF_THE_AXES, _ON_TEXT, _ON_LINE = 100.0, 20.0, 4.0
"""What it costs a place to leave the axes, and to cover a text or a line."""


def as_written(name: str, letters: int, lines: int = 3) -> str:
    """Return a name from a file for a figure: letters only, in a few lines.

    A dollar sign begins no formula, and a legend leaves out no name for its first underscore.

    Args:
        name: what a file or the user calls something.
        letters: the most letters of a line.
        lines: the most lines.
    """
    shown = "".join(letter if letter.isprintable() else " " for letter in name)
    text = "\n".join(wrap(shown, letters, max_lines=lines, placeholder=" …")).replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def halo(width: float = 2.5) -> dict[str, Any]:
    """Return the style of a text with a white outline.

    Args:
        width: thickness of the rim [points].
    """
    from matplotlib.patheffects import withStroke

    return {"path_effects": [withStroke(linewidth=width, foreground="white")]}


def write_near(
    axes: Axes,
    text: str,
    at: tuple[float, float],
    offset: tuple[float, float],
    *,
    movable: bool = True,
    **style: Any,
) -> None:
    """Write a text with a halo near a point of the data.

    Args:
        at: the place, in data coordinates unless `style` has ``xycoords``.
        offset: where the label is best, from the place [points]; it begins there on that side.
        movable: whether it may stand on another side where it would cover something.
        style: as matplotlib's annotate takes it.
    """
    label = axes.annotate(
        text, at, xytext=offset, textcoords="offset points", zorder=style.pop("zorder", 8),
        **{**_alignment(offset), **halo(), **style},
    )  # fmt: skip
    if movable:
        label.set_label(_MOVABLE)
        # a label that moves must not move the axes that it was placed by
        label.set_in_layout(False)


def settle_labels(figure: Figure) -> None:
    """Move every movable label of a figure to where it covers least."""
    labels: list[Any] = figure.findobj(lambda artist: artist.get_label() == _MOVABLE)
    if not labels:
        return
    figure.draw_without_rendering()
    settled: list[Bbox] = []
    for label in labels:
        axes = label.axes
        legend = axes.get_legend()
        fixed_texts = [text for text in axes.texts if text not in labels and text.get_text()]
        fixed_texts = [*(legend.get_texts() if legend else ()), *fixed_texts]
        obstacles = [*settled, *(text.get_window_extent() for text in fixed_texts)]
        lines = list(_lines(axes))
        best, least = label.xyann, math.inf
        for rank, offset in enumerate(_label_offsets(label.xyann)):
            _move(label, offset)
            cost = rank * 0.1 + _cost(label.get_window_extent(), axes, obstacles, lines)
            if cost < least:
                best, least = offset, cost
        _move(label, best)
        settled.append(label.get_window_extent())


def _label_offsets(offset: tuple[float, float]) -> Iterator[tuple[float, float]]:
    """Yield offsets around a point; the given offset and its mirror images come first."""
    x, y = offset
    reach = math.hypot(x, y)
    yield from dict.fromkeys([(x, y), (x, -y), (-x, y), (-x, -y)])
    for farther in (1.0, 2.0, 3.5):
        for turn in range(8):
            angle = math.atan2(y, x) + turn * math.pi / 4.0
            yield (farther * reach * math.cos(angle), farther * reach * math.sin(angle))


def _alignment(offset: tuple[float, float]) -> dict[str, str]:
    """Return the alignment of a text that begins at an offset from its point."""
    x, y = offset
    small = 0.2 * math.hypot(x, y)
    return {
        "ha": "center" if abs(x) <= small else "left" if x > 0.0 else "right",
        "va": "center" if abs(y) <= small else "bottom" if y > 0.0 else "top",
    }


def _move(label: Annotation, offset: tuple[float, float]) -> None:
    label.xyann = offset
    label.set(**_alignment(offset))


def _cost(box: Bbox, axes: Axes, obstacles: Sequence[Bbox], lines: Sequence[LinePath]) -> float:
    frame, rim = axes.get_window_extent(), box.padded(1.5)
    outside = not (frame.contains(*box.min) and frame.contains(*box.max))
    covered = sum(rim.overlaps(obstacle) for obstacle in obstacles)
    crossed = sum(
        path.intersects_bbox(rim, filled=False) or rim.count_contains(path.vertices) > 0
        for path in lines
    )
    return _OFF_THE_AXES * outside + _ON_TEXT * covered + _ON_LINE * crossed


def _lines(axes: Axes) -> Iterator[LinePath]:
    """Yield the lines and points of axes as paths, in pixels."""
    from matplotlib.path import Path as LinePath

    for line in axes.lines:
        path = line.get_transform().transform_path(line.get_path())
        vertices = np.asarray(path.vertices)
        yield LinePath(vertices[np.isfinite(vertices).all(axis=1)])
    for points in axes.collections:
        offsets = np.ma.getdata(points.get_offsets())
        if len(offsets) > 1:
            yield LinePath(points.get_offset_transform().transform(offsets))
