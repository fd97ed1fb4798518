"""Many blocks under one motion in one call, their steps side by side in vector instructions.

A step of one run waits for the step before it, and leaves a processor idle most of the time. Here
up to `BATCH` runs over one record take each step together. Only the plain step of a moving block
is taken so; whatever else happens in an interval (a start, a peak, an impact, a jump, the end of
the record) is left to :func:`rbfrag.solver.integrator.toppling_kernel.advance`, which goes on to
the next node at which the block moves. Every operation is that of the single run, in the same
order, so that the results are equal bit for bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.solver.excitation import Excitation, Nodes
from rbfrag.solver.integrator.compiled import fused_kernel, inner_kernel, kernel, within
from rbfrag.solver.integrator.events import irrecoverable, keeps_direction, simple_turn
from rbfrag.solver.integrator.state import (
    Peak,
    State,
    StepExcitation,
    excitation_over,
    kernel_corner,
)
from rbfrag.solver.integrator.taylor import (
    ORDER,
    PH_MAX,
    SMALL_TURN,
    StepRules,
    drift_of_step,
    exponential_bound,
    series,
    small_turn,
    step_errors,
)
from rbfrag.solver.integrator.toppling_kernel import (
    TOPPLED,
    Progress,
    TrajectoryBounds,
    advance,
    beginning,
    end_of_run,
)
from rbfrag.solver.results import FloatArray, IntArray

BATCH = 32

FEW = 3
"""At or below this number of runs, steps of single runs are faster than a vector step."""

# Where the slots' values begin in one array: of what a step takes ...
PH, SIN, COS, K_H, DK_H, W, DW, THETA, RATE, ERROR, DRIFT, PEAK, LEAST_Q, APART = (
    row * BATCH for row in range(14)
)
INPUT_ROWS = 14

# ... and of what it gives. (Arrays of their own would have to be told apart at each step.)
TURNED, U_START, U_END, V_START, V_END, U5, U6, U7, U8, SIN_END, COS_END, ALONE, FALLS = (
    row * BATCH for row in range(13)
)
OUTPUT_ROWS = 13

SLOT = np.dtype(
    [
        ("job", "i8"), ("number", "i8"), ("parts", "i8"), ("part", "f8"), ("length_s", "f8"),
        ("node", "i8"), ("theta", "f8"), ("rate", "f8"), ("sin", "f8"), ("cos", "f8"),
        ("error", "f8"), ("drift", "f8"), ("peak", "f8"), ("peak_error", "f8"),
        ("started_s", "f8"), ("is_hidden", "i8"), ("steps", "i8"), ("samples", "i8"),
    ]
)  # fmt: skip
"""Which run is in a slot, which part of its interval comes next, how many parts there are, their
fraction of the interval, and the length of an interval that the last two hold for; then how far
the run is (`Progress`), at node -1 before its beginning."""


@fused_kernel
def take_steps(x: FloatArray, y: FloatArray, batch: int) -> None:
    """Take one step of order 8 in every slot, as `taylor_step` and `turn` do."""
    for j in range(batch):
        u0 = x[PH + j] * x[RATE + j]
        shaking = StepExcitation(x[K_H + j], x[DK_H + j], x[W + j], x[DW + j])
        turned, u_end, v_end, u1, _, _, _, u5, u6, u7, u8 = series(
            ORDER, u0, x[PH + j], x[SIN + j], x[COS + j], shaking
        )
        s_end, c_end = small_turn(x[SIN + j], x[COS + j], turned)
        y[TURNED + j] = turned
        y[U_START + j] = u0
        y[U_END + j] = u_end
        y[V_START + j] = u1
        y[V_END + j] = v_end
        y[U5 + j] = u5
        y[U6 + j] = u6
        y[U7 + j] = u7
        y[U8 + j] = u8
        y[SIN_END + j] = s_end
        y[COS_END + j] = c_end


@inner_kernel
def judge_steps(x: FloatArray, y: FloatArray, batch: int) -> None:
    """Update the error estimates; advance slots whose step had no event, mark the others."""
    # A step is plain if theta stays above 0 without a peak that counts (`keeps_direction`,
    # `simple_turn`) and the series of exp and sin hold: exactly the steps that the kernel of a
    # single run takes without examining them, hence the same bits
    for j in range(batch):
        ph = x[PH + j]
        theta = x[THETA + j]
        turned = y[TURNED + j]
        # from here on the single run's own functions, without branches: one instruction a row
        theta_end = theta + turned
        state = State(theta, x[RATE + j], x[SIN + j], x[COS + j])
        shaking = StepExcitation(x[K_H + j], x[DK_H + j], x[W + j], x[DW + j])
        highest = (y[U5 + j], y[U6 + j], y[U7 + j], y[U8 + j])
        growth, truncation, rounding = step_errors(ORDER, ph, state, shaking, turned, highest)
        error = x[ERROR + j] * exponential_bound(growth) + truncation + rounding
        drift = x[DRIFT + j] + drift_of_step(ph, error, theta_end)
        u_end = y[U_END + j]
        u_start = y[U_START + j]
        v_start = y[V_START + j]
        v_end = y[V_END + j]
        simple = keeps_direction(u_start, v_start, u_end, v_end) | simple_turn(
            theta, theta_end, u_start, v_start, u_end, v_end, x[PEAK + j], drift
        )
        alone = (theta_end <= 0.0) | (not simple) | (x[APART + j] > 0.0)
        # beyond these bounds the single run computes exp and sin themselves
        alone = alone | (growth > 1.0) | (abs(turned) > SMALL_TURN)
        rate = u_end / ph
        falls = irrecoverable(rate, y[SIN_END + j], y[COS_END + j], x[LEAST_Q + j], error)
        y[ALONE + j] = 1.0 if alone else 0.0
        y[FALLS + j] = 1.0 if falls else 0.0
        # what goes to the single kernel keeps the state of its start
        x[THETA + j] = theta if alone else theta_end
        x[RATE + j] = x[RATE + j] if alone else rate
        x[SIN + j] = x[SIN + j] if alone else y[SIN_END + j]
        x[COS + j] = x[COS + j] if alone else y[COS_END + j]
        x[ERROR + j] = x[ERROR + j] if alone else error
        x[DRIFT + j] = x[DRIFT + j] if alone else drift


@within
def enter(progress: Progress, place: Any, x: FloatArray, slot: int) -> None:
    """Place a run, at a node, into a slot."""
    place.number = 0
    place.length_s = -1.0
    place.node, place.is_hidden = progress.node, progress.is_hidden
    place.peak, place.peak_error = progress.bounds.peak
    place.started_s, place.steps, place.samples = (
        progress.started_s, progress.steps, progress.samples
    )  # fmt: skip
    x[THETA + slot], x[RATE + slot], x[SIN + slot], x[COS + slot] = progress.state
    x[ERROR + slot] = progress.bounds.error
    x[DRIFT + slot] = progress.bounds.drift
    x[PEAK + slot] = progress.bounds.peak.x


@within
def put_down(place: Any, x: FloatArray, slot: int) -> None:
    """Write the state of a slot at the beginning of its interval."""
    place.theta = x[THETA + slot]
    place.rate = x[RATE + slot]
    place.sin = x[SIN + slot]
    place.cos = x[COS + slot]
    place.error = x[ERROR + slot]
    place.drift = x[DRIFT + slot]


@within
def put_down_progress(place: Any) -> Progress:
    """Return the progress of a run whose state has been written out."""
    state = State(place.theta, place.rate, place.sin, place.cos)
    bounds = TrajectoryBounds(place.error, place.drift, Peak(place.peak, place.peak_error))
    return Progress(
        place.node,
        True,
        state,
        bounds,
        place.started_s,
        place.is_hidden > 0,
        place.steps,
        place.samples,
        math.nan,
        0.0,
        0,
    )


@inner_kernel
def move_slot(x: FloatArray, y: FloatArray, slots: np.ndarray, source: int, slot: int) -> None:
    """Move a run to another slot."""
    for row in range(INPUT_ROWS):
        x[row * BATCH + slot] = x[row * BATCH + source]
    y[ALONE + slot] = y[ALONE + source]
    y[FALLS + slot] = y[FALLS + source]
    slots[slot] = slots[source]


@kernel
def run_batch(
    nodes: Nodes, kr: FloatArray, p: FloatArray, ph_max: float, counts: IntArray, real: FloatArray
) -> None:
    """Run blocks over one record, order 8, side by side.

    Args:
        nodes: the excitation.
        kr: rocking acceleration coefficients, shape (m,).
        p: frequency parameters [1/s], shape (m,).
        ph_max: greatest p·h of one step.
        counts: filled with outcome, steps and samples moved, shape (3, m).
        real: filled with peak, start, verdict and error, shape (4, m).
    """
    # Invariant: slots 0..running - 1 hold unfinished runs, each at the start of a step; jobs below
    # `job` have been started. A slot that finishes takes the next job, or else the last slot
    # moves into its place

    # The loops over slots stand here: in functions of their own, numba would count the references
    # to all these arrays at every step.
    time_s, interval_s, k_h, w = nodes.time_s, nodes.interval_s, nodes.k_h, nodes.w
    tail_min_q = nodes.tail_min_q
    last = nodes.last
    rules = StepRules(ORDER, ph_max)
    x = np.ones(INPUT_ROWS * BATCH)
    y = np.zeros(OUTPUT_ROWS * BATCH)
    slots = np.zeros(BATCH, SLOT)
    no_rows, u = np.empty((4, 0)), np.empty(9)
    running = min(BATCH, kr.size)
    job = running
    for slot in range(running):
        slots[slot].job = slot
        slots[slot].node = -1
        y[ALONE + slot] = 1.0  # up to where it first moves at a node
    begun = False
    while running > 0:
        # vectors of a few runs cost more than the runs: the last ones are finished one by one
        few = begun and running <= FEW
        if few:
            for slot in range(running):
                x[APART + slot] = 1.0 if slots[slot].number == 0 else 0.0
                y[ALONE + slot] = 1.0
        elif begun:
            # a loop of its own: mixed with the arithmetic, scattered reads keep that from becoming
            # vector instructions
            for slot in range(running):
                place = slots[slot]
                i = place.node
                if i >= last or interval_s[i] == 0.0:
                    x[APART + slot] = 1.0
                    continue
                x[APART + slot] = 0.0
                if interval_s[i] != place.length_s:
                    # records are sampled evenly: the division is made once a run
                    length = p[place.job] * interval_s[i]
                    place.length_s = interval_s[i]
                    place.parts = max(1, math.ceil(length / ph_max))
                    place.part = 1.0 / place.parts
                    x[PH + slot] = length / place.parts
                if place.parts > 1 and place.number == 0:
                    # the single kernel goes through a whole interval: it needs its beginning
                    put_down(place, x, slot)
                shaking = excitation_over(k_h, w, i, place.number * place.part, place.part)
                x[K_H + slot] = shaking.k_h
                x[DK_H + slot] = shaking.dk_h
                x[W + slot] = shaking.w
                x[DW + slot] = shaking.dw
                x[LEAST_Q + slot] = tail_min_q[i + 1 if place.number == place.parts - 1 else i]
            # whole vectors: what is done in slots without a run means nothing
            filled = min(BATCH, (running + 7) // 8 * 8)
            take_steps(x, y, filled)
            judge_steps(x, y, filled)
        begun = True
        slot = 0
        while slot < running:
            place = slots[slot]
            alone = y[ALONE + slot] > 0.0
            falls = y[FALLS + slot] > 0.0
            goes_on = not (alone or falls)
            if place.number < place.parts - 1 and not alone:
                alone = falls  # between nodes; the single kernel says where
                place.number += 1 if goes_on else 0
            elif not alone:
                place.number = 0
                place.node += 1
                place.steps += place.parts
                place.samples += 1
                if falls:
                    counts[0, place.job], real[0, place.job] = TOPPLED, math.nan
                    counts[1, place.job], counts[2, place.job] = place.steps, place.samples
                    real[1, place.job], real[2, place.job] = place.started_s, time_s[place.node]
                    real[3, place.job] = x[ERROR + slot]
            # a run that has just begun has no state in the slot yet
            if alone and place.node >= 0 and (place.parts == 1 or x[APART + slot] > 0.0):
                put_down(place, x, slot)
            while alone or (not goes_on and job < kr.size):
                if not alone:  # its run is over, and the next one begins
                    place.job = job
                    job += 1
                    place.node = -1
                # to its next moving node, or to its end
                alone = False
                j = place.job
                corner = kernel_corner(kr[j], p[j], 0.0)
                progress = beginning(corner) if place.node < 0 else put_down_progress(place)
                progress = advance(nodes, corner, rules, progress, not few, no_rows, u)
                goes_on = progress.node < last and math.isnan(progress.decided_s)
                if goes_on:
                    enter(progress, place, x, slot)
                else:
                    run = end_of_run(nodes, corner, progress)
                    counts[0, j], counts[1, j], counts[2, j] = (
                        run.outcome,
                        run.steps,
                        run.samples_moved,
                    )
                    real[0, j], real[1, j] = run.peak_rad, run.started_s
                    real[2, j], real[3, j] = run.verdict_s, run.error_rad
            if not goes_on:
                # the last run takes the place of the one that is done
                running -= 1
                move_slot(x, y, slots, running, slot)
                continue
            slot += 1


@dataclass(frozen=True, eq=False)
class Runs:
    """Results of many runs; every array has the shape of the blocks in the call.

    Args:
        outcome: codes of `rbfrag.solver.integrator.toppling_kernel` (STABLE, TOPPLED, UNDETERMINED,
            JUMP).
        theta_n: peak rotation over the critical angle; NaN unless the block stays.
        peak_rad: peak rotation [rad]; NaN unless the block stays.
        started_s: time of the first lift-off [s]; NaN where the block never moves.
        verdict_s: time at which toppling (or the throw) was certain [s]; NaN where it was not.
        error_rad: estimated bound on the error of the peak rotation [rad].
        steps: integration steps taken.
        samples_moved: sample intervals that had to be integrated.
    """

    outcome: IntArray
    theta_n: FloatArray
    peak_rad: FloatArray
    started_s: FloatArray
    verdict_s: FloatArray
    error_rad: FloatArray
    steps: IntArray
    samples_moved: IntArray


def simulate_many(excitation: Excitation, *, p2: ArrayLike, kr: ArrayLike) -> Runs:
    """Run many blocks under one excitation.

    Args:
        p2: frequency parameters p² [1/s²], > 0.
        kr: rocking acceleration coefficients k_r > 0; broadcast with `p2`.

    Returns:
        Arrays of the common shape; each block has exactly the numbers that
        :func:`rbfrag.solver.toppling_run.simulate` gives it, whatever else is in the batch.

    Raises:
        InputError: a value that is not positive and finite, or shapes that do not go together.
    """
    try:
        sizes, strengths = np.broadcast_arrays(
            np.asarray(p2, dtype=np.float64), np.asarray(kr, dtype=np.float64)
        )
    except ValueError as error:
        raise InputError(f"p2 and kr must be numbers of compatible shapes: {error}") from None
    for name, values in (("p2", sizes), ("kr", strengths)):
        wrong = ~(np.isfinite(values) & (values > 0.0))
        if wrong.any():
            raise InputError(
                f"{name} must be positive finite numbers, not {float(values[wrong].flat[0]):g}"
            )
    # kernels take flat arrays of one memory order: one compilation, whatever the caller's shape
    shape = sizes.shape
    flat_kr = np.ascontiguousarray(strengths).reshape(-1)
    counts = np.empty((3, flat_kr.size), dtype=np.int64)
    real = np.empty((4, flat_kr.size))
    # theta'' = p² [k_h cos(theta_c - theta) - (1 + k_v) sin(theta_c - theta)], tan(theta_c) = k_r:
    # a block enters by p and k_r alone
    p = np.sqrt(sizes).reshape(-1)
    run_batch(excitation.nodes, flat_kr, p, PH_MAX, counts, real)
    return Runs(
        outcome=counts[0].reshape(shape),
        # the critical angle of the model is atan(k_r), whatever the dip
        theta_n=(real[0] / np.arctan(flat_kr)).reshape(shape),
        peak_rad=real[0].reshape(shape),
        started_s=real[1].reshape(shape),
        verdict_s=real[2].reshape(shape),
        error_rad=real[3].reshape(shape),
        steps=counts[1].reshape(shape),
        samples_moved=counts[2].reshape(shape),
    )
