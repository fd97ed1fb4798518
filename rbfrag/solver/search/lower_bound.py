"""K_low: every block with a smaller k_r topples, whatever its earlier motion.

With x = theta'/p + 2 sin(psi/2), the motion obeys ::

    x' = -p cos(psi/2) x + p k_h cos(psi) - p k_v sin(psi)

so that x is bounded from below by the excitation alone, without regard to when a block began to
rock. A block that leaves |psi| <= psi_m, tan(psi_m) the greatest of k_r and of what is to pull it
back, has toppled; within, cos(psi), cos(psi/2) and sin(psi) have bounds. Since theta >= 0, no block
that has not toppled falls back faster than theta'/p = x - 2 sin(theta_c/2). In a stretch of q > K a
motion that starts from theta = 0 with that rate, and is carried on below 0 until it turns, bounds
every block with k_r <= K from below from there on: those that impact meanwhile start again at once.
If a block at rest there topples, all do.
"""

from __future__ import annotations

import math

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel
from rbfrag.solver.integrator.excursion import (
    NO_IMPACT,
    TOPPLED,
    TRUSTED,
    excursion_from_rest,
    integrate_excursion,
)
from rbfrag.solver.integrator.state import Place, State, at_rest
from rbfrag.solver.results import FloatArray

RATIOS = (0.99, 0.96, 0.92, 0.86, 0.78, 0.68, 0.55, 0.4)
"""Ratios to the linear model's estimate of K_low that are tried in turn."""


@bare_kernel
def least_rate(excitation: BlockExcitation, top: float, bound: FloatArray) -> None:
    """Fill a lower bound of x at every node, at most 0, for all blocks with k_r <= top."""
    k_h, w, q = excitation.k_h, excitation.w, excitation.q
    pull = top
    for i in range(q.size):
        pull = max(pull, -q[i])
    c_m = 1.0 / math.sqrt(1.0 + pull * pull)
    s_m = pull * c_m
    c_half = math.sqrt(0.5 * (1.0 + c_m))
    # a block at rest has x > 0; at the slowest decay, cos(psi/2) = c_half, a bound below zero holds
    x = 0.0
    bound[0] = 0.0
    for i in range(excitation.interval_s.size):
        ph = excitation.p * excitation.interval_s[i]
        # k_h cos(psi) at its least is concave in k_h: the trapezoid is below its integral
        f0 = k_h[i] * (c_m if k_h[i] > 0.0 else 1.0) - abs(1.0 - w[i]) * s_m
        f1 = k_h[i + 1] * (c_m if k_h[i + 1] > 0.0 else 1.0) - abs(1.0 - w[i + 1]) * s_m
        gain = ph * (0.5 * (f0 + f1) - ph * max(abs(f0), abs(f1)))
        x = x * math.exp(-c_half * ph) + gain
        # a block may also begin to rock inside the interval, with x > 0
        x = min(x, ph * min(min(f0, f1), 0.0))
        bound[i + 1] = x


@inner_kernel
def topples_from_any_state(
    excitation: BlockExcitation, kr: float, margin: float, node: int, bound: FloatArray
) -> bool:
    """Return whether all blocks with k_r <= kr topple by the shaking after a node."""
    last = excitation.q.size - 1
    k_lower = kr * (1.0 + margin)
    if excitation.q[node] <= k_lower:
        return False
    state = at_rest(k_lower)
    # the fastest fall of a block that has not toppled, from theta = 0
    rate = bound[node] - math.sqrt(2.0 * (1.0 - state.cos)) * (1.0 + margin)
    place = Place(node, 0.0)
    state = State(0.0, rate, state.sin, state.cos)
    while state.rate < 0.0:
        i = place.interval
        if i >= last or excitation.q[i + 1] <= k_lower:
            return False
        excursion = integrate_excursion(
            excitation, k_lower, place, state, False, Place(i + 1, 0.0), NO_IMPACT
        )
        place = Place(excursion.place.interval, 0.0)
        state = excursion.state
    # those that closed their contact meanwhile started again at once: from rest, at the latest here
    return (
        place.interval < last
        and excursion_from_rest(excitation, k_lower, place, TRUSTED).event == TOPPLED
    )


@bare_kernel
def all_topple_below(
    excitation: BlockExcitation, bottom: float, top: float, margin: float, bound: FloatArray
) -> float:
    """Return K_low between two k_r; `bottom` if none is found.

    Args:
        excitation: the excitation of a block; D >= 0 throughout.
        bottom: least k_r of interest.
        top: greatest k_r of interest.
        margin: relative margin on k_r.
        bound: work array, shape (n,).
    """
    least_rate(excitation, top, bound)
    # in the linear model a state topples if theta'/p + remaining excitation > theta_c - theta
    best = bottom
    node = -1
    for i in range(excitation.q.size - 1):
        guess = min(min(0.5 * (excitation.remaining[i] + bound[i]), excitation.q[i]), top)
        if guess > best:
            best = guess
            node = i
    if node < 0:
        return bottom
    for ratio in RATIOS:
        kr = ratio * best
        if kr <= bottom:
            break
        if topples_from_any_state(excitation, kr, margin, node, bound):
            return kr
    return bottom
