"""A block followed from an instant of rest: whether it topples, and how nearly it does not."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.compiled import kernel
from rbfrag.solver.flight import RESEATED, TOPPLED, fly, rest_state
from rbfrag.solver.rises import next_start

FloatArray = NDArray[np.float64]


@kernel
def linear_distance(
    time_s: FloatArray,
    interval_s: FloatArray,
    still: FloatArray,
    p: float,
    linear: bool,
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
    x = s if linear else math.atan2(s, c)
    end_s = time_s[i]
    to_come = still[i]
    if tau > 0.0:
        end_s += tau * interval_s[i]
        to_come += (still[i + 1] - to_come) * tau
    start_s = time_s[start_i]
    if start_tau > 0.0:
        start_s += start_tau * interval_s[start_i]
    distance: float = (rate + to_come - x) * math.exp(-p * (end_s - start_s))
    if toppled:
        return max(distance, 1e-300)
    return min(distance, -1e-300)


@kernel
def follow(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    still: FloatArray,
    p: float,
    ph_max: float,
    linear: bool,
    kr: float,
    node: int,
    failing_end: int,
    u: FloatArray,
    us: FloatArray,
    uc: FloatArray,
) -> tuple[float, int]:
    """Follow a block at rest at a node; return its distance from toppling and the steps taken.

    Args:
        time_s: node times [s], shape (n,).
        interval_s: as in :func:`rbfrag.solver.flight.fly`; likewise up to `linear`.
        still: of :func:`rbfrag.solver.upper_bound.linear_drive`.
        kr: rocking acceleration coefficient.
        node: node of rest.
        failing_end: node after which no start topples.
        u: work of `fly`.
        us: work of `fly`.
        uc: work of `fly`.
    """
    n = q.size
    s0, c0 = rest_state(kr, linear)
    best = -kr
    steps = 0
    i = node
    tau = 0.0
    for _ in range(4 * n + 16):
        i, tau = next_start(k_h, w, q, block_max_q, kr, i, tau)
        if i >= n or i >= failing_end:
            break
        event, at, fraction, _, rate, s, c, made = fly(
            interval_s, k_h, w, tail_min_q, p, ph_max, linear, kr, i, tau,
            0.0, 0.0, s0, c0, True, n - 1, 0.0, True, 0, 0.0, u, us, uc,
        )  # fmt: skip
        steps += made
        distance = linear_distance(
            time_s, interval_s, still, p, linear, i, tau, at, fraction, rate, s, c,
            event == TOPPLED,
        )  # fmt: skip
        if event == TOPPLED:
            return distance, steps
        best = max(best, distance)
        if event != RESEATED:
            break
        i = at
        tau = fraction
    return best, steps
