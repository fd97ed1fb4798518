"""Tests of two blocks on a shake table, and what single blocks do under the same motions.

The folder has `tests.csv` (test, base_record, pga_g, pgv_over_pga_s, sp1_overturned,
sp2_overturned, has_trace) and `table_acceleration_g_200hz.npz` (an array `testNNN` for each test
with a trace: acceleration of the table [g] at 200 Hz).
"""

from __future__ import annotations

import csv
import hashlib
import math
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver import toppling_run
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.rocking_kernel import TOPPLED
from rbfrag.solver.integrator.state import corner
from rbfrag.solver.results import NUMERICS_VERSION
from rbfrag.solver.rocking_run import FreeBlock, simulate
from rbfrag.vocabulary.spectral import period_of

FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]
Codes = NDArray[np.int8]

SPECIMENS = ("specimen 1", "specimen 2")

P2 = 18.0
"""p² of both specimens by their meshes [1/s²]."""

ALPHA_RAD = np.geomspace(0.02, 0.35, 22)
RESTITUTION = np.array([0.6, 0.75, 0.85, 0.92, 0.97])

OTHER_SENSE = 1.6
"""Critical angle of the stronger sense of an uneven block over that of the weaker one."""

RATE_HZ, DECIMATION = 200.0, 2
BAND_HZ, ORDER = (0.3, 30.0), 4
"""Corners and order of the Butterworth filter, which is run forward and backward."""

PROGRESS_EVERY = 25


@dataclass(frozen=True, eq=False)
class Trials:
    """Tests with a trace.

    Args:
        name: of each test.
        base: number of the record that was scaled, shape (n,).
        pga_g: PGA by the source's sheet [g], shape (n,).
        pgv_m_s: PGV by the source's sheet [m/s], shape (n,).
        overturned: 1 or 0 by specimen, shape (2, n).
        motions: filtered acceleration of the table.
    """

    name: tuple[str, ...]
    base: Labels
    pga_g: FloatArray
    pgv_m_s: FloatArray
    overturned: FloatArray
    motions: tuple[GroundMotion, ...]

    @cached_property
    def digest(self) -> str:
        """What the outcomes of the blocks depend on."""
        parts = [NUMERICS_VERSION.encode(), ALPHA_RAD.tobytes(), RESTITUTION.tobytes()]
        parts.append(np.array([P2, OTHER_SENSE]).tobytes())
        parts += [motion.acceleration_g.tobytes() for motion in self.motions]
        return hashlib.sha256(b"".join(parts)).hexdigest()[:16]

    def measured(self, name: str) -> FloatArray:
        """Return a measure of each filtered trace by its name, `pgv_m_s` or `sa(1)` say."""
        if (period_s := period_of(name)) is not None:
            return np.array([motion.spectral_acceleration(period_s) for motion in self.motions])
        return np.array([getattr(motion, name) for motion in self.motions])

    def spectrum_m_s(self) -> FloatArray:
        """Return X(p) of each motion, the greater of both polarities [m/s]."""
        return np.array(
            [
                max(toppling_spectrum(motion, P2, way) for way in ("forward", "reverse"))
                for motion in self.motions
            ]
        )


def read(folder: Path) -> Trials:
    """Return the tests with traces, filtered.

    Raises:
        InputError: a file or a trace is missing.
    """
    table, traces = folder / "tests.csv", folder / "table_acceleration_g_200hz.npz"
    for path in (table, traces):
        if not path.is_file():
            raise InputError(f"no file {path.name} in {folder}: see docs/evidence/shake-table.md")
    with table.open(newline="", encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if row["has_trace"] == "1"]
    with np.load(traces) as stored:
        missing = [row["test"] for row in rows if _array(row) not in stored]
        if missing:
            raise InputError(f"{traces.name} has no trace of test {missing[0]}: see tests.csv")
        motions = tuple(filtered(stored[_array(row)].astype(np.float64)) for row in rows)
    pga = np.array([float(row["pga_g"]) for row in rows])
    ratio = np.array([float(row["pgv_over_pga_s"]) for row in rows])
    return Trials(
        name=tuple(row["test"] for row in rows),
        base=np.unique([row["base_record"] for row in rows], return_inverse=True)[1],
        pga_g=pga,
        pgv_m_s=ratio * pga * STANDARD_GRAVITY_M_S2,
        overturned=np.array([[float(row[f"sp{k}_overturned"]) for row in rows] for k in (1, 2)]),
        motions=motions,
    )


def _array(row: dict[str, str]) -> str:
    return f"test{int(row['test']):03d}"


def filtered(acceleration_g: FloatArray) -> GroundMotion:
    """Return a trace in the band of the table, at half its rate."""
    from scipy.signal import butter, sosfiltfilt

    sections = butter(ORDER, BAND_HZ, "bandpass", fs=RATE_HZ, output="sos")
    samples = sosfiltfilt(sections, acceleration_g)[::DECIMATION]
    return GroundMotion(np.ascontiguousarray(samples), DECIMATION / RATE_HZ)


@dataclass(frozen=True, eq=False)
class Outcomes:
    """What single blocks do: outcome codes of the kernels.

    Args:
        free_standing: rocking blocks: even; uneven, weaker forward; uneven, weaker backward; shape
            (n, 3, alpha, restitution).
        backed: toppling blocks: leaning forward, backward; shape (n, 2, alpha).
    """

    free_standing: Codes
    backed: Codes


def outcomes(trials: Trials, *, work: Path | None = None, workers: int = 1) -> Outcomes:
    """Run all blocks under all motions.

    Args:
        trials: the tests.
        work: folder that keeps the outcomes for the next time.
        workers: processes.
    """
    stored_file = None if work is None else work / f"outcomes-{trials.digest}.npz"
    if stored_file is not None and stored_file.is_file():
        with np.load(stored_file) as stored:
            return Outcomes(stored["free"], stored["backed"])
    samples = [motion.acceleration_g for motion in trials.motions]
    if workers == 1:
        runs = _counted(map(run_blocks, samples), len(samples))
    else:
        # kernels are compiled once, and read by the others
        run_blocks(samples[0][:4])
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            runs = _counted(pool.map(run_blocks, samples), len(samples))
    result = Outcomes(
        np.array([free_standing for free_standing, _ in runs]), np.array([back for _, back in runs])
    )
    if stored_file is not None:
        stored_file.parent.mkdir(parents=True, exist_ok=True)
        partial = stored_file.with_suffix(".partial.npz")
        np.savez_compressed(partial, free=result.free_standing, backed=result.backed)
        partial.replace(stored_file)
    return result


def _counted(runs: Iterable[tuple[Codes, Codes]], total: int) -> list[tuple[Codes, Codes]]:
    result = []
    for run in runs:
        result.append(run)
        if len(result) % PROGRESS_EVERY == 0 or len(result) == total:
            print(f"{len(result)} of {total} motions", file=sys.stderr, flush=True)
    return result


def run_blocks(acceleration_g: FloatArray) -> tuple[Codes, Codes]:
    """Return the outcomes of one motion: of free blocks (3, alpha, e), of backed ones (2, alpha).

    An even block needs one polarity: the other one is its mirror image.
    """
    motion = GroundMotion(acceleration_g, DECIMATION / RATE_HZ)
    ways = [excitation(motion, None, way) for way in ("forward", "reverse")]
    free_standing = np.empty((3, ALPHA_RAD.size, RESTITUTION.size), np.int8)
    backed = np.empty((2, ALPHA_RAD.size), np.int8)
    for i, alpha in enumerate(ALPHA_RAD.tolist()):
        kr, other = math.tan(alpha), math.tan(OTHER_SENSE * alpha)
        for j, e in enumerate(RESTITUTION.tolist()):
            even, uneven = free_block(kr, kr, e), free_block(kr, other, e)
            free_standing[0, i, j] = simulate(ways[0], even).outcome
            free_standing[1, i, j] = simulate(ways[0], uneven).outcome
            free_standing[2, i, j] = simulate(ways[1], uneven).outcome
        for k, way in enumerate(ways):
            backed[k, i] = toppling_run.simulate(way, p2=P2, kr=kr).outcome
    return free_standing, backed


def free_block(forward_kr: float, backward_kr: float, e: float) -> FreeBlock:
    """Return a block on level ground by its strengths; its outline is not needed."""
    p = math.sqrt(P2)
    return FreeBlock(corner(forward_kr, p, e), corner(backward_kr, p, e), 0.0, (0.0, 0.0), 0.0)


def overturned(codes: Codes) -> FloatArray:
    """Return 1 where a block overturns, 0 elsewhere."""
    return np.asarray(codes == TOPPLED, dtype=np.float64)
