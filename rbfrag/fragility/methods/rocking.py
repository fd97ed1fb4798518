"""The method ``rocking``: outcomes of free-standing blocks, probit, with their restitution.

    P = Φ(eta),   eta = h [sum of b times what the table names]

    pga   1, -ln r, ln(1 - r), l, l², s, ln[p A/(PGA g)]   h = exp(s)
    sa    1, l, l², s, ln(A/y)                             h = exp(s)
    pgv   1, ln(PGV/y), l, l², s                           h = p^.25

r = k_r/PGA, l = ln p, s = sqrt(1 - e), A of
:func:`rbfrag.fragility.spectral_velocity.ln_rocking_velocity`. P = 0 from r = 1 on where PGA is
known. e is the speed after an impact over that before it: Housner's 1 - 1.5 sin² α (1963) of the
rectangle with tan α = k_r, unless it is given. PGV says no more than A does: where it is given,
A is regressed on it. How well the models do is in docs/theory/rocking.md.
"""

from __future__ import annotations

from typing import Any

from rbfrag.fragility import method
from rbfrag.fragility.method import (
    ArrayNamespace,
    LinearPredictor,
    Parameters,
    Values,
    linear,
    ln_size,
)
from rbfrag.fragility.spectral_velocity import ln_rocking_velocity
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
    smallest_p2=0.3,
    completed_from="all",
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


class RestitutionFactor:
    """Factor of eta h = exp(s): the more speed an impact takes, the surer is the outcome."""

    formula = r"\exp(s)"

    def of(self, values: Values, ns: ArrayNamespace) -> Any:
        """Return h from the speed loss among the values."""
        return ns.exp(values["speed_loss"])


def _pga(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    l, pga = ln_size(v, ns), v["pga_g"]  # noqa: E741  as in the formula
    r = v["kr"] / pga
    log_a = ns.log(v["p"] * v["velocity_m_s"] / (pga * STANDARD_GRAVITY_M_S2))
    return linear(b, 1.0, -ns.log(r), ns.log(1.0 - r), l, l * l, v["speed_loss"], log_a)


def _sa(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    l = ln_size(v, ns)  # noqa: E741  as in the formula
    return linear(b, 1.0, l, l * l, v["speed_loss"], ns.log(v["velocity_m_s"] / v["y_m_s"]))


def _pgv(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    l = ln_size(v, ns)  # noqa: E741  as in the formula
    return linear(b, 1.0, ns.log(v["pgv_m_s"] / v["y_m_s"]), l, l * l, v["speed_loss"])


_SIZE = (r"\ln p", r"\ln^2 p", "s")
_LOSS = r"s = \sqrt{1 - e}"

METHOD = method.Method(
    name="rocking",
    block=BLOCK,
    link=method.NORMAL,
    forms={
        "pga": method.Form(
            ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_p", "b_ln_p_squared", "b_s", "b_ln_a"), _pga,
            (BLOCK.at_rest,), size_factor=RestitutionFactor(),
            terms=("1", r"\ln(1/r)", r"\ln(1 - r)", *_SIZE, r"\ln[p A/(\mathrm{PGA}\,g)]"),
            where=rf"r = k_r/\mathrm{{PGA}},\ {_LOSS}",
            velocity=method.SpectralPredictor(
                ln_rocking_velocity, "pga_g", ("pgv_m_s", "tm_s", "magnitude")
            ),
            positive=("b_ln_r", "b_ln_1_minus_r"),
            advice="PGA alone predicts overturning poorly: the log loss of held-out earthquakes "
            "is 0.22, with SA(1) 0.13, with PGV 0.12, with SA(0.3), SA(1) and SA(3) 0.10",
        ),
        "sa": method.Form(
            ("b0", "b_ln_p", "b_ln_p_squared", "b_s", "b_ln_a_over_y"), _sa,
            size_factor=RestitutionFactor(),
            terms=("1", *_SIZE, r"\ln(A/y)"), where=_LOSS,
            velocity=method.SpectralPredictor(ln_rocking_velocity), positive=("b_ln_a_over_y",),
            advice="SA at one period predicts overturning poorly: the log loss of held-out "
            "earthquakes is 0.17 with SA(1), with PGA 0.13",
        ),
        "pgv": method.Form(
            ("b0", "b_ln_pgv_over_y", "b_ln_p", "b_ln_p_squared", "b_s"), _pgv,
            size_factor=method.SizeFactor(0.25),
            terms=("1", r"\ln(\mathrm{PGV}/y)", *_SIZE), where=_LOSS,
            positive=("b_ln_pgv_over_y",),
            hint="PGA would help: the log loss of held-out earthquakes is 0.15 with PGV alone, "
            "0.12 with PGA, 0.09 with a response spectrum as well",
        ),
    },
    meaning="probability that the free-standing block overturns",
    fit="outcomes",
    failure=lambda _, __: "overturning",
)  # fmt: skip
