"""The method ``lognormal``: ln y* normal about a line in ln x, with censored critical values.

    eta = [a + b ln x (+ (M - 1) ln p) - ln y]/σ,   P = Φ(eta)

(3) of docs/theory/fragility.md.
"""

from __future__ import annotations

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values


def _eta(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    log_x = ns.log(v["intensity_m_s"])
    per = ns.exp(-b[2])
    from_line = b[0] + b[1] * log_x - ns.log(v["y_m_s"])
    if len(b) == 3:
        eta = from_line * per
        return LinearPredictor(eta, (per, log_x * per, -eta), b[2], (0.0, 0.0, 1.0))
    log_p = ns.log(v["p"])
    eta = (from_line + b[3] * log_p) * per
    return LinearPredictor(eta, (per, log_x * per, -eta, log_p * per), b[2], (0.0, 0.0, 1.0, 0.0))


_FORM = method.Form(
    ("ln_median", "slope", "ln_sigma", "m_minus_1"), _eta,
    terms=("1", r"\ln x", "", r"\ln p"), equation=r"(<sum> - \ln y)/<exp ln_sigma>",
)  # fmt: skip

METHOD = method.Method(
    name="lognormal",
    block=method.TOPPLING_BLOCK,
    link=method.NORMAL,
    forms=dict.fromkeys(("pgv", "pga_tm", "pgd_tm", "xp"), _FORM),
    meaning=method.OF_CRITICAL,
    fit="log_line",
    exponent="m_minus_1",
)
