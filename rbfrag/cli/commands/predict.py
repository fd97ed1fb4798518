"""`rbfrag predict`: probability of failure of blocks."""

from __future__ import annotations

from typing import Annotated, Any

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, option
from rbfrag.cli.output import check_files, print_result
from rbfrag.vocabulary.quantities import BLOCK, COMMON, INVERSE, MEASURED, REQUEST

EXAMPLE = "Example:  rbfrag predict --height 2.4 --width 0.5 --dip 3 --pgv 0.6"


def predict(
    *,
    block_inputs: Annotated[Inputs, Fields(*BLOCK, *MEASURED, *COMMON)],
    measures: options.Shaking,
    request: Annotated[Inputs, Fields(*REQUEST, *INVERSE)],
    block_draws: options.BlockDraws = None,
    motion: str | None = option(
        "Accelerogram instead of intensity measures: a file, FILE#INDEX or a database id; P "
        "is computed from its toppling spectrum",
        metavar="MOTION",
    ),
    polarity: str = option(
        "Polarity of --motion: forward, reverse, or both if unknown (mean of the two)", "both"
    ),
    slope_azimuth: options.SlopeAzimuth = None,
    reading: options.Reading,
    blocks: str | None = option(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) with columns such as p2_1_s2 and kr, "
        "or height_m and width_m, or ky and displacement_m; standard deviations such as "
        "kr_sigma; and pgv_m_s, pga_g, sa(1) etc.; values common to all rows can be options",
        None,
        "--blocks",
        "--batch",
        metavar="FILE",
    ),
    sheet: options.Sheet = None,
    ignore_columns: options.IgnoreColumns = None,
    out: str | None = option(
        "Output table for --blocks: the columns of the input and kind, mode, probability, "
        "ci_low, ci_high, event_low, event_high, in_domain, how, reason and, for uncertain "
        "blocks, block_sd",
        metavar="FILE",
    ),
    sensitivity: bool = option(
        "Columns with P at usual errors of measurement of each field, and with the sources of the "
        "uncertainty of P (a single block has them in lines)",
        False,
    ),
    excel_text: options.ExcelText = False,
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Print the probability of failure of blocks.

    P is the mean over earthquakes and sites with these intensity measures, with its confidence
    interval. With --sites a prediction interval is added for the fraction of identical blocks that
    fails at these sites in one earthquake.

    The intensity measures determine the model: PGV, PGA or both, best with spectral accelerations
    (--sa) or Tm; spectral accelerations alone; for sliding and slumping also Arias intensity or
    magnitude; or the accelerogram. Where they suffice for several models, --verbose lists the
    answers of all.

    Toppling blocks are backed by a rock face; a free-standing block overturns at weaker shaking:
    --kind rocking.

    Without intensity measures, --magnitude, --rjb, --vs30 and --mechanism give median and
    dispersion of the shaking (Boore et al. 2014), or --gmm FILE, a table of another ground-motion
    model. P is then integrated over the ground-motion uncertainty, as with --pgv-sigma etc.

    With --dip-sigma, --width-sigma etc. P and its interval include the errors of measurement; the
    block stands, so values at which it would not are excluded. With --kr-sigma etc. the numbers of
    the block are uncertain, and block_sd is the standard deviation of P among blocks.
    """
    if blocks is not None:
        from rbfrag.exchange.table_answers import SHOWN, predict_table

        check_files(table=out, excel_text=excel_text)
        for_all = {**block_inputs, **measures}
        kind = for_all.pop("kind", None)
        answer = predict_table(
            blocks, out, inputs=for_all, kind=kind,
            sheet=sheet, ignore_columns=options.column_names(ignore_columns),
            excel_text=excel_text, sensitivity=sensitivity,
            remarks=(*block_inputs.notes, *measures.notes), **request,
        )  # fmt: skip
        print_result(answer, json=json, verbose=verbose, fields=())
        if answer.blocks is not None and answer.rows > SHOWN and not json:
            print(f"... {SHOWN} of {answer.rows:,} rows: --out FILE writes them all")
        return
    from rbfrag.question.document import answer_block, answer_numbers

    question: dict[str, Any] = {**request}
    if motion is not None:
        from rbfrag.cli.inputs import find_shaking

        question["motion"], *_ = find_shaking(
            motion, db=request.get("db"), reading=reading, slope_azimuth_deg=slope_azimuth
        )
        question["polarity"] = polarity if slope_azimuth is None else "forward"
    question["remarks"] = (*block_inputs.notes, *measures.notes)
    inputs = {**block_inputs, **measures}
    kind = inputs.pop("kind", None)
    if block_draws is None:
        with block_inputs.named():
            result = answer_block(inputs, kind=kind, **question)
    else:
        from rbfrag.exchange.block_rows import read_draws
        from rbfrag.question.keywords import reject_inverse

        reject_inverse(question)
        draws, weights = read_draws(block_draws)
        inputs = {**draws, **inputs}
        result = answer_numbers(inputs, kind=kind, weights=weights, **question)
    print_result(result, json=json, verbose=verbose)
