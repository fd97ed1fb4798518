"""Scatter of critical values between earthquakes, between motions of one, and within a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class NestedScatter:
    """Standard deviations of ln y about a model's median.

    Args:
        total: of all residuals.
        between_events: of the part that an earthquake's points share.
        between_motions: of the part that a motion's points share, beyond the earthquake.
        within_motion: of the rest: polarity and block size.
    """

    total: float
    between_events: float
    between_motions: float
    within_motion: float


def nested_scatter(
    residual: FloatArray, event: NDArray[np.intp], motion: NDArray[np.int64]
) -> NestedScatter | None:
    """Split residuals by the analysis of variance of unbalanced nested classes.

    Mean squares are equated to their expectations (Searle, Casella and McCulloch 1992,
    section 3.6); a negative component is zero.

    Args:
        residual: ln y less its median, shape (n,).
        event: number of the earthquake, shape (n,).
        motion: number of the motion, each in one earthquake, shape (n,).

    Returns:
        None without two earthquakes, a second motion in one, and a second point in a motion.
    """
    n = residual.size
    motions, inverse = np.unique(motion, return_inverse=True)
    owner = np.zeros(motions.size, dtype=np.intp)
    owner[inverse] = event
    events, owner = np.unique(owner, return_inverse=True)
    per_motion = np.bincount(inverse).astype(np.float64)
    per_event = np.bincount(owner, per_motion)
    a, m = events.size, motions.size
    if a < 2 or m <= a or n <= m:
        return None
    sum_motion = np.bincount(inverse, residual)
    sum_event = np.bincount(owner, sum_motion)
    of_all = residual.sum() ** 2 / n
    of_events = (sum_event**2 / per_event).sum()
    of_motions = (sum_motion**2 / per_motion).sum()
    within = ((residual**2).sum() - of_motions) / (n - m)
    squares_by_event = np.bincount(owner, per_motion**2) / per_event
    k1 = (n - squares_by_event.sum()) / (m - a)
    k2 = (squares_by_event.sum() - (per_motion**2).sum() / n) / (a - 1)
    k3 = (n - (per_event**2).sum() / n) / (a - 1)
    of_motion = max(((of_motions - of_events) / (m - a) - within) / k1, 0.0)
    of_event = max(((of_events - of_all) / (a - 1) - within - k2 * of_motion) / k3, 0.0)
    return NestedScatter(
        total=float(residual.std(ddof=1)),
        between_events=math.sqrt(of_event),
        between_motions=math.sqrt(of_motion),
        within_motion=math.sqrt(max(within, 0.0)),
    )
