"""What a model expects of each motion: the block that topples with a given probability."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.answers import PredictionArray
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import answer_given
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

_LOWEST, _HIGHEST = 1e-4, 50.0
"""Range of y/x in which a strength is looked for."""

_HALVINGS = 50


def predicted_strengths(
    model: FragilityModel, table: CombinationTable, xp_m_s: FloatArray, probability: float
) -> FloatArray:
    """Return the toppling velocity y [m/s] at which each motion topples a block so likely.

    Args:
        model: the model.
        table: motions and block sizes, n rows.
        xp_m_s: toppling spectrum of each row [m/s], shape (n,).
        probability: between 0 and 1.

    Returns:
        Shape (n,); NaN where what the model reads is not known.
    """
    columns = {name: getattr(table, name) for name in ("p2", "pgv_m_s", "pga_g", "tm_s", "pgd_m")}
    columns["xp_m_s"] = xp_m_s
    given = {name: columns[name] for name in ("p2", *model.term.inputs)}
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.asarray(model.term.intensity_m_s(given), dtype=np.float64)
        low, high = np.log(_LOWEST * x), np.log(_HIGHEST * x)
    known = np.isfinite(low)
    for name in model.term.inputs:
        known &= np.isfinite(given[name])
    given = {name: column[known] for name, column in given.items()}
    low, high = low[known], high[known]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        kr = np.exp(middle) * np.sqrt(given["p2"]) / STANDARD_GRAVITY_M_S2
        answer = answer_given(model, {**given, "kr": kr}, 0.95)
        assert isinstance(answer, PredictionArray)
        likely = answer.probability >= probability
        low, high = np.where(likely, middle, low), np.where(likely, high, middle)
    result = np.full(x.shape, np.nan)
    result[known] = np.exp(0.5 * (low + high))
    return result


def running_medians(
    x: FloatArray, y: FloatArray, *, bins: int = 24
) -> tuple[FloatArray, FloatArray]:
    """Return medians of x and of y in bins of equal count along x, for a line."""
    order = np.argsort(x, kind="stable")
    parts = [part for part in np.array_split(order, bins) if part.size]
    return (
        np.array([np.median(x[part]) for part in parts]),
        np.array([np.median(y[part]) for part in parts]),
    )
