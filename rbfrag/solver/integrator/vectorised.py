"""Many runs side by side: their steps in the lanes of vector instructions.

A step of one run waits for the step before it, and leaves a processor idle most of the time. Here
up to `LANES` runs over one record take each step together. Only the plain step of a moving block
is taken so; whatever else happens in an interval (a start, a peak, a touch, a jump, the end of the
record) is left to :func:`rbfrag.solver.integrator.single_run.run_toppling`, which goes through
that interval
and hands the run back. Every operation is that of the single run, in the same order, so that the
results are equal bit for bit.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.compiled import fused_kernel, kernel
from rbfrag.solver.integrator.single_run import (
    AT_INTERVAL,
    COS,
    DRIFT,
    ERROR,
    PEAK,
    PENDING,
    RATE,
    SAMPLES,
    SIN,
    STARTED,
    STATE_SIZE,
    STEPS,
    THETA,
    TO_THE_END,
    TOPPLED,
    run_toppling,
)
from rbfrag.solver.integrator.taylor import MACHINE_EPSILON, ORDER, SMALL_TURN, series8, small_turn

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LANES = 32

FEW = 3
"""Number of runs that no longer pay for a vector step."""

# rows of what a step takes ...
_PH, _S, _C, _A0, _DA, _W0, _DW, _THETA, _RATE, _ERROR, _DRIFT, _PEAK, _LEAST, _APART = range(14)
ROWS_IN = 14

# ... and of what it gives
_TURNED, _U0, _U_END, _V_END, _U1, _U6, _U7, _U8, _S_END, _C_END, _ALONE, _FALLS = range(12)
ROWS_OUT = 12


@fused_kernel
def _steps(x: FloatArray, y: FloatArray, lanes: int) -> None:
    """Take one step of order 8 in every lane: `step8` and `turn` of `taylor`."""
    for j in range(lanes):
        ph = x[_PH * LANES + j]
        u0 = ph * x[_RATE * LANES + j]
        s0 = x[_S * LANES + j]
        c0 = x[_C * LANES + j]
        a0 = x[_A0 * LANES + j]
        da = x[_DA * LANES + j]
        w0 = x[_W0 * LANES + j]
        dw = x[_DW * LANES + j]
        turned, u_end, v_end, u1, _, _, _, _, u6, u7, u8 = series8(u0, ph, s0, c0, a0, da, w0, dw)
        s_end, c_end = small_turn(s0, c0, turned)
        y[_TURNED * LANES + j] = turned
        y[_U0 * LANES + j] = u0
        y[_U_END * LANES + j] = u_end
        y[_V_END * LANES + j] = v_end
        y[_U1 * LANES + j] = u1
        y[_U6 * LANES + j] = u6
        y[_U7 * LANES + j] = u7
        y[_U8 * LANES + j] = u8
        y[_S_END * LANES + j] = s_end
        y[_C_END * LANES + j] = c_end


@kernel
def _judge(x: FloatArray, y: FloatArray, lanes: int) -> None:
    """Carry the error estimates on; go on where the step was a plain one, mark the others."""
    for j in range(lanes):
        ph = x[_PH * LANES + j]
        s0 = x[_S * LANES + j]
        c0 = x[_C * LANES + j]
        a_size = abs(x[_A0 * LANES + j]) + abs(x[_DA * LANES + j])
        w_size = abs(x[_W0 * LANES + j]) + abs(x[_DW * LANES + j])
        turned = y[_TURNED * LANES + j]
        u_end = y[_U_END * LANES + j]
        theta = x[_THETA * LANES + j]
        theta_end = theta + turned
        stiffness = w_size * abs(c0)
        stiffness += a_size * abs(s0)
        growth = ph * max(1.0, stiffness)
        omitted = 16.0 * ph * (a_size + w_size) / (ORDER * (ORDER + 1))
        truncation = omitted * (abs(y[_U8 * LANES + j]) + abs(y[_U7 * LANES + j]))
        truncation += abs(y[_U6 * LANES + j] * turned) / ph
        drive = a_size * abs(c0) + w_size * (abs(s0) + abs(turned))
        rounding = MACHINE_EPSILON * (
            2.0 * (abs(theta_end) + abs(x[_RATE * LANES + j]) + abs(s0)) + 4.0 * ph * drive
        )
        grown = 1.0 + growth * (1.0 + growth * (0.5 + growth * (1.0 / 6.0 + growth * 0.06)))
        error = x[_ERROR * LANES + j] * grown + truncation + rounding
        drift = x[_DRIFT * LANES + j]
        drift += ph * error + truncation + 2.0 * MACHINE_EPSILON * abs(theta_end)
        u_start = y[_U0 * LANES + j]
        v_start = y[_U1 * LANES + j]
        v_end = y[_V_END * LANES + j]
        up = (u_start > 0.0) & (u_end > 0.0)
        down = (u_start < 0.0) & (u_end < 0.0)
        dips = (v_start < 0.0) & (v_end > 0.0) & (u_start + v_start <= 0.0)
        rises = (v_start > 0.0) & (v_end < 0.0) & (u_start + v_start >= 0.0)
        rounds = (u_start > 0.0) & (u_end <= 0.0) & (v_start < 0.0) & (v_end < 0.0)
        rounds = rounds & (min(theta + u_start, theta_end - u_end) <= x[_PEAK * LANES + j])
        bounces = (u_start < 0.0) & (u_end >= 0.0) & (v_start > 0.0) & (v_end > 0.0)
        bounces = bounces & (max(theta + u_start, theta_end - u_end) > drift)
        plain = (up & ~dips) | (down & ~rises) | rounds | bounces
        alone = (theta_end <= 0.0) | ~plain | (growth > 1.0) | (abs(turned) > SMALL_TURN)
        alone = alone | (x[_APART * LANES + j] > 0.0)
        rate = u_end / ph
        s_end = y[_S_END * LANES + j]
        c_end = y[_C_END * LANES + j]
        least = x[_LEAST * LANES + j]
        beyond = (rate > error) & (s_end < 0.0)
        falls = beyond & (c_end * least - s_end > error * (1.0 - least))
        y[_ALONE * LANES + j] = 1.0 if alone else 0.0
        y[_FALLS * LANES + j] = 1.0 if falls else 0.0
        x[_THETA * LANES + j] = theta if alone else theta_end
        x[_RATE * LANES + j] = x[_RATE * LANES + j] if alone else rate
        x[_S * LANES + j] = s0 if alone else s_end
        x[_C * LANES + j] = c0 if alone else c_end
        x[_ERROR * LANES + j] = x[_ERROR * LANES + j] if alone else error
        x[_DRIFT * LANES + j] = x[_DRIFT * LANES + j] if alone else drift


@kernel
def _enter(
    states: FloatArray,
    at: IntArray,
    piece: IntArray,
    length_s: FloatArray,
    x: FloatArray,
    lane: int,
) -> None:
    """Take a run into a lane."""
    at[lane] = int(states[lane, AT_INTERVAL])
    piece[lane] = 0
    length_s[lane] = -1.0
    x[_THETA * LANES + lane] = states[lane, THETA]
    x[_RATE * LANES + lane] = states[lane, RATE]
    x[_S * LANES + lane] = states[lane, SIN]
    x[_C * LANES + lane] = states[lane, COS]
    x[_ERROR * LANES + lane] = states[lane, ERROR]
    x[_DRIFT * LANES + lane] = states[lane, DRIFT]
    x[_PEAK * LANES + lane] = states[lane, PEAK]


@kernel
def _leave(states: FloatArray, at: IntArray, x: FloatArray, lane: int) -> None:
    """Put down the state of a lane at the beginning of its interval."""
    states[lane, AT_INTERVAL] = at[lane]
    states[lane, THETA] = x[_THETA * LANES + lane]
    states[lane, RATE] = x[_RATE * LANES + lane]
    states[lane, SIN] = x[_S * LANES + lane]
    states[lane, COS] = x[_C * LANES + lane]
    states[lane, ERROR] = x[_ERROR * LANES + lane]
    states[lane, DRIFT] = x[_DRIFT * LANES + lane]


@kernel
def _by_itself(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    jump_node: int,
    kr: FloatArray,
    p: FloatArray,
    ph_max: float,
    history: FloatArray,
    state: FloatArray,
    work: FloatArray,
    j: int,
    whole: IntArray,
    real: FloatArray,
) -> bool:
    """Carry a run on by the single kernel; whether it is to go on in a lane, else it is written."""
    outcome, peak, started_s, verdict_s, error, steps, moved, _ = run_toppling(
        time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr[j], p[j], False,
        ORDER, ph_max, history, state, work,
    )  # fmt: skip
    if outcome == PENDING:
        return True
    whole[0, j] = outcome
    whole[1, j] = steps
    whole[2, j] = moved
    real[0, j] = peak
    real[1, j] = started_s
    real[2, j] = verdict_s
    real[3, j] = error
    return False


@kernel
def run_in_lanes(
    time_s: FloatArray,
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    q: FloatArray,
    tail_min_q: FloatArray,
    block_max_q: FloatArray,
    jump_node: int,
    kr: FloatArray,
    p: FloatArray,
    ph_max: float,
    whole: IntArray,
    real: FloatArray,
) -> None:
    """Run blocks over one record, order 8, side by side.


    Args:
        time_s: as in :func:`rbfrag.solver.integrator.single_run.run_toppling`; likewise up to
            `jump_node`.
        kr: rocking acceleration coefficients, shape (m,).
        p: frequency parameters [1/s], shape (m,).
        ph_max: greatest p·h of one step.
        whole: filled with outcome, steps and samples moved, shape (3, m).
        real: filled with peak, start, verdict and error, shape (4, m).
    """
    last = min(k_h.size, jump_node) - 1
    no_history = np.empty((4, 0))
    work = np.empty((3, ORDER + 1))
    x = np.ones(ROWS_IN * LANES)
    y = np.zeros(ROWS_OUT * LANES)
    states = np.zeros((LANES, STATE_SIZE))
    job = np.empty(LANES, dtype=np.int64)
    at = np.zeros(LANES, dtype=np.int64)  # interval
    length_s = np.full(LANES, -1.0)  # of the interval that the next three are for
    piece = np.zeros(LANES, dtype=np.int64)
    pieces = np.ones(LANES, dtype=np.int64)
    part = np.ones(LANES)
    next_job = 0
    lanes = 0
    while True:
        while lanes < LANES and next_job < kr.size:
            # a new run, up to where it first moves at a node
            states[lanes, AT_INTERVAL] = -1.0
            job[lanes] = next_job
            next_job += 1
            if _by_itself(
                time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                ph_max, no_history, states[lanes], work, job[lanes], whole, real,
            ):  # fmt: skip
                _enter(states, at, piece, length_s, x, lanes)
                lanes += 1
        if lanes <= FEW:
            for lane in range(lanes):
                if piece[lane] == 0:
                    _leave(states, at, x, lane)
                states[lane, TO_THE_END] = 1.0
                _by_itself(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                    ph_max, no_history, states[lane], work, job[lane], whole, real,
                )  # fmt: skip
            return
        for lane in range(lanes):
            i = at[lane]
            if i >= last or interval_s[i] == 0.0:
                x[_APART * LANES + lane] = 1.0
                continue
            x[_APART * LANES + lane] = 0.0
            if interval_s[i] != length_s[lane]:
                length_s[lane] = interval_s[i]
                left = p[job[lane]] * interval_s[i]
                pieces[lane] = max(1, math.ceil(left / ph_max))
                part[lane] = 1.0 / pieces[lane]
                x[_PH * LANES + lane] = left / pieces[lane]
            dk = k_h[i + 1] - k_h[i]
            dv = w[i + 1] - w[i]
            if pieces[lane] == 1:
                x[_A0 * LANES + lane] = k_h[i]
                x[_DA * LANES + lane] = dk
                x[_W0 * LANES + lane] = w[i]
                x[_DW * LANES + lane] = dv
                x[_LEAST * LANES + lane] = tail_min_q[i + 1]
                continue
            if piece[lane] == 0:
                _leave(states, at, x, lane)
            start = piece[lane] * part[lane]
            x[_A0 * LANES + lane] = k_h[i] + dk * start
            x[_DA * LANES + lane] = dk * part[lane]
            x[_W0 * LANES + lane] = w[i] + dv * start
            x[_DW * LANES + lane] = dv * part[lane]
            x[_LEAST * LANES + lane] = tail_min_q[i + (piece[lane] + 1) // pieces[lane]]
        padded = min(LANES, (lanes + 7) // 8 * 8)
        _steps(x, y, padded)
        _judge(x, y, padded)
        lane = 0
        while lane < lanes:
            falls = y[_FALLS * LANES + lane] > 0.0
            ended = False
            if y[_ALONE * LANES + lane] > 0.0 or (falls and piece[lane] < pieces[lane] - 1):
                if pieces[lane] == 1 or x[_APART * LANES + lane] > 0.0:
                    _leave(states, at, x, lane)
                ended = not _by_itself(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                    ph_max, no_history, states[lane], work, job[lane], whole, real,
                )  # fmt: skip
                if not ended:
                    _enter(states, at, piece, length_s, x, lane)
            elif piece[lane] < pieces[lane] - 1:
                piece[lane] += 1
            else:
                piece[lane] = 0
                at[lane] += 1
                states[lane, STEPS] += pieces[lane]
                states[lane, SAMPLES] += 1.0
                if falls:
                    j = job[lane]
                    whole[0, j] = TOPPLED
                    whole[1, j] = int(states[lane, STEPS])
                    whole[2, j] = int(states[lane, SAMPLES])
                    real[0, j] = math.nan
                    real[1, j] = states[lane, STARTED]
                    real[2, j] = time_s[at[lane]]
                    real[3, j] = x[_ERROR * LANES + lane]
                    ended = True
            while ended and next_job < kr.size:
                states[lane, AT_INTERVAL] = -1.0
                job[lane] = next_job
                next_job += 1
                if _by_itself(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                    ph_max, no_history, states[lane], work, job[lane], whole, real,
                ):  # fmt: skip
                    _enter(states, at, piece, length_s, x, lane)
                    ended = False
            if ended:
                # the last lane takes the place of the one that is done
                lanes -= 1
                for row in range(ROWS_IN):
                    x[row * LANES + lane] = x[row * LANES + lanes]
                y[_ALONE * LANES + lane] = y[_ALONE * LANES + lanes]
                y[_FALLS * LANES + lane] = y[_FALLS * LANES + lanes]
                states[lane] = states[lanes]
                job[lane] = job[lanes]
                at[lane] = at[lanes]
                length_s[lane] = length_s[lanes]
                piece[lane] = piece[lanes]
                pieces[lane] = pieces[lanes]
                part[lane] = part[lanes]
            else:
                lane += 1
