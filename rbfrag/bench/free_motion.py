"""What all compared methods share: the answer, and the closed form after the record."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

STABLE, TOPPLED = "stable", "toppled"


class Answer(NamedTuple):
    """Outcome and peak rotation [rad]; the peak is NaN unless the block stays."""

    outcome: str
    peak_rad: float


def free_motion(
    theta: float | np.longdouble,
    rate: float | np.longdouble,
    p: float | np.longdouble,
    theta_c: float | np.longdouble,
    peak: float | np.longdouble,
) -> Answer:
    """Decide by energy what becomes of a moving block once the ground is at rest.

    Args:
        theta: rotation at the end of the record [rad].
        rate: rotation rate [rad/s].
        p: frequency parameter [1/s].
        theta_c: critical angle [rad].
        peak: greatest rotation so far [rad].
    """
    x, v = theta_c - theta, rate / p
    half = 2 * np.sin(np.abs(x) / 2)
    topples = v > half if x > 0 else v > -half
    if topples:
        return Answer(TOPPLED, math.nan)
    if v > 0:
        top = theta_c - 2 * np.arcsin(np.sqrt((half - v) * (half + v)) / 2)
        peak = max(peak, top)
    return Answer(STABLE, float(peak))
