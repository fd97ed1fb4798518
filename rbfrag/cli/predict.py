"""`rbfrag predict`: the probability that a block topples."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.predict_answer import answer_one, show
from rbfrag.errors import InputError

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
