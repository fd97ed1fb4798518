"""`rbfrag predict`: the probability that a block fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rbfrag.cli.output import (
    check_files,
    print_json,
    print_pairs,
    print_rows,
    print_warnings,
    show_prediction,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import WAYS, BlockOptions, UncertaintyOptions
from rbfrag.cli.parameters.stack import option, stacked
from rbfrag.cli.sentences import answer_in_short, table_in_words
from rbfrag.errors import InputError
from rbfrag.question.fields import option_of

SHOWN = 40
"""So many rows of a table are printed."""

EXAMPLE = "Example:  rbfrag predict --height 2.4 --width 0.5 --dip 3 --pgv 0.6"


@dataclass(frozen=True, kw_only=True)
class Failure:
    """How a block fails, and the numbers of one that does not topple."""

    kind: str | None = option(
        "How the block fails: toppling (backed by a slope), rocking (free-standing), slumping or "
        "sliding. Default: what the block is given by, --p2 (toppling), --ks or --ky."
    )
    restitution: float | None = option(
        "Rocking: speed after an impact over that before it, above 0 and up to 1. Default: what "
        "angular momentum leaves."
    )
    ky: float | None = option(
        "Sliding: yield acceleration coefficient tan(phi - beta), with --beta."
    )
    displacement: float | None = option("Sliding: the displacement that is too far [m].")
    ks: float | None = option("Slumping: yield acceleration coefficient k_s, with --ps2.")
    ps2: float | None = option("Slumping: frequency parameter p_s² at rest [1/s²].")
    rotation: float | None = option(
        "Slumping: rotation that counts as failure [deg]; there must be a model of it. "
        "Default: failure past recovery."
    )


@dataclass(frozen=True, kw_only=True)
class Uncertainty(UncertaintyOptions):
    """How well a block is known that fails in any way."""

    ks_sigma: float | None = option("Standard deviation of ln k_s.")
    ps2_sigma: float | None = option("Standard deviation of ln p_s².")


@dataclass(frozen=True, kw_only=True)
class Record:
    """The accelerogram itself."""

    motion: str | None = option(
        "The accelerogram itself, instead of its measures: a file, FILE#INDEX or a "
        "database id. Its toppling spectrum answers, for both polarities and their mean.",
        metavar="MOTION",
    )
    polarity: str = option("With --motion: forward, reverse, or both where unknown.", "both")


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of blocks, and one of answers."""

    blocks: str | None = option(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) with columns p2_1_s2 and kr (or "
        "height_m and width_m; or ky and displacement_m; or ks and ps2_1_s2), restitution, "
        "p2_sigma, kr_sigma and the like, and any of pgv_m_s, sa03_g, sa10_g, sa20_g, sa30_g, "
        "pga_g, tm_s, pgd_m; what is the same for all rows may be an option.",
        word=("--blocks", "--batch"),
        metavar="FILE",
    )
    sheet: str | None = option(options.SHEET, metavar="NAME")
    out: str | None = option(
        "With --blocks: table to write, the same columns with kind, mode, probability, ci_low, "
        "ci_high, event_low, event_high, in_domain, reason and, of uncertain blocks, block_sd. "
        "Default: a list of the answers; --json lists the first 10,000.",
        metavar="FILE",
    )
    excel_text: bool = option(options.EXCEL_TEXT, False)


@stacked
def predict(
    block: BlockOptions,
    failure: Failure,
    known: Uncertainty,
    measures: options.Measures,
    record: Record,
    reading: options.Reading,
    table: Table,
    answering: options.Answering,
    printing: options.Printing,
) -> None:
    """Print the probability that a block fails.

    P is the share of such blocks that fail over all earthquakes and sites with these measures, its
    interval how well the data tell that share, and the range of one earthquake what share of such
    blocks at many sites may fail in one single earthquake.

    What is known of the motion decides which model answers: PGV, alone or with PGA and Tm; a
    spectral acceleration; PGA; PGA with spectral accelerations; or the motion itself. Where the
    measures suffice for several models, each is answered.

    Toppling answers are for blocks backed by a slope; free-standing blocks fail at weaker
    shaking: ask for --kind rocking.

    A block of which --kr-sigma and the like are given is uncertain: P is the mean over all that it
    may be, and block_sd how much P differs among them.
    """
    numbers = {
        "p2": block.p2, "kr": block.kr, "ky": failure.ky, "displacement_m": failure.displacement,
        "ks": failure.ks, "ps2": failure.ps2, "restitution": failure.restitution,
    }  # fmt: skip
    given: dict[str, Any] = {name: value for name, value in numbers.items() if value is not None}
    given |= {**known.sigmas(), **measures.given()}
    question: dict[str, Any] = {
        "rotation_deg": failure.rotation, "model": answering.model, "level": answering.level,
        "db": answering.db,
    }  # fmt: skip
    if table.blocks is not None:
        from rbfrag.exchange.table_answers import predict_table

        check_files(table=table.out, excel_text=table.excel_text)
        if block.beta is not None:
            given["beta_deg"] = block.beta
        summary = predict_table(
            table.blocks, table.out, given=given, kind=failure.kind, sheet=table.sheet,
            excel_text=table.excel_text, **question,
        )  # fmt: skip
        _show_table(summary, json=printing.json)
        return
    if record.motion is None and not measures.given():
        raise InputError(
            "nothing about the shaking is given: state what is known of it, --pgv [m/s], --pga "
            "[g], --tm [s], --sa10 [g] …, or  --motion FILE"
        )
    from rbfrag.question.document import prediction_document

    kind = failure.kind
    remarks: tuple[str, ...] = ()
    if known.block_draws is not None:
        from rbfrag.exchange.block_draws import read_draws

        draws, question["weights"] = read_draws(known.block_draws)
        given = {**draws, **given}
    else:
        kind, given, remarks = _completed(given, block, kind)
    if record.motion is not None:
        from rbfrag.cli.parameters.motion import find_motion

        question["motion"] = find_motion(record.motion, db=answering.db, reading=reading)
        question["polarity"] = record.polarity
    document = prediction_document(given, kind=kind, remarks=remarks, **question)
    show_prediction(document, given, json=printing.json, verbose=printing.verbose)


def _completed(
    given: dict[str, Any], block: BlockOptions, kind: str | None
) -> tuple[str | None, dict[str, Any], tuple[str, ...]]:
    """Return the kind, block and measures as answers read them, and warnings about the block."""
    from rbfrag.fragility.lookup import block_of
    from rbfrag.fragility.measures import MEASURES

    shape = block.described()
    if shape is not None:
        from rbfrag.question.blocks import described_block

        others = {name: value for name, value in given.items() if name not in MEASURES}
        measures = {name: value for name, value in given.items() if name in MEASURES}
        blocks = described_block(shape, others, kind)
        (group,) = blocks.groups
        return group.kind, {**group.numbers, **measures}, blocks.remarks
    if block.beta is not None:
        given["beta_deg"] = block.beta
    known_by = block_of(given, kind)
    missing = [name for name in known_by.names if name not in given]
    if missing and kind in (None, known_by.kind):
        raise InputError(
            f"{option_of(missing[0])} is missing: a block of kind {known_by.kind} is given by "
            f"{' and '.join(map(option_of, known_by.names))}, or by {WAYS}"
        )
    return kind, given, ()


def _show_table(summary: dict[str, Any], *, json: bool) -> None:
    if json:
        print_json(summary)
        return
    warnings, rows = summary.pop("warnings"), summary.pop("blocks", None)
    print(table_in_words(summary))
    print()
    if rows is not None:
        print_rows([answer_in_short(row) for row in rows[:SHOWN]])
        if more := summary["rows"] - len(rows[:SHOWN]):
            print(f"... and {more:,} more: --out FILE writes them all")
        print()
    print_pairs(summary)
    print_warnings(warnings)
