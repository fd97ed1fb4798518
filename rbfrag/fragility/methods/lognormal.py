"""The method ``lognormal``: ln y* normal about a line in ln x, with censored critical values.

    eta = [a + b ln x (+ (M - 1) ln p) - ln y]/σ,   P = Φ(eta)

(3) of docs/theory/fragility.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits
from rbfrag.fragility.method import (
    NORMAL,
    OF_CRITICAL,
    TOPPLING_BLOCK,
    ArrayNamespace,
    Form,
    LinearPredictor,
    Method,
)


def _eta(b: Sequence[float], v: Mapping[str, Any], ns: ArrayNamespace) -> LinearPredictor:
    log_x = ns.log(v["intensity_m_s"])
    per = ns.exp(-b[2])
    from_line = b[0] + b[1] * log_x - ns.log(v["y_m_s"])
    if len(b) == 3:
        eta = from_line * per
        return LinearPredictor(eta, (per, log_x * per, -eta), b[2], (0.0, 0.0, 1.0))
    log_p = ns.log(v["p"])
    eta = (from_line + b[3] * log_p) * per
    return LinearPredictor(eta, (per, log_x * per, -eta, log_p * per), b[2], (0.0, 0.0, 1.0, 0.0))


_FORM = Form(
    ("ln_median", "slope", "ln_sigma", "m_minus_1"), _eta, 5,
    terms=("1", r"\ln x", "", r"\ln p"), equation=r"(<sum> - \ln y)/<exp ln_sigma>",
)  # fmt: skip

METHOD = Method(
    name="lognormal",
    block=TOPPLING_BLOCK,
    link=NORMAL,
    forms=dict.fromkeys(("pgv", "pga_tm", "pgd_tm", "xp"), _FORM),
    reads="critical",
    meaning=OF_CRITICAL,
    fit=fits.log_line,
    exponent="m_minus_1",
)
