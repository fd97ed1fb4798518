"""Reports as one HTML file with embedded figures."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice
from pathlib import Path

from rbfrag.files import write_text
from rbfrag.plots.canvas import freeze_layout, in_own_style, new_figure
from rbfrag.plots.labels import settle_labels
from rbfrag.plots.report.contents import (
    COLUMNS,
    SYMBOL,
    Contents,
    Report,
    ReportedBlock,
    Table,
)
from rbfrag.plots.report.panels import Panel, panels_of
from rbfrag.results.diagnostic import labelled

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
        _summary(entries) if several else "",
        _notes(labelled(report.notes)),
        *(_block(contents, report.notes_of(contents), name, f"b{i}-" if several else "")
          for i, (name, contents) in enumerate(answered)),
        "<footer>", *(f"<p>{escape(text)}</p>" for text in versions), "</footer>",
        "</body></html>",
    ]  # fmt: skip
    write_text("\n".join(part for part in parts if part) + "\n", target)


def _summary(entries: Sequence[ReportedBlock]) -> str:
    """Return a table of all blocks; rows without an answer show the reason."""
    rows = [f"<tr>{''.join(f'<th><b>{name}</b></th>' for name in COLUMNS)}</tr>"]
    for entry in entries:
        texts = "".join(f"<td>{_written(cell)}</td>" for cell in entry.cells)
        if entry.reason:
            texts += f'<td colspan="{len(COLUMNS) - 1}">{_written(entry.reason)}</td>'
        rows.append(f"<tr>{texts}</tr>")
    return f'<table class="all">{"".join(rows)}</table>'


def _block(contents: Contents, notes: Sequence[str], name: str, prefix: str) -> str:
    """Return the section of a block; with several blocks, each has unique element names."""
    first, *further = contents.sentences()
    figures = (_figure(panel._replace(name=prefix + panel.name)) for panel in panels_of(contents))
    return "\n".join([
        f"<section>{f'<h1>{escape(name)}</h1>' if prefix else ''}",
        f'<p class="first">{_written(first)}</p>',
        *(f"<p>{_written(text)}</p>" for text in further),
        _rows(contents.lines()), '<div class="parts">', *map(_table, contents.sections), "</div>",
        '<div class="parts">', *islice(figures, 2 if prefix else None), "</div>",
        _notes(labelled(notes)), "</section>",
    ])  # fmt: skip


def _notes(sentences: Sequence[str]) -> str:
    """Return the warnings in a box; empty where there are none."""
    items = "".join(f"<li>{_written(text)}</li>" for text in sentences)
    return f'<div class="notes"><h2>Warnings and notes</h2><ul>{items}</ul></div>' if items else ""


def _written(text: str) -> str:
    """Return a text for the page: the subscript of k_r set as such, no isolated percent sign."""
    return SYMBOL.sub(r"\1<sub>\2</sub>", escape(text)).replace(" %", "&nbsp;%")


def _table(table: Table) -> str:
    heading, rows = table
    return f"<div><h2>{escape(heading)}</h2>{_rows(rows)}</div>"


def _rows(rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(
        f'<tr><th scope="row">{_written(name)}</th><td>{_written(value)}</td></tr>'
        for name, value in rows
    )
    return f"<table>{cells}</table>"


def _figure(panel: Panel) -> str:
    return f"<figure><figcaption>{_written(panel.title)}</figcaption>\n{_svg(panel)}\n</figure>"


def _svg(panel: Panel) -> str:
    """Return a figure as an element of the page, with unique names inside it."""
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": panel.name, "font.size": 9}):
        figure = new_figure(*_SIZE_IN)
        panel.draw(figure)
        freeze_layout(figure)
        settle_labels(figure)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg)  # the page says what they are
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{panel.name}-", svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{escape(panel.title)}"', 1).strip()
