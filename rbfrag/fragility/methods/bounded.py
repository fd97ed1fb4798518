"""The method ``bounded``: outcomes, with P falling to 0 at the bounds of mechanics.

    P = exp(-exp(-eta))
    eta = h(p) [b0 - b1 ln r + b2 ln(1 - r) + b3 ln(1 - v) + b4 ln z + b5 ln z_T]

r = k_r/PGA, v = y/2PGV, z = p PGV/(PGA g), z_T = p T_m/2π; with PGV alone
eta = h(p) [b0 - b1 ln v + b2 ln(1 - v) + b3 l + b4 l²] with l = ln p.
h(p) = exp(.18 l - .06 l²). (7) of docs/theory/fragility.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility.methods import (
    ABOVE_TWICE_PGV,
    LOGLOG,
    NOT_LIFTED,
    OF_OUTCOME,
    TOPPLING_BLOCK,
    Eta,
    Form,
    Method,
    Numbers,
    SizeFactor,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


def _pgv(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = v["y_m_s"] / (2.0 * v["intensity_m_s"])
    f1, f2, f3 = -ns.log(ratio), ns.log(1.0 - ratio), ns.log(v["p"])
    f4 = f3 * f3
    return Eta(b[0] + b[1] * f1 + b[2] * f2 + b[3] * f3 + b[4] * f4, (1.0, f1, f2, f3, f4))


def _pgv_pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    pga, x = v["pga_g"], v["intensity_m_s"]
    r = v["kr"] / pga
    f1, f2 = -ns.log(r), ns.log(1.0 - r)
    f3 = ns.log(1.0 - v["y_m_s"] / (2.0 * x))
    f4 = ns.log(v["p"] * x / (pga * STANDARD_GRAVITY_M_S2))
    return Eta(b[0] + b[1] * f1 + b[2] * f2 + b[3] * f3 + b[4] * f4, (1.0, f1, f2, f3, f4))


def _pgv_pga_tm(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    eta, slopes, _, _ = _pgv_pga(b, v, ns)
    f5 = ns.log(v["p"] * v["tm_s"] / (2.0 * math.pi))
    return Eta(eta + b[5] * f5, (*slopes, f5))


_BOUNDS = (NOT_LIFTED, ABOVE_TWICE_PGV)
_OF_SIZE = SizeFactor(0.18, 0.06)
_NAMES = ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_share", "b_ln_z")

METHOD = Method(
    name="bounded",
    block=TOPPLING_BLOCK,
    link=LOGLOG,
    forms={
        "pgv": Form(
            ("b0", "b_ln_share", "b_ln_1_minus_share", "b_ln_p", "b_ln_p_squared"),
            _pgv, 0, (ABOVE_TWICE_PGV,), size_factor=_OF_SIZE,
        ),
        "pgv_pga": Form(_NAMES, _pgv_pga, 0, _BOUNDS, size_factor=_OF_SIZE),
        "pgv_pga_tm": Form((*_NAMES, "b_ln_zt"), _pgv_pga_tm, 0, _BOUNDS, size_factor=_OF_SIZE),
    },
    reads="outcomes",
    meaning=OF_OUTCOME,
    fit="rbfrag.fragility.fit.outcomes:fit_outcomes",
)  # fmt: skip
