"""Marching down through k_r: verdict after verdict, each for all blocks of an interval."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.compiled import kernel
from rbfrag.solver.envelopes import ALL_SAFE, ALL_TOPPLE, NO_ORDER, SPLIT, decide
from rbfrag.solver.renewal import fresh_starts, last_failing_end, last_rest
from rbfrag.solver.toppling import TOPPLED as RUN_TOPPLED
from rbfrag.solver.toppling import run_toppling

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SAFE, TOPPLES, UNKNOWN, ORDERLESS = 0, 1, 2, 3

TO_BRACKET, TO_ISLANDS, TO_BOTTOM = 0, 1, 2


@kernel
def march(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    p: float,
    ph_max: float,
    linear: bool,
    top: float,
    bottom: float,
    margin: float,
    depth: float,
    order_depth: float,
    first_step: float,
    check: bool,
    goal: int,
    resolution: float,
    max_steps: int,
    low: FloatArray,
    high: FloatArray,
    verdict: IntArray,
    point: FloatArray,
) -> tuple[int, float, int, int]:
    """Give verdicts from `top` downwards until the goal or `bottom` is reached.

    Args:
        time_s: node times [s], shape (n,).
        interval_s: as in :func:`rbfrag.solver.flight.fly`; likewise up to `linear`.
        top: k_r to start from.
        bottom: k_r to stop at.
        margin: relative margin on k_r of the enclosing motions.
        depth: relative width below which an interval is left undecided.
        order_depth: the same where the order of motions is lost.
        first_step: relative width of the first interval.
        check: check D >= 0 on the way.
        goal: TO_BRACKET, TO_ISLANDS or TO_BOTTOM.
        resolution: width of k_r of the islands that count for TO_ISLANDS.
        max_steps: integration steps after which the march is given up.
        low: filled with the lower ends of the intervals, falling.
        high: filled with their upper ends.
        verdict: filled with SAFE, TOPPLES, UNKNOWN or ORDERLESS.
        point: filled with a k_r of an UNKNOWN interval whose block topples, or NaN.

    Returns:
        Number of intervals, k_r reached, runs, steps.
    """
    n = q.size
    u = np.empty(9)
    us = np.empty(9)
    uc = np.empty(9)
    nothing = np.empty((3, 0))
    # fresh starts over the whole record at one k_r, and over the part of it that they leave
    # open at a greater one
    coarse = np.empty((4, n), dtype=np.int64)
    n_coarse = 0
    coarse_k = math.inf
    coarse_other = 0.0
    fine = np.empty((4, n), dtype=np.int64)
    n_fine = 0
    fine_k = math.inf
    window = 0
    window_end = 0
    runs = 0
    steps = 0
    count = 0
    found = False
    island = 0.0  # width of the toppling interval being passed
    wide_island = False
    gap = 0.0  # width of the safe interval being passed below a toppling one
    wide_gap = False
    hi = top
    width = first_step * top
    while hi > bottom and steps < max_steps and count < low.size:
        lo = max(hi - width, bottom)
        if lo < bottom * (1.0 + 0.1 * depth):
            lo = bottom
        if lo < coarse_k or (check and hi > coarse_other):
            coarse_k = max(bottom, lo - 0.5 * (hi - lo) - 0.01 * hi)
            coarse_other = hi * (1.0 + margin)
            n_coarse, _, made = fresh_starts(
                interval_s, k_h, w, q, tail_min_q, block_max_q, p, ph_max, linear, coarse_k,
                coarse_k * (1.0 - margin), coarse_other, check, 0, n, coarse, u, us, uc,
            )  # fmt: skip
            runs += n_coarse
            steps += made
            fine_k = math.inf
            window, _ = last_rest(coarse, n_coarse, 0, 0, 0)
            window_end = last_failing_end(coarse, n_coarse)
        if lo >= fine_k:
            what, peak, made_runs, made = decide(
                interval_s, k_h, w, q, tail_min_q, block_max_q, p, ph_max, linear, lo, hi, margin,
                check, fine, n_fine, window, u, us, uc,
            )  # fmt: skip
        else:
            what, peak, made_runs, made = decide(
                interval_s, k_h, w, q, tail_min_q, block_max_q, p, ph_max, linear, lo, hi, margin,
                check, coarse, n_coarse, 0, u, us, uc,
            )  # fmt: skip
        runs += made_runs
        steps += made
        scanned = fine_k if lo >= fine_k else coarse_k
        if what == SPLIT and not (lo < peak < hi) and lo - scanned > 2.0 * (hi - lo):
            fine_k = max(lo - 0.5 * (hi - lo), coarse_k)
            n_fine, _, made = fresh_starts(
                interval_s, k_h, w, q, tail_min_q, block_max_q, p, ph_max, linear, fine_k,
                fine_k * (1.0 - margin), coarse_other, check, window, window_end, fine, u, us, uc,
            )  # fmt: skip
            runs += n_fine
            steps += made
            continue
        topples_at = math.nan
        if what == ALL_SAFE or what == ALL_TOPPLE:
            answer = SAFE if what == ALL_SAFE else TOPPLES
            width = min(2.0 * (hi - lo), 0.2 * lo)
        elif lo < peak < hi:
            width = hi - peak
            continue
        elif hi - lo > (order_depth if what == NO_ORDER else depth) * hi:
            width = 0.5 * (hi - lo)
            continue
        else:
            answer = ORDERLESS if what == NO_ORDER else UNKNOWN
            width = hi - lo
            if not found:
                result = run_toppling(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, n, lo, p, linear,
                    8, ph_max, 0, False, nothing,
                )  # fmt: skip
                runs += 1
                steps += result[5]
                if result[0] == RUN_TOPPLED:
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
            wide_island = wide_island or island > resolution
            gap = 0.0
        elif answer == SAFE:
            island = 0.0
            if found:
                gap = gap + hi - lo
                wide_gap = wide_gap or gap > resolution
        found = found or topples_at == lo
        hi = lo
        if found and (goal == TO_BRACKET or (goal == TO_ISLANDS and wide_island and wide_gap)):
            break
    return count, hi, runs, steps
