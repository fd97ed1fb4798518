"""What happens inside one step: peaks, dips below zero, the impact."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.taylor import bracketed_root, rotation, value

FloatArray = NDArray[np.float64]


@kernel
def examine_step(
    theta: float, u: FloatArray, order: int, theta_end: float, u_end: float, v_end: float
) -> tuple[float, float, float, float]:
    """Find what happens inside one step.

    The step is cut at the turning points of theta into monotone stretches, so a peak and a
    impact in one step, or a dip below zero between two positive ends, are all seen.

    Returns:
        tau of the impact or -1; peak, -1 where theta has no maximum before the impact; tau
        of the peak; lowest minimum above zero, infinite where there is none.
    """
    v_start = u[1]
    # a start from rest has U = 0: its direction is that of the acceleration
    u_start = u[0] if u[0] != 0.0 else v_start
    first = -1.0
    second = -1.0
    if (v_start > 0.0 and v_end < 0.0) or (v_start < 0.0 and v_end > 0.0):
        extremum = bracketed_root(2, theta, u, order, 0.0, 1.0)
        u_mid = value(u, order, extremum)
        if (u_start > 0.0 and u_mid <= 0.0) or (u_start < 0.0 and u_mid >= 0.0):
            first = bracketed_root(1, theta, u, order, 0.0, extremum)
        if (u_mid > 0.0 and u_end <= 0.0) or (u_mid < 0.0 and u_end >= 0.0):
            second = bracketed_root(1, theta, u, order, extremum, 1.0)
    elif (u_start > 0.0 and u_end <= 0.0) or (u_start < 0.0 and u_end >= 0.0):
        first = bracketed_root(1, theta, u, order, 0.0, 1.0)

    peak = -1.0
    peak_tau = -1.0
    lowest = math.inf
    rising = u_start > 0.0
    left = 0.0
    theta_left = theta
    for stretch in range(3):
        right = 1.0
        if stretch == 0:
            if first < 0.0:
                continue
            right = first
        elif stretch == 1:
            if second < 0.0:
                continue
            right = second
        theta_right = theta_end if stretch == 2 else rotation(theta, u, order, right)
        if rising:
            if stretch < 2 and theta_right > peak:
                peak = theta_right
                peak_tau = right
        elif theta_right <= 0.0:
            if theta_left <= 0.0:
                return left, peak, peak_tau, lowest
            return bracketed_root(0, theta, u, order, left, right), peak, peak_tau, lowest
        elif stretch < 2:
            lowest = min(lowest, theta_right)
        rising = not rising
        left = right
        theta_left = theta_right
    return -1.0, peak, peak_tau, lowest
