"""Reports as PDF, PNG or HTML: headline, warnings, tables and figures of one question.

The contents are those of the answer's `Result` (`report_contents`); here they are laid out.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from html import escape
from itertools import islice
from os import PathLike
from pathlib import Path
from textwrap import fill, wrap
from typing import TYPE_CHECKING, Any, Unpack

from rbfrag.errors import InputError
from rbfrag.files import output_path, write_text, written_whole
from rbfrag.hazards.branches import Weights
from rbfrag.hazards.curve import CurveKeywords
from rbfrag.hazards.curve_file import CurveLike
from rbfrag.plots.block import draw_block
from rbfrag.plots.canvas import BLUE, freeze_layout, in_own_style, new_figure, settle_labels
from rbfrag.plots.chart import draw_chart
from rbfrag.plots.curve import AXIS, draw_curve
from rbfrag.plots.hazard import draw_contribution
from rbfrag.plots.report_contents import (
    COLUMNS,
    SYMBOL,
    Contents,
    RateQuestion,
    Report,
    ReportedBlock,
    Table,
    report_of,
)  # fmt: skip
from rbfrag.plots.sensitivity import draw_sensitivity
from rbfrag.question.fields import BlockKeywords, RangeFields, ShakingFields, SourceFields
from rbfrag.question.keywords import parts_of
from rbfrag.results.diagnostic import labelled
from rbfrag.version import __version__
from rbfrag.vocabulary.quantities import BLOCKS, RANGE, SHAKING, SOURCE

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase, SubFigure


SUFFIXES = (".pdf", ".png", ".html")
"""Forms of a report."""

TITLE = "Seismic fragility of a rock block"


class ReportKeywords(
    BlockKeywords[float | None], ShakingFields[float | None], SourceFields, RangeFields,
    CurveKeywords, total=False,
):  # fmt: skip
    """Keywords of a report: block, shaking or scenario, hazard curve and model."""

    rotation_deg: float | None


def report(
    out: str | PathLike[str],
    *,
    curve: CurveLike | Sequence[CurveLike] | None = None,
    weights: Weights | None = None,
    years: float = 50.0,
    title: str = TITLE,
    date: str = "",
    **question: Unpack[ReportKeywords],
) -> Path:
    """Write one page about one block: headline, drawing, inputs, chart, curve, rate, versions.

    The same question gives the same file, byte for byte, with the same versions of rbfrag and
    matplotlib.

    Args:
        out: file to write: .pdf or .png (a page of A4), or .html (one file that needs no other).
        curve: hazard curve, or its file, for the annual rate; or several of a logic tree.
        weights: weights of several curves, as in :func:`rbfrag.hazard`.
        years: period of the probability [a].
        title: title of the page.
        date: date that is printed on it; nothing is, if empty.
        question: fields of block and shaking or scenario, ``kind``, ``model`` (a
            name), ``level``, ``sites`` and ``db`` as :func:`rbfrag.predict` has them; ``imt``,
            ``site``, ``convert`` and ``convert_sigma`` of the curve as :func:`rbfrag.hazard` has
            them; ``component`` of the measures and of the curve.

    Returns:
        The path.

    Raises:
        InputError: a question that cannot be answered, or a path that cannot be written.
        UnknownFieldError: a keyword that is none.
    """
    of_shaking = (*SHAKING, *SOURCE, *RANGE, "rotation_deg")
    block, shaking, meaning = parts_of(
        (), question, BLOCKS, of_shaking, CurveKeywords.__optional_keys__
    )
    request = {**block, **shaking}
    if (component := meaning.get("component")) is not None:
        request["component"] = component
    rate = RateQuestion(curve, years, meaning, weights)
    write_report(out, [request], rate, title=title, date=date)
    return Path(out)


def write_report(
    out: str | PathLike[str],
    rows: Sequence[Mapping[str, Any]],
    rate: RateQuestion | None = None,
    *,
    title: str = TITLE,
    date: str = "",
    warnings: Sequence[str] = (),
    **answering: Unpack[RangeFields],
) -> Report:
    """Write the report of blocks, each given by a row of fields, and return its contents.

    Args:
        warnings: what to know about the table of the blocks.
    """
    target = output_path(out, SUFFIXES, "report")
    new_figure()  # says which extra is missing, before long work
    contents = report_of(rows, rate, warnings, **answering)
    write = write_html if target.suffix.lower() == ".html" else write_sheet
    write(contents, title, date, target)
    return contents


def _panels_of(contents: Contents) -> dict[str, str]:
    """Return the titles of the figures of a report by their names, in order."""
    panels = {}
    if contents.drawing is not None:
        panels["block"] = contents.drawing[2]
    if contents.is_unstable:
        return panels
    if contents.model.term.inputs[0] in AXIS:
        panels["curve"] = "Probability of failure of this block"
    if contents.prediction.sensitivity:
        panels["sensitivity"] = "P at usual errors of measurement"
    if contents.held is not None:
        panels["chart"] = f"Design chart, model {contents.model.name}"
    if contents.hazard is not None:
        panels["rate"] = "Hazard, and the shaking that the rate comes from"
    return panels


def _two_panels(report: Report, name: str, contents: Contents) -> dict[str, str]:
    """Return the titles of the two figures of one of several blocks, as :func:`_panels_of`."""
    panels = _panels_of(contents)
    if "sensitivity" in panels and name in report.most_critical:
        panels.pop("curve", None)
    return dict(islice(panels.items(), 2))


def _wrap_labels(part: SubFigure) -> None:
    for axes in part.axes:
        axes.set_xlabel(fill(axes.get_xlabel(), 24))
        axes.set_ylabel(fill(axes.get_ylabel(), 24))


def _draw_panel(part: FigureBase, name: str, contents: Contents) -> None:
    """Draw a figure of a report into a figure or a part of one."""
    model, measures, prediction = contents.model, contents.measures, contents.prediction
    if name == "sensitivity":
        draw_sensitivity(part.subplots(), prediction)
        return
    if name == "rate":
        assert contents.hazard is not None
        top, bottom = part.subplots(2, 1, sharex=True)
        draw_contribution(top, bottom, contents.hazard.curves[0], contents.hazard)
        top.set_ylabel("exceedances [yr⁻¹]")
        bottom.set_ylabel("fraction of\nthe rate [%]")
        return
    axes = part.subplots()
    if name == "block":
        assert contents.drawing is not None
        draw_block(axes, *contents.drawing[:2])
        axes.set_xlabel("out of the slope, from the centroid [m]")
        axes.set_ylabel("above the centroid [m]")
    elif name == "curve":
        fixed = {name: measures[name] for name in model.term.inputs}
        across = "pgv_m_s" if "pgv_m_s" in fixed else model.term.inputs[0]
        at = fixed.pop(across)
        draw_curve(
            axes, model, contents.numbers, across, fixed, level=prediction.level, at=at,
            sites=prediction.sites,
        )  # fmt: skip
        part.legend(loc="outside lower center", fontsize=7, frameon=False)
    else:
        assert contents.held is not None
        x, y_m_s = measures.get(contents.held.across, prediction.intensity_m_s), prediction.y_m_s
        draw_chart(axes, model, contents.held, point=None if y_m_s is None else (x, y_m_s))
        axes.set_ylabel("toppling velocity, $y = k_r\\,g/p$ [m/s]")
        if contents.held.words:
            axes.set_title(contents.held.words, fontsize=8)


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
        for cell, panel in zip(cells, _two_panels(report, name, contents), strict=False):
            _draw_panel(cell, panel, contents)
            _wrap_labels(cell)
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
    panels = [*_panels_of(contents).items()]
    first = 3 if len(panels) == 5 else 2  # two rows of figures, which leave room for the text
    rows = [panels[:first], *(panels[i : i + 2] for i in range(first, len(panels), 2))]
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
        for cell, (name, heading) in zip(cells, row, strict=True):
            _draw_panel(cell, name, contents)
            if len(row) == 3:
                _wrap_labels(cell)
            cell.suptitle(_shown(heading), fontsize=9, parse_math=False)
    y = 0.25 / heights[-1] + 0.13 * (len(versions) - 1) / heights[-1]
    for line in versions:
        _write(parts[-1], _LEFT_EDGE, y, line, fontsize=6.8, color="#333333")
        y -= 0.13 / heights[-1]
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


_SIZE_IN = (5.4, 4.6)

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 60rem; margin: 2rem auto;
  padding: 0 1rem; }
h1 { color: #1f4e79; font-size: 1.6rem; margin: 0; }
h2 { color: #1f4e79; font-size: 1rem; margin: 1rem 0 .2rem; }
.first { font-size: 1.15rem; font-weight: 600; }
.parts { display: grid; grid-template-columns: repeat(auto-fit, minmax(22rem, 1fr)); gap: 1rem;
  margin-bottom: 1rem; }
table { border-collapse: collapse; width: 100%; }
th { width: 50%; }
th, td { text-align: left; font-weight: normal; padding: .1rem .6rem .1rem 0;
  border-bottom: 1px solid #ddd; }
figure { margin: 0; break-inside: avoid; }
figcaption { font-size: .9rem; }
svg { width: 100%; height: auto; }
table.all th { width: auto; }
section { break-inside: avoid; margin-top: 2rem; }
.notes { border: 1px solid #bbb; border-radius: 4px; padding: 0 1rem; margin: 1rem 0; }
.notes h2 { margin-top: .5rem; }
.notes ul { padding-left: 1.2rem; margin: .3rem 0 .6rem; }
footer { font-size: .85rem; color: #333; margin-top: 1rem; }
footer p { margin: .2rem 0; }
sub { font-size: 75%; line-height: 0; }
@page { size: A4; margin: 12mm; }
@media print { body { font-size: 10px; margin: 0; max-width: none; }
  .parts { grid-template-columns: 1fr 1fr; } }
"""


@in_own_style
def write_html(report: Report, title: str, date: str, target: Path) -> None:
    """Write a report as a self-contained page: the summary, and each block."""
    entries = report.entries
    several = len(entries) > 1
    answered = [(e.name, e.contents) for e in entries if e.contents is not None]
    versions = dict.fromkeys(text for _, contents in answered for text in contents.versions)
    parts = [
        "<!DOCTYPE html>", '<html lang="en">', '<head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title>", f"<style>{_STYLE}</style></head>", "<body>",
        f"<h1>{escape(title)}</h1>", f"<p>{escape(date)}</p>" if date else "",
        _rows(report.summary) if report.summary else "",
        _summary_table(entries) if several else "",
        _notes(labelled(report.notes)),
        *(_block_section(contents, report.notes_of(contents), name, f"b{i}-" if several else "",
                         _two_panels(report, name, contents) if several else _panels_of(contents))
          for i, (name, contents) in enumerate(answered)),
        "<footer>", *(f"<p>{escape(text)}</p>" for text in versions), "</footer>",
        "</body></html>",
    ]  # fmt: skip
    write_text("\n".join(part for part in parts if part) + "\n", target)


def _summary_table(entries: Sequence[ReportedBlock]) -> str:
    """Return a table of all blocks; rows without an answer show the reason."""
    rows = [f"<tr>{''.join(f'<th><b>{name}</b></th>' for name in COLUMNS)}</tr>"]
    for entry in entries:
        texts = "".join(f"<td>{_written(cell)}</td>" for cell in entry.cells)
        if entry.reason:
            texts += f'<td colspan="{len(COLUMNS) - 1}">{_written(entry.reason)}</td>'
        rows.append(f"<tr>{texts}</tr>")
    return f'<table class="all">{"".join(rows)}</table>'


def _block_section(
    contents: Contents, notes: Sequence[str], name: str, prefix: str, panels: Mapping[str, str]
) -> str:
    """Return the section of a block; with several blocks, each has unique element names."""
    first, *further = contents.sentences()
    figures = (
        f"<figure><figcaption>{_written(title)}</figcaption>\n"
        f"{_svg(contents, panel, title, prefix)}\n</figure>"
        for panel, title in panels.items()
    )
    tables = (
        f"<div><h2>{escape(heading)}</h2>{_rows(rows)}</div>" for heading, rows in contents.sections
    )
    return "\n".join([
        f"<section>{f'<h1>{escape(name)}</h1>' if prefix else ''}",
        f'<p class="first">{_written(first)}</p>',
        *(f"<p>{_written(text)}</p>" for text in further),
        _rows(contents.lines()), '<div class="parts">', *tables, "</div>",
        '<div class="parts">', *figures, "</div>",
        _notes(labelled(notes)), "</section>",
    ])  # fmt: skip


def _notes(sentences: Sequence[str]) -> str:
    """Return the warnings in a box; empty where there are none."""
    items = "".join(f"<li>{_written(text)}</li>" for text in sentences)
    return f'<div class="notes"><h2>Warnings and notes</h2><ul>{items}</ul></div>' if items else ""


def _written(text: str) -> str:
    """Return a text for the page: the subscript of k_r set as such, no isolated percent sign."""
    return SYMBOL.sub(r"\1<sub>\2</sub>", escape(text)).replace(" %", "&nbsp;%")


def _rows(rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(
        f'<tr><th scope="row">{_written(name)}</th><td>{_written(value)}</td></tr>'
        for name, value in rows
    )
    return f"<table>{cells}</table>"


def _svg(contents: Contents, panel: str, title: str, prefix: str) -> str:
    """Return a figure as an element of the page, with unique names inside it."""
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": prefix + panel, "font.size": 9}):
        figure = new_figure(*_SIZE_IN)
        _draw_panel(figure, panel, contents)
        freeze_layout(figure)
        settle_labels(figure)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg)  # the page says what they are
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}{panel}-", svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{escape(title)}"', 1).strip()
