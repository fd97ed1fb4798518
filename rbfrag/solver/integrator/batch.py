"""Many blocks under one motion in one call; the results equal those of single runs bit for bit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.taylor import PH_MAX
from rbfrag.solver.integrator.vectorised import run_batch
from rbfrag.solver.results import FloatArray, IntArray


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
