"""Starts of motion: upcrossings of k_r by q = k_h/(1 + k_v), for one k_r or a range."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import inner_kernel
from rbfrag.solver.integrator.state import Place
from rbfrag.solver.integrator.toppling_kernel import next_lifting_node
from rbfrag.solver.results import FloatArray

LIFTED, TURNED_BACK, APART = 0, 1, 2


class CommonStart(NamedTuple):
    """Start of one pair of trajectories that encloses all blocks of an interval, if there is one.

    Args:
        kind: LIFTED where it does; TURNED_BACK where all blocks are lifted but q turns before the
            lower trajectory starts; APART where q turns lower.
        latest: start of the lower trajectory; LIFTED or TURNED_BACK.
        peak: q where it turns; NaN where it turns at the earliest start.
    """

    kind: int
    latest: Place
    peak: float


@inner_kernel
def crossing(excitation: BlockExcitation, i: int, kr: float) -> float:
    """Return the fraction of interval i at which k_h - (1 + k_v) k_r rises through zero."""
    # k_h - (1 + k_v) k_r is linear in the interval as q itself is not
    g0 = excitation.k_h[i] - excitation.w[i] * kr
    g1 = excitation.k_h[i + 1] - excitation.w[i + 1] * kr
    if g0 >= 0.0 or g1 <= g0:
        return 0.0
    fraction: float = min(-g0 / (g1 - g0), 1.0)
    return fraction


@inner_kernel
def next_start(excitation: BlockExcitation, kr: float, place: Place) -> Place:
    """Return the first position from one on with q > kr; interval n if there is none.

    A start at the last node counts as none: the ground is at rest from there on.
    """
    k_h, w, q = excitation.k_h, excitation.w, excitation.q
    n = q.size
    i, tau = place
    if tau > 0.0 and i < n - 1:
        # inside an interval: lifted at once where q > k_r, or at the crossing that is still to come
        k_h_there = k_h[i] + (k_h[i + 1] - k_h[i]) * tau
        if k_h_there > (w[i] + (w[i + 1] - w[i]) * tau) * kr:
            return place
        if q[i + 1] > kr:
            return Place(i, max(tau, crossing(excitation, i, kr)))
        i += 1
    if i >= n - 1:
        return Place(n, 0.0)
    if q[i] > kr:
        return Place(i, 0.0)
    j = next_lifting_node(q, excitation.block_max_q, i + 1, n, kr)
    if j >= n:
        return Place(n, 0.0)
    return Place(j - 1, crossing(excitation, j - 1, kr))


@inner_kernel
def common_start(
    excitation: BlockExcitation, k2: float, k_lower: float, earliest: Place, last_impact: Place
) -> CommonStart:
    """Rule A: the start of one trajectory that bounds all blocks with k_r <= k2 from below.

    It is there if min(q, k2) does not fall between the first start and the last.

    Args:
        k2: greatest k_r.
        k_lower: k_r of the lower bounding trajectory, >= k2.
        earliest: start e of the weakest block.
        last_impact: by when all have closed their contact.
    """
    # q is scanned at the nodes from e on: a quotient of straight lines, it is monotone between them

    # A holds if min(q, k2) does not decrease from the first start to the last. When a block k
    # starts in between, q >= k1 since e: the upper trajectory has been lifted, and bounds it.
    # And q >= k from there until the lower one starts: by then the block has been lifted itself
    k_h, w, q = excitation.k_h, excitation.w, excitation.q
    n = q.size
    e, tau_e = earliest
    previous = q[e]
    if tau_e > 0.0:
        previous = k_h[e] + (k_h[e + 1] - k_h[e]) * tau_e
        previous /= w[e] + (w[e + 1] - w[e]) * tau_e
    peak = math.nan
    node = e + 1
    while True:
        i = node - 1
        # the last start is the first place with q >= k2 after the last impact: before that
        # impact only a fall matters
        if i >= last_impact.interval:
            low = 0.0
            if i == e:
                low = tau_e
            if i == last_impact.interval:
                low = max(low, last_impact.fraction)
            if node >= n:
                # the record ends above k2: all are lifted, and the ground is at rest from there
                if previous >= k2:
                    return CommonStart(TURNED_BACK, Place(n - 1, 0.0), peak)
                return CommonStart(APART, Place(n, 0.0), peak)
            k_h_there = k_h[i] + (k_h[node] - k_h[i]) * low
            if k_h_there >= (w[i] + (w[node] - w[i]) * low) * k_lower:
                return CommonStart(LIFTED, Place(i, low), peak)
            if q[node] >= k_lower:
                latest = max(low, crossing(excitation, i, k_lower))
                return CommonStart(LIFTED, Place(i, latest), peak)
            if q[node] < previous:
                # between k2 and the lower trajectory's k_r, greater by the margin: every block is
                # lifted by then, and that trajectory falls back at once
                kind = TURNED_BACK if previous >= k2 and low == 0.0 else APART
                return CommonStart(kind, Place(i, 0.0), peak)
        elif q[node] < min(previous, k_lower):
            # A fails: min(q, k2) falls, and some blocks are lifted before and some after
            return CommonStart(APART, Place(i, 0.0), peak)
        previous = q[node]
        peak = previous
        node += 1


@inner_kernel
def restart_floor(q: FloatArray, k1: float, k2: float, i: int) -> int:
    """Rule C: the first node at which a block lifted in interval i may restart.

    If q stays >= k2 after the common start and then falls without a rise to <= k1, no block
    with k_r in [k1, k2] impacts before q has fallen below its k_r (by lift), nor starts before
    that node. -1 where q does otherwise; n if the record ends first.
    """
    n = q.size
    node = i + 1
    while node < n and q[node] >= k2:
        node += 1
    # a rise between k2 and k1 would lift some of those that have closed their contact there
    first = node
    while node < n and q[node] > k1:
        if node > first and q[node] > q[node - 1]:
            return -1
        node += 1
    return node
