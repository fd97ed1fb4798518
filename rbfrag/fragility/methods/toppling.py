"""The method ``toppling``: outcomes of backed blocks, probit.

    P = Φ(eta),   eta = h(p) [sum of b times what the table names]

    pgv_pga   1, -ln r, ln(1 - r), ln(1 - v), ln z, ln(X/PGV)    h = exp(.22 l - .02 l²)
    pga       1, l, -ln r, ln(1 - r), ln[p X/(PGA g)]            the same
    sa        1, l, l², ln(X/y)                                  the same
    pgv       1, -ln v, ln(1 - v), l², ln(1 + k_r/.3)            h = exp(.18 l - .06 l²)

r = k_r/PGA, v = y/2PGV, z = p PGV/(PGA g), l = ln p, X of
:func:`rbfrag.fragility.spectral_velocity.ln_toppling_velocity`. P = 0 from r = 1 on where PGA is
known, and from v = 1 on where PGV is. (5) of docs/theory/fragility.md.
"""

from __future__ import annotations

from rbfrag.fragility import method
from rbfrag.fragility.method import (
    ArrayNamespace,
    LinearPredictor,
    Parameters,
    Values,
    linear,
    ln_size,
)
from rbfrag.fragility.spectral_velocity import ln_toppling_velocity
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


def _pgv_pga(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    pga, pgv = v["pga_g"], v["pgv_m_s"]
    r = v["kr"] / pga
    below_two_pgv = ns.log(1.0 - v["y_m_s"] / (2.0 * pgv))
    log_z = ns.log(v["p"] * pgv / (pga * STANDARD_GRAVITY_M_S2))
    log_x = ns.log(v["velocity_m_s"] / pgv)
    return linear(b, 1.0, -ns.log(r), ns.log(1.0 - r), below_two_pgv, log_z, log_x)


def _pga(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    p, pga = v["p"], v["pga_g"]
    r = v["kr"] / pga
    log_x = ns.log(p * v["velocity_m_s"] / (pga * STANDARD_GRAVITY_M_S2))
    return linear(b, 1.0, ln_size(v, ns), -ns.log(r), ns.log(1.0 - r), log_x)


def _sa(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    l = ln_size(v, ns)  # noqa: E741  as in the formula
    return linear(b, 1.0, l, l * l, ns.log(v["velocity_m_s"] / v["y_m_s"]))


def _pgv(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    ratio = v["y_m_s"] / (2.0 * v["pgv_m_s"])
    l = ln_size(v, ns)  # noqa: E741  as in the formula
    strength = ns.log(1.0 + v["kr"] / _STRONG_KR)
    return linear(b, 1.0, -ns.log(ratio), ns.log(1.0 - ratio), l * l, strength)


_STRONG_KR = 0.3
"""A strong block needs a PGA above k_r, also where PGA is unknown."""

_SIZE = method.SizeFactor(0.22, 0.02)
_R, _V, _X = r"r = k_r/\mathrm{PGA}", r"v = y/(2\,\mathrm{PGV})", "X"

METHOD = method.Method(
    name="toppling",
    block=method.TOPPLING_BLOCK,
    link=method.NORMAL,
    forms={
        "pgv_pga": method.Form(
            ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_v", "b_ln_z", "b_ln_x"), _pgv_pga,
            (method.NOT_LIFTED, method.ABOVE_TWICE_PGV), size_factor=_SIZE,
            terms=("1", r"\ln(1/r)", r"\ln(1 - r)", r"\ln(1 - v)", r"\ln z",
                   r"\ln(X/\mathrm{PGV})"),
            where=rf"{_R},\ {_V},\ z = p\,\mathrm{{PGV}}/(\mathrm{{PGA}}\,g)",
            velocity=method.SpectralPredictor(ln_toppling_velocity, "pgv_m_s", ("tm_s",)),
            positive=("b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_v"),
        ),
        "pga": method.Form(
            ("b0", "b_ln_p", "b_ln_r", "b_ln_1_minus_r", "b_ln_x"), _pga,
            (method.NOT_LIFTED,), size_factor=_SIZE,
            terms=("1", r"\ln p", r"\ln(1/r)", r"\ln(1 - r)", r"\ln[p X/(\mathrm{PGA}\,g)]"),
            where=_R,
            velocity=method.SpectralPredictor(ln_toppling_velocity, "pga_g", ("tm_s",)),
            positive=("b_ln_r", "b_ln_1_minus_r"),
            advice="PGA alone predicts toppling poorly: the log loss of held-out earthquakes is "
            "0.17, with T_m 0.10, with SA(0.3), SA(1) and SA(3) 0.09, with PGV 0.09",
        ),
        "sa": method.Form(
            ("b0", "b_ln_p", "b_ln_p_squared", "b_ln_x_over_y"), _sa, size_factor=_SIZE,
            terms=("1", r"\ln p", r"\ln^2 p", r"\ln(X/y)"),
            velocity=method.SpectralPredictor(ln_toppling_velocity), positive=("b_ln_x_over_y",),
            advice="SA at one period predicts toppling poorly: the log loss of held-out "
            "earthquakes is 0.14 with SA(1), with PGA 0.10, with SA(0.3), SA(1) and SA(3) 0.11",
        ),
        "pgv": method.Form(
            ("b0", "b_ln_v", "b_ln_1_minus_v", "b_ln_p_squared", "b_strength"), _pgv,
            (method.ABOVE_TWICE_PGV,), size_factor=method.SizeFactor(0.18, 0.06),
            terms=("1", r"\ln(1/v)", r"\ln(1 - v)", r"\ln^2 p", r"\ln(1 + k_r/0.3)"), where=_V,
            positive=("b_ln_v", "b_ln_1_minus_v"),
            hint="PGA would help: the log loss of held-out earthquakes is 0.11 with PGV alone, "
            "0.09 with PGA, 0.07 with a response spectrum as well",
        ),
    },
    meaning=method.OF_OUTCOME,
    fit="outcomes",
)  # fmt: skip
