"""Where a model gives one probability: lines over intensity, for figures."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.held_measures import HeldMeasures, held_measures
from rbfrag.plots.model_answers import model_answers

FloatArray = NDArray[np.float64]

_LOWEST, _HIGHEST = 1e-4, 50.0
"""Range of y/x in which a line is looked for."""

_HALVINGS = 50


def failure_line(
    model: FragilityModel, x_m_s: FloatArray, probability: float, held: HeldMeasures | None = None
) -> FloatArray:
    """Return the toppling velocity y [m/s] that fails with a given probability.

    Args:
        model: a model of a term that is one number, or of PGV with PGA.
        x_m_s: intensities [m/s], shape (n,), > 0.
        probability: between 0 and 1.
        held: what does not change along the line; None for the middle of the fitted ranges.

    Returns:
        y, shape (n,); NaN where even the weakest block is less likely to fail, which is where
        a model of no bound runs below zero.

    Raises:
        InputError: a model of another term.
    """
    held = held_measures(model) if held is None else held
    low, high = np.log(_LOWEST * x_m_s), np.log(_HIGHEST * x_m_s)
    none = toppling_probability(model, x_m_s, np.exp(low), held) < probability
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        likely = toppling_probability(model, x_m_s, np.exp(middle), held) >= probability
        low, high = np.where(likely, middle, low), np.where(likely, high, middle)
    line: FloatArray = np.where(none, np.nan, np.exp(0.5 * (low + high)))
    return line


def toppling_probability(
    model: FragilityModel, x_m_s: FloatArray, y_m_s: FloatArray, held: HeldMeasures
) -> FloatArray:
    """Return the probability of blocks y [m/s] at intensities x [m/s], arrays of one shape."""
    kr = y_m_s * math.sqrt(held.p2) / STANDARD_GRAVITY_M_S2
    return model_answers(model, held.p2, kr, held.measures(model, x_m_s)).probability
