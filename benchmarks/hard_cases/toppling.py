"""Toppling blocks where runs are hard: close to critical, grazing, rough, slow, endless."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.certify.borders import border
from benchmarks.extended.toppling import truth
from benchmarks.hard_cases import Row
from benchmarks.hard_cases._records import made_up, vertical_of
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import OUTCOMES, simulate

SEED = 30
AGAINST = "Taylor series in 32 digits"
DISTANCES = tuple(10.0**-n for n in range(3, 14))


class Case(NamedTuple):
    """A block under an excitation."""

    excited: Excitation
    p2: float
    kr: float


def close_to_critical(rng: np.random.Generator) -> Iterator[Case]:
    """Yield blocks at stated relative distances from critical, on both sides."""
    while True:
        motion, p2 = made_up(rng)
        result = critical(motion, p2=p2)
        if not result.certified or result.lower is None or result.upper is None:
            continue
        excited = excitation(motion)
        # where it lies, the judge says
        exact = border(excited, p2, result.lower * excited.pga_g, result.upper * excited.pga_g)
        if exact is None:
            continue
        for distance in DISTANCES:
            for side in (-1.0, 1.0):
                yield Case(excited, p2, exact[0] + (exact[1] + side * distance * exact[0]))


def rough(rng: np.random.Generator) -> Iterator[Case]:
    """Yield blocks under made-up records, of which every other has a vertical motion, too."""
    while True:
        motion, p2 = made_up(rng)
        for up in (None, vertical_of(motion, rng)):
            excited = excitation(motion, up)
            yield Case(excited, p2, excited.max_q * float(rng.uniform(0.02, 1.0)))


def at_the_threshold(rng: np.random.Generator) -> Iterator[Case]:
    """Yield records that chatter about k_r by 1e-9, rest on it, or jump across it."""
    while True:
        kr = float(rng.uniform(0.05, 0.5))
        signs = rng.choice([-1.0, 0.0, 1.0], 200)
        chatter = np.concatenate([kr + 1e-9 * signs, kr * rng.uniform(-2.0, 2.5, 100)])
        yield Case(excitation(GroundMotion(chatter, 0.01)), float(rng.uniform(0.5, 20.0)), kr)
        plateau = np.repeat(kr * rng.choice([0.0, 1.0, 1.5, -1.2], 60), 8)
        yield Case(excitation(GroundMotion(plateau, 0.01)), float(rng.uniform(0.5, 20.0)), kr)
        # rectangular pulses: intervals without length
        ends = np.repeat(np.cumsum(rng.uniform(0.05, 0.4, 7)), 2)
        levels = np.repeat(kr * rng.uniform(-2.0, 2.5, 6), 2)
        pulses = GroundMotion.from_nodes(ends, np.concatenate([[0.0], levels, [0.0]]))
        yield Case(excitation(pulses), float(rng.uniform(0.5, 20.0)), kr)


def at_the_limits(rng: np.random.Generator) -> Iterator[Case]:
    """Yield long steps, huge and tiny blocks and strengths, padding, one sample, sudden ends."""
    while True:
        samples = made_up(rng)[0].acceleration_g
        motion = GroundMotion(samples, 0.02)
        pga = float(np.abs(samples).max())
        if pga == 0.0:
            continue
        yield Case(excitation(motion), 100.0, 0.3 * pga)
        yield Case(excitation(motion), 1e-3, 0.01 * pga)
        yield Case(excitation(motion), 3.0, 1e-5)
        yield Case(excitation(motion), 3.0, 1e4)
        still = np.zeros(20_000)
        padded = GroundMotion(np.concatenate([still, samples, still]), 0.01)
        yield Case(excitation(padded), 1.0, 0.2 * pga)
        yield Case(excitation(GroundMotion(samples[:1] + 0.3, 0.01)), 1.0, 0.2)
        yield Case(excitation(GroundMotion(0.0 * samples, 0.01)), 1.0, 0.2)
        cut = GroundMotion(samples[: samples.size // 2], 0.01)
        yield Case(excitation(cut), 10.0, 0.2 * pga)


def study(subject: str, cases: Iterator[Case], count: int) -> Row:
    """Judge so many runs: wrong is another outcome, or a peak beyond the error estimate."""
    tried = wrong = within = undecided = 0
    for case in cases:
        if tried == count:
            break
        tried += 1
        run = simulate(case.excited, p2=case.p2, kr=case.kr)
        true = truth(case.excited, p2=case.p2, kr=case.kr)
        mine = OUTCOMES[run.outcome].value
        if mine == "undetermined":
            undecided += 1
            continue
        error = 0.0
        if mine == true.outcome == "stable":
            error = abs((run.peak_rad - true.peak_rad) - true.peak_low_rad)
        if mine != true.outcome or error > run.error_rad:
            wrong += 1
            print(
                f"{subject}: p2 {case.p2!r}, kr {case.kr!r}: {mine}, not {true.outcome}; off by "
                f"{error:.3g}, estimate {run.error_rad:.3g}",
                file=sys.stderr,
            )
        else:
            within += 1
    return Row(subject, AGAINST, tried, wrong, within, undecided)


def rows() -> list[Row]:
    """Run all cases."""
    kinds = {
        "topples at 1e-3 to 1e-13 of critical": (close_to_critical, 66),
        "topples under rough records": (rough, 60),
        "topples at the threshold": (at_the_threshold, 42),
        "topples at the limits": (at_the_limits, 32),
    }
    return [
        study(subject, cases(np.random.default_rng([SEED, number])), count)
        for number, (subject, (cases, count)) in enumerate(kinds.items())
    ]
