"""Kernel of the toppling block: one run over one record.

    moving: theta'' = p² [k_h cos(theta_c - theta) - (1 + k_v) sin(theta_c - theta)]
    rest:   theta = theta' = 0 while k_h <= (1 + k_v) k_r

theta is the forward rotation about the toe; theta_c = atan(k_r). In the linear model, kept
for verification against closed forms, sin is replaced by its argument, cos by 1, and
theta_c = k_r. Events: lift-off (an upward crossing of the threshold), impact (theta back
to 0, without rebound; motion restarts at once if the threshold is exceeded), and the
verdict "irrecoverable". After the last sample the ground is at rest and the verdict is
closed-form, by energy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import BLOCK
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.events import examine_step
from rbfrag.solver.integrator.taylor import (
    MACHINE_EPSILON,
    fill_coefficients,
    step8,
    turn,
    value,
)

FloatArray = NDArray[np.float64]

STABLE, TOPPLED, UNDETERMINED, JUMP = 0, 1, 2, 3

PENDING = 4
"""Outcome of a run that is handed over before its end: its state is to be carried on."""

AT_INTERVAL, THETA, RATE, SIN, COS, ERROR, DRIFT = 0, 1, 2, 3, 4, 5, 6
PEAK, PEAK_ERROR, STARTED, LOST, STEPS, SAMPLES = 7, 8, 9, 10, 11, 12
TO_THE_END = 13
STATE_SIZE = 14
"""Fields of the state of a run that moves at a node. An interval below 0 means the beginning;
TO_THE_END above 0 that the run is not handed over again."""


class Run(NamedTuple):
    """What the kernel returns.

    `peak_rad` is NaN unless the block stays; times are NaN where nothing happened.
    """

    outcome: int
    peak_rad: float
    started_s: float
    verdict_s: float
    error_rad: float
    steps: int
    samples_moved: int
    history_length: int


@kernel
def next_lifting_node(
    q: FloatArray, block_max_q: FloatArray, start: int, stop: int, kr: float
) -> int:
    """First node in [start, stop) with q > kr, or `stop`; skips rest by block maxima."""
    i = start
    while i < stop:
        if i % BLOCK == 0 and block_max_q[i // BLOCK] <= kr:
            i += BLOCK
        elif q[i] > kr:
            return i
        else:
            i += 1
    return stop


@kernel
def _exponential(x: float) -> float:
    """Upper bound of exp(x) for 0 <= x, close for the small x of one step."""
    if x > 1.0:
        return math.exp(x)
    return 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * 0.06)))


@kernel
def run_toppling(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    jump_node: int,
    kr: float,
    p: float,
    linear: bool,
    order: int,
    ph_max: float,
    history: FloatArray,
    state: FloatArray,
    work: FloatArray,
) -> tuple[int, float, float, float, float, int, int, int]:
    """Run one block over one record; the fields of :class:`Run` in order.

    Args:
        time_s: node times [s], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g].
        w: 1 + k_v at the nodes.
        q: k_h/(1 + k_v) at the nodes.
        tail_min_q: least q from each node on, rest after the record included.
        block_max_q: greatest q of each block of nodes.
        jump_node: first node with 1 + k_v <= 0, or n.
        kr: rocking acceleration coefficient k_r (linear model: critical angle [rad]).
        p: frequency parameter [1/s].
        linear: the linear verification model.
        order: degree of the Taylor step.
        ph_max: greatest p·h of one step.
        history: shape (4, m) to be filled with time, theta, theta' and node (-1 for an event
            between nodes); (4, 0) for none. With a
            history the run goes on after the verdict until the block lies beyond 90 degrees.
        state: shape (STATE_SIZE,) to go on from there and to hand over with PENDING as soon as
            the block moves at a node beyond; (0,) to run to the end.
        work: work, shape (3, order + 1).
    """
    n = k_h.size
    last = min(n, jump_node) - 1
    if linear:
        theta_c = kr
        s_rest = kr
        c_rest = 1.0
    else:
        theta_c = math.atan(kr)
        c_rest = 1.0 / math.sqrt(1.0 + kr * kr)
        s_rest = kr * c_rest
    u = work[0]
    s = work[1]
    c = work[2]

    room = history.shape[1]
    filled = 0
    started_s = math.nan
    verdict_s = math.nan
    peak = 0.0
    peak_error = 0.0
    steps = 0
    moved = 0
    counted = -1
    decided = False
    verdict_error = 0.0

    i = 0
    tau = 0.0  # position inside interval i
    moving = False
    just_lifted = False  # starting at an upward crossing: no impact is possible in the first step
    theta = 0.0
    rate = 0.0  # theta'/p
    error = 0.0  # bound on |error of theta| + |error of theta'/p|
    drift = 0.0  # closer bound on the error of theta alone, which times an impact
    lost = False  # whether an impact may as well have been a fall: the error hid the difference
    hands_over = state.size > 0 and state[TO_THE_END] <= 0.0
    entered = -1  # interval at which a state was taken over
    if state.size > 0 and state[AT_INTERVAL] >= 0.0:
        i = int(state[AT_INTERVAL])
        entered = i
        moving = True
        theta = state[THETA]
        rate = state[RATE]
        s[0] = state[SIN]
        c[0] = state[COS]
        error = state[ERROR]
        drift = state[DRIFT]
        peak = state[PEAK]
        peak_error = state[PEAK_ERROR]
        started_s = state[STARTED]
        lost = state[LOST] > 0.0
        steps = int(state[STEPS])
        moved = int(state[SAMPLES])

    while i < last:
        if hands_over and moving and tau == 0.0 and not just_lifted and i > entered:
            state[AT_INTERVAL] = i
            state[THETA] = theta
            state[RATE] = rate
            state[SIN] = s[0]
            state[COS] = c[0]
            state[ERROR] = error
            state[DRIFT] = drift
            state[PEAK] = peak
            state[PEAK_ERROR] = peak_error
            state[STARTED] = started_s
            state[LOST] = 1.0 if lost else 0.0
            state[STEPS] = steps
            state[SAMPLES] = moved
            return PENDING, math.nan, started_s, math.nan, error, steps, moved, 0
        g0 = k_h[i] - w[i] * kr
        g1 = k_h[i + 1] - w[i + 1] * kr
        if not moving and interval_s[i] == 0.0:  # nothing lifts in no time
            i += 1
            tau = 0.0
            continue
        if not moving:
            if tau == 0.0:
                if g0 > 0.0:
                    moving = True
                elif g1 <= 0.0:
                    i = next_lifting_node(q, block_max_q, i + 2, last + 1, kr) - 1
                    continue
                else:
                    tau = -g0 / (g1 - g0)
                    moving = True
                    just_lifted = True
            elif g1 > 0.0:  # at rest inside the interval, after an impact
                tau = min(max(tau, -g0 / (g1 - g0)), 1.0)
                moving = True
                just_lifted = True
            else:
                i += 1
                tau = 0.0
                continue
            theta = 0.0
            rate = 0.0
            s[0] = s_rest
            c[0] = c_rest
            if math.isnan(started_s):
                started_s = time_s[i] + tau * interval_s[i]
            if filled < room:
                history[0, filled] = time_s[i] + tau * interval_s[i]
                history[1, filled] = 0.0
                history[2, filled] = 0.0
                history[3, filled] = -1.0
                filled += 1

        left = interval_s[i] * (1.0 - tau)
        impact_at = -1.0
        if left <= 0.0:
            # a jump, or a start at the very end of the interval: what follows decides
            moving = theta != 0.0 or rate != 0.0
            just_lifted = False
        else:
            if i != counted:
                counted = i
                moved += 1
            pieces = max(1, math.ceil(p * left / ph_max))
            part = (1.0 - tau) / pieces
            ph = p * left / pieces
            da = (k_h[i + 1] - k_h[i]) * part
            dw = (w[i + 1] - w[i]) * part
            for piece in range(pieces):
                at = tau + piece * part
                a0 = k_h[i] + (k_h[i + 1] - k_h[i]) * at
                w0 = w[i] + (w[i + 1] - w[i]) * at
                steps += 1
                if order == 8 and not linear:
                    turned, u_end, v_end = step8(u, ph * rate, ph, s[0], c[0], a0, da, w0, dw)
                else:
                    u[0] = ph * rate
                    fill_coefficients(u, s, c, order, ph * ph, a0, da, w0, dw, linear)
                    turned, u_end, v_end = 0.0, 0.0, 0.0
                    for k in range(order, 0, -1):
                        turned += u[k] / (k + 1)
                        u_end += u[k]
                        v_end += k * u[k]
                    turned += u[0]
                    u_end += u[0]
                theta_end = theta + turned

                a_size = abs(a0) + abs(da)
                w_size = abs(w0) + abs(dw)
                stiffness = w_size * abs(c[0])
                if not linear:
                    stiffness += a_size * abs(s[0])
                growth = ph * max(1.0, stiffness)
                # the first two omitted terms, from u[k+2] ~ (p·h)² D u[k]/((k+1)(k+2)): one
                # alone is fooled, since from rest under constant a every other one vanishes
                omitted = 16.0 * ph * (a_size + w_size) / (order * (order + 1))
                truncation = omitted * (abs(u[order]) + abs(u[order - 1]))
                if not linear:
                    # and the terms in theta³, which from rest come three places apart
                    truncation += abs(u[order - 2] * turned) / ph
                drive = a_size * abs(c[0]) + w_size * (abs(s[0]) + abs(turned))
                rounding = MACHINE_EPSILON * (
                    2.0 * (abs(theta_end) + abs(rate) + abs(s[0])) + 4.0 * ph * drive
                )
                error = error * _exponential(growth) + truncation + rounding
                drift += ph * error + truncation + 2.0 * MACHINE_EPSILON * abs(theta_end)

                if just_lifted:
                    just_lifted = False
                    if theta_end <= 0.0 or u_end <= 0.0:
                        theta_end = 0.0
                        impact_at = at + part
                else:
                    u_start = u[0]
                    v_start = u[1]
                    look = theta_end <= 0.0
                    if u_start > 0.0 and u_end > 0.0:
                        # theta may dip only if U falls and rises again; V is monotone in a step
                        look = look or (v_start < 0.0 and v_end > 0.0 and u_start + v_start <= 0.0)
                    elif u_start < 0.0 and u_end < 0.0:
                        look = look or (v_start > 0.0 and v_end < 0.0 and u_start + v_start >= 0.0)
                    elif room > 0:
                        look = True
                    elif u_start > 0.0:
                        # a peak below its two tangents: of interest if it may be the highest
                        top = min(theta + u_start, theta_end - u_end)
                        look = look or v_start >= 0.0 or v_end >= 0.0 or top > peak
                    else:
                        # a dip above its two tangents: of interest if it may touch
                        low = max(theta + u_start, theta_end - u_end)
                        look = look or v_start <= 0.0 or v_end <= 0.0 or low <= drift
                    if look:
                        x, top, top_at, low = examine_step(theta, u, order, theta_end, u_end, v_end)
                        if top > peak:
                            peak = top
                            peak_error = error
                        if top > 0.0 and filled < room:
                            history[0, filled] = time_s[i] + (at + part * top_at) * interval_s[i]
                            history[1, filled] = top
                            history[2, filled] = 0.0
                            history[3, filled] = -1.0
                            filled += 1
                        if x >= 0.0:
                            impact_at = at + part * x
                            rate = value(u, order, x) / ph
                        elif low <= drift:
                            # it may have touched after all, and lost the speed of the touch
                            error += math.sqrt(2.0 * max(g0, g1, 0.0) * c_rest * drift)
                if impact_at >= 0.0:
                    break
                theta = theta_end
                rate = u_end / ph
                if linear:
                    s[0] -= turned
                else:
                    s[0], c[0] = turn(s[0], c[0], turned)
                if piece < pieces - 1 and not decided:
                    # in a long interval the block could swing right round before its end
                    least = tail_min_q[i]
                    excess = c[0] * least - s[0]
                    if rate > error and s[0] < 0.0 and excess > error * (1.0 - least):
                        decided = True
                        verdict_s = time_s[i] + (at + part) * interval_s[i]
                        verdict_error = error
                        if room == 0:
                            return (
                                TOPPLED, math.nan, started_s, verdict_s, error, steps, moved, 0,
                            )  # fmt: skip

        if impact_at >= 0.0:
            moving = False
            stuck = impact_at <= tau
            tau = min(impact_at, 1.0)
            g = g0 + (g1 - g0) * tau
            impact = abs(rate)
            push = max(g * c_rest, 0.0)  # theta''/p² at theta = 0
            if impact <= 2.0 * error or impact * impact <= 4.0 * push * drift:
                # a graze: whether it touches at all is below the error, and if it does not it
                # keeps its speed
                error += impact + math.sqrt(2.0 * push * drift)
                lost = lost or error > 0.25 * theta_c
            elif g > 0.0:
                # motion restarts at once; only the error of its starting time is left
                late = 2.0 * drift / impact
                error = push * late
                drift = error * late
            else:
                error = 0.0
                drift = 0.0
            if filled < room:
                history[0, filled] = time_s[i] + tau * interval_s[i]
                history[1, filled] = 0.0
                history[2, filled] = 0.0
                history[3, filled] = -1.0
                filled += 1
            if stuck:
                # The threshold is exceeded by less than rounding. A falling drive leaves the
                # block at rest; a rising one starts it as an upward crossing does.
                if g1 > g0:
                    moving = True
                    just_lifted = True
                    theta = 0.0
                    rate = 0.0
                    s[0] = s_rest
                    c[0] = c_rest
                else:
                    i += 1
                    tau = 0.0
            elif g > 0.0 and tau < 1.0:
                moving = True
                theta = 0.0
                rate = 0.0
                s[0] = s_rest
                c[0] = c_rest
            elif tau >= 1.0:
                i += 1
                tau = 0.0
            continue

        i += 1
        tau = 0.0
        if filled < room:
            history[0, filled] = time_s[i]
            history[1, filled] = theta
            history[2, filled] = rate * p
            history[3, filled] = i
            filled += 1
        if not decided:
            excess = c[0] * tail_min_q[i] - s[0]
            if rate > error and s[0] < 0.0 and excess > error * (1.0 - tail_min_q[i]):
                decided = True
                verdict_s = time_s[i]
                verdict_error = error
                if room == 0:
                    return TOPPLED, math.nan, started_s, verdict_s, error, steps, moved, 0
        elif theta > theta_c + 0.5 * math.pi:
            break

    if decided:
        return TOPPLED, math.nan, started_s, verdict_s, verdict_error, steps, moved, filled
    if last < n - 1:
        verdict_s = time_s[0]
        if last >= 0:
            verdict_s = time_s[last] + interval_s[last] * w[last] / (w[last] - w[last + 1])
        return JUMP, math.nan, started_s, verdict_s, error, steps, moved, filled
    if lost:
        return UNDETERMINED, math.nan, started_s, math.nan, error, steps, moved, filled
    if not moving:
        return STABLE, peak, started_s, math.nan, peak_error, steps, moved, filled

    # Free motion after the record: energy decides.
    if linear:
        x = s[0]
        half = abs(x)
    else:
        x = math.atan2(s[0], c[0])
        half = 2.0 * abs(math.sin(0.5 * x))
    # the states that come to rest upright: the border between falling over and falling back
    margin = rate - math.copysign(half, x)
    topples = margin > 0.0
    if abs(margin) <= error:
        return UNDETERMINED, math.nan, started_s, time_s[n - 1], error, steps, moved, filled
    if topples:
        return TOPPLED, math.nan, started_s, time_s[n - 1], error, steps, moved, filled
    if rate > 0.0:
        # 1 - cos is conserved up to the kinetic energy: sin²(x_top/2) = sin²(x/2) - rate²/4
        rest = math.sqrt((half - rate) * (half + rate))
        if linear:
            x_top = rest
            amplification = (half + rate) / rest
        else:
            x_top = 2.0 * math.asin(0.5 * rest)
            amplification = (abs(math.sin(x)) + rate) / math.sin(x_top)
        if theta_c - x_top > peak:
            peak = theta_c - x_top
            peak_error = error * amplification
    return STABLE, peak, started_s, math.nan, peak_error, steps, moved, filled
