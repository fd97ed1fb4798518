"""The method ``logistic``: outcomes, logistic in ln(x/y).

    eta = b0 + b1 ln(x/y) (+ b2 ln p),   P = 1/(1 + exp(-eta))

(4) of docs/theory/fragility.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility.methods import LOGIT, OF_OUTCOME, TOPPLING_BLOCK, Eta, Form, Method, Numbers


def _eta(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    if len(b) == 2:
        return Eta(b[0] + b[1] * ratio, (1.0, ratio))
    log_p = ns.log(v["p"])
    return Eta(b[0] + b[1] * ratio + b[2] * log_p, (1.0, ratio, log_p))


_FORM = Form(("b0", "b_ln_x_over_y", "b_ln_p"), _eta, 4)

METHOD = Method(
    name="logistic",
    block=TOPPLING_BLOCK,
    link=LOGIT,
    forms=dict.fromkeys(("pgv", "pga_tm", "pgd_tm", "xp"), _FORM),
    reads="outcomes",
    meaning=OF_OUTCOME,
    fit="rbfrag.fragility.fit.outcomes:fit_outcomes",
    exponent="b_ln_p",
)
