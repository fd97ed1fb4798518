"""The formula of the dissertation's models: a straight line with normal scatter.

    y* = c0 + c1 x + ε,   ε normal with variance  v(x) = v0 + v1 x (+ v2 x²)
    P  = P(y* >= y | x) = Φ(z),   z = (c0 + c1 x - y) / sqrt(v(x))

Equations (4.28)-(4.31) of the dissertation. No library is loaded here: `predict` needs it.
"""

from __future__ import annotations

from collections.abc import Sequence

from rbfrag.fragility.functions import Functions, N

MEANING = (
    "probability that the critical toppling velocity of the motion is at least the block's; "
    "safe islands below the critical value are not taken off"
)
"""What the probability of these models is a probability of."""


def mean_m_s(parameters: Sequence[float], x: N) -> N:
    """Return the mean critical toppling velocity c0 + c1 x [m/s] at intensity x [m/s]."""
    return x * parameters[1] + parameters[0]


def variance_m2_s2(parameters: Sequence[float], x: N) -> N:
    """Return the variance v(x) [m²/s²] of the critical toppling velocity at intensity x [m/s]."""
    result = x * parameters[-1]
    for coefficient in parameters[-2:2:-1]:
        result = (result + coefficient) * x
    return result + parameters[2]


def score(
    parameters: Sequence[float], x: N, y: N, functions: Functions[N]
) -> tuple[N, tuple[N, ...]]:
    """Return z, whose normal distribution function is P, and its slopes by each parameter.

    Args:
        parameters: c0 [m/s], c1, v0, v1[, v2].
        x: intensity [m/s], scalar or array.
        y: toppling velocity of the block [m/s], same shape.
        functions: functions for the kind of number given.
    """
    variance = variance_m2_s2(parameters, x)
    sigma = functions.sqrt(variance)
    z = (mean_m_s(parameters, x) - y) / sigma
    by_variance = z / (variance * -2.0)
    slopes = [1.0 / sigma, x / sigma]
    for _ in parameters[2:]:
        slopes.append(by_variance)
        by_variance = by_variance * x
    return z, tuple(slopes)


def negative_share(parameters: Sequence[float], x: N, functions: Functions[N]) -> N:
    """Return the probability that the model gives to critical velocities below zero at x."""
    sigma = functions.sqrt(variance_m2_s2(parameters, x))
    return functions.normal_cdf(-(mean_m_s(parameters, x) / sigma))


def rise(parameters: Sequence[float], x: N, y: N) -> N:
    """Return a number of the sign of dz/dx: negative where P would fall with growing intensity.

    It is v^(3/2) dz/dx = c1 v - (c0 + c1 x - y) v'/2, which is positive for every y >= c0.
    """
    variance_slope = x * 0.0
    for power in range(len(parameters) - 3, 0, -1):
        variance_slope = variance_slope * x + parameters[power + 2] * power
    drop = (mean_m_s(parameters, x) - y) * variance_slope * 0.5
    return variance_m2_s2(parameters, x) * parameters[1] - drop
