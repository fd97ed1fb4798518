"""Answers of a model of blocks that slide or slump, for many blocks under one motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from rbfrag.fragility.kind_formulas import Numbers
from rbfrag.fragility.kind_model import KindModel
from rbfrag.fragility.quantiles import student_half_width
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

STILL = "the block does not move: P is 0"
OUTSIDE = "outside the range that was fitted: the answer is an extrapolation"


class KindAnswers(NamedTuple):
    """Probabilities of many blocks, arrays of shape (n,).

    Args:
        probability: P.
        ci_low: lower ends of the confidence intervals.
        ci_high: upper ends.
        in_domain: True where block and motion lie in the ranges that were fitted.
        reason: why an answer is ruled or to be doubted, as text.
    """

    probability: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    in_domain: NDArray[np.bool_]
    reason: NDArray[np.object_]


def kind_answers(
    model: KindModel,
    block: dict[str, FloatArray],
    *,
    pgv_m_s: float,
    pga_g: float | None,
    level: float,
) -> KindAnswers:
    """Return the answers of one model for many blocks.

    Args:
        model: the model.
        block: ``ky`` and ``displacement_m``, or ``ks`` and ``ps2``, shape (n,).
        pgv_m_s: PGV of the motion [m/s].
        pga_g: its PGA [g], or None.
        level: confidence level of the intervals.
    """
    k = block["ky"] if "ky" in block else block["ks"]
    n = k.size
    moves = np.full(n, pgv_m_s > 0.0)
    if pga_g is not None:
        moves &= k < pga_g
    p, low, high = np.zeros(n), np.zeros(n), np.zeros(n)
    inside = np.ones(n, dtype=np.bool_)
    reason = np.where(moves, "", STILL).astype(object)
    if moves.any():
        values = {name: value[moves] for name, value in block.items()}
        values["pgv_m_s"] = np.full(int(moves.sum()), pgv_m_s)
        if pga_g is not None:
            values["pga_g"] = np.full(int(moves.sum()), pga_g)
        eta, _, slopes, _ = model.formula.eta(model.parameters, values, Numbers(np.log, np.exp))
        rows = np.array(np.broadcast_arrays(*slopes))
        variance = np.einsum("in,ij,jn->n", rows, np.array(model.row.covariance), rows)
        off = student_half_width(level, model.degrees_of_freedom) * np.sqrt(
            np.maximum(variance, 0.0)
        )
        p[moves], low[moves], high[moves] = ndtr(eta), ndtr(eta - off), ndtr(eta + off)
        inside[moves] = _inside(model, values)
        reason[moves] = np.where(inside[moves], "", OUTSIDE)
    return KindAnswers(p, low, high, inside, reason)


def _inside(model: KindModel, values: dict[str, FloatArray]) -> NDArray[np.bool_]:
    told = dict(values)
    k = values["ky"] if "ky" in values else values["ks"]
    if "pga_g" in values:
        told["k_over_pga"] = k / values["pga_g"]
        told["pgv_over_pga_s"] = values["pgv_m_s"] / (values["pga_g"] * STANDARD_GRAVITY_M_S2)
    if "ps2" in values:
        told["y_m_s"] = k * STANDARD_GRAVITY_M_S2 / np.sqrt(values["ps2"])
    inside = np.ones(k.size, dtype=np.bool_)
    for name, value in told.items():
        low, high = model.row.domain.get(name, (-np.inf, np.inf))
        inside &= (value >= low) & (value <= high)
    return inside
