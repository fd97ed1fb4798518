"""`rbfrag report`: a question about blocks, answered in a document."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from rbfrag.cli.output import print_json, print_rows, print_sentences, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import argument, option, stacked

EXAMPLE = "Example:  rbfrag report --height 2.4 --width 0.5 --pgv 0.6 --out block.pdf"


@dataclass(frozen=True, kw_only=True)
class Heading:
    """What stands above a report."""

    title: str | None = option("Title of the page. Default: Seismic fragility of a rock block.")
    date: str = option("Date to print; nothing is printed without.", "")


@dataclass(frozen=True, kw_only=True)
class Hazard:
    """How often a year the block is asked to fail."""

    hazard: str | None = option(
        "Hazard curve, as  rbfrag hazard  reads it: the page has the annual rate, too.",
        metavar="CURVE",
    )
    years: float = option("Period of the probability [years].", 50.0)


@stacked
def report(
    *,
    blocks: str | None = argument(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) in the place of one block: a summary, "
        "and half a page for each. Options hold for the rows that do not state them.",
        None,
        metavar="[BLOCKS]",
    ),
    sheet: str | None = option(options.SHEET, metavar="NAME"),
    out: str = option("File to write: .pdf or .png (a page of A4), or .html (one file).", ...),
    given: options.Block,
    measures: options.Measures,
    rate: Hazard,
    meaning: options.Curve,
    heading: Heading,
    answering: options.Ranging,
    json: options.Json = False,
) -> None:
    """Write one document about blocks: PDF or HTML to attach.

    A page has the answer in a sentence, the block to scale, a table of what was asked, the design
    chart and the fragility curve with the block on them, with --hazard the annual rate, and the
    versions of program, model and data. The same question gives the same file.
    """
    from rbfrag.exchange.block_table import stated_rows
    from rbfrag.plots.report.contents import COLUMNS, RateQuestion
    from rbfrag.plots.report.write import TITLE, write_report

    component = {} if meaning.component is None else {"component": meaning.component}
    known: dict[str, Any] = {**given, **measures, **component}
    rows, remarks = stated_rows(blocks, known, sheet=sheet) if blocks else ([known], ())
    title = heading.title or (TITLE if len(rows) == 1 else "Seismic fragility of rock blocks")
    with given.named():
        entries = write_report(
            out, rows, RateQuestion(rate.hazard, rate.years, vars(meaning)), title=title,
            date=heading.date, **answering,
        )  # fmt: skip
    reports = [entry.contents for entry in entries if entry.contents is not None]
    if json:
        documents = [each.document for each in reports]
        print_json({"file": out, **(documents[0] if blocks is None else {"blocks": documents})})
        return
    if len(rows) == 1:
        print_sentences(reports[0].sentences)
    else:
        print_rows([{**dict(zip_longest(COLUMNS, e.cells)), "reason": e.reason} for e in entries])
        print()
    print(out)
    print_warnings(dict.fromkeys((*remarks, *(text for each in reports for text in each.remarks))))
