"""The method ``capacity``: what slumping blocks did under scaled records, probit.

    P = Φ(eta), 0 from r = 1 on

    pgv_pga_m   eta = b0 + b1 ln((1 - r)/r) + b2 ln z + b3 ln k_s + b4 (M - 6.5)
    pgv_pga     the same without M

r = k_s/PGA, z = p_s PGV/(PGA g). P falls with k_s where b3 < b1: the slope of eta by ln k_s is
b3 - b1/(1 - r). It rises where all measures rise together: z stays and r falls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits
from rbfrag.fragility.method import (
    NORMAL,
    BlockParameters,
    Bound,
    Eta,
    Form,
    Method,
    Numbers,
    linear,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

MIDDLE_MAGNITUDE = 6.5

BLOCK = BlockParameters(
    ("ks", "ps2"),
    "slumping",
    "ks",
    "ps2",
    Bound(
        lambda v: v["ks"] >= v["pga_g"],
        "ks",
        "is not below PGA: the block does not move, P = 0 by mechanics, not by the model",
    ),
    criterion="rotation_deg",
    points="scaled_records",
)
"""Blocks known by the yield acceleration coefficient k_s and p_s² at rest [1/s²]."""


def _pgv_pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    r = v["ks"] / v["pga_g"]
    z = v["p"] * v["pgv_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2)
    return linear(b, 1.0, ns.log((1.0 - r) / r), ns.log(z), ns.log(v["ks"]))


def _pgv_pga_m(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    features = _pgv_pga(b, v, ns).slopes
    return linear(b, *features, v["magnitude"] - MIDDLE_MAGNITUDE)


def _failure(_: Mapping[str, Any], rotation: float | None) -> str:
    if rotation is None:
        return "failure past recovery"
    return f"a rotation of {rotation:g} degrees or failure past recovery"


_PARAMETERS = ("b0", "b_ln_excess", "b_ln_z", "b_ln_k")

METHOD = Method(
    name="capacity",
    block=BLOCK,
    link=NORMAL,
    forms={
        "pgv_pga_m": Form((*_PARAMETERS, "b_m"), _pgv_pga_m, 0, (BLOCK.at_rest,)),
        "pgv_pga": Form(_PARAMETERS, _pgv_pga, 0, (BLOCK.at_rest,)),
    },
    reads="outcomes",
    meaning="probability that the block slumps past recovery, or by the rotation asked for",
    fit=fits.outcomes,
    failure=_failure,
)
