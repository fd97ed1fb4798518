"""What a method of fitting hands back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class MethodResult:
    """What a method of fitting hands back.

    Args:
        coefficients: value of each parameter by name, in the order of the formula.
        covariance: covariance of the parameters in that order.
        standard_errors: standard error of each parameter by name.
        scores: how well the model predicts, by name.
        details: everything else the report states, JSON-able.
        warnings: sentences for people.
        held_out: probability of each block of the grid by a fit without its earthquake,
            shape (n, 25).
    """

    coefficients: dict[str, float]
    covariance: tuple[tuple[float, ...], ...]
    standard_errors: dict[str, float]
    scores: dict[str, float]
    details: dict[str, object]
    warnings: tuple[str, ...]
    held_out: NDArray[np.float64]
