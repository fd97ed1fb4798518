"""`rbfrag report`: a question about one block, answered on one page."""

from __future__ import annotations

from dataclasses import dataclass

from rbfrag.cli.output import print_json, print_sentences, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import option, stacked

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
    out: str = option("File to write: .pdf or .png (a page of A4), or .html (one file).", ...),
    given: options.Block,
    measures: options.Measures,
    rate: Hazard,
    meaning: options.Curve,
    heading: Heading,
    answering: options.Ranging,
    json: options.Json = False,
) -> None:
    """Write one page about one block: PDF or HTML to attach.

    It has the answer in a sentence, the block to scale, a table of what was asked, the design
    chart and the fragility curve with the block on them, with --hazard the annual rate, and the
    versions of program, model and data. The same question gives the same file.
    """
    from rbfrag.plots.report.contents import RateQuestion
    from rbfrag.plots.report.write import TITLE, write_report

    with given.named():
        contents = write_report(
            out, {**given, **measures}, RateQuestion(rate.hazard, rate.years, vars(meaning)),
            title=heading.title or TITLE, date=heading.date, **answering,
        )  # fmt: skip
    if json:
        rates = None if contents.rate is None else contents.rate.document
        print_json({"file": out, **contents.document, "hazard": rates})
        return
    print_sentences(contents.sentences)
    print(out)
    print_warnings(contents.remarks)
