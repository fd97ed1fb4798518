"""Benchmark cases: recorded motions, and a seeded random choice of blocks."""

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

STRENGTHS = (0.03, 0.95)
"""Range of k_r/PGA that blocks are drawn from, evenly in the logarithm."""


@dataclass(frozen=True, eq=False)
class Records:
    """Motions to measure on, and a sentence on their origin."""

    motions: tuple[GroundMotion, ...]
    source: str


@dataclass(frozen=True, eq=False)
class BenchCase:
    """One block under one motion; no vertical motion, equally spaced samples."""

    motion: GroundMotion
    polarity: Polarity
    excitation: Excitation
    p2: float
    kr: float


def find_records(path: str | os.PathLike[str] | None = None) -> Records:
    """Return the horizontal motions to measure on.

    Args:
        path: accelerogram file or folder; None for the sample records of rbfrag[samples], or
            analytic pulses where these are not installed.
    """
    if path is not None:
        if not Path(path).exists():
            raise InputError(f"no folder {path}: give a folder with records", fields=("records",))
        motions = _read(Path(path))
        if not motions:
            raise InputError(f"no horizontal accelerogram in {path}: give another folder")
        return Records(motions, f"{len(motions)} horizontal records")
    samples = sample_folder()
    if samples is not None:
        motions = _read(samples)
        return Records(motions, f"{len(motions)} sample records of rbfrag[samples]")
    pulses = tuple(
        reversal_pulse(0.4, ratio, period_s, 0.005)
        for period_s in (0.2, 0.5, 1.0, 2.0)
        for ratio in (0.35, 0.65, 1.0)
    )
    return Records(pulses, f"{len(pulses)} analytic pulses (no records are installed)")


def _read(root: Path) -> tuple[GroundMotion, ...]:
    """Read all readable files, each accelerogram once, in an order that never changes."""
    files = sorted(p for p in root.rglob("*") if p.is_file()) if root.is_dir() else [root]
    by_samples: dict[str, GroundMotion] = {}
    for file in files:
        try:
            motions = read_motions(file)
        except (MotionFileError, InputError):
            continue  # manifests, read-mes and formats without a reader lie beside the records
        for motion in motions:
            is_valid = motion.is_vertical is not True and motion.npts > 1
            if is_valid and motion.node_time_s is None and motion.acceleration_g.any():
                by_samples.setdefault(motion.sha256, motion)
    return tuple(by_samples.values())


def choose_cases(records: Records, number: int, *, seed: int = 1) -> tuple[BenchCase, ...]:
    """Draw blocks that lift off: motions in turn, polarity, p² and k_r/PGA at random.

    Args:
        records: motions to draw from.
        number: number of cases.
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
