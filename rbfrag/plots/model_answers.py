"""What a model says of many blocks, as figures ask for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.answers import PredictionArray
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import predict

FloatArray = NDArray[np.float64]


def model_answers(
    model: FragilityModel,
    p2: float,
    kr: FloatArray | float,
    measures: Mapping[str, FloatArray | float],
    *,
    level: float = 0.95,
) -> PredictionArray:
    """Return the answers of one model for blocks of one size.

    Args:
        model: the model.
        p2: frequency parameter [1/s²].
        kr: rocking acceleration coefficients, a number or an array.
        measures: measures of the motion by name; at least one of them, or kr, an array.
        level: confidence level.
    """
    given: dict[str, Any] = dict(measures)
    shape = np.broadcast_shapes(np.shape(kr), *(np.shape(value) for value in given.values()))
    answer = predict(
        np.full(shape, p2), np.broadcast_to(kr, shape), model=model, level=level, **given
    )
    assert isinstance(answer, PredictionArray)
    return answer
