"""`rbfrag predict`: the probability that a block topples."""

from __future__ import annotations

from rbfrag.cli import options
from rbfrag.cli.block_argument import toppling_block
from rbfrag.cli.output import print_json, print_pairs, print_warnings

EXAMPLE = "Example:  rbfrag predict --p2 3 --kr 0.1 --pgv 0.6 --json"


def predict(
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    pgv: options.Pgv = None,
    pga: options.Pga = None,
    tm: options.Tm = None,
    pgd: options.Pgd = None,
    model: options.Model = None,
    level: options.Level = 0.95,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Print the probability that a block topples, with its confidence interval."""
    from rbfrag.fragility.prediction import predict as answer

    p2, kr, remarks = toppling_block(p2, kr, block)
    prediction = answer(
        p2,
        kr,
        pgv_m_s=pgv,
        pga_g=pga,
        tm_s=tm,
        pgd_m=pgd,
        model=model,
        level=level,
        db=db,
    )
    document = prediction.as_dict()
    document["warnings"] = [*remarks, *prediction.warnings]
    if json:
        print_json(document)
        return
    document.pop("warnings")
    print_pairs(document)
    print_warnings([*remarks, *prediction.warnings])
