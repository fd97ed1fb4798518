"""One Taylor step of the rocking block, and the polynomials it leaves behind.

On tau in [0, 1] with h the interval, P = p²h², U = h theta', phi = theta_c - theta,
s = sin(phi), c = cos(phi) (linear model: s = phi, c = 1), a(tau) = a0 + da tau the driving
acceleration and w(tau) = w0 + dw tau the effective gravity, both in g::

    U[k+1] = P/(k+1) (a0 c[k] + da c[k-1] - w0 s[k] - dw s[k-1])
    s[k+1] = -sum_j U[j] c[k-j]/(k+1),    c[k+1] = sum_j U[j] s[k-j]/(k+1)
    theta(tau) = theta + sum_k U[k] tau^(k+1)/(k+1)

The record is linear between samples, so no step crosses a kink. s and c are carried from
step to step: the loop calls no sine or cosine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.compiled import kernel

FloatArray = NDArray[np.float64]

ORDER = 8
"""Degree of the rotation-rate polynomial; the method's order of convergence."""

PH_MAX = 0.1
"""Greatest p·h of one step; longer intervals are split evenly. At order 8 the truncation
of a step is then below the rounding of its result."""

MACHINE_EPSILON = 2.220446049250313e-16


@kernel
def fill_coefficients(
    u: FloatArray,
    s: FloatArray,
    c: FloatArray,
    order: int,
    big_p: float,
    a0: float,
    da: float,
    w0: float,
    dw: float,
    linear: bool,
) -> None:
    """Fill u[1..order], s[1..order], c[1..order] from u[0], s[0], c[0]."""
    for k in range(order):
        drive = a0 * c[k] - w0 * s[k]
        if k > 0:
            drive += da * c[k - 1] - dw * s[k - 1]
        u[k + 1] = big_p * drive / (k + 1)
        if linear:
            s[k + 1] = -u[k] / (k + 1)
            c[k + 1] = 0.0
        else:
            sum_s = 0.0
            sum_c = 0.0
            for j in range(k + 1):
                sum_s += u[j] * c[k - j]
                sum_c += u[j] * s[k - j]
            s[k + 1] = -sum_s / (k + 1)
            c[k + 1] = sum_c / (k + 1)


@kernel
def value(x: FloatArray, order: int, tau: float) -> float:
    """Polynomial sum_k x[k] tau^k, k = 0..order."""
    total = x[order]
    for k in range(order - 1, -1, -1):
        total = total * tau + x[k]
    return total


@kernel
def slope(x: FloatArray, order: int, tau: float) -> float:
    """Derivative of :func:`value` with respect to tau."""
    total = order * x[order]
    for k in range(order - 1, 0, -1):
        total = total * tau + k * x[k]
    return total


@kernel
def curvature(x: FloatArray, order: int, tau: float) -> float:
    """Second derivative of :func:`value` with respect to tau."""
    total = order * (order - 1) * x[order]
    for k in range(order - 1, 1, -1):
        total = total * tau + k * (k - 1) * x[k]
    return total


@kernel
def rotation(theta: float, u: FloatArray, order: int, tau: float) -> float:
    """Rotation theta(tau) on the step that starts at `theta`."""
    total = u[order] / (order + 1)
    for k in range(order - 1, -1, -1):
        total = total * tau + u[k] / (k + 1)
    return theta + tau * total


@kernel
def bracketed_root(
    kind: int, theta: float, u: FloatArray, order: int, low: float, high: float
) -> float:
    """Root in [low, high] by Newton's method kept inside the bracket.

    Args:
        kind: 0 for theta(tau) = 0, 1 for U(tau) = 0, 2 for U'(tau) = 0.
        theta: rotation at the start of the step.
        u: coefficients of U.
        order: their degree.
        low: end of the bracket where the function has one sign.
        high: end where it has the other (or is zero).

    Bisection takes over whenever Newton leaves the bracket or gains too little, so the
    bracket always shrinks to rounding and no iterate is ever mistaken for a root.
    """
    at_low = _at(kind, theta, u, order, low)
    tau = 0.5 * (low + high)
    for _ in range(200):
        f = _at(kind, theta, u, order, tau)
        if f == 0.0:
            return tau
        if (f > 0.0) == (at_low > 0.0):
            low = tau
        else:
            high = tau
        if kind == 0:
            d = value(u, order, tau)
        elif kind == 1:
            d = slope(u, order, tau)
        else:
            d = curvature(u, order, tau)
        following = tau - f / d if d != 0.0 else low - 1.0
        if not (low < following < high):
            following = 0.5 * (low + high)
        if abs(following - tau) <= MACHINE_EPSILON * tau or high - low <= MACHINE_EPSILON * high:
            return following
        tau = following
    return 0.5 * (low + high)


@kernel
def _at(kind: int, theta: float, u: FloatArray, order: int, tau: float) -> float:
    if kind == 0:
        return rotation(theta, u, order, tau)
    if kind == 1:
        return value(u, order, tau)
    return slope(u, order, tau)
