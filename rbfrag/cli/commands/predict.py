"""`rbfrag predict`: the probability that a block fails."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.predict_answer import answer_one, show
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag predict --p2 3 --kr 0.1 --pgv 0.6 --json"


def _number(name: str, text: str) -> Any:
    return typer.Option(name, help=text, show_default=False)


def predict(
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: Annotated[
        str | None,
        typer.Option(
            "--block",
            metavar="FILE",
            help="Block file (.toml or .csv) with beta_deg and phi_deg, instead of numbers; "
            "refused unless its mode is that of --kind.",
            show_default=False,
        ),
    ] = None,
    kind: Annotated[
        str, typer.Option("--kind", help="How the block fails: toppling, slumping or sliding.")
    ] = "toppling",
    ky: Annotated[
        float | None, _number("--ky", "Sliding: yield acceleration coefficient tan(phi - beta).")
    ] = None,
    beta: Annotated[
        float | None,
        _number("--beta", "Sliding, with --ky: dip of the base, out of the slope positive [deg]."),
    ] = None,
    displacement: Annotated[
        float | None, _number("--displacement", "Sliding: the displacement that is too far [m].")
    ] = None,
    ks: Annotated[
        float | None, _number("--ks", "Slumping: yield acceleration coefficient k_s, with --ps2.")
    ] = None,
    ps2: Annotated[
        float | None, _number("--ps2", "Slumping: frequency parameter p_s² at rest [1/s²].")
    ] = None,
    rotation: Annotated[
        float | None,
        _number(
            "--rotation",
            "Slumping: rotation that counts as failure [deg]; there must be a model of it. "
            "Default: failure past recovery.",
        ),
    ] = None,
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
    """Print the probability that a block fails, with its confidence interval.

    What is known of the motion decides which model answers: PGV; PGV and PGA; these and Tm; or
    the motion itself. Where the measures suffice for several terms, each is answered. With
    --kind slumping or sliding, PGV, or better PGV and PGA.
    """
    from rbfrag.cli.commands.predict_kind import predict_kind, refuse_options_of_other_kinds

    refuse_options_of_other_kinds(
        kind,
        {
            "--p2": p2 is not None,
            "--kr": kr is not None,
            "--tm": tm is not None,
            "--pgd": pgd is not None,
            "--motion": motion is not None,
            "--polarity": polarity != "both",
            "--batch": batch is not None,
            "--out": out is not None,
            "--ky": ky is not None,
            "--beta": beta is not None,
            "--displacement": displacement is not None,
            "--ks": ks is not None,
            "--ps2": ps2 is not None,
            "--rotation": rotation is not None,
        },
    )
    if kind != "toppling":
        predict_kind(
            kind, block=block, ky=ky, beta_deg=beta, displacement_m=displacement, ks=ks, ps2=ps2,
            rotation_deg=rotation, pgv_m_s=pgv, pga_g=pga, model=model, level=level, db=db,
            json=json,
        )  # fmt: skip
        return
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
