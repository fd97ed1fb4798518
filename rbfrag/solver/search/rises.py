"""Where blocks start: crossings of k_r by q = k_h/(1 + k_v), for one k_r or for all between two."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.single_run import next_lifting_node

FloatArray = NDArray[np.float64]

LIFTED, TURNED_BACK, APART = 0, 1, 2


@kernel
def crossing(k0: float, k1: float, w0: float, w1: float, kr: float) -> float:
    """Fraction of an interval at which k_h - (1 + k_v) k_r rises through zero."""
    g0 = k0 - w0 * kr
    g1 = k1 - w1 * kr
    if g0 >= 0.0 or g1 <= g0:
        return 0.0
    return min(-g0 / (g1 - g0), 1.0)


@kernel
def next_start(
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    block_max_q: FloatArray,
    kr: float,
    i: int,
    tau: float,
) -> tuple[int, float]:
    """First position from (i, tau) on with q > kr; (n, 0) where there is none.

    A start at the last node counts as none: the ground is at rest from there on.
    """
    n = q.size
    if tau > 0.0 and i < n - 1:
        at = k_h[i] + (k_h[i + 1] - k_h[i]) * tau
        vt = w[i] + (w[i + 1] - w[i]) * tau
        if at > vt * kr:
            return i, tau
        if q[i + 1] > kr:
            return i, max(tau, crossing(k_h[i], k_h[i + 1], w[i], w[i + 1], kr))
        i += 1
    if i >= n - 1:
        return n, 0.0
    if q[i] > kr:
        return i, 0.0
    j = next_lifting_node(q, block_max_q, i + 1, n, kr)
    if j >= n:
        return n, 0.0
    return j - 1, crossing(k_h[j - 1], k_h[j], w[j - 1], w[j], kr)


@kernel
def common_start(
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    k2: float,
    kb: float,
    ie: int,
    te: float,
    ia: int,
    ta: float,
) -> tuple[int, int, float, float]:
    """Rule A: the start of the motion that is behind all blocks with k_r <= k2.

    Args:
        k_h: driving acceleration at the nodes [g], shape (n,).
        w: 1 + k_v at the nodes, shape (n,).
        q: k_h/(1 + k_v) at the nodes, shape (n,).
        k2: greatest k_r.
        kb: k_r of the lower bounding trajectory, >= k2.
        ie: interval of the earliest start e.
        te: its fraction.
        ia: interval of the last impact.
        ta: its fraction.

    Returns:
        LIFTED and the first position from the impact on with q >= kb, if min(q, kb) does not
        fall between e and there; TURNED_BACK and a position by which all are lifted, if q turns
        between k2 and kb; APART if q turns lower. Last, the value of q at the turn (NaN where
        it turns at e).
    """
    n = q.size
    at = k_h[ie] + (k_h[ie + 1] - k_h[ie]) * te
    previous = at / (w[ie] + (w[ie + 1] - w[ie]) * te) if te > 0.0 else q[ie]
    peak = math.nan
    node = ie + 1
    while True:
        i = node - 1
        if i >= ia:
            low = 0.0
            if i == ie:
                low = te
            if i == ia:
                low = max(low, ta)
            if node >= n:
                if previous >= k2:
                    return TURNED_BACK, n - 1, 0.0, peak
                return APART, n, 0.0, peak
            at = k_h[i] + (k_h[node] - k_h[i]) * low
            if at >= (w[i] + (w[node] - w[i]) * low) * kb:
                return LIFTED, i, low, peak
            if q[node] >= kb:
                return LIFTED, i, max(low, crossing(k_h[i], k_h[node], w[i], w[node], kb)), peak
            if q[node] < previous:
                if previous >= k2 and low == 0.0:
                    return TURNED_BACK, i, 0.0, peak
                return APART, i, 0.0, peak
        elif q[node] < min(previous, kb):
            return APART, i, 0.0, peak
        previous = q[node]
        peak = previous
        node += 1


@kernel
def restart_floor(q: FloatArray, k1: float, k2: float, i: int) -> int:
    """Rule C: first node at which a block lifted at a position in interval i may start anew.

    If q stays >= k2 after the common start and then falls without a rise to <= k1, no block
    with k_r in [k1, k2] impacts before q has fallen below its k_r, nor starts before that
    node. -1 where q does otherwise; n if the record ends first.
    """
    n = q.size
    node = i + 1
    while node < n and q[node] >= k2:
        node += 1
    first = node
    while node < n and q[node] > k1:
        if node > first and q[node] > q[node - 1]:
            return -1
        node += 1
    return node
