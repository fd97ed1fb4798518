"""The method ``displacement``: permanent displacement of sliding blocks, lognormal.

Sliding further than d on a level plane, with r = k_y/PGA:

    eta = [c + b1 ln(PGV²/(k_y g)) + b2 ln(1 - r) + b3 m - ln d]/σ,       ln σ = s0 + s1 r

where m is M - 6.5 if the magnitude is known, ln(Ia/PGV²) if the Arias intensity Ia [m/s] is,

and, where PGA is not known, with u = ln(1 + k_y/(κ PGV)):

    eta = [c + b1 ln(PGV²/(k_y g)) - b2 u - ln d]/σ,               ln σ = s0

A scatter that grew with u would make P rise again as PGV falls, one of k_y as the strength grows.
P = Φ(eta). A rectangular pulse gives the first with c = ln(1/2), b1 = b2 = 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import mul
from typing import Any

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

Formula = Callable[[Parameters, Values, ArrayNamespace], LinearPredictor]


def _level(values: dict[str, Any], ns: ArrayNamespace) -> None:
    """Convert the displacement down a dipping base to a level plane, d cos φ/cos(φ - β)."""
    if "beta_deg" not in values:
        return
    beta = values["beta_deg"] * (math.pi / 180.0)
    sin, cos = ns.sin(beta), ns.cos(beta)
    values["displacement_m"] = values["displacement_m"] * (cos - values["ky"] * sin)
    values["sin_phi"] = sin + values["ky"] * cos


BLOCK = method.BlockParameters(
    ("ky", "displacement_m"),
    "sliding",
    "ky",
    None,
    method.MechanicalBound(
        lambda v: v["ky"] >= v["pga_g"],
        "ky",
        "k_y{ky} is not below PGA{pga_g}: the block does not move",
    ),
    options=("beta_deg",),
    points="displacements",
    adjust=_level,
    rejects=(
        method.MechanicalBound(
            lambda v: (
                "beta_deg" in v
                and (abs(v["beta_deg"]) >= 90.0)
                | (v["displacement_m"] <= 0.0)
                | (v["sin_phi"] < 0.0)
            ),
            "beta_deg",
            "means, with this ky, a friction angle that is not from 0 to below 90 degrees",
        ),
    ),
)
"""Blocks known by k_y = tan(φ - β) and the displacement that is too far [m]."""


def _eta(further: Callable[[Values, ArrayNamespace], tuple[Any, ...]]) -> Formula:
    """Return the formula with further terms of the median."""

    def formula(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
        ky, pgv = v["ky"], v["pgv_m_s"]
        r = ky / v["pga_g"]
        size = ns.log(pgv * pgv / (ky * STANDARD_GRAVITY_M_S2))
        columns = (1.0, size, ns.log(1.0 - r), *further(v, ns))
        log_sigma = b[-2] + b[-1] * r
        per = ns.exp(-log_sigma)
        median = sum(map(mul, b, columns))
        eta = (median - ns.log(v["displacement_m"])) * per
        slopes = (*(column * per for column in columns), -eta, -eta * r)
        return LinearPredictor(eta, slopes, log_sigma, (*(0.0 for _ in columns), 1.0, r))

    return formula


def _pgv(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    ky, pgv = v["ky"], v["pgv_m_s"]
    size = ns.log(pgv * pgv / (ky * STANDARD_GRAVITY_M_S2))
    a = ky / (ns.exp(b[3]) * pgv)
    u = ns.log(1.0 + a)
    per = ns.exp(-b[4])
    eta = (b[0] + b[1] * size - b[2] * u - ns.log(v["displacement_m"])) * per
    slopes = (per, size * per, -u * per, b[2] * per * a / (1.0 + a), -eta)
    return LinearPredictor(eta, slopes, b[4], (0.0, 0.0, 0.0, 0.0, 1.0))


METHOD = method.Method(
    name="displacement",
    block=BLOCK,
    link=method.NORMAL,
    forms={
        "pgv_pga": method.Form(
            ("c", "b1", "b2", "s0", "s1"), _eta(lambda _, __: ()), (BLOCK.at_rest,),
            start=(0.6, 0.9, 3.7, -0.6, 0.9),
            advice="without magnitude, P is overestimated below M 6.4 and underestimated from "
            "M 7.5: give the magnitude",
        ),
        "pgv_pga_m": method.Form(
            ("c", "b1", "b2", "b_magnitude", "s0", "s1"),
            _eta(lambda v, _: (v["magnitude"] - 6.5,)), (BLOCK.at_rest,),
            start=(0.2, 0.8, 4.0, 0.4, -0.8, 1.4),
        ),
        "pgv_pga_ia": method.Form(
            ("c", "b1", "b2", "b_arias", "s0", "s1"),
            _eta(lambda v, ns: (ns.log(v["arias_m_s"] / (v["pgv_m_s"] * v["pgv_m_s"])),)),
            (BLOCK.at_rest,),
            start=(-0.9, 1.2, 2.7, 0.7, -0.8, 1.0),
        ),
        "pgv": method.Form(
            ("c", "b1", "b2", "ln_kappa", "s0"), _pgv, start=(2.9, 0.2, 2.7, -3.5, 0.4),
        ),
    },
    meaning="probability that the block slides further than the displacement",
    fit="censored",
    failure=lambda values, _: f"permanent displacement above {values['displacement_m']:g} m",
    median_of="displacement_m",
)  # fmt: skip
