"""Mean and variance of the critical toppling velocity along a straight line (4.28 to 4.31)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rbfrag.fragility.method import ArrayNamespace

NEGATIVE_LIMIT = 0.025
"""Probability of a negative critical velocity above which a straight line is doubted."""


def mean_m_s(b: Sequence[float], x: Any) -> Any:
    """Return the mean critical toppling velocity c0 + c1 x [m/s] at intensity x [m/s]."""
    return x * b[1] + b[0]


def variance_m2_s2(b: Sequence[float], x: Any) -> Any:
    """Return the variance v(x) [m²/s²] of the critical toppling velocity at intensity x [m/s]."""
    if len(b) > 4:
        return (x * b[4] + b[3]) * x + b[2]
    return x * b[3] + b[2]


def negative_probability(b: Sequence[float], x: Any, ns: ArrayNamespace) -> Any:
    """Return the model's probability of negative critical velocities at x."""
    return ns.ndtr(-(mean_m_s(b, x) / ns.sqrt(variance_m2_s2(b, x))))


def rise(b: Sequence[float], x: Any, y: Any) -> Any:
    """Return v^(3/2) deta/dx, negative where P would decrease with increasing intensity."""
    slope = b[3] + 2.0 * b[4] * x if len(b) > 4 else b[3]
    return variance_m2_s2(b, x) * b[1] - (mean_m_s(b, x) - y) * slope * 0.5
