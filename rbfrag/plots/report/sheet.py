"""A report as one page of A4."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from rbfrag.files import written_whole
from rbfrag.plots.canvas import (
    BLUE,
    freeze_layout,
    in_own_style,
    new_figure,
)
from rbfrag.plots.labels import settle_labels
from rbfrag.plots.report.contents import SYMBOL, Contents
from rbfrag.plots.report.panels import panels_of
from rbfrag.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

_WIDTH_IN, _HEIGHT_IN = 8.27, 11.69
_LEFT, _RIGHT = 0.085, 0.915
"""Edges of what is written, of the width of the sheet."""

_MARGIN = 0.11
"""At the sides of the pictures, of the width of one."""

_STEP_IN = 0.158
"""From one row of a table to the next."""

_TALLEST_ROW_IN = 3.7
"""Of pictures: two rows of them are spread over the page, one is not."""

_TITLE, _WIDE, _NARROW, _FINE, _CELL = 48, 104, 80, 136, 30
"""Letters that a line holds of the title, of small text, of the first sentence, of the notes, and
that a cell does."""

_TITLE_STEP_IN = 0.27

_BELOW = {"r": "\N{LATIN SUBSCRIPT SMALL LETTER R}", "s": "\N{LATIN SUBSCRIPT SMALL LETTER S}"}

_RC: Any = {"pdf.fonttype": 42, "font.size": 8.5, "axes.titlesize": 9}
"""Letters stay letters, so that the page can be searched and copied from."""


@in_own_style
def write_sheet(contents: Contents, title: str, date: str, target: Path) -> None:
    """Write a report as a page of A4, PDF or PNG by the suffix of the file."""
    from matplotlib import rc_context

    with rc_context(_RC):
        figure = new_figure(_WIDTH_IN, _HEIGHT_IN)
        _draw(figure, contents, title, date)
        freeze_layout(figure)
        settle_labels(figure)
        kind = target.suffix.lower()[1:]
        about: dict[str, str | None] = {"Title": title, "Creator": f"rbfrag {__version__}"}
        if kind == "pdf":
            about["CreationDate"] = None
        with written_whole(target, "report") as partial, partial.open("wb") as stream:
            figure.savefig(stream, format=kind, metadata=about, dpi=130)


def _draw(figure: Figure, contents: Contents, title: str, date: str) -> None:
    titles = wrap(title, _TITLE, max_lines=3, placeholder=" …")
    head_in = 0.85 + _TITLE_STEP_IN * (len(titles) - 1) + 0.17 * len(_head_lines(contents))
    lines = (sum(1.5 + len(rows) for _, rows in tables) for tables in contents.columns())
    tables_in = 0.1 + _STEP_IN * max(lines)
    foot_in = 0.35 + 0.13 * len(_foot_lines(contents))
    panels = panels_of(contents)
    rows = [panels[i : i + 2] for i in range(0, len(panels), 2)]
    row_in = min((_HEIGHT_IN - head_in - tables_in - foot_in) / len(rows), _TALLEST_ROW_IN)
    heights = [head_in, tables_in, *[row_in] * len(rows)]
    heights.append(_HEIGHT_IN - sum(heights))
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    _write_head(parts[0], contents, titles, date, head_in)
    _write_tables(parts[1], contents, tables_in)
    for part, row in zip(parts[2:-1], rows, strict=True):
        # one picture alone is as wide as two
        widths = [2.0 / len(row)] * len(row)
        ratios = [_MARGIN, *widths, _MARGIN]
        _, *cells, _ = part.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        for cell, panel in zip(cells, row, strict=True):
            panel.draw(cell)
            cell.suptitle(_shown(panel.title), fontsize=9, parse_math=False)
    _write_foot(parts[-1], contents, heights[-1])


def _head_lines(contents: Contents) -> list[tuple[str, bool]]:
    first, *others = contents.sentences
    return [
        *((line, True) for line in _wrapped(first, _NARROW)),
        *((line, False) for line in _wrapped(" ".join(others), _WIDE)),
    ]


def _wrapped(text: str, letters: int) -> list[str]:
    """Return the lines of a text, of which none begins with a percent sign."""
    return wrap(text.replace(" %", "\u00a0%"), letters, break_on_hyphens=False)


def _foot_lines(contents: Contents) -> list[str]:
    texts = (*contents.notes(), *contents.versions)
    return [line for text in texts for line in _wrapped(text, _FINE)]


def _shown(text: str) -> str:
    """Return a text with the index of k_r where it belongs."""
    return SYMBOL.sub(lambda match: match[1] + _BELOW.get(match[2], f"_{match[2]}"), text)


def _write(part: SubFigure, x: float, y: float, text: str, **style: Any) -> None:
    """Write letters as they are, dollars too."""
    part.text(x, y, _shown(text), va="center", parse_math=False, **style)


def _write_head(
    part: SubFigure, contents: Contents, titles: Sequence[str], date: str, tall_in: float
) -> None:
    y = 1.0 - 0.42 / tall_in
    _write(part, _RIGHT, y, date, fontsize=9, ha="right")
    for line in titles:
        _write(part, _LEFT, y, line, fontsize=15, fontweight="bold", color=BLUE)
        y -= _TITLE_STEP_IN / tall_in
    y -= (0.33 - _TITLE_STEP_IN) / tall_in
    for line, is_first in _head_lines(contents):
        size, weight = (11, "bold") if is_first else (9, "normal")
        _write(part, _LEFT, y, line, fontsize=size, fontweight=weight)
        y -= (0.2 if is_first else 0.165) / tall_in


def _write_tables(part: SubFigure, contents: Contents, tall_in: float) -> None:
    step = _STEP_IN / tall_in
    for x, wide, tables in zip((_LEFT, 0.56), (0.235, 0.19), contents.columns(), strict=True):
        y = 1.0 - 0.5 * step
        for heading, rows in tables:
            _write(part, x, y, heading, fontsize=9, fontweight="bold", color=BLUE)
            for name, value in rows:
                y -= step
                _write(part, x, y, name, fontsize=8.2)
                shown = value if len(value) <= _CELL else f"{value[: _CELL - 1]}…"
                _write(part, x + wide, y, shown, fontsize=8.2)
            y -= 1.5 * step


def _write_foot(part: SubFigure, contents: Contents, tall_in: float) -> None:
    lines = _foot_lines(contents)
    y = 0.25 / tall_in + 0.13 * (len(lines) - 1) / tall_in
    for line in lines:
        _write(part, _LEFT, y, line, fontsize=6.8, color="#333333")
        y -= 0.13 / tall_in
