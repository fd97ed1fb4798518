"""The method ``record``: outcomes, probit in ln(X(p)/y) and in the strength of the motion.

    eta = h(p) [b0 + b1 ln(X(p)/y) + b2 ln s],   s = p X(p)/(PGA g),   h(p) = p^.18
    P = Φ(eta), 0 where y >= X(p) or k_r >= PGA

(6) of docs/theory/fragility.md.
"""

from __future__ import annotations

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values, linear
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


def _eta(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    x = v["intensity_m_s"]
    log_s = ns.log(v["p"] * x / (v["pga_g"] * STANDARD_GRAVITY_M_S2))
    return linear(b, 1.0, ns.log(x / v["y_m_s"]), log_s)


METHOD = method.Method(
    name="record",
    block=method.TOPPLING_BLOCK,
    link=method.NORMAL,
    forms={
        "xp": method.Form(
            ("b0", "b_ln_xp_over_y", "b_ln_s"), _eta,
            (method.ABOVE_SPECTRUM, method.NOT_LIFTED), size_factor=method.SizeFactor(0.18),
            terms=("1", r"\ln(x/y)", r"\ln s"), where=r"s = p\,x/(\mathrm{PGA}\,g)",
        )
    },
    meaning=method.OF_OUTCOME,
    fit="outcomes",
)  # fmt: skip
