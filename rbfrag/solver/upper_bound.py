"""K_up: no block with a larger k_r topples, because no fresh excursion of one does."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.compiled import kernel
from rbfrag.solver.renewal import END, FAILS, FIRST, fresh_starts

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

NOTHING_FAILS, FOUND, AT_THE_TOP = 0, 1, 2


@kernel
def linear_upper_bound(interval_s: FloatArray, k_h: FloatArray, p: float) -> float:
    """Largest critical angle over all fresh starts in the linear model, vertical left out.

    The greatest G(t) = p integral_t^inf k_h(s) exp(-p (s - t)) ds, by G' = p (G - k_h) from the
    end backwards; where G is greatest it equals k_h, which may be inside an interval.
    """
    g = 0.0
    greatest = 0.0
    h = -1.0
    decay = 0.0
    for i in range(interval_s.size - 1, -1, -1):
        if interval_s[i] != h:
            h = interval_s[i]
            decay = math.exp(-p * h)
        if h > 0.0:
            slope = (k_h[i + 1] - k_h[i]) / h
            rest = g - k_h[i + 1] - slope / p  # times exp(-p (t_end - t))
            # G turns where slope + p rest exp(-p (t_end - t)) = 0
            if slope > 0.0 and rest < 0.0:
                faded = -slope / (p * rest)
                if decay < faded <= 1.0:
                    greatest = max(greatest, k_h[i + 1] + slope * math.log(faded) / p)
            g = k_h[i] + slope / p + rest * decay
        greatest = max(greatest, g)
    return greatest


@kernel
def upper_bound(
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    p: float,
    ph_max: float,
    linear: bool,
    bottom: float,
    top: float,
    margin: float,
    width: float,
    check: bool,
    stretches: IntArray,
    u: FloatArray,
    us: FloatArray,
    uc: FloatArray,
) -> tuple[int, float, float, int, int]:
    """Find K_up between two k_r.

    Args:
        interval_s: as in :func:`rbfrag.solver.flight.fly`; likewise up to `linear`.
        bottom: least k_r of interest.
        top: greatest q of the record.
        margin: the excursions are flown with k_r (1 - margin).
        width: relative width to which K_up is bisected.
        check: check D >= 0; where it fails the answer is `top`.
        stretches: work, shape (4, n).
        u: work of `fly`.
        us: work of `fly`.
        uc: work of `fly`.

    Returns:
        NOTHING_FAILS (no fresh excursion at `bottom` topples), FOUND or AT_THE_TOP;
        a k_r with a failing fresh excursion and K_up; flights; steps.
    """
    n = q.size
    guess = min(max(linear_upper_bound(interval_s, k_h, p), bottom), top)
    flights = 0
    steps = 0
    low = bottom
    high = top
    first = 0
    stop = n
    known = False
    # close in on the border from the linear value outwards
    reach = 0.004
    k = guess
    going = 0
    while True:
        k = min(max(k, bottom), top)
        count, failing, made = fresh_starts(
            interval_s, k_h, w, q, tail_min_q, block_max_q, p, ph_max, linear, k,
            k * (1.0 - margin), top, check, first, stop, stretches, u, us, uc,
        )  # fmt: skip
        flights += count
        steps += made
        if failing > 0:
            low = k
            known = True
            first = n
            stop = 0
            for m in range(count):
                if stretches[FAILS, m] == 1:
                    first = min(first, stretches[FIRST, m])
                    stop = max(stop, stretches[END, m])
            if k >= top:
                return AT_THE_TOP, top, top, flights, steps
            if going < 0:
                break
            going = 1
            k = k * (1.0 + reach)
        else:
            high = k
            if k <= bottom:
                return NOTHING_FAILS, bottom, bottom, flights, steps
            if going > 0:
                break
            going = -1
            k = k * (1.0 - reach)
        reach *= 4.0
        if reach > 0.5 and going < 0:
            k = bottom
        elif reach > 4.0:
            k = top
    while high - low > width * high:
        k = 0.5 * (low + high)
        count, failing, made = fresh_starts(
            interval_s, k_h, w, q, tail_min_q, block_max_q, p, ph_max, linear, k,
            k * (1.0 - margin), top, check, first, stop, stretches, u, us, uc,
        )  # fmt: skip
        flights += count
        steps += made
        if failing > 0:
            low = k
        else:
            high = k
    return FOUND if known else NOTHING_FAILS, low, high, flights, steps
