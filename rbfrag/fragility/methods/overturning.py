"""The method ``overturning``: outcomes of free-standing blocks, logistic, with their restitution.

    P = 1/(1 + exp(-eta)), 0 from r = 1 on,   eta = h(p) [sum of b times what the forms name]

r = k_r/PGA, z = p PGV/(PGA g), l = ln p, V_T = SA g T/2π, u = ln(y/PGV) or ln(y/V_1),
w_T = ln(V_T/PGV), Q_T = ln(V_T/(PGA g)), k' of :func:`rbfrag.fragility.method.log_strength`,
s = sqrt(1 - e). e is the speed after an impact over that before it: Housner's 1 - 1.5 sin² α (1963)
of the rectangle with tan α = k_r, unless it is given. Of terms of second order in ln z P would rise
again towards weak shaking. How well the models do stands in docs/theory/rocking.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from rbfrag.fragility import method
from rbfrag.fragility.measures import spectral_velocity_m_s
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values, linear
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

LEAST_RESTITUTION = 1e-6
"""Stands for the restitution of stocky blocks, of whose speed an impact leaves nothing."""


def _restitution(values: dict[str, Any], ns: ArrayNamespace) -> None:
    """Complete the restitution: as given, or that of the rectangle times a factor."""
    if "restitution" not in values:
        square = values["kr"] * values["kr"]
        formula = 1.0 - 1.5 * square / (1.0 + square)
        factor = values.get("restitution_factor", 1.0)
        values["restitution"] = ns.maximum(factor * formula, LEAST_RESTITUTION)
    # also of a value that is rejected afterwards
    values["speed_loss"] = ns.sqrt(ns.maximum(1.0 - values["restitution"], 0.0))


BLOCK = method.BlockParameters(
    ("p2", "kr"),
    "rocking",
    "kr",
    "p2",
    method.NOT_LIFTED,
    options=("restitution",),
    stored={"restitution_factor": (1.0, 0.9)},
    judged_kr=1.0,
    fractions=("restitution",),
    adjust=_restitution,
    rejects=(
        method.MechanicalBound(
            lambda v: (v["restitution"] <= 0.0) | (v["restitution"] > 1.0),
            "restitution",
            "must be above 0 and up to 1 (a block that comes to rest at its first impact is not "
            "supported)",
        ),
    ),
    support="assumed free-standing: a symmetric rectangle on level ground that rocks about both "
    "edges, without vertical motion",
)
"""Free-standing blocks known by p² [1/s²], k_r = tan(critical angle) and, if given, restitution."""


def _log_odds(v: Values, ns: ArrayNamespace) -> Any:
    r = v["kr"] / v["pga_g"]
    return ns.log(r / (1.0 - r))


def _log_z(v: Values, ns: ArrayNamespace) -> Any:
    return ns.log(v["p"] * v["intensity_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2))


def _small_magnitude(v: Values, ns: ArrayNamespace) -> Any:
    """Return M - 6.5 below 6.5, otherwise 0."""
    return ns.minimum(v["magnitude"], _LARGE_MAGNITUDE) - _LARGE_MAGNITUDE


def _over_pgv(measure: str, period_s: float) -> Callable[[Values, ArrayNamespace], Any]:
    return lambda v, ns: ns.log(spectral_velocity_m_s(v[measure], period_s) / v["pgv_m_s"])


def _over_pga(measure: str, period_s: float) -> Callable[[Values, ArrayNamespace], Any]:
    # g drops out
    return lambda v, ns: ns.log(v[measure] / v["pga_g"] * (period_s / (2.0 * math.pi)))


_LARGE_MAGNITUDE = 6.5
_FEATURES: Mapping[str, tuple[str, Callable[[Values, ArrayNamespace], Any]]] = {
    "logit_r": (r"\ln\frac{r}{1 - r}", _log_odds),
    "ln_z": (r"\ln z", _log_z),
    "ln_y_over_x": (r"\ln(y/x)", lambda v, ns: ns.log(v["y_m_s"] / v["intensity_m_s"])),
    "s": ("s", lambda v, _: v["speed_loss"]),
    "ln_p": (r"\ln p", lambda v, ns: ns.log(v["p"])),
    "w10": ("w_1", _over_pgv("sa10_g", 1.0)),
    "w30": ("w_3", _over_pgv("sa30_g", 3.0)),
    "q10": ("Q_1", _over_pga("sa10_g", 1.0)),
    "q30": ("Q_3", _over_pga("sa30_g", 3.0)),
    "strength": ("k'", method.log_strength),
    "magnitude": ("M'", _small_magnitude),
}
"""What forms are sums of, by the names of their coefficients: as mathtext, and from values."""


def _form(
    features: str,
    *products: tuple[str, str],
    a: float = 0.0,
    b: float = 0.0,
    of_pga: bool = True,
    advice: str = "",
) -> method.Form:
    """Return the formula of a constant, features, and products of two features.

    Args:
        features: their names, with blanks between.
        a: A of the factor h of size.
        b: its B.
        of_pga: whether PGA is read, which a block's strength is bounded by.
        advice: as of :class:`~rbfrag.fragility.method.Form`.
    """
    names = features.split()
    parts = {name: _FEATURES[name] for name in names}

    def formula(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
        features = {name: of(v, ns) for name, (_, of) in parts.items()}
        return linear(b, 1.0, *features.values(), *[features[x] * features[y] for x, y in products])

    return method.Form(
        ("b0", *(f"b_{name}" for name in names), *(f"b_{x}_{y}" for x, y in products)),
        formula, 0, (BLOCK.at_rest,) if of_pga else (),
        size_factor=method.SizeFactor(a, b) if a else None,
        terms=(
            "1", *(text for text, _ in parts.values()),
            *(rf"{parts[x][0]}\,{parts[y][0]}" for x, y in products),
        ),
        advice=advice,
    )  # fmt: skip


_LOSS_AND_STRENGTH, _SQUARE = ("s", "logit_r"), ("ln_p", "ln_p")

METHOD = method.Method(
    name="overturning",
    block=BLOCK,
    link=method.LOGIT,
    forms={
        "pgv_pga_sa10_sa30": _form(
            "logit_r ln_z s ln_p w10 w30",
            _LOSS_AND_STRENGTH, ("w10", "ln_p"), ("w30", "ln_p"), a=0.15, b=0.08,
        ),
        "pgv_pga": _form("logit_r ln_z s", _LOSS_AND_STRENGTH),
        "pgv": _form("ln_y_over_x ln_p s", _SQUARE, a=0.25, of_pga=False),
        "sa10": _form("ln_y_over_x ln_p s strength", _SQUARE, a=0.30, of_pga=False),
        "pga_sa10": _form("logit_r ln_p s q10", _SQUARE, _LOSS_AND_STRENGTH, a=0.30),
        "pga_sa10_sa30": _form(
            "logit_r ln_p s q10 q30", _SQUARE, ("q10", "ln_p"), ("q30", "ln_p"), a=0.20
        ),
        "pga_m": _form(
            "logit_r ln_p s strength magnitude", _SQUARE, _LOSS_AND_STRENGTH, a=0.20,
            advice="PGA and magnitude alone say little of overturning: PGV, or SA(1.0) with PGA, "
            "would lower the log loss on earthquakes left out from 0.22 to 0.19 or 0.17",
        ),
    },
    meaning="probability that the free-standing block overturns",
    fit="outcomes",
    failure=lambda _, __: "overturning",
)  # fmt: skip
