"""The method ``weibull``: outcomes, Weibull in the odds of the block's strength.

    P = exp(-exp(-eta)),   eta = b0 + b1 ln((1 - r)/r) + b2 ln z + b3 ln z_T

r = k_r/PGA, z = p PGV/(PGA g), z_T = p T_m/2π; with PGV alone y/2PGV stands for r. (5) and (6) of
docs/theory/fragility.md.
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
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


def _pgv(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = v["y_m_s"] / (2.0 * v["intensity_m_s"])
    log_odds = ns.log((1.0 - ratio) / ratio)
    return Eta(b[0] + b[1] * log_odds, (1.0, log_odds))


def _pgv_pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    r = v["kr"] / v["pga_g"]
    log_odds = ns.log((1.0 - r) / r)
    log_z = ns.log(v["p"] * v["intensity_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2))
    return Eta(b[0] + b[1] * log_odds + b[2] * log_z, (1.0, log_odds, log_z))


def _pgv_pga_tm(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    eta, slopes, _, _ = _pgv_pga(b, v, ns)
    log_zt = ns.log(v["p"] * v["tm_s"] / (2.0 * math.pi))
    return Eta(eta + b[3] * log_zt, (*slopes, log_zt))


METHOD = Method(
    name="weibull",
    block=TOPPLING_BLOCK,
    link=LOGLOG,
    forms={
        # before `bounded` on PGV alone, where the third parameter of that gains nothing
        "pgv": Form(("b0", "b_logit_share"), _pgv, 0, (ABOVE_TWICE_PGV,)),
        "pgv_pga": Form(("b0", "b_logit_r", "b_ln_z"), _pgv_pga, 2, (NOT_LIFTED,)),
        "pgv_pga_tm": Form(("b0", "b_logit_r", "b_ln_z", "b_ln_zt"), _pgv_pga_tm, 2, (NOT_LIFTED,)),
    },
    reads="outcomes",
    meaning=OF_OUTCOME,
    fit="rbfrag.fragility.fit.outcomes:fit_outcomes",
)
