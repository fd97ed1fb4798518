"""The method ``weibull``: outcomes, Weibull in the odds of the block's strength.

    P = exp(-exp(-eta)),   eta = h(p) [b0 + b1 ln((1 - r)/r) + b2 ln z + b3 ln z_T]

r = k_r/PGA, z = p PGV/(PGA g), z_T = p T_m/2π; with PGV alone y/2PGV stands for r.
h(p) = exp(.18 l - .06 l²), l = ln p. (5) and (6) of docs/theory/fragility.md.

On the reference h lowers the held-out log loss from .1696, .1557 and .1520 to .1673, .1535 and
.1494 (PGV, with PGA, with PGA and Tm).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import methods
from rbfrag.fragility.methods import Eta, Form, Method, Numbers, SizeFactor
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


_OF_SIZE = SizeFactor(0.18, 0.06)
_TERMS = ("1", r"\ln\frac{1 - r}{r}", r"\ln z")
_WHERE = r"r = k_r/\mathrm{PGA},\ z = p\,x/(\mathrm{PGA}\,g)"

METHOD = Method(
    name="weibull",
    block=methods.TOPPLING_BLOCK,
    link=methods.LOGLOG,
    forms={
        "pgv": Form(
            ("b0", "b_logit_share"), _pgv, 1, (methods.ABOVE_TWICE_PGV,), size_factor=_OF_SIZE,
            terms=("1", r"\ln\frac{1 - v}{v}"), where="v = y/2x",
        ),
        "pgv_pga": Form(
            ("b0", "b_logit_r", "b_ln_z"), _pgv_pga, 1, (methods.NOT_LIFTED,), size_factor=_OF_SIZE,
            terms=_TERMS, where=_WHERE,
        ),
        "pgv_pga_tm": Form(
            ("b0", "b_logit_r", "b_ln_z", "b_ln_zt"), _pgv_pga_tm, 1, (methods.NOT_LIFTED,),
            size_factor=_OF_SIZE, terms=(*_TERMS, r"\ln z_T"),
            where=_WHERE + r",\ z_T = p\,T_m/2\pi",
        ),
    },
    reads="outcomes",
    meaning=methods.OF_OUTCOME,
    fit="rbfrag.fragility.fit.outcomes:fit_outcomes",
)  # fmt: skip
