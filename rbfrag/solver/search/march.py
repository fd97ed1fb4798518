"""Marching down through k_r: verdict after verdict, each for all blocks of an interval."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.search.envelopes import ALL_SAFE, ALL_TOPPLE, NO_ORDER, SPLIT, decide
from rbfrag.solver.search.from_rest import follow
from rbfrag.solver.search.renewal import Starts, begin, last_rest, no_starts, work_of
from rbfrag.solver.search.upper_bound import between

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SAFE, TOPPLES, UNKNOWN, ORDERLESS = 0, 1, 2, 3

BORDER = 1e-11
"""Relative width to which a border between two single blocks is closed in on."""

TO_BRACKET, TO_ISLAND, TO_BOTTOM = 0, 1, 2


@kernel
def border(
    g: Ground,
    lo: float,
    at_lo: float,
    hi: float,
    width: float,
    rest: int,
    starts: Starts,
    use: bool,
) -> tuple[float, float, int, int]:
    """Close in on a border between two k_r of which one topples and the other does not.

    Returns:
        A k_r on the side of `lo` and one on the side of `hi`, a relative `width` apart; runs,
        steps.
    """
    low_topples = at_lo > 0.0
    at_hi = math.inf if at_lo < 0.0 else -math.inf
    runs = 0
    steps = 0
    tries = 0
    gauge = hi - lo
    slow = True
    side = 0
    while hi - lo > width * hi:
        k = between(lo, hi, at_lo, at_hi, side, 0.25 * width * hi, slow)
        far, made = follow(g, k, rest, starts, use)
        runs += 1
        steps += made
        if (far > 0.0) == low_topples:
            lo = k
            at_lo = far
            if side > 0:
                at_hi *= 0.5
            side = 1
        else:
            hi = k
            at_hi = far
            if side < 0:
                at_lo *= 0.5
            side = -1
        slow = math.isinf(at_hi)
        tries += 1
        if tries == 3:
            tries = 0
            slow = slow or hi - lo > 0.125 * gauge
            gauge = hi - lo
    return lo, hi, runs, steps


@kernel
def march(
    g: Ground,
    top: float,
    bottom: float,
    margin: float,
    depth: float,
    least: float,
    order_depth: float,
    first_step: float,
    check: bool,
    goal: int,
    resolution: float,
    inside: bool,
    max_steps: int,
    low: FloatArray,
    high: FloatArray,
    verdict: IntArray,
    point: FloatArray,
) -> tuple[int, float, int, int]:
    """Give verdicts from `top` downwards until the goal or `bottom` is reached.

    Args:
        g: the excitation of a block.
        top: k_r to start from.
        bottom: k_r to stop at.
        margin: relative margin on k_r of the enclosing motions.
        depth: relative width below which an interval is left undecided.
        least: the same, as a width of k_r itself.
        order_depth: the relative one where the order of motions is lost.
        first_step: relative width of the first interval.
        check: check D >= 0 on the way.
        goal: TO_BRACKET, TO_ISLAND (to the end of the first interval that is proven to topple
            and as wide as the resolution) or TO_BOTTOM.
        resolution: width of k_r of the islands that count for TO_ISLAND.
        inside: blocks below `top` topple, it is not K_up.
        max_steps: integration steps after which the march is given up.
        low: filled with the lower ends of the intervals, falling.
        high: filled with their upper ends.
        verdict: filled with SAFE, TOPPLES, UNKNOWN or ORDERLESS.
        point: filled with a k_r of an UNKNOWN interval whose block topples, or NaN.

    Returns:
        Number of intervals, k_r reached, runs, steps.
    """
    n = g.q.size
    # starts from rest over the whole record at one k_r, and over the part of it that they leave
    # open at a greater one
    coarse = no_starts(n)
    coarse_k = math.inf
    coarse_other = 0.0
    fine = no_starts(n)
    fine_k = math.inf
    fine_rest = -1
    fine_fails = -1
    window = 0
    runs = 0
    steps = 0
    count = 0
    found = inside
    island = 0.0  # width of the toppling interval being passed
    hi = top
    width = first_step * top
    steady = width  # width of the last interval that got a verdict
    side = TOPPLES if inside else SAFE
    share = 0.6
    patience = 2.0
    halved = False
    edge_high = top  # a border known by two blocks: one of `side` above, one of the other below
    edge_low = top
    edge_point = top
    if not inside:
        far, made = follow(g, top * (1.0 - depth), 0, coarse, False)
        runs += 1
        steps += made
        if far > 0.0:  # K_up itself is the border
            edge_point = top * (1.0 - depth)
            edge_low = edge_point - max(0.25 * depth, 2.0 * margin) * top
    while hi > bottom and steps < max_steps and count < low.size - 1:
        if hi == edge_high and edge_low < hi:
            high[count] = hi
            low[count] = edge_low
            verdict[count] = UNKNOWN
            point[count] = edge_point if side == SAFE else math.nan
            count += 1
            side = TOPPLES if side == SAFE else SAFE
            hi = edge_low
            width = min(steady, 0.2 * hi)
            if side == TOPPLES:
                found = True
                if goal == TO_BRACKET:
                    break
            continue
        finest = max(depth * hi, least)
        clear = max(0.25 * finest, 2.0 * margin * hi)  # of the margins of the enclosing motions
        lo = max(hi - width, bottom)
        if lo < bottom + 0.1 * finest:
            lo = bottom
        if lo < edge_high < hi:
            # towards a border the distance left is shared out: all of it at once seldom works
            lo = edge_high
            if hi - lo > 3.0 * finest:
                lo = hi - share * (hi - lo)
        if lo < coarse_k or (check and hi > coarse_other):
            coarse_k = max(bottom, lo - 0.5 * (hi - lo) - 0.1 * hi)
            coarse_other = hi * (1.0 + margin)
            runs, steps = runs + work_of(coarse)[0], steps + work_of(coarse)[1]
            begin(coarse, coarse_k, coarse_k * (1.0 - margin), coarse_other, check, 0, n)
            fine_k = math.inf
            window, _ = last_rest(g, coarse, 0, 0, 0)
        if lo >= fine_k:
            what, peak, made_runs, made = decide(g, lo, hi, margin, check, fine, window)
        else:
            what, peak, made_runs, made = decide(g, lo, hi, margin, check, coarse, 0)
        runs += made_runs
        steps += made
        scanned = fine_k if lo >= fine_k else coarse_k
        if what == SPLIT and not (lo < peak < hi) and lo - scanned > patience * (hi - lo):
            fine_k = max(lo - 0.5 * (hi - lo), coarse_k)
            runs, steps = runs + work_of(fine)[0], steps + work_of(fine)[1]
            begin(fine, fine_k, fine_k * (1.0 - margin), coarse_other, check, window, n)
            rest, failing = last_rest(g, fine, window, window, window)
            gained = rest != fine_rest or failing != fine_fails
            patience = 2.0 if gained else patience * 8.0
            fine_rest, fine_fails = rest, failing
            continue
        topples_at = math.nan
        if what in (ALL_SAFE, ALL_TOPPLE):
            answer = SAFE if what == ALL_SAFE else TOPPLES
            # soon after a width that was too much the next one is tried with care
            width = min((1.3 if halved else 2.0) * (hi - lo), 0.2 * lo)
            halved = False
            share = min(1.3 * share, 0.9)
            if not (edge_high < hi):
                steady = width
            side = answer
        elif lo < peak < hi:
            width = hi - peak
            continue
        elif hi - lo > (max(order_depth * hi, finest) if what == NO_ORDER else finest):
            if what == SPLIT and not (lo <= edge_high < hi):
                # is a border the reason? then verdicts can go as far as that
                far, made = follow(g, lo, window, coarse, True)
                runs += 1
                steps += made
                if (far > 0.0) == (side == SAFE):
                    edge_point, edge_high, made_runs, made = border(
                        g, lo, far, hi, max(BORDER, 0.1 * least / hi), window, coarse, True
                    )
                    runs += made_runs
                    steps += made
                    edge_low = max(edge_point - clear, lo)
                    edge_high = min(edge_high + clear, hi)
                    width = hi - edge_high
                    share = 0.6
                    continue
            width = 0.5 * (hi - lo)
            halved = True
            share *= 0.5
            continue
        else:
            answer = ORDERLESS if what == NO_ORDER else UNKNOWN
            width = hi - lo
            if not found:
                far, made = follow(g, lo, window, coarse, True)
                runs += 1
                steps += made
                if far > 0.0:
                    topples_at = lo
        if count > 0 and verdict[count - 1] == answer and answer != UNKNOWN:
            low[count - 1] = lo
        else:
            high[count] = hi
            low[count] = lo
            verdict[count] = answer
            point[count] = topples_at
            count += 1
        if answer == TOPPLES:
            found = True
            island = island + hi - lo
        elif answer == SAFE:
            island = 0.0
        found = found or topples_at == lo
        hi = lo
        if found and (goal == TO_BRACKET or (goal == TO_ISLAND and island > resolution)):
            break
    runs += work_of(coarse)[0] + work_of(fine)[0]
    steps += work_of(coarse)[1] + work_of(fine)[1]
    return count, hi, runs, steps
