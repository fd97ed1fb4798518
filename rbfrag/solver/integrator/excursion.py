"""One excursion of one block, from a given state to the event that ends it.

The search for critical values runs many short pieces of motion with the same kernel; a
piece here has no error estimate, no peak and no history, only what happens to the block.
A position in a record is a pair (interval i, fraction tau in [0, 1]); node i is (i, 0).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.spans import span_step
from rbfrag.solver.integrator.taylor import (
    bracketed_root,
    fill_coefficients,
    lean_step,
    rotation,
    turn,
    value,
)

FloatArray = NDArray[np.float64]

IMPACT, TOPPLED, IN_AIR, STOPPED, ORDER_LOST = 0, 1, 2, 3, 4

ORDER = 8


@kernel
def rest_state(kr: float, linear: bool) -> tuple[float, float]:
    """Return sin and cos of the critical angle (linear: the angle and 1)."""
    if linear:
        return kr, 1.0
    c = 1.0 / math.sqrt(1.0 + kr * kr)
    return kr * c, c


@kernel
def first_touch(theta: float, u: FloatArray, theta_end: float, u_end: float, v_end: float) -> float:
    """Fraction of a step at which theta returns to 0, or -1."""
    v_start = u[1]
    if theta_end > 0.0:
        # theta is above its ends where it is concave, above its tangents where it is convex
        if v_start < 0.0 and v_end < 0.0:
            return -1.0
        if v_start > 0.0 and v_end > 0.0 and max(theta + u[0], theta_end - u_end) > 0.0:
            return -1.0
    u_start = u[0] if u[0] != 0.0 else v_start
    first = -1.0
    second = -1.0
    if (v_start > 0.0 and v_end < 0.0) or (v_start < 0.0 and v_end > 0.0):
        extremum = bracketed_root(2, theta, u, ORDER, 0.0, 1.0)
        u_mid = value(u, ORDER, extremum)
        if (u_start > 0.0 and u_mid <= 0.0) or (u_start < 0.0 and u_mid >= 0.0):
            first = bracketed_root(1, theta, u, ORDER, 0.0, extremum)
        if (u_mid > 0.0 and u_end <= 0.0) or (u_mid < 0.0 and u_end >= 0.0):
            second = bracketed_root(1, theta, u, ORDER, extremum, 1.0)
    elif (u_start > 0.0 and u_end <= 0.0) or (u_start < 0.0 and u_end >= 0.0):
        first = bracketed_root(1, theta, u, ORDER, 0.0, 1.0)
    falling = u_start <= 0.0
    left = 0.0
    theta_left = theta
    for stretch in range(3):
        right = 1.0
        if stretch == 0:
            if first < 0.0:
                continue
            right = first
        elif stretch == 1:
            if second < 0.0:
                continue
            right = second
        theta_right = theta_end if stretch == 2 else rotation(theta, u, ORDER, right)
        if falling and theta_right <= 0.0:
            if theta_left <= 0.0:
                return left
            return bracketed_root(0, theta, u, ORDER, left, right)
        falling = not falling
        left = right
        theta_left = theta_right
    return -1.0


@kernel
def order_lost(
    a0: float,
    da: float,
    w0: float,
    dw: float,
    s0: float,
    c0: float,
    s1: float,
    c1: float,
    turned: float,
    tangent: float,
) -> bool:
    """Return whether D may be negative between the states of one step and tan(phi) = tangent."""
    a1 = a0 + da
    w1 = w0 + dw
    least = min(
        min(a0 * s0 + w0 * c0, a1 * s0 + w1 * c0), min(a0 * s1 + w0 * c1, a1 * s1 + w1 * c1)
    )
    # phi leaves the range of its ends by less than it can turn in the step
    slack = (abs(a0) + abs(da) + abs(w0) + abs(dw)) * turned
    return least < slack or min(a0 * tangent + w0, a1 * tangent + w1) < 0.0 or min(c0, c1) <= 0.0


@kernel
def integrate_excursion(
    g: Ground,
    kr: float,
    i: int,
    tau: float,
    theta: float,
    rate: float,
    s: float,
    c: float,
    lifting: bool,
    stop_i: int,
    stop_tau: float,
    touch: bool,
    check: int,
    kr_other: float,
) -> tuple[int, int, float, float, float, float, float, int]:
    """Integrate an excursion from (i, tau) until the block impacts, topples or the stop comes.

    Args:
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g], shape (n,).
        w: 1 + k_v at the nodes, shape (n,).
        tail_min_q: least k_h/(1 + k_v) from each node on, shape (n,).
        p: frequency parameter [1/s].
        ph_max: greatest p·h of one step.
        linear: the linear model.
        kr: rocking acceleration coefficient.
        i: interval of the start.
        tau: fraction of it.
        theta: rotation at the start [rad].
        rate: theta'/p at the start.
        s: sin(theta_c - theta) at the start.
        c: cos(theta_c - theta) at the start.
        lifting: theta >= 0, theta' >= 0 and q >= kr at the start: until q next falls below
            kr the rotation rate cannot become negative, so that no impact is looked for.
        stop_i: interval of the stop; n - 1 for none.
        stop_tau: fraction of it.
        touch: False continues below theta = 0 (a virtual motion).
        check: 0 to trust that D = k_h sin(phi) + (1 + k_v) cos(phi) >= 0; 1 to check it on the
            way between this motion and a block with `kr_other` at rest; 2 between this motion
            and the border of the irrecoverable states.
        kr_other: see `check`.

    Returns:
        Event, interval, fraction, theta, theta'/p, s, c there, and the steps taken.
    """
    interval_s = g.interval_s
    k_h = g.k_h
    w = g.w
    tail_min_q = g.tail_min_q
    p = g.p
    ph_max = g.ph_max
    linear = g.linear
    u = g.u
    us = g.us
    uc = g.uc
    last = k_h.size - 1
    steps = 0
    ph_now = -1.0
    per_ph = 0.0
    u_now = 0.0
    use_spans = touch and check == 0 and g.span_length.size > 0
    while i < last and (i < stop_i or (i == stop_i and tau < stop_tau)):
        if use_spans and tau == 0.0 and i % g.span_length[g.span_length.size - 1] == 0:
            spanned = False
            for level in range(g.span_length.size):
                length = g.span_length[level]
                if i % length != 0 or i + length > stop_i:
                    continue
                row = g.span_row[level] + i // length
                ph = p * g.spans[row, 0]
                if not 0.0 < ph <= g.span_ph:
                    continue
                # |theta''| <= p² (|a| + w): the block cannot touch down in this span
                if theta + min(ph * rate, 0.0) - 0.5 * ph * ph * g.spans[row, 1] <= 0.0:
                    continue
                turned, u_end = span_step(g.spans, row, ph * rate, ph, s, c)
                steps += 1
                theta += turned
                s, c = turn(s, c, turned)
                rate = u_end / ph
                lifting = False
                ph_now = -1.0
                i += length
                spanned = True
                break
            if spanned:
                if rate > 0.0 and s < 0.0 and s < c * tail_min_q[i]:
                    return TOPPLED, i, 0.0, theta, rate, s, c, steps
                continue
        end = 1.0
        if i == stop_i and stop_tau < 1.0:
            end = stop_tau
        k0 = k_h[i]
        k1 = k_h[i + 1]
        w0 = w[i]
        w1 = w[i + 1]
        if lifting and k1 - kr * w1 < 0.0:
            lifting = False
        part = end - tau
        ph = p * interval_s[i] * part
        if ph > 0.0:
            pieces = 1
            if ph > ph_max:
                pieces = math.ceil(ph / ph_max)
                part /= pieces
                ph /= pieces
            da = (k1 - k0) * part
            dw = (w1 - w0) * part
            for piece in range(pieces):
                at = tau + piece * part
                a0 = k0 + (k1 - k0) * at
                v0 = w0 + (w1 - w0) * at
                steps += 1
                if ph != ph_now:
                    ph_now = ph
                    per_ph = 1.0 / ph
                    u_now = ph * rate
                if linear:
                    us[0] = s
                    uc[0] = c
                    u[0] = u_now
                    fill_coefficients(u, us, uc, ORDER, ph * ph, a0, da, v0, dw, True)
                    turned, u_end, v_end = 0.0, 0.0, 0.0
                    for k in range(ORDER, 0, -1):
                        turned += u[k] / (k + 1)
                        u_end += u[k]
                        v_end += k * u[k]
                    turned += u[0]
                    u_end += u[0]
                else:
                    turned, u_end, v_end = lean_step(u, u_now, ph, s, c, a0, da, v0, dw)
                theta_end = theta + turned
                if lifting:
                    theta_end = max(theta_end, 0.0)
                    u_end = max(u_end, 0.0)
                elif touch:
                    look = theta_end <= 0.0
                    u_start = u[0]
                    v_start = u[1]
                    if u_start > 0.0 and u_end > 0.0:
                        look = look or (v_start < 0.0 and v_end > 0.0 and u_start + v_start <= 0.0)
                    elif u_start < 0.0 and u_end < 0.0:
                        look = look or (v_start > 0.0 and v_end < 0.0 and u_start + v_start >= 0.0)
                    else:
                        look = True
                    if look:
                        x = first_touch(theta, u, theta_end, u_end, v_end)
                        if x >= 0.0:
                            rate = min(value(u, ORDER, x) / ph, 0.0)
                            s, c = rest_state(kr, linear)
                            return IMPACT, i, min(at + part * x, 1.0), 0.0, rate, s, c, steps
                theta = theta_end
                if linear:
                    s -= turned
                    rate = u_end * per_ph
                    u_now = u_end
                else:
                    s_end, c_end = turn(s, c, turned)
                    if check > 0:
                        tangent = kr_other if check == 1 else tail_min_q[i]
                        if order_lost(
                            a0, da, v0, dw, s, c, s_end, c_end,
                            ph * (abs(rate) + abs(u_end * per_ph)), tangent,
                        ):  # fmt: skip
                            return ORDER_LOST, i, at, theta, rate, s, c, steps
                    s = s_end
                    c = c_end
                    rate = u_end * per_ph
                    u_now = u_end
                if s < 0.0 and rate > 0.0 and piece < pieces - 1 and s < c * tail_min_q[i]:
                    # in a long interval the block could swing right round before its end
                    return TOPPLED, i, at + part, theta, rate, s, c, steps
        if end < 1.0:
            return STOPPED, i, end, theta, rate, s, c, steps
        i += 1
        tau = 0.0
        if rate > 0.0 and s < 0.0 and s < c * tail_min_q[i]:
            return TOPPLED, i, tau, theta, rate, s, c, steps
    if i < last or stop_i < last:
        return STOPPED, i, tau, theta, rate, s, c, steps
    half = s if linear else 2.0 * math.sin(0.5 * math.atan2(s, c))
    if rate > half:
        return TOPPLED, i, tau, theta, rate, s, c, steps
    return IN_AIR, i, tau, theta, rate, s, c, steps
