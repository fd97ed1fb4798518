"""Many runs side by side: their steps in vector instructions.

A step of one run waits for the step before it, and leaves a processor idle most of the time. Here
up to `BATCH` runs over one record take each step together. Only the plain step of a moving block
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

BATCH = 32

FEW = 3
"""Number of runs that no longer pay for a vector step."""

# rows of what a step takes ...
_PH, _S, _C, _A0, _DA, _W0, _DW, _THETA, _RATE, _ERROR, _DRIFT, _PEAK, _LEAST, _APART = range(14)
ROWS_IN = 14

# ... and of what it gives
_TURNED, _U0, _U_END, _V_END, _U1, _U6, _U7, _U8, _S_END, _C_END, _ALONE, _FALLS = range(12)
ROWS_OUT = 12


@fused_kernel
def _steps(x: FloatArray, y: FloatArray, batch: int) -> None:
    """Take one step of order 8 in every slot: `step8` and `turn` of `taylor`."""
    for j in range(batch):
        ph = x[_PH * BATCH + j]
        u0 = ph * x[_RATE * BATCH + j]
        s0 = x[_S * BATCH + j]
        c0 = x[_C * BATCH + j]
        a0 = x[_A0 * BATCH + j]
        da = x[_DA * BATCH + j]
        w0 = x[_W0 * BATCH + j]
        dw = x[_DW * BATCH + j]
        turned, u_end, v_end, u1, _, _, _, _, u6, u7, u8 = series8(u0, ph, s0, c0, a0, da, w0, dw)
        s_end, c_end = small_turn(s0, c0, turned)
        y[_TURNED * BATCH + j] = turned
        y[_U0 * BATCH + j] = u0
        y[_U_END * BATCH + j] = u_end
        y[_V_END * BATCH + j] = v_end
        y[_U1 * BATCH + j] = u1
        y[_U6 * BATCH + j] = u6
        y[_U7 * BATCH + j] = u7
        y[_U8 * BATCH + j] = u8
        y[_S_END * BATCH + j] = s_end
        y[_C_END * BATCH + j] = c_end


@kernel
def _judge(x: FloatArray, y: FloatArray, batch: int) -> None:
    """Carry the error estimates on; go on where the step was a plain one, mark the others."""
    for j in range(batch):
        ph = x[_PH * BATCH + j]
        s0 = x[_S * BATCH + j]
        c0 = x[_C * BATCH + j]
        a_size = abs(x[_A0 * BATCH + j]) + abs(x[_DA * BATCH + j])
        w_size = abs(x[_W0 * BATCH + j]) + abs(x[_DW * BATCH + j])
        turned = y[_TURNED * BATCH + j]
        u_end = y[_U_END * BATCH + j]
        theta = x[_THETA * BATCH + j]
        theta_end = theta + turned
        stiffness = w_size * abs(c0)
        stiffness += a_size * abs(s0)
        growth = ph * max(1.0, stiffness)
        omitted = 16.0 * ph * (a_size + w_size) / (ORDER * (ORDER + 1))
        truncation = omitted * (abs(y[_U8 * BATCH + j]) + abs(y[_U7 * BATCH + j]))
        truncation += abs(y[_U6 * BATCH + j] * turned) / ph
        drive = a_size * abs(c0) + w_size * (abs(s0) + abs(turned))
        rounding = MACHINE_EPSILON * (
            2.0 * (abs(theta_end) + abs(x[_RATE * BATCH + j]) + abs(s0)) + 4.0 * ph * drive
        )
        grown = 1.0 + growth * (1.0 + growth * (0.5 + growth * (1.0 / 6.0 + growth * 0.06)))
        error = x[_ERROR * BATCH + j] * grown + truncation + rounding
        drift = x[_DRIFT * BATCH + j]
        drift += ph * error + truncation + 2.0 * MACHINE_EPSILON * abs(theta_end)
        u_start = y[_U0 * BATCH + j]
        v_start = y[_U1 * BATCH + j]
        v_end = y[_V_END * BATCH + j]
        up = (u_start > 0.0) & (u_end > 0.0)
        down = (u_start < 0.0) & (u_end < 0.0)
        dips = (v_start < 0.0) & (v_end > 0.0) & (u_start + v_start <= 0.0)
        rises = (v_start > 0.0) & (v_end < 0.0) & (u_start + v_start >= 0.0)
        rounds = (u_start > 0.0) & (u_end <= 0.0) & (v_start < 0.0) & (v_end < 0.0)
        rounds = rounds & (min(theta + u_start, theta_end - u_end) <= x[_PEAK * BATCH + j])
        bounces = (u_start < 0.0) & (u_end >= 0.0) & (v_start > 0.0) & (v_end > 0.0)
        bounces = bounces & (max(theta + u_start, theta_end - u_end) > drift)
        plain = (up & ~dips) | (down & ~rises) | rounds | bounces
        alone = (theta_end <= 0.0) | ~plain | (growth > 1.0) | (abs(turned) > SMALL_TURN)
        alone = alone | (x[_APART * BATCH + j] > 0.0)
        rate = u_end / ph
        s_end = y[_S_END * BATCH + j]
        c_end = y[_C_END * BATCH + j]
        least = x[_LEAST * BATCH + j]
        beyond = (rate > error) & (s_end < 0.0)
        falls = beyond & (c_end * least - s_end > error * (1.0 - least))
        y[_ALONE * BATCH + j] = 1.0 if alone else 0.0
        y[_FALLS * BATCH + j] = 1.0 if falls else 0.0
        x[_THETA * BATCH + j] = theta if alone else theta_end
        x[_RATE * BATCH + j] = x[_RATE * BATCH + j] if alone else rate
        x[_S * BATCH + j] = s0 if alone else s_end
        x[_C * BATCH + j] = c0 if alone else c_end
        x[_ERROR * BATCH + j] = x[_ERROR * BATCH + j] if alone else error
        x[_DRIFT * BATCH + j] = x[_DRIFT * BATCH + j] if alone else drift


@kernel
def _enter(
    states: FloatArray,
    at: IntArray,
    piece: IntArray,
    length_s: FloatArray,
    x: FloatArray,
    slot: int,
) -> None:
    """Take a run into a slot."""
    at[slot] = int(states[slot, AT_INTERVAL])
    piece[slot] = 0
    length_s[slot] = -1.0
    x[_THETA * BATCH + slot] = states[slot, THETA]
    x[_RATE * BATCH + slot] = states[slot, RATE]
    x[_S * BATCH + slot] = states[slot, SIN]
    x[_C * BATCH + slot] = states[slot, COS]
    x[_ERROR * BATCH + slot] = states[slot, ERROR]
    x[_DRIFT * BATCH + slot] = states[slot, DRIFT]
    x[_PEAK * BATCH + slot] = states[slot, PEAK]


@kernel
def _leave(states: FloatArray, at: IntArray, x: FloatArray, slot: int) -> None:
    """Put down the state of a slot at the beginning of its interval."""
    states[slot, AT_INTERVAL] = at[slot]
    states[slot, THETA] = x[_THETA * BATCH + slot]
    states[slot, RATE] = x[_RATE * BATCH + slot]
    states[slot, SIN] = x[_S * BATCH + slot]
    states[slot, COS] = x[_C * BATCH + slot]
    states[slot, ERROR] = x[_ERROR * BATCH + slot]
    states[slot, DRIFT] = x[_DRIFT * BATCH + slot]


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
    """Carry a run on by the single kernel; whether it is to go on in a slot, else it is written."""
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
def run_batch(
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
    x = np.ones(ROWS_IN * BATCH)
    y = np.zeros(ROWS_OUT * BATCH)
    states = np.zeros((BATCH, STATE_SIZE))
    job = np.empty(BATCH, dtype=np.int64)
    at = np.zeros(BATCH, dtype=np.int64)  # interval
    length_s = np.full(BATCH, -1.0)  # of the interval that the next three are for
    piece = np.zeros(BATCH, dtype=np.int64)
    pieces = np.ones(BATCH, dtype=np.int64)
    part = np.ones(BATCH)
    next_job = 0
    batch = 0
    while True:
        while batch < BATCH and next_job < kr.size:
            # a new run, up to where it first moves at a node
            states[batch, AT_INTERVAL] = -1.0
            job[batch] = next_job
            next_job += 1
            if _by_itself(
                time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                ph_max, no_history, states[batch], work, job[batch], whole, real,
            ):  # fmt: skip
                _enter(states, at, piece, length_s, x, batch)
                batch += 1
        if batch <= FEW:
            for slot in range(batch):
                if piece[slot] == 0:
                    _leave(states, at, x, slot)
                states[slot, TO_THE_END] = 1.0
                _by_itself(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                    ph_max, no_history, states[slot], work, job[slot], whole, real,
                )  # fmt: skip
            return
        for slot in range(batch):
            i = at[slot]
            if i >= last or interval_s[i] == 0.0:
                x[_APART * BATCH + slot] = 1.0
                continue
            x[_APART * BATCH + slot] = 0.0
            if interval_s[i] != length_s[slot]:
                length_s[slot] = interval_s[i]
                left = p[job[slot]] * interval_s[i]
                pieces[slot] = max(1, math.ceil(left / ph_max))
                part[slot] = 1.0 / pieces[slot]
                x[_PH * BATCH + slot] = left / pieces[slot]
            dk = k_h[i + 1] - k_h[i]
            dv = w[i + 1] - w[i]
            if pieces[slot] == 1:
                x[_A0 * BATCH + slot] = k_h[i]
                x[_DA * BATCH + slot] = dk
                x[_W0 * BATCH + slot] = w[i]
                x[_DW * BATCH + slot] = dv
                x[_LEAST * BATCH + slot] = tail_min_q[i + 1]
                continue
            if piece[slot] == 0:
                _leave(states, at, x, slot)
            start = piece[slot] * part[slot]
            x[_A0 * BATCH + slot] = k_h[i] + dk * start
            x[_DA * BATCH + slot] = dk * part[slot]
            x[_W0 * BATCH + slot] = w[i] + dv * start
            x[_DW * BATCH + slot] = dv * part[slot]
            x[_LEAST * BATCH + slot] = tail_min_q[i + (piece[slot] + 1) // pieces[slot]]
        padded = min(BATCH, (batch + 7) // 8 * 8)
        _steps(x, y, padded)
        _judge(x, y, padded)
        slot = 0
        while slot < batch:
            falls = y[_FALLS * BATCH + slot] > 0.0
            ended = False
            if y[_ALONE * BATCH + slot] > 0.0 or (falls and piece[slot] < pieces[slot] - 1):
                if pieces[slot] == 1 or x[_APART * BATCH + slot] > 0.0:
                    _leave(states, at, x, slot)
                ended = not _by_itself(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                    ph_max, no_history, states[slot], work, job[slot], whole, real,
                )  # fmt: skip
                if not ended:
                    _enter(states, at, piece, length_s, x, slot)
            elif piece[slot] < pieces[slot] - 1:
                piece[slot] += 1
            else:
                piece[slot] = 0
                at[slot] += 1
                states[slot, STEPS] += pieces[slot]
                states[slot, SAMPLES] += 1.0
                if falls:
                    j = job[slot]
                    whole[0, j] = TOPPLED
                    whole[1, j] = int(states[slot, STEPS])
                    whole[2, j] = int(states[slot, SAMPLES])
                    real[0, j] = math.nan
                    real[1, j] = states[slot, STARTED]
                    real[2, j] = time_s[at[slot]]
                    real[3, j] = x[_ERROR * BATCH + slot]
                    ended = True
            while ended and next_job < kr.size:
                states[slot, AT_INTERVAL] = -1.0
                job[slot] = next_job
                next_job += 1
                if _by_itself(
                    time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr, p,
                    ph_max, no_history, states[slot], work, job[slot], whole, real,
                ):  # fmt: skip
                    _enter(states, at, piece, length_s, x, slot)
                    ended = False
            if ended:
                # the last slot takes the place of the one that is done
                batch -= 1
                for row in range(ROWS_IN):
                    x[row * BATCH + slot] = x[row * BATCH + batch]
                y[_ALONE * BATCH + slot] = y[_ALONE * BATCH + batch]
                y[_FALLS * BATCH + slot] = y[_FALLS * BATCH + batch]
                states[slot] = states[batch]
                job[slot] = job[batch]
                at[slot] = at[batch]
                length_s[slot] = length_s[batch]
                piece[slot] = piece[batch]
                pieces[slot] = pieces[batch]
                part[slot] = part[batch]
            else:
                slot += 1
