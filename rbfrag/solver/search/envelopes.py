"""One verdict for all blocks of a range: two motions that enclose theirs.

With q = k_h/(1 + k_v) and D = k_h sin(phi) + (1 + k_v) cos(phi) >= 0, the acceleration of the
block grows with theta and falls with k_r. Hence a motion that is ahead of another in theta and
theta' stays so until the other impacts, and a smaller k_r only adds to its lead. A motion
*ahead*, with the smallest k_r and the earliest start, and one *behind*, with the largest k_r
and the latest start, enclose every block between. Rules A to E say how the enclosure is carried
through impacts and new starts.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.excursion import (
    IMPACT,
    IN_AIR,
    ORDER,
    ORDER_LOST,
    STOPPED,
    TOPPLED,
    integrate_excursion,
    rest_state,
)
from rbfrag.solver.integrator.taylor import bracketed_root
from rbfrag.solver.search.renewal import Starts, fails_after, last_rest
from rbfrag.solver.search.rises import APART, TURNED_BACK, common_start, next_start, restart_floor

FloatArray = NDArray[np.float64]

ALL_SAFE, ALL_TOPPLE, SPLIT, NO_ORDER = 0, 1, 2, 3


@kernel
def decide(
    g: Ground,
    k1: float,
    k2: float,
    margin: float,
    check: bool,
    starts: Starts,
    at_rest: int,
) -> tuple[int, float, int, int]:
    """Decide whether all blocks with k_r in [k1, k2] topple, or none, if that can be told.

    Args:
        g: the excitation of a block.
        k1: smallest k_r.
        k2: greatest k_r.
        margin: the enclosing motions are integrated with k1 (1 - margin) and k2 (1 + margin).
        check: check D >= 0 on the way.
        starts: excursions from rest of a k_r <= k1.
        at_rest: node at which all blocks are at rest, and from which on the excursions count.

    Returns:
        Verdict, a k_r to split at (NaN for anywhere), trajectories, steps.
    """
    interval_s = g.interval_s
    k_h = g.k_h
    w = g.w
    q = g.q
    block_max_q = g.block_max_q
    p = g.p
    ph_max = g.ph_max
    linear = g.linear
    u = g.u
    n = q.size
    steps = 0
    trajectories = 0
    ka = k1 * (1.0 - margin)
    kb = k2 * (1.0 + margin)
    sa0, ca0 = rest_state(ka, linear)
    sb0, cb0 = rest_state(kb, linear)

    rest, _ = last_rest(g, starts, at_rest, at_rest, at_rest)
    ib = rest  # first and last impact
    tb = 0.0
    ia = rest
    ta = 0.0
    in_air = False  # the upper bounding trajectory is still off its base when the record ends
    mixable = False  # the trajectory before this rest lets rule E be tried
    # the motions at the first impact, for rule E
    ixb = 0
    txb = 0.0
    rate_b = 0.0
    theta_a = 0.0
    rate_a = 0.0
    s_a = 0.0
    c_a = 0.0

    for _ in range(4 * n + 16):
        ie, te = next_start(k_h, w, q, block_max_q, k1, ib, tb)
        if ie >= n or not fails_after(g, starts, ie):
            return ALL_SAFE, math.nan, trajectories, steps
        code = APART
        il = 0
        tl = 0.0
        peak = math.nan
        if not in_air:
            code, il, tl, peak = common_start(k_h, w, q, k2, kb, ie, te, ia, ta)
        if code != APART:
            ixa = ie
            txa = te
            theta_a = 0.0
            rate_a = 0.0
            s_a = sa0
            c_a = ca0
        else:
            mixed = False
            if mixable:
                # rule E: carry the lower bounding trajectory on below zero until it turns
                i = ixb
                tau = txb
                theta = 0.0
                rate = rate_b
                s = sb0
                c = cb0
                while i < n - 1 and q[i + 1] > kb:
                    il = i
                    tl = tau
                    event, i, tau, theta, rate, s, c, made = integrate_excursion(
                        g, kb, i, tau, theta, rate, s, c, False, i + 1, 0.0, False, 0, 0.0,
                    )  # fmt: skip
                    steps += made
                    if rate >= 0.0:
                        mixed = True
                        left = 1.0 - tl
                        if p * interval_s[il] * left <= ph_max and u[0] < 0.0:
                            # all have theta' >= 0 from where the lower trajectory turns
                            turn_at = bracketed_root(1, theta, u, ORDER, 0.0, 1.0)
                            tl = min(tl + turn_at * left + 1e-13, 1.0)
                        else:
                            il = i
                            tl = 0.0
                        break
                trajectories += 1
                mixable = False
            if mixed:
                # ahead of those that have had no impact since, and of those that have
                event, _, _, theta, rate, s, c, made = integrate_excursion(
                    g, ka, ixb, txb, 0.0, 0.0, sa0, ca0, True, il, tl, True, 0, 0.0,
                )  # fmt: skip
                steps += made
                event, ixa, txa, theta_a, rate_a, s_a, c_a, made = integrate_excursion(
                    g, ka, ixb, txb, theta_a, rate_a, s_a, c_a, False, il, tl, False, 0, 0.0,
                )  # fmt: skip
                steps += made
                if event != STOPPED:
                    return SPLIT, math.nan, trajectories, steps
                if theta > theta_a:
                    theta_a = theta
                    s_a = s
                    c_a = c
                rate_a = max(rate_a, rate, 0.0)
            else:
                rest_from = 2 * n if in_air else (ia + 1 if ta > 0.0 else ia)
                rest, failing = last_rest(g, starts, ib, rest_from, -1)
                if failing < 0:
                    return ALL_SAFE, math.nan, trajectories, steps
                if rest > ib:
                    ib = rest
                    ia = rest
                    tb = 0.0
                    ta = 0.0
                    in_air = False
                    continue
                # rule F: what starts in this stretch is below the upper trajectory from e
                event, i, tau, _, _, _, _, made = integrate_excursion(
                    g,
                    ka,
                    ie,
                    te,
                    0.0,
                    0.0,
                    sa0,
                    ca0,
                    True,
                    n - 1,
                    0.0,
                    True,
                    1 if check else 0,
                    kb,
                )
                steps += made
                trajectories += 1
                if event == ORDER_LOST:
                    return NO_ORDER, math.nan, trajectories, steps
                if event == TOPPLED:
                    if k1 < peak < k2:
                        return SPLIT, peak, trajectories, steps
                    return SPLIT, math.nan, trajectories, steps
                in_air = in_air or event == IN_AIR
                node = ie + 1
                while node < n and q[node] > k1:
                    node += 1
                ib = node
                tb = 0.0
                if i > ia or (i == ia and tau > ta):
                    ia = i
                    ta = tau
                if ia < node:
                    ia = node
                    ta = 0.0
                continue

        # lower bounding trajectory
        floor = restart_floor(q, k1, k2, il)
        mixable = False
        in_air = False
        if code == TURNED_BACK:
            event = IMPACT
            ixb = il
            txb = tl
            rate_b = 0.0
        else:
            event, ixb, txb, _, rate_b, _, _, made = integrate_excursion(
                g,
                kb,
                il,
                tl,
                0.0,
                0.0,
                sb0,
                cb0,
                True,
                n - 1,
                0.0,
                True,
                2 if check else 0,
                0.0,
            )
            steps += made
            trajectories += 1
            if event == ORDER_LOST:
                return NO_ORDER, math.nan, trajectories, steps
            if event == TOPPLED:
                return ALL_TOPPLE, math.nan, trajectories, steps
        check_ahead = 1 if check else 0
        if event == IN_AIR:
            event, _, _, _, _, _, _, made = integrate_excursion(
                g, ka, ixa, txa, theta_a, rate_a, s_a, c_a, True, n - 1, 0.0, True, check_ahead, kb,
            )  # fmt: skip
            steps += made
            trajectories += 1
            if event == ORDER_LOST:
                return NO_ORDER, math.nan, trajectories, steps
            return (ALL_SAFE if event == IN_AIR else SPLIT), math.nan, trajectories, steps
        # the lower bounding trajectory has ended in an impact; bring the upper one there
        event, ixa, txa, theta_a, rate_a, s_a, c_a, made = integrate_excursion(
            g, ka, ixa, txa, theta_a, rate_a, s_a, c_a, True, ixb, txb, True, check_ahead, kb,
        )  # fmt: skip
        steps += made
        trajectories += 1
        if event == ORDER_LOST:
            return NO_ORDER, math.nan, trajectories, steps
        if event == IN_AIR:  # the first impact is at the end of the record
            return ALL_SAFE, math.nan, trajectories, steps
        if event != STOPPED:
            return SPLIT, math.nan, trajectories, steps
        at = k_h[ixb] + (k_h[ixb + 1] - k_h[ixb]) * txb
        at /= w[ixb] + (w[ixb + 1] - w[ixb]) * txb
        lifting = rate_a >= 0.0 and at >= k1
        event, ia, ta, _, _, _, _, made = integrate_excursion(
            g, ka, ixa, txa, theta_a, rate_a, s_a, c_a, lifting, n - 1, 0.0, True, check_ahead, kb,
        )  # fmt: skip
        steps += made
        if event == ORDER_LOST:
            return NO_ORDER, math.nan, trajectories, steps
        if event == TOPPLED:
            return SPLIT, math.nan, trajectories, steps
        in_air = event == IN_AIR
        ib = ixb
        tb = txb
        mixable = at > kb and code != TURNED_BACK
        if floor >= 0:
            if ib < floor:
                ib = floor
                tb = 0.0
                mixable = False
            if ia < floor:
                ia = floor
                ta = 0.0
    return SPLIT, math.nan, trajectories, steps
