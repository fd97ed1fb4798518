"""Where a model gives one probability: lines over intensity, for figures."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.formulas import EXPONENTS
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.model_answers import model_answers

FloatArray = NDArray[np.float64]

ONE_NUMBER_TERMS = ("pgv", "pga_tm", "pgd_tm")
"""Terms for which a probability depends on y and the term alone."""

# Neither matters to the probability; large blocks and short periods keep k_r below PGA.
_P2 = 0.1
_TM_S = 0.05

_LOWEST, _HIGHEST = 1e-4, 50.0
"""Range of y/x in which a line is looked for."""

_HALVINGS = 50


def failure_line(model: FragilityModel, x_m_s: FloatArray, probability: float) -> FloatArray:
    """Return the toppling velocity y [m/s] that fails with a given probability.

    Args:
        model: a model of a term that is one number.
        x_m_s: intensities [m/s], shape (n,), > 0.
        probability: between 0 and 1.

    Returns:
        y, shape (n,); NaN where even the weakest block is less likely to fail, which is where
        a model of no bound runs below zero.

    Raises:
        InputError: a model of another term.
    """
    low, high = np.log(_LOWEST * x_m_s), np.log(_HIGHEST * x_m_s)
    none = toppling_probability(model, x_m_s, np.exp(low)) < probability
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        likely = toppling_probability(model, x_m_s, np.exp(middle)) >= probability
        low, high = np.where(likely, middle, low), np.where(likely, high, middle)
    line: FloatArray = np.where(none, np.nan, np.exp(0.5 * (low + high)))
    return line


def toppling_probability(model: FragilityModel, x_m_s: FloatArray, y_m_s: FloatArray) -> FloatArray:
    """Return the probability of blocks y [m/s] at intensities x [m/s], arrays of one shape."""
    kr = y_m_s * math.sqrt(_P2) / STANDARD_GRAVITY_M_S2
    return model_answers(model, _P2, kr, _measures(model, x_m_s)).probability


def _measures(model: FragilityModel, x_m_s: FloatArray) -> Mapping[str, FloatArray]:
    name = model.term.name
    if name not in ONE_NUMBER_TERMS:
        raise InputError(
            f"model {model.name!r} reads {' and '.join(model.term.inputs)}: this figure draws "
            f"models of one number, {', '.join(ONE_NUMBER_TERMS)}"
        )
    if not EXPONENTS.isdisjoint(model.row.coefficients):
        raise InputError(
            f"model {model.name!r} has an estimated exponent M: its probability depends on the "
            "size of the block too; draw one fitted with M = 1"
        )
    tm = np.full(x_m_s.shape, _TM_S)
    if name == "pga_tm":
        return {"pga_g": x_m_s * (2.0 * math.pi) / (STANDARD_GRAVITY_M_S2 * tm), "tm_s": tm}
    if name == "pgd_tm":
        return {"pgd_m": x_m_s * tm / (2.0 * math.pi), "tm_s": tm}
    return {"pgv_m_s": x_m_s}
