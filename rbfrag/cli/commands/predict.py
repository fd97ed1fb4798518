"""`rbfrag predict`: the probability that a block fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from rbfrag.cli.output import check_files, print_result
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import Given, fields_of, option, stacked
from rbfrag.vocabulary.quantities import BLOCK, REQUEST, WHOLE

EXAMPLE = "Example:  rbfrag predict --height 2.4 --width 0.5 --dip 3 --pgv 0.6"


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """The accelerogram itself."""

    motion: str | None = option(
        "The accelerogram itself, instead of its measures: a file, FILE#INDEX or a "
        "database id. Its toppling spectrum answers, for both polarities and their mean.",
        metavar="MOTION",
    )
    polarity: str = option("With --motion: forward, reverse, or both where unknown.", "both")


@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """A table of blocks, and one of answers."""

    blocks: str | None = option(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) with columns p2_1_s2 and kr (or "
        "height_m and width_m; or ky and displacement_m; or ks and ps2_1_s2; or kct and "
        "pct2_1_s2), restitution, p2_sigma, kr_sigma and the like, and any of pgv_m_s, sa03_g, "
        "sa10_g, sa30_g, pga_g, tm_s, pgd_m, arias_m_s, magnitude; what is the same for all rows "
        "may be an option.",
        word=("--blocks", "--batch"),
        metavar="FILE",
    )
    sheet: str | None = option(options.SHEET, metavar="NAME")
    ignore_columns: str | None = option(options.IGNORE_COLUMNS, metavar="NAME,NAME")
    out: str | None = option(
        "With --blocks: table to write, the same columns with kind, mode, probability, ci_low, "
        "ci_high, event_low, event_high, in_domain, how (what answered), reason and, of uncertain "
        "blocks, block_sd. Default: a list of the answers; --json lists the first 10,000.",
        metavar="FILE",
    )
    excel_text: bool = option(options.EXCEL_TEXT, False)


@stacked
def predict(
    *,
    given: Annotated[Given, fields_of(*BLOCK, *WHOLE)],
    measures: options.Shaking,
    request: Annotated[Given, fields_of(*REQUEST)],
    block_draws: options.BlockDraws = None,
    record: RecordOptions,
    reading: options.ReadingOptions,
    table: BatchOptions,
    printing: options.Printing,
) -> None:
    """Print the probability that a block fails.

    P is the mean over all earthquakes and sites with these intensity measures, with its confidence
    interval. With --sites a prediction interval gives the fraction of such blocks that fails at so
    many sites of one earthquake.

    What is known of the motion decides which model answers: PGV, alone or with PGA, best with the
    spectral accelerations at 1 and 3 s or Tm, too; PGA with spectral accelerations; SA at 1 s or
    PGA alone; of slides and slumps also Arias intensity or magnitude; or the motion itself. Where
    the measures suffice for several models, each is answered.

    Toppling answers are for blocks backed by a slope; free-standing blocks fail at weaker
    shaking: ask for --kind rocking.

    Where no measure is known, --magnitude, --rjb, --vs30 and --mechanism say how strong the shaking
    is and how it scatters (Boore et al. 2014), or --gmm FILE, a table of another ground-motion
    model. P is the mean over that scatter, or over that of --pgv-sigma and the like.

    A block of which --kr-sigma and the like are given is uncertain: P is the mean over all that it
    may be, and block_sd how much P differs among them.
    """
    if table.blocks is not None:
        from rbfrag.exchange.table_answers import SHOWN, predict_table

        check_files(table=table.out, excel_text=table.excel_text)
        for_all = {**given, **measures}
        kind = for_all.pop("kind", None)
        answer = predict_table(
            table.blocks, table.out, given=for_all, kind=kind,
            sheet=table.sheet, ignore_columns=options.column_names(table.ignore_columns),
            excel_text=table.excel_text, remarks=(*given.notes, *measures.notes), **request,
        )  # fmt: skip
        print_result(answer, json=printing.json, verbose=printing.verbose, fields=())
        if answer.blocks is not None and answer.rows > SHOWN and not printing.json:
            print(f"... {SHOWN} of {answer.rows:,} rows: --out FILE writes them all")
        return
    from rbfrag.question.document import answer_block, answer_numbers

    question: dict[str, Any] = {**request}
    if record.motion is not None:
        from rbfrag.cli.parameters.motion import find_motion

        question["motion"] = find_motion(record.motion, db=request.get("db"), reading=reading)
        question["polarity"] = record.polarity
    question["remarks"] = (*given.notes, *measures.notes)
    inputs = {**given, **measures}
    kind = inputs.pop("kind", None)
    if block_draws is None:
        with given.named():
            result = answer_block(inputs, kind=kind, **question)
    else:
        from rbfrag.exchange.block_draws import read_draws

        draws, weights = read_draws(block_draws)
        inputs = {**draws, **inputs}
        result = answer_numbers(inputs, kind=kind, weights=weights, **question)
    print_result(result, json=printing.json, verbose=printing.verbose)
