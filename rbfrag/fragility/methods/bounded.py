"""The method ``bounded``: outcomes, with P decreasing to 0 at the bounds of mechanics.

    P = exp(-exp(-eta)),   eta = h(p) [sum of b times what the table names]

    pgv_kr               1, -ln v, ln(1 - v), l², k'
    pgv_pga              1, -ln r, ln(1 - r), ln(1 - v), ln z
    pgv_pga_tm           the same, ln z_T
    pgv_pga_sa10_sa30    those of pgv_pga, w_1, w_3, w_3 l
    pga                  1, l, l², -ln r, k'
    pga_sa10             1, l, l², -ln r, Q_1, Q_1 l
    pga_sa03_sa10_sa30   1, l, l², -ln r, Q_.3, Q_1, Q_3, Q_3 l

r = k_r/PGA, v = y/2PGV, z = p PGV/(PGA g), z_T = p T_m/2π, l = ln p, V_T = SA g T/2π,
w_T = ln(V_T/PGV), Q_T = ln(V_T/(PGA g)), k' of :func:`rbfrag.fragility.method.log_strength`.
h(p) = exp(.18 l - .06 l²) with PGV and p^.30 without. (5) of docs/theory/fragility.md.

ln(1 - r) is left out where PGV is unknown: its coefficient would be negative, and P would rise
near r = 1.
"""

from __future__ import annotations

import math
from functools import partial

from rbfrag.fragility import method
from rbfrag.fragility.measures import spectral_velocity_m_s
from rbfrag.fragility.method import (
    ArrayNamespace,
    LinearPredictor,
    Parameters,
    Values,
    linear,
    log_strength,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.vocabulary.quantities import SPECTRAL


def _pgv_kr(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    ratio = v["y_m_s"] / (2.0 * v["intensity_m_s"])
    l = ns.log(v["p"])  # noqa: E741  as in the formula
    return linear(b, 1.0, -ns.log(ratio), ns.log(1.0 - ratio), l * l, log_strength(v, ns))


def _pgv_pga(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    pga, x = v["pga_g"], v["intensity_m_s"]
    r = v["kr"] / pga
    below_two_pgv = ns.log(1.0 - v["y_m_s"] / (2.0 * x))
    log_z = ns.log(v["p"] * x / (pga * STANDARD_GRAVITY_M_S2))
    return linear(b, 1.0, -ns.log(r), ns.log(1.0 - r), below_two_pgv, log_z)


def _pgv_pga_tm(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    return linear(b, *_pgv_pga(b, v, ns).slopes, ns.log(v["p"] * v["tm_s"] / (2.0 * math.pi)))


def _pgv_pga_sa(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    w1, w3 = (
        ns.log(spectral_velocity_m_s(v[measure], period_s) / v["intensity_m_s"])
        for measure, period_s in (("sa10_g", 1.0), ("sa30_g", 3.0))
    )
    return linear(b, *_pgv_pga(b, v, ns).slopes, w1, w3, w3 * ns.log(v["p"]))


def _pga(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    l = ns.log(v["p"])  # noqa: E741  as in the formula
    return linear(b, 1.0, l, l * l, ns.log(v["pga_g"] / v["kr"]), log_strength(v, ns))


def _pga_sa(
    periods: tuple[str, ...], b: Parameters, v: Values, ns: ArrayNamespace
) -> LinearPredictor:
    l, pga = ns.log(v["p"]), v["pga_g"]  # noqa: E741  as in the formula
    slopes = [1.0, l, l * l, ns.log(pga / v["kr"])]
    for period in periods:
        measure = f"sa{period}_g"
        # V_T/(PGA g), in which g drops out
        slopes.append(ns.log(v[measure] / pga * (_PERIOD_S[measure] / (2.0 * math.pi))))
    return linear(b, *slopes, slopes[-1] * l)


def _of_pga(*periods: str) -> method.Form:
    last = periods[-1]
    q = {period: rf"\ln Q_{{{_PERIOD_S[f'sa{period}_g']:g}}}" for period in periods}
    return method.Form(
        ("b0", "b_ln_p", "b_ln_p_squared", "b_ln_r",
         *(f"b_ln_q{period}" for period in periods), f"b_ln_q{last}_ln_p"),
        partial(_pga_sa, periods), 0, (method.NOT_LIFTED,), size_factor=_WITHOUT_PGV,
        terms=("1", r"\ln p", r"\ln^2 p", r"\ln(1/r)", *q.values(), rf"{q[last]}\,\ln p"),
        where=_OF_PGA + r",\ Q_T = \mathrm{SA}(T)\,T/(2\pi\,\mathrm{PGA})",
    )  # fmt: skip


_OF_PGA, _OF_VELOCITY = r"r = k_r/\mathrm{PGA}", "v = y/2x"
_OF_STRENGTH = r"k' = \ln(1 + k_r/0.3)"
_PERIOD_S = {measure: period_s for period_s, measure in SPECTRAL.items()}
_BOUNDS = (method.NOT_LIFTED, method.ABOVE_TWICE_PGV)
_WITH_PGV, _WITHOUT_PGV = method.SizeFactor(0.18, 0.06), method.SizeFactor(0.30)
_TERMS = ("1", r"\ln(1/r)", r"\ln(1 - r)", r"\ln(1 - v)", r"\ln z")
_WHERE = rf"{_OF_PGA},\ {_OF_VELOCITY},\ z = p\,x/(\mathrm{{PGA}}\,g)"
_NAMES = ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_share", "b_ln_z")

METHOD = method.Method(
    name="bounded",
    block=method.TOPPLING_BLOCK,
    link=method.LOGLOG,
    forms={
        "pgv_kr": method.Form(
            ("b0", "b_ln_share", "b_ln_1_minus_share", "b_ln_p_squared", "b_strength"),
            _pgv_kr, 0, (method.ABOVE_TWICE_PGV,), size_factor=_WITH_PGV,
            terms=("1", r"\ln(1/v)", r"\ln(1 - v)", r"\ln^2 p", "k'"),
            where=rf"{_OF_VELOCITY},\ {_OF_STRENGTH}",
        ),
        "pgv_pga": method.Form(
            _NAMES, _pgv_pga, 0, _BOUNDS, size_factor=_WITH_PGV, terms=_TERMS, where=_WHERE
        ),
        "pgv_pga_tm": method.Form(
            (*_NAMES, "b_ln_zt"), _pgv_pga_tm, 0, _BOUNDS, size_factor=_WITH_PGV,
            terms=(*_TERMS, r"\ln z_T"), where=_WHERE + r",\ z_T = p\,T_m/2\pi",
        ),
        "pgv_pga_sa10_sa30": method.Form(
            (*_NAMES, "b_w10", "b_w30", "b_w30_ln_p"), _pgv_pga_sa, 0, _BOUNDS,
            size_factor=_WITH_PGV, terms=(*_TERMS, "w_1", "w_3", r"w_3\,\ln p"),
            where=_WHERE + r",\ w_T = \ln(\mathrm{SA}(T)\,g\,T/2\pi x)",
        ),
        "pga": method.Form(
            ("b0", "b_ln_p", "b_ln_p_squared", "b_ln_r", "b_strength"),
            _pga, 0, (method.NOT_LIFTED,), size_factor=_WITHOUT_PGV,
            terms=("1", r"\ln p", r"\ln^2 p", r"\ln(1/r)", "k'"),
            where=rf"{_OF_PGA},\ {_OF_STRENGTH}",
            advice="PGA alone predicts toppling poorly: the log loss of held-out earthquakes is "
            "0.25, with PGV 0.13 and with SA(1.0) 0.19",
        ),
        "pga_sa10": _of_pga("10"),
        "pga_sa03_sa10_sa30": _of_pga("03", "10", "30"),
    },
    meaning=method.OF_OUTCOME,
    fit="outcomes",
)  # fmt: skip
