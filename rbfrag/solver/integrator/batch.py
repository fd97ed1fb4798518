"""Many blocks under one motion in one call, with the answers of the single run, bit for bit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.single_run import run_toppling
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.integrator.vectorised import run_batch

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Runs:
    """What many runs ended in; every array has the shape of the blocks that were asked for.

    Args:
        outcome: codes of `rbfrag.solver.integrator.single_run` (STABLE, TOPPLED, UNDETERMINED,
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


@kernel
def run_blocks(
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
    linear: bool,
    order: int,
    ph_max: float,
    whole: IntArray,
    real: FloatArray,
) -> None:
    """Run one block after another over one record.

    Args:
        time_s: as in :func:`rbfrag.solver.integrator.single_run.run_toppling`; likewise up to
            `jump_node`.
        kr: rocking acceleration coefficients, shape (m,).
        p: frequency parameters [1/s], shape (m,).
        linear: the linear verification model.
        order: degree of the Taylor step.
        ph_max: greatest p·h of one step.
        whole: filled with outcome, steps and samples moved, shape (3, m).
        real: filled with peak, start, verdict and error, shape (4, m).
    """
    nothing = np.empty((4, 0))
    to_the_end = np.empty(0)
    work = np.empty((3, order + 1))
    for j in range(kr.size):
        (
            whole[0, j], real[0, j], real[1, j], real[2, j], real[3, j],
            whole[1, j], whole[2, j], _,
        ) = run_toppling(
            time_s, interval_s, k_h, w, q, tail_min_q, block_max_q, jump_node, kr[j], p[j],
            linear, order, ph_max, nothing, to_the_end, work,
        )  # fmt: skip


def simulate_many(drive: Excitation, *, p2: ArrayLike, kr: ArrayLike, linear: bool = False) -> Runs:
    """Run many blocks under one excitation.

    Args:
        drive: the excitation.
        p2: frequency parameters p² [1/s²], > 0.
        kr: rocking acceleration coefficients k_r (linear: critical angles [rad]), > 0; broadcast
            with `p2`.
        linear: the linear model.

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
        raise InputError(f"p2 and kr must be numbers of shapes that go together: {error}") from None
    for name, values in (("p2", sizes), ("kr", strengths)):
        wrong = ~(np.isfinite(values) & (values > 0.0))
        if wrong.any():
            raise InputError(
                f"{name} must be positive finite numbers, not {float(values[wrong].flat[0]):g}"
            )
    shape = sizes.shape
    flat_kr = np.ascontiguousarray(strengths).reshape(-1)
    whole = np.empty((3, flat_kr.size), dtype=np.int64)
    real = np.empty((4, flat_kr.size))
    arrays = (
        drive.time_s, drive.interval_s, drive.k_h, drive.w, drive.q, drive.tail_min_q,
        drive.block_max_q,
    )  # fmt: skip
    p = np.sqrt(sizes).reshape(-1)
    if linear:
        run_blocks(*arrays, drive.jump_node, flat_kr, p, True, ORDER, PH_MAX, whole, real)
    else:
        run_batch(*arrays, drive.jump_node, flat_kr, p, PH_MAX, whole, real)
    theta_c = flat_kr if linear else np.arctan(flat_kr)
    return Runs(
        outcome=whole[0].reshape(shape),
        theta_n=(real[0] / theta_c).reshape(shape),
        peak_rad=real[0].reshape(shape),
        started_s=real[1].reshape(shape),
        verdict_s=real[2].reshape(shape),
        error_rad=real[3].reshape(shape),
        steps=whole[1].reshape(shape),
        samples_moved=whole[2].reshape(shape),
    )
