"""`rbfrag report`: PDF or HTML report on blocks."""

from __future__ import annotations

from itertools import zip_longest
from typing import Annotated, Any

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, argument, option
from rbfrag.cli.output import print_json, print_pairs, print_result, print_rows, print_warnings
from rbfrag.vocabulary.quantities import BLOCK, COMMON, REQUEST

EXAMPLE = "Example:  rbfrag report --height 2.4 --width 0.5 --pgv 0.6 --out block.pdf"


def report(
    *,
    blocks: str | None = argument(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) instead of a single block: a "
        "summary and half a page for each block; options apply to rows without such a value",
        None,
        metavar="[BLOCKS]",
    ),
    sheet: options.Sheet = None,
    ignore_columns: options.IgnoreColumns = None,
    out: str = option("Output file: .pdf or .png (A4 page), or .html (single file)", ...),
    block_inputs: Annotated[Inputs, Fields(*BLOCK, *COMMON)],
    shaking: options.Shaking,
    request: Annotated[Inputs, Fields(*REQUEST, without=("component",))],
    hazard: list[str] | None = option(
        "Hazard curve as in rbfrag hazard, for the return period of failure; once for each "
        "branch of a logic tree",
        metavar="CURVE",
    ),
    weights: options.Weights = None,
    years: float = option("Exposure time of the probability [years]", 50.0),
    meaning: options.Curve,
    title: str | None = option("Title of the page [default: Seismic fragility of a rock block]"),
    date: str = option("Date on the page [default: none]", ""),
    json: options.Json = False,
) -> None:
    """Write a report on blocks (PDF or HTML).

    The options are those of predict and hazard. A page has the answer, the block to scale, the
    inputs, the design chart and the fragility curve with the block, with --hazard the return period
    of failure, the notes, and the versions of program, model and data. For a table the first page
    lists the blocks, those unstable at rest first, and the totals. The same inputs give the same
    file.
    """
    from rbfrag.exchange.block_table import read_rows
    from rbfrag.plots.report import TITLE, write_report
    from rbfrag.plots.report_contents import COLUMNS, RateQuestion

    inputs: dict[str, Any] = {**block_inputs, **shaking, **request}
    if meaning["component"] is not None:
        inputs["component"] = meaning["component"]
    rows, remarks = [inputs], (*block_inputs.notes, *shaking.notes)
    if blocks:
        names = options.column_names(ignore_columns)
        rows, of_table = read_rows(blocks, inputs, sheet=sheet, ignore_columns=names)
        remarks += of_table
    title = title or (TITLE if len(rows) == 1 else "Seismic fragility of rock blocks")
    question = RateQuestion(hazard, years, meaning, weights)
    with block_inputs.named():
        report = write_report(out, rows, question, title=title, date=date, warnings=remarks)
    contents = [entry.contents for entry in report.entries if entry.contents is not None]
    if json:
        documents = [{"block_id": e.name, **e.contents.as_dict()} for e in report.entries
                     if e.contents is not None]  # fmt: skip
        rejected = [{"block_id": e.name, "reason": e.reason} for e in report.entries if e.reason]
        several = {"blocks": documents, "rejected": rejected, **report.totals}
        warnings = {"warnings": [*report.warnings]} if blocks else {}
        print_json({"file": out, **(several if blocks else contents[0].as_dict()), **warnings})
        return
    if len(rows) == 1:
        print_result(contents[0], json=False)
        print()
    else:
        print_pairs(dict(report.summary))
        print()
        print_rows(
            [{**dict(zip_longest(COLUMNS, e.cells)), "reason": e.reason} for e in report.entries]
        )
        print()
    print(out)
    if len(rows) > 1:
        print_warnings([*report.warnings, *(w for block in contents for w in block.warnings)])
