"""`rbfrag predict`: the probability that a block topples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.block_argument import toppling_block
from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.fragility.answers import Prediction

EXAMPLE = "Example:  rbfrag predict --p2 3 --kr 0.1 --pgv 0.6 --json"


def predict(
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    pgv: options.Pgv = None,
    pga: options.Pga = None,
    tm: options.Tm = None,
    pgd: options.Pgd = None,
    motion: Annotated[
        str | None,
        typer.Option(
            "--motion",
            metavar="MOTION",
            help="The accelerogram itself, instead of its measures: a file, FILE#INDEX or a "
            "database id. Its toppling spectrum answers, for both polarities and their mean.",
            show_default=False,
        ),
    ] = None,
    polarity: Annotated[
        str,
        typer.Option("--polarity", help="With --motion: forward, reverse, or both where unknown."),
    ] = "both",
    batch: Annotated[
        str | None,
        typer.Option(
            "--batch",
            metavar="FILE",
            help="Block table (.csv or .parquet) with columns p2_1_s2, kr and any of pgv_m_s, "
            "pga_g, tm_s, pgd_m; measures that are the same for all rows may be options.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="With --batch: table to write, the same columns with probability, ci_low, "
            "ci_high, in_domain and reason.",
            show_default=False,
        ),
    ] = None,
    model: options.Model = None,
    level: options.Level = 0.95,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Print the probability that a block topples, with its confidence interval.

    What is known of the motion decides which model answers: PGV; PGV and PGA; these and Tm; or
    the motion itself. Where the measures suffice for several terms, each is answered.
    """
    given = {"pgv_m_s": pgv, "pga_g": pga, "tm_s": tm, "pgd_m": pgd}
    measures = {name: value for name, value in given.items() if value is not None}
    if batch is not None or out is not None:
        if p2 is not None or kr is not None or block is not None or motion is not None:
            raise InputError(
                "--batch FILE describes the blocks: leave out --p2, --kr, --block and --motion"
            )
        _predict_table(batch, out, measures, model=model, level=level, db=db, json=json)
        return
    document, warnings = answer_one(
        p2,
        kr,
        block,
        measures,
        motion=motion,
        polarity=polarity,
        model=model,
        level=level,
        units=units,
        dt=dt,
        db=db,
    )
    show(document, warnings, json=json)


def answer_one(
    p2: float | None,
    kr: float | None,
    block: str | None,
    measures: dict[str, float],
    *,
    motion: str | None,
    polarity: str,
    model: str | None,
    level: float,
    units: str | None,
    dt: float | None,
    db: str | None,
) -> tuple[dict[str, Any], list[str]]:
    """Return the JSON document and the warnings of one block."""
    from rbfrag.fragility.prediction import answer_given
    from rbfrag.fragility.prediction import predict as run

    answer: Any = run
    p2, kr, remarks = toppling_block(p2, kr, block)
    others: list[Prediction] = []
    if motion is not None:
        from rbfrag.cli.motion_argument import find_motion

        prediction: Any = answer(
            p2,
            kr,
            **measures,
            motion=find_motion(motion, db=db, units=units, dt_s=dt),
            polarity=polarity,
            model=model,
            level=level,
            db=db,
        )
        others = [prediction]
    elif model is not None:
        prediction = answer(p2, kr, **measures, model=model, level=level, db=db)
        others = [prediction]
    else:
        from rbfrag.fragility.model_lookup import suited_models

        values = {"p2": p2, "kr": kr, **measures}
        others = [answer_given(each, values, level) for each in suited_models(values, db)]  # type: ignore[misc]
        prediction = others[0]
    document = prediction.as_dict()
    warnings = [*remarks, *prediction.warnings]
    document["warnings"] = warnings
    document["answers"] = [
        {
            "model": each.model,
            "term": each.term,
            "method": each.method,
            "probability": each.probability,
            "ci_low": each.ci_low,
            "ci_high": each.ci_high,
            "in_domain": each.in_domain,
            "recommended": each is prediction,
        }
        for each in others
    ]
    return document, warnings


def show(document: dict[str, Any], warnings: list[str], *, json: bool) -> None:
    """Print an answer."""
    if json:
        print_json(document)
        return
    answers = document.pop("answers")
    polarities = document.pop("polarities", None)
    document.pop("warnings")
    print_pairs(document)
    if polarities:
        print()
        print_table(
            ("polarity", "probability", "ci_low", "ci_high", "intensity_m_s"),
            [
                (name, p["probability"], p["ci_low"], p["ci_high"], p["intensity_m_s"])
                for name, p in polarities.items()
            ],
        )
    if len(answers) > 1:
        print()
        print_table(
            ("model", "term", "probability", "ci_low", "ci_high", "in_domain", "recommended"),
            [
                (a["model"], a["term"], a["probability"], a["ci_low"], a["ci_high"],
                 a["in_domain"], a["recommended"])
                for a in answers
            ],
        )  # fmt: skip
    print_warnings(warnings)


def _predict_table(
    batch: str | None,
    out: str | None,
    measures: dict[str, float],
    *,
    model: str | None,
    level: float,
    db: str | None,
    json: bool,
) -> None:
    from rbfrag.exchange.batch import predict_table

    if batch is None or out is None:
        raise InputError(
            "--batch and --out go together: --batch FILE names the blocks, --out FILE the answers"
        )
    summary = predict_table(batch, out, measures=measures, model=model, level=level, db=db)
    warnings = summary.pop("warnings")
    if json:
        print_json({**summary, "warnings": warnings})
        return
    print_pairs(summary)
    print_warnings(warnings)  # type: ignore[arg-type]
