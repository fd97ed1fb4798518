"""Forward Euler at fractions of the record's interval, compiled like rbfrag's own kernel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.bench.cases import Case
from rbfrag.bench.free_motion import STABLE, TOPPLED, Answer, free_motion
from rbfrag.solver.integrator.compiled import kernel

FloatArray = NDArray[np.float64]


def euler(case: Case, parts: int) -> Answer:
    """Run one case with `parts` Euler steps per sample interval."""
    drive = case.drive
    p, theta_c = math.sqrt(case.p2), math.atan(case.kr)
    border = math.atan(min(float(drive.q.min()), 0.0))
    fell, theta, rate, peak = _march(
        drive.k_h, float(drive.interval_s[0]), case.kr, case.p2, theta_c, border, parts
    )
    if fell:
        return Answer(TOPPLED, math.nan)
    if theta <= 0.0 and rate <= 0.0:
        return Answer(STABLE, peak)
    return free_motion(theta, rate, p, theta_c, peak)


@kernel
def _march(
    k_h: FloatArray,
    dt: float,
    kr: float,
    p2: float,
    theta_c: float,
    border: float,
    parts: int,
) -> tuple[bool, float, float, float]:
    theta = 0.0
    rate = 0.0
    peak = 0.0
    h = dt / parts
    for i in range(k_h.size - 1):
        for j in range(parts):
            k = k_h[i] + (k_h[i + 1] - k_h[i]) * j / parts
            if theta <= 0.0 and rate <= 0.0 and k <= kr:
                continue
            x = theta_c - theta
            slope = p2 * (k * math.cos(x) - math.sin(x))
            theta += h * rate
            rate += h * slope
            if theta < 0.0 or (theta == 0.0 and rate <= 0.0):
                theta = 0.0
                rate = 0.0
            elif theta > peak:
                peak = theta
            if rate > 0.0 and theta_c - theta < border:
                return True, theta, rate, peak
    return False, theta, rate, peak
