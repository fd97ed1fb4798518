"""A report as one page of A4."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from textwrap import fill, wrap
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.files import written_whole
from rbfrag.plots.canvas import BLUE, freeze_layout, in_own_style, new_figure
from rbfrag.plots.labels import settle_labels
from rbfrag.plots.report.contents import COLUMNS, SYMBOL, Contents, ReportedBlock, Table
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

_ROWS, _SUMMARY = 60, (_LEFT, 0.31, 0.54, 0.66, 0.82)
"""Blocks of a page of the summary, and where its columns begin."""

_BELOW = {"r": "\N{LATIN SUBSCRIPT SMALL LETTER R}", "s": "\N{LATIN SUBSCRIPT SMALL LETTER S}"}

_RC: Any = {"pdf.fonttype": 42, "font.size": 8.5, "axes.titlesize": 9}
"""Letters stay letters, so that the page can be searched and copied from."""


@in_own_style
def write_sheet(entries: Sequence[ReportedBlock], title: str, date: str, target: Path) -> None:
    """Write a report as pages of A4, PDF, or of one block PNG, by the suffix of the file."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import PdfPages

    about: dict[str, str | None] = {"Title": title, "Creator": f"rbfrag {__version__}"}
    is_png = target.suffix.lower() == ".png"
    if len(entries) > 1 and is_png:
        raise InputError(f"{target}: several blocks need several pages: write .pdf or .html")
    with rc_context(_RC), written_whole(target, "report") as path, path.open("wb") as stream:
        pages = _pages(entries, title, date)
        if is_png:
            next(pages).savefig(stream, format="png", metadata=about, dpi=130)
        else:
            with PdfPages(stream, metadata={**about, "CreationDate": None}) as book:
                for page in pages:
                    page.savefig(book, format="pdf")


def _pages(entries: Sequence[ReportedBlock], title: str, date: str) -> Iterator[Figure]:
    """Yield the pages: one of a single block; or the summary, and half a page for each block."""
    answered = [(e.name, e.contents) for e in entries if e.contents is not None]
    draws: list[Callable[[Figure], None]] = [
        *(partial(_list, entries=entries, first=i, title=title, date=date)
          for i in range(0, len(entries), _ROWS)),
        *(partial(_draw_halves, entries=answered[i : i + 2]) for i in range(0, len(answered), 2)),
    ]  # fmt: skip
    if len(entries) == 1:
        draws = [partial(_draw, contents=answered[0][1], title=title, date=date)]
    for draw in draws:
        figure = new_figure(_WIDTH_IN, _HEIGHT_IN)
        draw(figure)
        freeze_layout(figure)
        settle_labels(figure)
        yield figure


def _list(
    figure: Figure, entries: Sequence[ReportedBlock], first: int, title: str, date: str
) -> None:
    (part,) = figure.subfigures(1, 1, squeeze=False)[0]
    _write(part, _LEFT, 0.964, _cut(title, _TITLE), fontsize=15, fontweight="bold", color=BLUE)
    _write(part, _RIGHT, 0.964, date, fontsize=9, ha="right")
    of_page = entries[first : first + _ROWS]
    for i, cells in enumerate([COLUMNS, *(entry.cells for entry in of_page)]):
        style = {} if i else {"fontweight": "bold", "color": BLUE}
        y, reason = 0.93 - i * _STEP_IN / _HEIGHT_IN, of_page[i - 1].reason if i else ""
        for x, cell in zip(_SUMMARY, cells, strict=False):
            _write(part, x, y, _cut(cell, _CELL), fontsize=8.2, **style)
        _write(part, _SUMMARY[1], y, _cut(reason, _NARROW), fontsize=8.2)
    versions = dict.fromkeys(v for e in entries if e.contents for v in e.contents.versions)
    _write_lines(part, _wrapped_all(versions), _HEIGHT_IN)


def _draw_halves(figure: Figure, entries: Sequence[tuple[str, Contents]]) -> None:
    halves = figure.subfigures(2, 1, squeeze=False)[:, 0]
    for half, (name, contents) in zip(halves, entries, strict=False):
        notes, head_in = _wrapped_all(contents.notes()), 0.85 + 0.17 * len(_head_lines(contents))
        foot_in = 0.35 + 0.13 * len(notes)
        heights = [head_in, 0.5 * _HEIGHT_IN - head_in - foot_in, foot_in]
        head, body, foot = half.subfigures(3, 1, height_ratios=heights)
        _write_head(head, contents, [_cut(name, _TITLE)], "", head_in)
        left, *cells, _ = body.subfigures(1, 4, width_ratios=[3.9, 2.1, 2.1, 0.17])
        _write_table(left, 0.18, 0.46, contents.tables[:3], heights[1])
        for cell, panel in zip(cells, panels_of(contents), strict=False):
            panel.draw(cell)
            for axes in cell.axes:
                axes.set_xlabel(fill(axes.get_xlabel(), 24))
            for legend in cell.legends:
                legend.remove()
        _write_lines(foot, notes, foot_in)


def _draw(figure: Figure, contents: Contents, title: str, date: str) -> None:
    titles = wrap(title, _TITLE, max_lines=3, placeholder=" …")
    head_in = 0.85 + _TITLE_STEP_IN * (len(titles) - 1) + 0.17 * len(_head_lines(contents))
    lines = (sum(1.5 + len(rows) for _, rows in tables) for tables in contents.columns())
    tables_in = 0.1 + _STEP_IN * max(lines)
    notes = _wrapped_all((*contents.notes(), *contents.versions))
    foot_in = 0.35 + 0.13 * len(notes)
    panels = panels_of(contents)
    rows = [panels[i : i + 2] for i in range(0, len(panels), 2)]
    row_in = min((_HEIGHT_IN - head_in - tables_in - foot_in) / len(rows), _TALLEST_ROW_IN)
    heights = [head_in, tables_in, *[row_in] * len(rows)]
    heights.append(_HEIGHT_IN - sum(heights))
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    _write_head(parts[0], contents, titles, date, head_in)
    for x, wide, tables in zip((_LEFT, 0.56), (0.235, 0.19), contents.columns(), strict=True):
        _write_table(parts[1], x, wide, tables, tables_in)
    for part, row in zip(parts[2:-1], rows, strict=True):
        # one picture alone is as wide as two
        widths = [2.0 / len(row)] * len(row)
        ratios = [_MARGIN, *widths, _MARGIN]
        _, *cells, _ = part.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        for cell, panel in zip(cells, row, strict=True):
            panel.draw(cell)
            cell.suptitle(_shown(panel.title), fontsize=9, parse_math=False)
    _write_lines(parts[-1], notes, heights[-1])


def _head_lines(contents: Contents) -> list[tuple[str, bool]]:
    first, *others = contents.sentences
    return [
        *((line, True) for line in _wrapped(first, _NARROW)),
        *((line, False) for line in _wrapped(" ".join(others), _WIDE)),
    ]


def _wrapped(text: str, letters: int) -> list[str]:
    """Return the lines of a text, of which none begins with a percent sign."""
    return wrap(text.replace(" %", "\u00a0%"), letters, break_on_hyphens=False)


def _wrapped_all(texts: Iterable[str]) -> list[str]:
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


def _cut(text: str, letters: int) -> str:
    return text if len(text) <= letters else f"{text[: letters - 1]}…"


def _write_table(
    part: SubFigure, x: float, wide: float, tables: Sequence[Table], tall_in: float
) -> None:
    """Write tables below each other from x on, their values behind names so wide."""
    step = _STEP_IN / tall_in
    y = 1.0 - 0.5 * step
    for heading, rows in tables:
        _write(part, x, y, heading, fontsize=9, fontweight="bold", color=BLUE)
        for name, value in rows:
            y -= step
            _write(part, x, y, name, fontsize=8.2)
            _write(part, x + wide, y, _cut(value, _CELL), fontsize=8.2)
        y -= 1.5 * step


def _write_lines(part: SubFigure, lines: Sequence[str], tall_in: float) -> None:
    """Write small lines at the foot of a part."""
    y = 0.25 / tall_in + 0.13 * (len(lines) - 1) / tall_in
    for line in lines:
        _write(part, _LEFT, y, line, fontsize=6.8, color="#333333")
        y -= 0.13 / tall_in
