"""`rbfrag predict`: the probability that a block fails."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings, show_prediction
from rbfrag.cli.parameters import options
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag predict --p2 3 --kr 0.1 --pgv 0.6 --json"


def predict(
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: Annotated[
        str | None,
        typer.Option(
            "--block",
            metavar="FILE",
            help="Block file (.toml or .csv) with beta_deg and phi_deg, instead of numbers; "
            "refused unless its mode is that of the kind.",
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            help="How the block fails: toppling, slumping or sliding. Default: what the block is "
            "given by, --p2, --ks or --ky.",
        ),
    ] = None,
    ky: Annotated[
        float | None,
        typer.Option("--ky", help="Sliding: yield acceleration coefficient tan(phi - beta)."),
    ] = None,
    beta: Annotated[
        float | None,
        typer.Option(
            "--beta", help="Sliding, with --ky: dip of the base, out of the slope positive [deg]."
        ),
    ] = None,
    displacement: Annotated[
        float | None,
        typer.Option("--displacement", help="Sliding: the displacement that is too far [m]."),
    ] = None,
    ks: Annotated[
        float | None,
        typer.Option("--ks", help="Slumping: yield acceleration coefficient k_s, with --ps2."),
    ] = None,
    ps2: Annotated[
        float | None,
        typer.Option("--ps2", help="Slumping: frequency parameter p_s² at rest [1/s²]."),
    ] = None,
    rotation: Annotated[
        float | None,
        typer.Option(
            "--rotation",
            help="Slumping: rotation that counts as failure [deg]; there must be a model of it. "
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
            help="Block table (.csv or .parquet) with columns p2_1_s2 and kr (or ky and "
            "displacement_m; or ks and ps2_1_s2) and any of pgv_m_s, pga_g, tm_s, pgd_m; what is "
            "the same for all rows may be an option.",
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="With --batch: table to write, the same columns with probability, ci_low, "
            "ci_high, in_domain and reason.",
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
    the motion itself. Where the measures suffice for several terms, each is answered.
    """
    options_given = {
        "p2": p2, "kr": kr, "ky": ky, "beta_deg": beta, "displacement_m": displacement, "ks": ks,
        "ps2": ps2, "pgv_m_s": pgv, "pga_g": pga, "tm_s": tm, "pgd_m": pgd,
    }  # fmt: skip
    given = {name: value for name, value in options_given.items() if value is not None}
    asked: dict[str, Any] = {
        "kind": kind, "rotation_deg": rotation, "model": model, "level": level, "db": db
    }  # fmt: skip
    if batch is not None or out is not None:
        if block is not None or motion is not None:
            raise InputError("--batch FILE describes the blocks: leave out --block and --motion")
        _predict_table(batch, out, given, asked, json=json)
        return
    document = answer_one(
        given, block=block, motion=motion, polarity=polarity, units=units, dt=dt, **asked
    )
    show_prediction(document, json=json)


def answer_one(
    given: Mapping[str, float],
    *,
    block: str | None = None,
    kind: str | None = None,
    rotation_deg: float | None = None,
    motion: str | None = None,
    polarity: str = "both",
    model: str | None = None,
    level: float = 0.95,
    units: str | None = None,
    dt: float | None = None,
    db: str | None = None,
) -> dict[str, Any]:
    """Return the JSON document of one block.

    Args:
        given: block and measures of the motion, by the names of :func:`rbfrag.predict`.
        block: a block file instead of the block's numbers.
        kind: how the block fails.
        rotation_deg: rotation that counts as failure [deg].
        motion: the accelerogram itself: a file, ``FILE#INDEX`` or a database id.
        polarity: forward, reverse or both; with `motion`.
        model: name of a stored model.
        level: confidence level of the interval.
        units: unit of a text file of the motion.
        dt: sampling interval of such a file [s].
        db: database.
    """
    from rbfrag.fragility.lookup import block_of
    from rbfrag.fragility.predict import prediction_document

    asked, record = dict(given), None
    remarks: tuple[str, ...] = ()
    described = block_of(asked)
    if block is not None:
        from rbfrag.cli.parameters.block import block_of_file

        values, remarks = block_of_file(block, described.kind if kind is None else kind)
        for name in values:
            if name in asked:
                raise InputError(
                    f"{_option(name)} does not go with --block: the file describes the block"
                )
        asked |= values
        described = block_of(asked)
    missing = [name for name in described.names if name not in asked]
    if missing and kind in (None, described.kind):
        raise InputError(
            f"{_option(missing[0])} is missing: a block of kind {described.kind} is given by "
            f"{' and '.join(map(_option, described.names))}, or by --block FILE"
        )
    if motion is not None:
        from rbfrag.cli.parameters.motion import find_motion

        record = find_motion(motion, db=db, units=units, dt_s=dt)
    return prediction_document(
        asked,
        kind=kind,
        rotation_deg=rotation_deg,
        motion=record,
        polarity=polarity,
        model=model,
        level=level,
        db=db,
        remarks=remarks,
    )


def _option(name: str) -> str:
    return {"displacement_m": "--displacement", "beta_deg": "--beta"}.get(name, f"--{name}")


def _predict_table(
    batch: str | None,
    out: str | None,
    given: dict[str, float],
    asked: dict[str, Any],
    *,
    json: bool,
) -> None:
    from rbfrag.exchange.batch import predict_table

    if batch is None or out is None:
        raise InputError(
            "--batch and --out go together: --batch FILE names the blocks, --out FILE the answers"
        )
    summary = predict_table(batch, out, given=given, **asked)
    warnings = summary.pop("warnings")
    if json:
        print_json({**summary, "warnings": warnings})
        return
    print_pairs(summary)
    print_warnings(warnings)  # type: ignore[arg-type]
