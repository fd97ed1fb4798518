"""Readable labels: a white halo, positions off the lines, and safe names.

A label is written beside its place of the data. When the figure is saved, where all is laid out,
each label takes the first of the places around its point where it covers no line, no point and no
other text, or the one where it covers least.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.path import Path
    from matplotlib.text import Annotation, Text
    from matplotlib.transforms import Bbox

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
        obstacles = [*settled, *(text.get_window_extent() for text in _fixed_texts(axes, labels))]
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


def _cost(box: Bbox, axes: Axes, obstacles: Sequence[Bbox], lines: Sequence[Path]) -> float:
    frame, rim = axes.get_window_extent(), box.padded(1.5)
    outside = not (frame.contains(*box.min) and frame.contains(*box.max))
    covered = sum(rim.overlaps(obstacle) for obstacle in obstacles)
    crossed = sum(
        path.intersects_bbox(rim, filled=False) or rim.count_contains(path.vertices) > 0
        for path in lines
    )
    return _OFF_THE_AXES * outside + _ON_TEXT * covered + _ON_LINE * crossed


def _fixed_texts(axes: Axes, labels: Sequence[Annotation]) -> Iterator[Text]:
    legend = axes.get_legend()
    if legend is not None:
        yield from legend.get_texts()
    yield from (text for text in axes.texts if text not in labels and text.get_text())


def _lines(axes: Axes) -> Iterator[Path]:
    """Yield the lines and points of axes as paths, in pixels."""
    from matplotlib.path import Path

    for line in axes.lines:
        path = line.get_transform().transform_path(line.get_path())
        vertices = np.asarray(path.vertices)
        yield Path(vertices[np.isfinite(vertices).all(axis=1)])
    for points in axes.collections:
        offsets = np.ma.getdata(points.get_offsets())
        if len(offsets) > 1:
            yield Path(points.get_offset_transform().transform(offsets))
