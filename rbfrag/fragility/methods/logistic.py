"""The method ``logistic``: outcomes, logistic in ln(x/y).

    eta = h(p) [b0 + b1 ln(x/y) (+ b2 ln p)],   P = 1/(1 + exp(-eta))

h(p) = exp(.18 l - .06 l²), l = ln p; with X(p) h(p) = p^.30, with PGD 1. (4) of
docs/theory/fragility.md. With a spectral acceleration alone, V_T = SA g T/2π and k' of
:func:`rbfrag.fragility.method.log_strength`,

    eta = p^A [b0 + b1 l + b2 l² + b3 ln(V_T/y) + b4 ln V_T + b5 k']

On the reference h lowers the held-out log loss from .1794, .1925 and .1470 to .1758, .1867 and
.1356 (PGV, PGA·g·Tm/2π, X(p)); with 2π·PGD/Tm it would raise it from .4024 to .4060.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits, method
from rbfrag.fragility.method import Eta, Form, Method, Numbers, SizeFactor, linear, log_strength


def _eta(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return linear(b, 1.0, ratio) if len(b) == 2 else linear(b, 1.0, ratio, ns.log(v["p"]))


def _spectral(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    x, l = v["intensity_m_s"], ns.log(v["p"])  # noqa: E741  as in the formula
    return linear(b, 1.0, l, l * l, ns.log(x / v["y_m_s"]), ns.log(x), log_strength(v, ns))


_SPECTRAL = ("b0", "b_size", "b_size_squared", "b_ln_x_over_y", "b_ln_x", "b_strength")


def _of_period(a: float) -> Form:
    return Form(
        _SPECTRAL, _spectral, 0, size_factor=SizeFactor(a), wide=True,
        terms=("1", r"\ln p", r"\ln^2 p", r"\ln(x/y)", r"\ln x", "k'"),
        where=r"k' = \ln(1 + k_r/0.3)",
    )  # fmt: skip


def _form(size_factor: SizeFactor | None) -> Form:
    return Form(
        ("b0", "b_ln_x_over_y", "b_ln_p"), _eta, 4, size_factor=size_factor,
        terms=("1", r"\ln(x/y)", r"\ln p"),
    )  # fmt: skip


_OF_SIZE = SizeFactor(0.18, 0.06)

METHOD = Method(
    name="logistic",
    block=method.TOPPLING_BLOCK,
    link=method.LOGIT,
    forms={
        "pgv": _form(_OF_SIZE),
        "pga_tm": _form(_OF_SIZE),
        "pgd_tm": _form(None),
        "xp": _form(SizeFactor(0.30)),
        "sa03": _of_period(0.16),
        "sa10": _of_period(0.13),
        "sa20": _of_period(-0.04),
        "sa30": _of_period(-0.08),
    },
    reads="outcomes",
    meaning=method.OF_OUTCOME,
    fit=fits.outcomes,
    exponent="b_ln_p",
)
