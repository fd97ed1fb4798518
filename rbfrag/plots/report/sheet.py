"""Reports on A4 pages."""

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
from rbfrag.plots.report.contents import (
    COLUMNS,
    SYMBOL,
    Contents,
    Report,
    Table,
)
from rbfrag.plots.report.panels import panels_of
from rbfrag.results.diagnostic import labelled
from rbfrag.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

_WIDTH_IN, _HEIGHT_IN = 8.27, 11.69
_LEFT_EDGE, _RIGHT_EDGE = 0.085, 0.915
"""Edges of what is written, of the width of the sheet."""

_MARGIN = 0.11
"""At the sides of the pictures, of the width of one."""

_STEP_IN = 0.158
"""From one row of a table to the next."""

_TALLEST_ROW_IN = 3.7
"""Of pictures: two rows of them are spread over the page, one is not."""

_TITLE, _WIDE, _NARROW, _FINE, _NOTE, _CELL = 48, 104, 80, 136, 112, 30
"""Letters that a line holds of the title, of small text, of the first sentence, of the versions, of
the notes, and that a cell does."""

_NOTE_SIZE, _NOTE_STEP_IN = 8.0, 0.15
"""Size of the letters of notes, and from one line to the next."""

_TITLE_STEP_IN = 0.27

_LINES, _SUMMARY, _VALUE = 66, (_LEFT_EDGE, 0.31, 0.54, 0.67, 0.82), 0.46
"""Lines of a page of the summary, where the columns of its table begin, and values of its head."""

_BELOW = {"r": "\N{LATIN SUBSCRIPT SMALL LETTER R}", "s": "\N{LATIN SUBSCRIPT SMALL LETTER S}"}

_RC: Any = {"pdf.fonttype": 42, "font.size": 8.5, "axes.titlesize": 9}
"""Letters stay letters, so that the page can be searched and copied from."""


@in_own_style
def write_sheet(report: Report, title: str, date: str, target: Path) -> None:
    """Write a report as A4 pages: PDF, or PNG for one block, by the suffix of the file."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import PdfPages

    about: dict[str, str | None] = {"Title": title, "Creator": f"rbfrag {__version__}"}
    is_png = target.suffix.lower() == ".png"
    if len(report.entries) > 1 and is_png:
        raise InputError(f"{target}: several blocks require .pdf or .html")
    with rc_context(_RC), written_whole(target, "report") as path, path.open("wb") as stream:
        pages = _pages(report, title, date)
        if is_png:
            next(pages).savefig(stream, format="png", metadata=about, dpi=130)
        else:
            with PdfPages(stream, metadata={**about, "CreationDate": None}) as book:
                for page in pages:
                    page.savefig(book, format="pdf")


def _pages(report: Report, title: str, date: str) -> Iterator[Figure]:
    """Yield the pages: one for a single block; or the summary, and half a page for each block."""
    answered = [(e.name, e.contents) for e in report.entries if e.contents is not None]
    lines = _summary_lines(report)
    draws: list[Callable[[Figure], None]] = [
        *(partial(_list, lines=lines[i : i + _LINES], title=title, date=date)
          for i in range(0, len(lines), _LINES)),
        *(partial(_draw_halves, report=report, entries=answered[i : i + 2])
          for i in range(0, len(answered), 2)),
    ]  # fmt: skip
    if len(report.entries) == 1:
        draws = [partial(_draw, contents=answered[0][1], title=title, date=date)]
    for draw in draws:
        figure = new_figure(_WIDTH_IN, _HEIGHT_IN)
        draw(figure)
        freeze_layout(figure)
        settle_labels(figure)
        yield figure


Line = tuple[tuple[float, str], ...]
"""Texts of a line and where each begins; a heading stands alone, at the left edge."""


def _summary_lines(report: Report) -> list[tuple[Line, dict[str, Any]]]:
    """Return the lines of the summary with their style: head, table of blocks, notes, versions."""
    heading: dict[str, Any] = {"fontsize": 8.2, "fontweight": "bold", "color": BLUE}
    normal: dict[str, Any] = {"fontsize": 8.2}
    lines: list[tuple[Line, dict[str, Any]]] = [
        (((_LEFT_EDGE, name), (_VALUE, _cut(value, _NARROW))), normal)
        for name, value in report.summary
    ]
    lines += [((), normal), (tuple(zip(_SUMMARY, COLUMNS, strict=True)), heading)]
    for entry in report.entries:
        cells = [*zip(_SUMMARY, (_cut(cell, _CELL) for cell in entry.cells), strict=False)]
        reasons = _wrapped(entry.reason, 84) if entry.reason else []
        cells += [(_SUMMARY[1], text) for text in reasons[:1]]
        lines.append((tuple(cells), normal))
        lines += [(((_SUMMARY[1], text),), normal) for text in reasons[1:]]
    notes = labelled(report.notes)
    if notes:
        lines += [((), normal), (((_LEFT_EDGE, "Warnings and notes"),), heading)]
        lines += [(((_LEFT_EDGE, text),), {"fontsize": _NOTE_SIZE}) for text in _note_lines(notes)]
    versions = dict.fromkeys(v for e in report.entries if e.contents for v in e.contents.versions)
    lines += [((), normal)]
    lines += [(((_LEFT_EDGE, text),), {"fontsize": 6.8}) for text in _wrapped_all(versions)]
    return lines


def _list(
    figure: Figure, lines: Sequence[tuple[Line, dict[str, Any]]], title: str, date: str
) -> None:
    (part,) = figure.subfigures(1, 1, squeeze=False)[0]
    _write(part, _LEFT_EDGE, 0.964, _cut(title, _TITLE), fontsize=15, fontweight="bold", color=BLUE)
    _write(part, _RIGHT_EDGE, 0.964, date, fontsize=9, ha="right")
    for i, (texts, style) in enumerate(lines):
        for x, text in texts:
            _write(part, x, 0.93 - i * _STEP_IN / _HEIGHT_IN, text, **style)


def _draw_halves(figure: Figure, report: Report, entries: Sequence[tuple[str, Contents]]) -> None:
    halves = figure.subfigures(2, 1, squeeze=False)[:, 0]
    for half, (name, contents) in zip(halves, entries, strict=False):
        notes = _note_lines(labelled(report.notes_of(contents)))
        head_in = 0.85 + 0.17 * len(_head_lines(contents))
        foot_in = 0.35 + _NOTE_STEP_IN * (len(notes) + 1)
        heights = [head_in, 0.5 * _HEIGHT_IN - head_in - foot_in, foot_in]
        head, body, foot = half.subfigures(3, 1, height_ratios=heights)
        _write_head(head, contents, [_cut(name, _TITLE)], "", head_in)
        table_part, *cells, _ = body.subfigures(1, 4, width_ratios=[3.9, 2.1, 2.1, 0.17])
        _write_table(table_part, 0.18, 0.46, contents.sections, heights[1])
        for cell, panel in zip(cells, panels_of(contents), strict=False):
            panel.draw(cell)
            for axes in cell.axes:
                axes.set_xlabel(fill(axes.get_xlabel(), 24))
            for legend in cell.legends:
                legend.remove()
        _write_notes(foot, notes, foot_in)


def _draw(figure: Figure, contents: Contents, title: str, date: str) -> None:
    titles = wrap(title, _TITLE, max_lines=3, placeholder=" …")
    head_in = 0.85 + _TITLE_STEP_IN * (len(titles) - 1) + 0.17 * len(_head_lines(contents))
    tables_in = 0.1 + _STEP_IN * max(1.5 + len(rows) for _, rows in contents.sections)
    notes, versions = _note_lines(labelled(contents.warnings)), _wrapped_all(contents.versions)
    versions_in = 0.35 + 0.13 * len(versions)
    foot_in = versions_in + _NOTE_STEP_IN * (len(notes) + 1)
    panels = panels_of(contents)
    rows = [panels[i : i + 2] for i in range(0, len(panels), 2)]
    free_height_in = (_HEIGHT_IN - head_in - tables_in - foot_in) / max(len(rows), 1)
    row_in = min(free_height_in, _TALLEST_ROW_IN)
    heights = [head_in, tables_in, *[row_in] * len(rows)]
    heights.append(_HEIGHT_IN - sum(heights))
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    _write_head(parts[0], contents, titles, date, head_in)
    for x, wide, table in zip((_LEFT_EDGE, 0.54), (0.235, 0.235), contents.sections, strict=True):
        _write_table(parts[1], x, wide, [table], tables_in)
    for part, row in zip(parts[2:-1], rows, strict=True):
        # one picture alone is as wide as two
        widths = [2.0 / len(row)] * len(row)
        ratios = [_MARGIN, *widths, _MARGIN]
        _, *cells, _ = part.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        for cell, panel in zip(cells, row, strict=True):
            panel.draw(cell)
            cell.suptitle(_shown(panel.title), fontsize=9, parse_math=False)
    _write_lines(parts[-1], versions, heights[-1])
    _write_notes(parts[-1], notes, heights[-1], versions_in)


def _head_lines(contents: Contents) -> list[tuple[str, bool]]:
    first, *further = contents.sentences()
    labelled = (f"{label}: {text}" if label else text for label, text in contents.lines())
    return [
        *((line, True) for line in _wrapped(first, _NARROW)),
        *((line, False) for text in (*further, *labelled) for line in _wrapped(text, _WIDE)),
    ]


def _wrapped(text: str, letters: int) -> list[str]:
    """Return the lines of a text, of which none begins with a percent sign."""
    return wrap(text.replace(" %", "\u00a0%"), letters, break_on_hyphens=False)


def _wrapped_all(texts: Iterable[str]) -> list[str]:
    return [line for text in texts for line in _wrapped(text, _FINE)]


def _shown(text: str) -> str:
    """Return a text with the subscript of k_r set as such."""
    return SYMBOL.sub(lambda match: match[1] + _BELOW.get(match[2], f"_{match[2]}"), text)


def _write(part: SubFigure, x: float, y: float, text: str, **style: Any) -> None:
    """Write a text literally, including dollar signs."""
    part.text(x, y, _shown(text), va="center", parse_math=False, **style)


def _write_head(
    part: SubFigure, contents: Contents, titles: Sequence[str], date: str, tall_in: float
) -> None:
    y = 1.0 - 0.42 / tall_in
    _write(part, _RIGHT_EDGE, y, date, fontsize=9, ha="right")
    for line in titles:
        _write(part, _LEFT_EDGE, y, line, fontsize=15, fontweight="bold", color=BLUE)
        y -= _TITLE_STEP_IN / tall_in
    y -= (0.33 - _TITLE_STEP_IN) / tall_in
    for line, is_first in _head_lines(contents):
        size, weight = (11, "bold") if is_first else (9, "normal")
        _write(part, _LEFT_EDGE, y, line, fontsize=size, fontweight=weight)
        y -= (0.2 if is_first else 0.165) / tall_in


def _cut(text: str, letters: int) -> str:
    return text if len(text) <= letters else f"{text[: letters - 1]}…"


def _write_table(
    part: SubFigure, x: float, wide: float, tables: Sequence[Table], tall_in: float
) -> None:
    """Write tables below each other from x on, with a given width of the names."""
    step = _STEP_IN / tall_in
    y = 1.0 - 0.5 * step
    for heading, rows in tables:
        _write(part, x, y, heading, fontsize=9, fontweight="bold", color=BLUE)
        for name, value in rows:
            y -= step
            _write(part, x, y, name, fontsize=8.2)
            _write(part, x + wide, y, _cut(value, _CELL), fontsize=8.2)
        y -= 1.5 * step


def _note_lines(sentences: Iterable[str]) -> list[str]:
    return [line for text in sentences for line in _wrapped(text, _NOTE)]


def _write_notes(
    part: SubFigure, lines: Sequence[str], tall_in: float, above_in: float = 0.2
) -> None:
    """Write the notes under their heading, with the last one a given distance above the foot."""
    if not lines:
        return
    y = (above_in + _NOTE_STEP_IN * len(lines)) / tall_in
    _write(part, _LEFT_EDGE, y, "Warnings and notes", fontsize=9, fontweight="bold", color=BLUE)
    for line in lines:
        y -= _NOTE_STEP_IN / tall_in
        _write(part, _LEFT_EDGE, y, line, fontsize=_NOTE_SIZE)


def _write_lines(part: SubFigure, lines: Sequence[str], tall_in: float) -> None:
    """Write small lines at the foot of a part."""
    y = 0.25 / tall_in + 0.13 * (len(lines) - 1) / tall_in
    for line in lines:
        _write(part, _LEFT_EDGE, y, line, fontsize=6.8, color="#333333")
        y -= 0.13 / tall_in
