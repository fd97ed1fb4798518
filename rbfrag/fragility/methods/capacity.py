"""The method ``capacity``: the strength of shaking at which a slumping block fails, lognormal.

With r = k_s/PGA and z = p_s PGV/(PGA g), and where PGA is not known with y = k_s g/p_s:

    eta = [ln((1 - r)/r) - c + b ln z + d ln k_s]/σ,    eta = [ln PGV - c - b ln y]/σ,    ln σ = s0

P = Φ(eta): the PGV at which a block fails, and its PGA, scatter about a line in ln z and ln k_s, or
in ln y. With PGA known P falls with k_s where d < 1, which is all that is fitted: the slope of eta
by ln k_s is d - 1/(1 - r) times 1/σ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits
from rbfrag.fragility.method import NORMAL, BlockParameters, Bound, Eta, Form, Method, Numbers
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

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
    options=("leaves_g",),
    doubts=(
        Bound(
            lambda v: "leaves_g" in v and "pga_g" in v and v["pga_g"] > v["leaves_g"],
            "pga_g",
            "is above leaves_g, at which the block leaves its back plane: the model takes it to "
            "stay there",
        ),
    ),
)
"""Blocks known by the yield acceleration coefficient k_s and p_s² at rest [1/s²]."""


def _pgv_pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    r = v["ks"] / v["pga_g"]
    z = ns.log(v["p"] * v["pgv_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2))
    per = ns.exp(-b[3])
    strength = ns.log(v["ks"])
    eta = (ns.log((1.0 - r) / r) - b[0] + b[1] * z + b[2] * strength) * per
    return Eta(eta, (-per, z * per, strength * per, -eta), b[3], (0.0, 0.0, 0.0, 1.0))


def _pgv(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    log_y = ns.log(v["y_m_s"])
    per = ns.exp(-b[2])
    eta = (ns.log(v["pgv_m_s"]) - b[0] - b[1] * log_y) * per
    return Eta(eta, (-per, -log_y * per, -eta), b[2], (0.0, 0.0, 1.0))


def _failure(_: Mapping[str, Any], rotation: float | None) -> str:
    if rotation is None:
        return "failure past recovery"
    return f"a rotation of {rotation:g} degrees or failure past recovery"


METHOD = Method(
    name="capacity",
    block=BLOCK,
    link=NORMAL,
    forms={
        "pgv_pga": Form(
            ("c", "b", "d", "s0"), _pgv_pga, 0, (BLOCK.at_rest,), (-0.5, 0.8, 0.4, -1.0)
        ),
        "pgv": Form(("c", "b", "s0"), _pgv, 0, (), (0.0, 1.0, -1.0)),
    },
    reads="critical",
    meaning="probability that the block slumps past recovery, or by the rotation asked for",
    fit=fits.censored,
    failure=_failure,
)
