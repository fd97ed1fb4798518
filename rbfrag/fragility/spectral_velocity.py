"""Block-relative spectral velocities: what toppling and rocking blocks respond to in a spectrum.

With V(T) = SA(T) g T/2π, p the frequency parameter of the block and l = ln p:

    toppling   X = [mean of (V φ)³]^(1/3) over 60 periods T from 0.1 to 10 s,
               φ = x/√(1 + x²), x = 1.4·2π/(p T)
    rocking    A = geometric mean of V over 24 periods from 0.25 to 2 times 2π/p, within 0.1 to 10 s

ln V is linear in ln T between the given ordinates and constant beyond them. PGA counts as SA at
0.03 s. Formulas are written once for numbers and arrays; no library is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from rbfrag.fragility.method import ArrayNamespace
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

PGA_PERIOD_S = 0.03
"""Oscillator period of which PGA is taken for the spectral acceleration."""

SHORTEST_S, LONGEST_S = 0.1, 10.0
"""Range of the periods over which means are taken; longer ordinates are not read."""

_STEP = math.log(100.0) / 59.0
_TOPPLING_PERIODS = tuple(
    (ln_t, math.exp(2.0 * ln_t)) for ln_t in (math.log(SHORTEST_S) + j * _STEP for j in range(60))
)
"""ln T and T² of the periods of the mean over a toppling block."""
_CORNER = 1.4 * 2.0 * math.pi
_ROCKING_LN = tuple(math.log(0.25 * 2.0 * math.pi) + j * math.log(8.0) / 23.0 for j in range(24))
_ENDS_LN_S = math.log(SHORTEST_S), math.log(LONGEST_S)

Ordinates = Mapping[float, Any]
"""Spectral accelerations [g], 5 % damping, by oscillator period [s]: numbers or arrays."""


def ln_velocities(ordinates: Ordinates, ns: ArrayNamespace) -> list[tuple[float, Any]]:
    """Return ln T and ln V of the ordinates, V in m/s, by increasing period."""
    return [
        (math.log(t), ns.log(sa * (STANDARD_GRAVITY_M_S2 * t / (2.0 * math.pi))))
        for t, sa in sorted(ordinates.items())
        if t <= LONGEST_S
    ]


def ln_toppling_velocity(ordinates: Ordinates, p: Any, ns: ArrayNamespace) -> Any:
    """Return ln X of a toppling block, X in m/s.

    Args:
        ordinates: one or more.
        p: frequency parameter of the block [1/s].
    """
    at = ln_velocities(ordinates, ns)
    # φ³ = (1 + (p T/corner)²)^(-3/2); between two ordinates V³ is a geometric progression
    scaled = p * (1.0 / _CORNER)
    square = scaled * scaled
    total: Any = 0.0
    last, cube, ratio, following = -1, ns.exp(3.0 * at[0][1]), 1.0, at[0][0]
    for ln_t, square_s2 in _TOPPLING_PERIODS:
        cube = cube * ratio
        if ln_t >= following:
            while last + 1 < len(at) and ln_t >= at[last + 1][0]:
                last += 1
            start, value = at[last]
            slope, following = 0.0, math.inf
            if last + 1 < len(at):
                following = at[last + 1][0]
                slope = (at[last + 1][1] - value) * (3.0 / (at[last + 1][0] - start))
            cube, ratio = ns.exp(3.0 * value + slope * (ln_t - start)), ns.exp(slope * _STEP)
        damped = 1.0 + square * square_s2
        total = total + cube / (damped * ns.sqrt(damped))
    total = ns.maximum(total, 1e-300)  # without shaking
    return ns.log(total * (1.0 / len(_TOPPLING_PERIODS))) * (1.0 / 3.0)


def ln_rocking_velocity(ordinates: Ordinates, p: Any, ns: ArrayNamespace) -> Any:
    """Return ln A of a free-standing block, A in m/s; arguments as for
    :func:`ln_toppling_velocity`.
    """
    at, ln_p = ln_velocities(ordinates, ns), ns.log(p)
    low, high = _ENDS_LN_S
    points = [ns.minimum(ns.maximum(point - ln_p, low), high) for point in _ROCKING_LN]
    # ln V(T) = ln V_1 + sum over the segments of slope times the part of it below T
    result = at[0][1]
    for (start, value), (end, following) in pairwise(at):
        part = sum(ns.minimum(ns.maximum(x, start), end) for x in points) / len(points) - start
        result = result + (following - value) * (part / (end - start))
    return result
