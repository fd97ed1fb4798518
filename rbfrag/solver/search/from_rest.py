"""A block followed from an instant of rest: whether it topples, and how nearly it does not."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.excursion import IMPACT, TOPPLED, integrate_excursion, rest_state
from rbfrag.solver.search.renewal import Starts, fails_after, no_starts
from rbfrag.solver.search.rises import next_start

FloatArray = NDArray[np.float64]


@kernel
def linear_distance(
    g: Ground,
    start_i: int,
    start_tau: float,
    i: int,
    tau: float,
    rate: float,
    s: float,
    c: float,
    toppled: bool,
) -> float:
    """How far in k_r an excursion was from the border, by the linear model: > 0 if it toppled.

    The linear model says what becomes of the state at the end of the excursion under the rest
    of the drive; referred back to its start, that is a distance in k_r. Good for a secant;
    nothing is concluded from its size.
    """
    time_s = g.time_s
    interval_s = g.interval_s
    remaining = g.remaining
    p = g.p
    linear = g.linear
    x = s if linear else math.atan2(s, c)
    end_s = time_s[i]
    to_come = remaining[i]
    if tau > 0.0:
        end_s += tau * interval_s[i]
        to_come += (remaining[i + 1] - to_come) * tau
    start_s = time_s[start_i]
    if start_tau > 0.0:
        start_s += start_tau * interval_s[start_i]
    distance: float = (rate + to_come - x) * math.exp(-p * (end_s - start_s))
    if toppled:
        return max(distance, 1e-300)
    return min(distance, -1e-300)


@kernel
def follow(
    g: Ground,
    kr: float,
    node: int,
    starts: Starts,
    use: bool,
) -> tuple[float, int]:
    """Follow a block at rest at a node; return its distance from toppling and the steps taken.

    Args:
        g: the excitation of a block.
        kr: rocking acceleration coefficient.
        node: node of rest.
        starts: excursions from rest of a k_r <= kr: where none is left that fails, the run ends.
        use: False to do without them.
    """
    k_h = g.k_h
    w = g.w
    q = g.q
    block_max_q = g.block_max_q
    linear = g.linear
    n = q.size
    s0, c0 = rest_state(kr, linear)
    best = -kr
    steps = 0
    i = node
    tau = 0.0
    for _ in range(4 * n + 16):
        i, tau = next_start(k_h, w, q, block_max_q, kr, i, tau)
        if i >= n or (use and not fails_after(g, starts, i)):
            break
        event, at, fraction, _, rate, s, c, made = integrate_excursion(
            g, kr, i, tau, 0.0, 0.0, s0, c0, True, n - 1, 0.0, True, 0, 0.0,
        )  # fmt: skip
        steps += made
        distance = linear_distance(g, i, tau, at, fraction, rate, s, c, event == TOPPLED)
        if event == TOPPLED:
            return distance, steps
        best = max(best, distance)
        if event != IMPACT:
            break
        i = at
        tau = fraction
    return best, steps


@kernel
def first_turn(g: Ground, kr: FloatArray, first: int, topples: bool) -> int:
    """Return the number of the first block from `first` on that does not do as said.

    Args:
        g: the excitation of a block.
        kr: rocking acceleration coefficients of blocks at rest when the record begins, shape (m,).
        first: number of the first block to look at.
        topples: what is said.

    Returns:
        The number, m where there is none.
    """
    unknown = no_starts(0)
    for j in range(first, kr.size):
        if (follow(g, kr[j], 0, unknown, False)[0] > 0.0) != topples:
            return j
    return kr.size
