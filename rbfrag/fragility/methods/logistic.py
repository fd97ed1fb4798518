"""The method ``logistic``: outcomes, logistic in ln(x/y).

    eta = h(p) [b0 + b1 ln(x/y) (+ b2 ln p)],   P = 1/(1 + exp(-eta))

h(p) = exp(.18 l - .06 l²), l = ln p; with X(p) h(p) = p^.30, with PGD 1. (4) of
docs/theory/fragility.md. With SA(1.0) alone, V_1 = SA g/2π and k' of
:func:`rbfrag.fragility.method.log_strength`,

    eta = h(p) [b0 + b1 l + b2 l² + b3 ln(V_1/y) + b4 ln V_1 + b5 k']
"""

from __future__ import annotations

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values, linear


def _eta(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return linear(b, 1.0, ratio) if len(b) == 2 else linear(b, 1.0, ratio, ns.log(v["p"]))


def _spectral(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    x, l = v["intensity_m_s"], ns.log(v["p"])  # noqa: E741  as in the formula
    return linear(b, 1.0, l, l * l, ns.log(x / v["y_m_s"]), ns.log(x), method.log_strength(v, ns))


def _form(size_factor: method.SizeFactor | None) -> method.Form:
    return method.Form(
        ("b0", "b_ln_x_over_y", "b_ln_p"), _eta, 4, size_factor=size_factor,
        terms=("1", r"\ln(x/y)", r"\ln p"),
    )  # fmt: skip


_OF_SIZE = method.SizeFactor(0.18, 0.06)
_SPECTRAL = method.Form(
    ("b0", "b_size", "b_size_squared", "b_ln_x_over_y", "b_ln_x", "b_strength"),
    _spectral, 0, size_factor=_OF_SIZE,
    terms=("1", r"\ln p", r"\ln^2 p", r"\ln(x/y)", r"\ln x", "k'"),
    where=r"k' = \ln(1 + k_r/0.3)",
)  # fmt: skip

METHOD = method.Method(
    name="logistic",
    block=method.TOPPLING_BLOCK,
    link=method.LOGIT,
    forms={
        "pgv": _form(_OF_SIZE),
        "pga_tm": _form(_OF_SIZE),
        "pgd_tm": _form(None),
        "xp": _form(method.SizeFactor(0.30)),
        "sa10": _SPECTRAL,
    },
    meaning=method.OF_OUTCOME,
    fit="outcomes",
    exponent="b_ln_p",
)
