"""A toppling block by classical Runge-Kutta, for many k_r at once: shares nothing with the solver.

Good to some 1e-7 of k_r: what it says differently is asked again of the reference of 32 digits.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

PARTS = 4
"""Least steps per sample."""

PH = 0.02
"""Greatest p·h of a step."""


@numba.njit(cache=True)
def _acceleration(theta_c: float, theta: float, k_h: float, w: float) -> float:
    phi = theta_c - theta
    return math.cos(phi) * k_h - math.sin(phi) * w


@numba.njit(cache=True)
def _step(
    theta_c: float, theta: float, rate: float, ph: float, k0: float, k1: float, w0: float, w1: float
) -> tuple[float, float]:
    km, wm = 0.5 * (k0 + k1), 0.5 * (w0 + w1)
    a1 = _acceleration(theta_c, theta, k0, w0)
    a2 = _acceleration(theta_c, theta + 0.5 * ph * rate, km, wm)
    a3 = _acceleration(theta_c, theta + 0.5 * ph * (rate + 0.5 * ph * a1), km, wm)
    a4 = _acceleration(theta_c, theta + ph * (rate + 0.5 * ph * a2), k1, w1)
    return (
        theta + ph * rate + ph * ph * (a1 + a2 + a3) / 6.0,
        rate + ph * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0,
    )


@numba.njit(cache=True)
def _topples(time_s: FloatArray, k_h: FloatArray, w: FloatArray, p: float, kr: float) -> bool:
    theta_c = math.atan(kr)
    theta = rate = 0.0
    moving = False
    for i in range(time_s.size - 1):
        span = p * (time_s[i + 1] - time_s[i])
        if span <= 0.0:
            continue
        if not moving and max(k_h[i] - kr * w[i], k_h[i + 1] - kr * w[i + 1]) <= 0.0:
            continue
        number = max(PARTS, math.ceil(span / PH))
        for j in range(number):
            at, end = j / number, (j + 1) / number
            # an impact or a start divides a step; a few of them at most
            for _ in range(8):
                part = end - at
                if part <= 1e-14:
                    break
                k0, w0 = k_h[i] + at * (k_h[i + 1] - k_h[i]), w[i] + at * (w[i + 1] - w[i])
                k1, w1 = k_h[i] + end * (k_h[i + 1] - k_h[i]), w[i] + end * (w[i + 1] - w[i])
                g0, g1 = k0 - kr * w0, k1 - kr * w1
                if not moving:
                    if g0 <= 0.0 and g1 <= 0.0:
                        break
                    if g0 <= 0.0:  # it lifts off where q rises through k_r
                        at += part * (-g0 / (g1 - g0))
                        theta = rate = 0.0
                        moving = True
                        continue
                    moving = True
                theta1, rate1 = _step(theta_c, theta, rate, span * part, k0, k1, w0, w1)
                if theta1 >= 0.0:
                    theta, rate, at = theta1, rate1, end
                    break
                # the impact, by bisection of the length of the step
                low, high = 0.0, part
                for _ in range(48):
                    mid = 0.5 * (low + high)
                    km = k_h[i] + (at + mid) * (k_h[i + 1] - k_h[i])
                    wm = w[i] + (at + mid) * (w[i + 1] - w[i])
                    if _step(theta_c, theta, rate, span * mid, k0, km, w0, wm)[0] >= 0.0:
                        low = mid
                    else:
                        high = mid
                at += high
                theta = rate = 0.0
                moving = False
        if theta_c - theta < -0.5 * math.pi:
            return True
    # the ground is at rest: by energy
    return moving and rate > 2.0 * math.sin(0.5 * (theta_c - theta))


@numba.njit(cache=True)
def topple(
    time_s: FloatArray, k_h: FloatArray, w: FloatArray, p: float, kr: FloatArray
) -> NDArray[np.bool_]:
    """Return whether each block topples.

    Args:
        time_s: node times [s], shape (n,).
        k_h: driving acceleration there [g].
        w: 1 + k_v there.
        p: frequency parameter [1/s].
        kr: rocking acceleration coefficients, shape (m,).
    """
    answers = np.empty(kr.size, dtype=np.bool_)
    for j in range(kr.size):
        answers[j] = _topples(time_s, k_h, w, p, kr[j])
    return answers
