"""K_up: no block with a larger k_r topples, because no excursion from rest of one does."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.excursion import TOPPLED, integrate_excursion, rest_state
from rbfrag.solver.integrator.single_run import next_lifting_node
from rbfrag.solver.search.from_rest import linear_distance
from rbfrag.solver.search.renewal import END, FAILS, FIRST, all_known, begin, no_starts, work_of
from rbfrag.solver.search.rises import next_start

FloatArray = NDArray[np.float64]

NOTHING_FAILS, FOUND, AT_THE_TOP = 0, 1, 2


@kernel
def margin_from_rest(
    g: Ground,
    kr: float,
    k_upper: float,
    first: int,
    stop: int,
) -> tuple[float, int, int]:
    """How far the excursions from rest that begin in [first, stop) are from toppling.

    Positive if one topples. The size is the linear model's estimate of the distance in k_r:
    good for a secant, and nothing is concluded from it.
    """
    k_h = g.k_h
    w = g.w
    q = g.q
    block_max_q = g.block_max_q
    linear = g.linear
    n = q.size
    s0, c0 = rest_state(k_upper, linear)
    best = -math.inf
    steps = 0
    trajectories = 0
    node = next_lifting_node(q, block_max_q, first, stop, kr)
    while node > 0 and node < stop and q[node - 1] > kr:
        node -= 1
    while node < stop:
        i, tau = next_start(k_h, w, q, block_max_q, kr, max(node - 1, 0), 0.0)
        if i >= n:
            break
        event, at, fraction, _, rate, s, c, made = integrate_excursion(
            g, k_upper, i, tau, 0.0, 0.0, s0, c0, True, n - 1, 0.0, True, 0, 0.0,
        )  # fmt: skip
        steps += made
        trajectories += 1
        distance = linear_distance(g, i, tau, at, fraction, rate, s, c, event == TOPPLED)
        best = max(best, distance)
        while node < n and q[node] > kr:
            node += 1
        node = next_lifting_node(q, block_max_q, node, stop, kr)
    if trajectories == 0:
        best = -kr
    return best, trajectories, steps


@kernel
def between(
    low: float, high: float, at_low: float, at_high: float, side: int, edge: float, halve: bool
) -> float:
    """Next k_r to try between one that topples and one that does not, by false position.

    A little beyond the root as seen from the side of the last one, so that the bracket closes
    from both sides.
    """
    if halve:
        return 0.5 * (low + high)
    k = (low * at_high - high * at_low) / (at_high - at_low)
    return min(max(k + (edge if side > 0 else -edge), low + edge), high - edge)


@kernel
def border_of(
    g: Ground,
    bottom: float,
    guess: float,
    top: float,
    first: int,
    stop: int,
    margin: float,
    width: float,
) -> tuple[float, float, bool, int, int]:
    """Bracket the k_r below which a excursion from rest that begins in [first, stop) topples.

    Returns:
        A k_r that fails, one that does not (or `top`), whether any fails, trajectories, steps.
    """
    low = bottom
    high = top
    at_low = math.inf
    at_high = -math.inf
    known = False
    trajectories = 0
    steps = 0
    side = 0
    tries = 0
    gauge = top - bottom
    slow = False
    reach = 0.004
    k = guess
    while high - low > width * high:
        distance, made_trajectories, made = margin_from_rest(
            g, k,
            k * (1.0 - margin), first, stop,
        )  # fmt: skip
        trajectories += made_trajectories
        steps += made
        if distance > 0.0:
            known = True
            low = k
            at_low = distance
            if side > 0:
                at_high *= 0.5
            side = 1
        else:
            if k <= bottom:
                return bottom, bottom, known, trajectories, steps
            high = k
            at_high = distance
            if side < 0:
                at_low *= 0.5
            side = -1
        edge = 0.25 * width * high
        if at_high == -math.inf or at_low == math.inf:
            # one side only so far: go on to the other, further each time
            reach *= 4.0
            k = low * (1.0 + reach) if at_high == -math.inf else high * (1.0 - reach)
            if k >= top:
                k = 0.5 * (low + top)
            if k <= bottom:
                k = bottom
        else:
            # false position, its ends halved in turn (Illinois); a little beyond the root, so
            # that the bracket closes from both sides; bisection where that gains too little
            tries += 1
            if tries == 3:
                tries = 0
                slow = high - low > 0.125 * gauge
                gauge = high - low
            k = between(low, high, at_low, at_high, side, edge, slow)
            slow = False
    return low, high, known, trajectories, steps


@kernel
def upper_bound(
    g: Ground,
    bottom: float,
    top: float,
    margin: float,
    width: float,
    check: bool,
) -> tuple[int, float, float, int, int]:
    """Find K_up between two k_r.

    Args:
        g: the excitation of a block.
        bottom: least k_r of interest.
        top: greatest q of the record.
        margin: the excursions are integrated with k_r (1 - margin).
        width: relative width to which K_up is bisected.
        check: check D >= 0; where it fails the answer is `top`.

    Returns:
        NOTHING_FAILS (no excursion from rest at `bottom` topples), FOUND or AT_THE_TOP;
        a k_r with a failing excursion from rest and K_up; trajectories; steps.
    """
    q = g.q
    n = q.size
    guess = g.remaining_max
    node = g.still_node
    trajectories = 0
    steps = 0
    starts = no_starts(n)
    begin(starts, top, top * (1.0 - margin), top, check, 0, n)
    count, failing = all_known(g, starts)
    trajectories += count
    steps += work_of(starts)[1]
    if failing > 0:
        return AT_THE_TOP, top, top, trajectories, steps
    high = top
    first = 0
    stop = n
    low = min(max(guess, bottom), top)
    known = False
    if guess > bottom and q[node] > bottom:
        # the stretch that decides in the linear model is the one to begin with
        first = node
        stop = node + 1
        while stop < n and q[stop] > bottom:
            stop += 1
        low, high, known, made_trajectories, made = border_of(
            g,
            bottom, min(guess, top), top, first, stop, margin, width,
        )  # fmt: skip
        trajectories += made_trajectories
        steps += made
    if not known:
        low = bottom
        high = bottom
    while True:
        # no other stretch may fail at `high`
        begin(starts, high, high * (1.0 - margin), top, check, 0, n)
        count, failing = all_known(g, starts)
        trajectories += count
        steps += work_of(starts)[1]
        if failing == 0:
            return FOUND if known else NOTHING_FAILS, low, high, trajectories, steps
        if high >= top:
            return AT_THE_TOP, top, top, trajectories, steps
        known = True
        first = n
        stop = 0
        for m in range(count):
            if starts.stretches[FAILS, m] == 1:
                first = min(first, starts.stretches[FIRST, m])
                stop = max(stop, starts.stretches[END, m])
        before = high
        low, high, _, made_trajectories, made = border_of(
            g, high, high * 1.001, top, first, stop, margin, width,
        )  # fmt: skip
        trajectories += made_trajectories
        steps += made
        if high <= before:  # it is the order of motions that is lost
            return AT_THE_TOP, top, top, trajectories, steps
