"""The method ``logistic``: outcomes, logistic in ln(x/y).

    eta = h(p) [b0 + b1 ln(x/y) (+ b2 ln p)],   P = 1/(1 + exp(-eta))

h(p) = exp(.18 l - .06 l²), l = ln p; with X(p) h(p) = p^.30, with PGD 1. (4) of
docs/theory/fragility.md.
"""

from __future__ import annotations

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values, linear


def _eta(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return linear(b, 1.0, ratio) if len(b) == 2 else linear(b, 1.0, ratio, ns.log(v["p"]))


def _form(size_factor: method.SizeFactor | None) -> method.Form:
    return method.Form(
        ("b0", "b_ln_x_over_y", "b_ln_p"), _eta, size_factor=size_factor,
        terms=("1", r"\ln(x/y)", r"\ln p"),
    )  # fmt: skip


_OF_SIZE = method.SizeFactor(0.18, 0.06)
METHOD = method.Method(
    name="logistic",
    block=method.TOPPLING_BLOCK,
    link=method.LOGIT,
    forms={
        "pgv": _form(_OF_SIZE),
        "pga_tm": _form(_OF_SIZE),
        "pgd_tm": _form(None),
        "xp": _form(method.SizeFactor(0.30)),
    },
    meaning=method.OF_OUTCOME,
    fit="outcomes",
    exponent="b_ln_p",
)
