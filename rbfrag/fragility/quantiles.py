"""Quantiles that confidence intervals reach to. Standard library only."""

from __future__ import annotations

import math
from functools import lru_cache

from rbfrag.errors import InputError
from rbfrag.fragility.functions import normal_half_width

FEWEST_FREEDOMS = 2


@lru_cache(maxsize=256)
def student_half_width(level: float, degrees_of_freedom: int) -> float:
    """Return t such that a Student number lies within ±t with probability `level`.

    Clustered errors come from as many independent numbers as there are earthquakes: their
    intervals reach to Student's t with one degree of freedom less, not to the normal quantile.

    Args:
        level: confidence level, between 0 and 1.
        degrees_of_freedom: earthquakes less one; 0 for the normal quantile.

    Raises:
        InputError: the level is not between 0 and 1.
    """
    if isinstance(level, bool):
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        )
    start = normal_half_width(level)
    if degrees_of_freedom < FEWEST_FREEDOMS:
        return start
    t = start * (1.0 + (start * start + 1.0) / (4.0 * degrees_of_freedom))
    target = 0.5 * (1.0 - level)
    for _ in range(100):
        excess = _upper_tail(t, degrees_of_freedom)
        # Newton's method on the logarithm of the tail, which bends one way
        step = excess / _density(t, degrees_of_freedom) * math.log(excess / target)
        t += step
        if abs(step) <= 1e-14 * t:
            break
    return t


def _density(t: float, nu: int) -> float:
    scale = math.lgamma(0.5 * (nu + 1)) - math.lgamma(0.5 * nu) - 0.5 * math.log(nu * math.pi)
    return math.exp(scale - 0.5 * (nu + 1) * math.log1p(t * t / nu))


def _upper_tail(t: float, nu: int) -> float:
    # For whole nu the distribution function is a finite sum (Abramowitz & Stegun 26.7.3-4),
    # subtracted from a half; the tail of interest is far from rounding.
    theta = math.atan(t / math.sqrt(nu))
    cos2 = math.cos(theta) ** 2
    if nu % 2:
        term, total = math.cos(theta), 0.0
        for k in range(1, nu - 1, 2):
            total += term
            term *= cos2 * (k + 1) / (k + 2)
        inside = (theta + math.sin(theta) * total) * 2.0 / math.pi
    else:
        term, total = 1.0, 0.0
        for k in range(0, nu - 1, 2):
            total += term
            term *= cos2 * (k + 1) / (k + 2)
        inside = math.sin(theta) * total
    return max(0.5 * (1.0 - inside), 1e-300)
