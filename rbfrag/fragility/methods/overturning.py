"""The method ``overturning``: what free-standing blocks did, logistic, with their restitution.

    P = 1/(1 + exp(-eta)), 0 from r = 1 on,   h(p) = exp(A l - B l²)

    pgv_pga    A = .15, B = .08   eta = h (b0 + b1 L + b2 ln z + b3 s + b4 s L)
    pga_sa10   A = .40, B = .04         h (b0 + b1 L + b2 l + b3 l² + b4 s + b5 s L + b6 Q)
    pgv        A = .35, B = .02         h (b0 + b1 u + b2 l + b3 l² + b4 s + b5 s u)
    sa10       A = .45, B = .04         the same

r = k_r/PGA, L = ln(r/(1 - r)), z = p PGV/(PGA g), l = ln p, u = ln(y/x), x being PGV or
SA(1.0) g/2π, Q = ln(SA(1.0)/(2π PGA)), s = sqrt(1 - e). e is the speed after an impact over that
before it: Housner's 1 - 1.5 sin² α (1963) of the rectangle with tan α = k_r, unless it is given.
Of terms of second order in ln z P would rise again towards weak shaking. How well the models do
stands in docs/theory/rocking.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits, method
from rbfrag.fragility.method import (
    BlockParameters,
    Bound,
    Eta,
    Form,
    Method,
    Numbers,
    SizeFactor,
    linear,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

LEAST_RESTITUTION = 1e-6
"""Stands for the restitution of stocky blocks, of whose speed an impact leaves nothing."""


def _restitution(values: dict[str, Any], ns: Numbers) -> None:
    """Complete the restitution: as given, or that of the rectangle times a factor of it."""
    if "restitution" not in values:
        square = values["kr"] * values["kr"]
        formula = 1.0 - 1.5 * square / (1.0 + square)
        factor = values.get("restitution_factor", 1.0)
        values["restitution"] = ns.maximum(factor * formula, LEAST_RESTITUTION)
    # also of a value that is refused afterwards
    values["speed_loss"] = ns.sqrt(ns.maximum(1.0 - values["restitution"], 0.0))


BLOCK = BlockParameters(
    ("p2", "kr"),
    "rocking",
    "kr",
    "p2",
    method.NOT_LIFTED._replace(
        text="is not below PGA: without vertical motion the ground cannot lift this block, which "
        "cannot overturn: P = 0 by mechanics, not by the model"
    ),
    options=("restitution",),
    stored=("restitution_factor",),
    fractions=("restitution",),
    adjust=_restitution,
    refuses=(
        Bound(
            lambda v: (v["restitution"] <= 0.0) | (v["restitution"] > 1.0),
            "restitution",
            "is no ratio of speeds that the model knows: give the speed after an impact over that "
            "before it, above 0 and up to 1 (a block that comes to rest at its first impact is "
            "outside the model)",
        ),
    ),
    support="the block is taken to stand free: a symmetric rectangle on level ground that rocks "
    "about both edges, without vertical motion",
)
"""Free-standing blocks known by p² [1/s²], k_r = tan(critical angle) and, if given, restitution."""


def _log_odds(v: Mapping[str, Any], ns: Numbers) -> Any:
    r = v["kr"] / v["pga_g"]
    return ns.log(r / (1.0 - r))


def _pgv_pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    odds, s = _log_odds(v, ns), v["speed_loss"]
    z = ns.log(v["p"] * v["intensity_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2))
    return linear(b, 1.0, odds, z, s, s * odds)


def _velocity(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    s = v["speed_loss"]
    u, l = ns.log(v["y_m_s"] / v["intensity_m_s"]), ns.log(v["p"])  # noqa: E741  as in the formula
    return linear(b, 1.0, u, l, l * l, s, s * u)


def _pga_sa10(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    odds, s = _log_odds(v, ns), v["speed_loss"]
    l = ns.log(v["p"])  # noqa: E741  as in the formula
    q = ns.log(v["sa10_g"] / v["pga_g"] * (0.5 / math.pi))
    return linear(b, 1.0, odds, l, l * l, s, s * odds, q)


_OF_VELOCITY = ("b0", "b_ln_y_over_x", "b_ln_p", "b_ln_p_squared", "b_s", "b_s_ln_y_over_x")

METHOD = Method(
    name="overturning",
    block=BLOCK,
    link=method.LOGIT,
    forms={
        "pgv_pga": Form(
            ("b0", "b_logit_r", "b_ln_z", "b_s", "b_s_logit_r"),
            _pgv_pga, 0, (BLOCK.at_rest,), size_factor=SizeFactor(0.15, 0.08),
        ),
        "pgv": Form(_OF_VELOCITY, _velocity, 0, size_factor=SizeFactor(0.35, 0.02)),
        "sa10": Form(_OF_VELOCITY, _velocity, 0, size_factor=SizeFactor(0.45, 0.04)),
        "pga_sa10": Form(
            ("b0", "b_logit_r", "b_ln_p", "b_ln_p_squared", "b_s", "b_s_logit_r", "b_ln_q10"),
            _pga_sa10, 0, (BLOCK.at_rest,), size_factor=SizeFactor(0.4, 0.04),
        ),
    },
    reads="outcomes",
    meaning="probability that the free-standing block overturns",
    fit=fits.outcomes,
    failure=lambda _, __: "overturning",
)  # fmt: skip
