"""K_low: every block with a smaller k_r topples, whatever it was doing before.

With x = theta'/p + 2 sin(phi/2), the motion obeys ::

    x' = -p cos(phi/2) x + p k_h cos(phi) - p k_v sin(phi)

so that x is bounded from below by the drive alone, without regard to when a block began to rock. A
block that leaves |phi| <= phi_m, tan(phi_m) the greatest of k_r and of what is to pull it back, has
toppled; within, cos(phi), cos(phi/2) and sin(phi) have bounds. Since theta >= 0, no block that has
not toppled falls back faster than theta'/p = x - 2 sin(theta_c/2). In a stretch of q > K a motion
that starts from theta = 0 with that rate, and is carried on below 0 until it turns, is behind every
block with k_r <= K from there on: those that impact meanwhile start again at once. If a block at
rest there topples, all do.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.excursion import TOPPLED, integrate_excursion, rest_state

FloatArray = NDArray[np.float64]

SHARES = (0.99, 0.96, 0.92, 0.86, 0.78, 0.68, 0.55, 0.4)
"""Shares of the linear model's estimate of K_low that are tried in turn."""


@kernel
def least_rate(g: Ground, top: float, bound: FloatArray) -> None:
    """Fill a lower bound of x at every node, at most 0, for all blocks with k_r <= top."""
    p = g.p
    pull = top
    for i in range(g.q.size):
        pull = max(pull, -g.q[i])
    c_m = 1.0 / math.sqrt(1.0 + pull * pull)
    s_m = pull * c_m
    c_half = math.sqrt(0.5 * (1.0 + c_m))
    x = 0.0
    bound[0] = 0.0
    for i in range(g.interval_s.size):
        ph = p * g.interval_s[i]
        # k_h cos(phi) at its least is concave in k_h: the trapezoid is below its integral
        f0 = g.k_h[i] * (c_m if g.k_h[i] > 0.0 else 1.0) - abs(1.0 - g.w[i]) * s_m
        f1 = g.k_h[i + 1] * (c_m if g.k_h[i + 1] > 0.0 else 1.0) - abs(1.0 - g.w[i + 1]) * s_m
        gain = ph * (0.5 * (f0 + f1) - ph * max(abs(f0), abs(f1)))
        x = x * math.exp(-c_half * ph) + gain
        # a block may also begin to rock inside the interval, with x > 0
        x = min(x, ph * min(min(f0, f1), 0.0))
        bound[i + 1] = x


@kernel
def topples_from_any_state(
    g: Ground, kr: float, margin: float, node: int, bound: FloatArray
) -> tuple[bool, int]:
    """Return whether all blocks with k_r <= kr topple by what follows a node; and steps."""
    n = g.q.size
    kb = kr * (1.0 + margin)
    s0, c0 = rest_state(kb, False)
    if g.q[node] <= kb:
        return False, 0
    rate = bound[node] - math.sqrt(2.0 * (1.0 - c0)) * (1.0 + margin)
    steps = 0
    i = node
    theta = 0.0
    s = s0
    c = c0
    while rate < 0.0:
        if i >= n - 1 or g.q[i + 1] <= kb:
            return False, steps
        _, i, _, theta, rate, s, c, made = integrate_excursion(
            g, kb, i, 0.0, theta, rate, s, c, False, i + 1, 0.0, False, 0, 0.0
        )
        steps += made
    if i >= n - 1:
        return False, steps
    event, _, _, _, _, _, _, made = integrate_excursion(
        g, kb, i, 0.0, 0.0, 0.0, s0, c0, True, n - 1, 0.0, True, 0, 0.0
    )
    return event == TOPPLED, steps + made


@kernel
def all_topple_below(g: Ground, bottom: float, top: float, margin: float) -> tuple[float, int, int]:
    """Return K_low between two k_r (`bottom` where none is found), trajectories, and steps.

    Args:
        g: the excitation of a block; D >= 0 throughout, not the linear model.
        bottom: least k_r of interest.
        top: greatest k_r of interest.
        margin: relative margin on k_r.
    """
    n = g.q.size
    bound = np.empty(n)
    least_rate(g, top, bound)
    trajectories = 0
    steps = 0
    # in the linear model a state topples if theta'/p + (drive to come) > theta_c - theta
    best = bottom
    node = -1
    for i in range(n - 1):
        guess = min(min(0.5 * (g.remaining[i] + bound[i]), g.q[i]), top)
        if guess > best:
            best = guess
            node = i
    if node < 0:
        return bottom, trajectories, steps
    for share in SHARES:
        kr = share * best
        if kr <= bottom:
            break
        trajectories += 1
        good, made = topples_from_any_state(g, kr, margin, node, bound)
        steps += made
        if good:
            return kr, trajectories, steps
    return bottom, trajectories, steps
