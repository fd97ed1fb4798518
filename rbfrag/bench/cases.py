"""What every method is run on: recorded motions, and a seeded choice of blocks."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.pulses import reversal_pulse
from rbfrag.motions.readers import read_motions
from rbfrag.motions.sample_motions import sample_folder
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.results import DEFAULT_P2, POLARITIES, Polarity

RECORDS_VARIABLE = "RBFRAG_TEST_RECORDS"

STRENGTHS = (0.03, 0.95)
"""Range of k_r/PGA that blocks are drawn from, evenly in the logarithm."""


@dataclass(frozen=True, eq=False)
class Records:
    """Motions to measure on, and a sentence that says where they come from."""

    motions: tuple[GroundMotion, ...]
    source: str


@dataclass(frozen=True, eq=False)
class BenchCase:
    """One block under one motion; no vertical, equally spaced samples."""

    motion: GroundMotion
    polarity: Polarity
    excitation: Excitation
    p2: float
    kr: float


def find_records(folder: str | os.PathLike[str] | None = None) -> Records:
    """Return the horizontal motions to measure on.

    Args:
        folder: folder (or file) of accelerograms. None for the folder that the environment
            variable RBFRAG_TEST_RECORDS names, else the sample records of
            rbfrag[samples], else analytic pulses.
    """
    if folder is None and not os.environ.get(RECORDS_VARIABLE):
        samples = sample_folder()
        if samples is None:
            pulses = tuple(
                reversal_pulse(0.4, ratio, period_s, 0.005)
                for period_s in (0.2, 0.5, 1.0, 2.0)
                for ratio in (0.35, 0.65, 1.0)
            )
            return Records(pulses, f"{len(pulses)} analytic pulses (no records are installed)")
        motions = _read(samples)
        return Records(motions, f"{len(motions)} sample records of rbfrag[samples]")
    root = Path(folder if folder is not None else os.environ[RECORDS_VARIABLE])
    if not root.exists():
        raise InputError(f"no folder {root}: give a folder with records", fields=("records",))
    motions = _read(root)
    if not motions:
        raise InputError(f"no horizontal accelerogram in {root}: give another folder")
    return Records(motions, f"{len(motions)} horizontal records")


def _read(root: Path) -> tuple[GroundMotion, ...]:
    """Read what can be read, each accelerogram once, in an order that never changes."""
    files = sorted(p for p in root.rglob("*") if p.is_file()) if root.is_dir() else [root]
    by_samples: dict[str, GroundMotion] = {}
    for file in files:
        try:
            motions = read_motions(file)
        except (MotionFileError, InputError):
            continue  # manifests, read-mes and formats without a reader lie beside the records
        for motion in motions:
            usable = motion.is_vertical is not True and motion.npts > 1
            if usable and motion.node_time_s is None and motion.acceleration_g.any():
                by_samples.setdefault(motion.sha256, motion)
    return tuple(by_samples.values())


def choose_cases(records: Records, number: int, *, seed: int = 1) -> tuple[BenchCase, ...]:
    """Draw blocks that lift off: motions in turn, polarity, p² and k_r/PGA at random.

    Args:
        records: where the motions come from.
        seed: the same seed draws the same cases.
    """
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(records.motions))
    cases: list[BenchCase] = []
    for turn in range(50 * number):
        if len(cases) == number:
            break
        motion = records.motions[order[turn % order.size]]
        polarity = POLARITIES[int(rng.integers(2))]
        p2 = float(rng.choice(DEFAULT_P2))
        low, high = np.log(STRENGTHS)
        excited = excitation(motion, None, polarity)
        kr = float(np.exp(rng.uniform(low, high))) * excited.pga_g
        if excited.max_q > kr:
            cases.append(BenchCase(motion, polarity, excited, p2, kr))
    if not cases:
        raise InputError("no drawn block lifts off under these records: give other records")
    return tuple(cases)


def choose_combinations(
    records: Records, number: int, *, seed: int = 1
) -> tuple[tuple[GroundMotion, Polarity, float], ...]:
    """Draw (motion, polarity, p²) for critical searches; p² in turn, no motion twice in a row."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(records.motions))
    return tuple(
        (
            records.motions[order[i % order.size]],
            POLARITIES[int(rng.integers(2))],
            float(DEFAULT_P2[i % len(DEFAULT_P2)]),
        )
        for i in range(number)
    )
