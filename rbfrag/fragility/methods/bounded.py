"""The method ``bounded``: outcomes, with P falling to 0 at the bounds of mechanics.

    P = exp(-exp(-eta))
    eta = h(p) [b0 - b1 ln r + b2 ln(1 - r) + b3 ln(1 - v) + b4 ln z + b5 ln z_T]

r = k_r/PGA, v = y/2PGV, z = p PGV/(PGA g), z_T = p T_m/2π; with PGV alone
eta = h(p) [b0 - b1 ln v + b2 ln(1 - v) + b3 l + b4 l²] with l = ln p.
h(p) = exp(.18 l - .06 l²). (5) of docs/theory/fragility.md.

Of measures that the hazard is given in, with V_T = SA g T/2π, Q_T = ln(V_T/(PGA g)) and k' of
:func:`rbfrag.fragility.method.log_strength`, h(p) = p^A:

    pgv_kr               A = .15   b0 + b1 l + b2 l² - b3 ln v + b4 ln(1 - v) + b5 k'
    pga                  A = .22   b0 + b1 l + b2 l² - b3 ln r
    pga_sa10             A = .29   the same + b4 Q_1 + b5 Q_1 l
    pga_sa03_sa10_sa30   A = .27   the same + b4 Q_.3 + b5 Q_.3 l + ... of Q_1 and Q_3

ln(1 - r) is left out where PGV is unknown: its coefficient would be negative, and P would rise
near r = 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits, method
from rbfrag.fragility.measures import SPECTRAL
from rbfrag.fragility.method import Eta, Form, Method, Numbers, SizeFactor, linear, log_strength
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


def _pgv(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = v["y_m_s"] / (2.0 * v["intensity_m_s"])
    l = ns.log(v["p"])  # noqa: E741  as in the formula
    return linear(b, 1.0, -ns.log(ratio), ns.log(1.0 - ratio), l, l * l)


def _pgv_pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    pga, x = v["pga_g"], v["intensity_m_s"]
    r = v["kr"] / pga
    below_two_pgv = ns.log(1.0 - v["y_m_s"] / (2.0 * x))
    log_z = ns.log(v["p"] * x / (pga * STANDARD_GRAVITY_M_S2))
    return linear(b, 1.0, -ns.log(r), ns.log(1.0 - r), below_two_pgv, log_z)


def _pgv_pga_tm(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    return linear(b, *_pgv_pga(b, v, ns).slopes, ns.log(v["p"] * v["tm_s"] / (2.0 * math.pi)))


def _pgv_kr(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = v["y_m_s"] / (2.0 * v["intensity_m_s"])
    l = ns.log(v["p"])  # noqa: E741  as in the formula
    logs = (-ns.log(ratio), ns.log(1.0 - ratio), log_strength(v, ns))
    return linear(b, 1.0, l, l * l, *logs)


def _pga(b: Sequence[float], v: Mapping[str, Any], ns: Numbers, *measures: str) -> Eta:
    l = ns.log(v["p"])  # noqa: E741  as in the formula
    pga = v["pga_g"]
    slopes = [1.0, l, l * l, ns.log(pga / v["kr"])]
    for measure in measures:
        # V_T/(PGA g), in which g drops out
        q = ns.log(v[measure] / pga * (_PERIOD_S[measure] / (2.0 * math.pi)))
        slopes += [q, q * l]
    return linear(b, *slopes)


def _with_spectrum(*periods: str) -> Callable[[Sequence[float], Mapping[str, Any], Numbers], Eta]:
    return lambda b, v, ns: _pga(b, v, ns, *(f"sa{period}_g" for period in periods))


def _of_pga(a: float, *periods: str) -> Form:
    names = [f"b_ln_q{period}{by}" for period in periods for by in ("", "_ln_p")]
    terms = [
        rf"\ln Q_{{{_PERIOD_S[f'sa{period}_g']:g}}}{by}"
        for period in periods
        for by in ("", r"\,\ln p")
    ]
    return Form(
        ("b0", "b_ln_p", "b_ln_p_squared", "b_ln_r", *names), _with_spectrum(*periods), 0,
        (method.NOT_LIFTED,), size_factor=SizeFactor(a), wide=True,
        terms=("1", r"\ln p", r"\ln^2 p", r"\ln(1/r)", *terms),
        where=_OF_PGA + (r",\ Q_T = \mathrm{SA}(T)\,T/(2\pi\,\mathrm{PGA})" if periods else ""),
    )  # fmt: skip


_OF_PGA, _OF_VELOCITY = r"r = k_r/\mathrm{PGA}", "v = y/2x"
_PERIOD_S = {measure: period_s for period_s, measure in SPECTRAL.items()}
_BOUNDS = (method.NOT_LIFTED, method.ABOVE_TWICE_PGV)
_OF_SIZE = SizeFactor(0.18, 0.06)
_TERMS = ("1", r"\ln(1/r)", r"\ln(1 - r)", r"\ln(1 - v)", r"\ln z")
_WHERE = rf"{_OF_PGA},\ {_OF_VELOCITY},\ z = p\,x/(\mathrm{{PGA}}\,g)"
_NAMES = ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_share", "b_ln_z")

METHOD = Method(
    name="bounded",
    block=method.TOPPLING_BLOCK,
    link=method.LOGLOG,
    forms={
        "pgv": Form(
            ("b0", "b_ln_share", "b_ln_1_minus_share", "b_ln_p", "b_ln_p_squared"),
            _pgv, 0, (method.ABOVE_TWICE_PGV,), size_factor=_OF_SIZE,
            terms=("1", r"\ln(1/v)", r"\ln(1 - v)", r"\ln p", r"\ln^2 p"), where=_OF_VELOCITY,
        ),
        "pgv_kr": Form(
            ("b0", "b_ln_p", "b_ln_p_squared", "b_ln_share", "b_ln_1_minus_share", "b_strength"),
            _pgv_kr, 0, (method.ABOVE_TWICE_PGV,), size_factor=SizeFactor(0.15), wide=True,
            terms=("1", r"\ln p", r"\ln^2 p", r"\ln(1/v)", r"\ln(1 - v)", "k'"),
            where=_OF_VELOCITY + r",\ k' = \ln(1 + k_r/0.3)",
        ),
        "pga": _of_pga(0.22),
        "pga_sa10": _of_pga(0.29, "10"),
        "pga_sa03_sa10_sa30": _of_pga(0.27, "03", "10", "30"),
        "pgv_pga": Form(
            _NAMES, _pgv_pga, 0, _BOUNDS, size_factor=_OF_SIZE, terms=_TERMS, where=_WHERE
        ),
        "pgv_pga_tm": Form(
            (*_NAMES, "b_ln_zt"), _pgv_pga_tm, 0, _BOUNDS, size_factor=_OF_SIZE,
            terms=(*_TERMS, r"\ln z_T"), where=_WHERE + r",\ z_T = p\,T_m/2\pi",
        ),
    },
    reads="outcomes",
    meaning=method.OF_OUTCOME,
    fit=fits.outcomes,
)  # fmt: skip
