"""Two or three motions one after another, beside one joined record that another integrates.

Slides by the slider in rational numbers, topples by the integrator of tests/solver/reference.py,
slumps and confined topples by a free block on stiff springs. The gaps are long enough to rest.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.hard_cases import Row
from benchmarks.hard_cases.slides import Slide, exact
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from tests.physics.confined_draws import FALLEN_RAD
from tests.physics.lost_contacts import DAMPING, DT_S, ELASTIC_M, random_motion
from tests.physics.penalty import simulate
from tests.solver.reference import integrate

OF_EACH = 5
SEED = 1906

GAP_S = 3.0
SPRINGS = 1e-3
"""Part of the peak that springs may differ by, beyond the error estimate."""


class Case(NamedTuple):
    """How far a sequence is from the joined record, and what it may be; None: nothing is told."""

    same_outcome: bool
    off: float
    allowed: float | None
    answer: Response


def joined(motions: list[GroundMotion]) -> GroundMotion:
    """Return one record; each motion begins and ends with zero."""
    rest = np.zeros(round(GAP_S / DT_S) - 1)
    parts = [motions[0].acceleration_g]
    for motion in motions[1:]:
        parts += [rest, motion.acceleration_g]
    return GroundMotion(np.concatenate(parts), DT_S)


def motions_of(random: np.random.Generator) -> list[GroundMotion]:
    return [random_motion(random) for _ in range(int(random.integers(2, 4)))]


def has_rested(answer: Response) -> bool:
    """Whether every motion found the block at rest at the time of the joined record."""
    begins = [part.begins_s for part in answer.parts]
    length_s = random_motion(np.random.default_rng(0)).duration_s + GAP_S
    return np.allclose(begins, length_s * np.arange(len(begins)), rtol=0.0, atol=1e-9)


def slides(random: np.random.Generator) -> Iterator[Case]:
    while True:
        motions = motions_of(random)
        ky, beta_deg = float(random.uniform(0.1, 0.5)), float(random.uniform(0.0, 20.0))
        two_way = bool(random.random() < 0.5)
        answer = respond(motions, ky=ky, beta_deg=beta_deg, two_way=two_way, gap_s=GAP_S)
        if not answer.peak_displacement_m or not has_rested(answer):
            continue
        peak, last = exact(Slide(joined(motions), None, ky, beta_deg, two_way))
        assert answer.displacement_m is not None
        off = max(
            abs(answer.peak_displacement_m - float(peak)), abs(answer.displacement_m - float(last))
        )
        yield Case(answer.outcome is Outcome.STABLE, off, answer.error_estimate, answer)


def topples(random: np.random.Generator) -> Iterator[Case]:
    while True:
        motions = motions_of(random)
        p2, kr = float(random.uniform(2.0, 10.0)), float(random.uniform(0.2, 0.5))
        answer = respond(motions, p2=p2, kr=kr, gap_s=GAP_S)
        if answer.started_s is None or not has_rested(answer):
            continue
        record = joined(motions)
        reference = integrate(record.time_s, record.acceleration_g, None, p2=p2, kr=kr)
        same = answer.outcome.value == reference.outcome
        ours, theirs = answer.peak_theta_rad, reference.peak_rad
        off = 0.0 if ours is None or theirs is None else abs(ours - theirs)
        yield Case(same, off, answer.error_estimate, answer)


def on_planes(random: np.random.Generator, kind: str) -> Iterator[Case]:
    """Blocks of a kind that two planes hold."""
    slumping = kind == "slumping"
    while True:
        motions = motions_of(random)
        angles = ((35.0, 50.0), (60.0, 76.0)) if slumping else ((-65.0, -25.0), (12.0, 28.0))
        alpha1, alpha3 = (random.uniform(*ends) for ends in angles)
        block = Block.from_angles(alpha1, alpha3, float(np.exp(random.uniform(0.0, 1.1))))
        planes = {"beta_deg": random.uniform(0.0, 12.0), "phi_deg": random.uniform(28.0, 40.0)}
        planes["phi_back_deg"] = planes["phi_deg"]
        try:
            answer = respond(motions, block=block, gap_s=GAP_S, **planes)
        except InputError:  # it falls at rest, or no acceleration moves it
            continue
        if answer.kind != kind or answer.started_s is None or not has_rested(answer):
            continue
        record = joined(motions)
        springs = simulate(
            block, **planes, time_s=record.time_s, k_h=record.acceleration_g,
            until_s=float(record.time_s[-1]) + 2.0, damping=DAMPING,
        )  # fmt: skip
        turned = springs.turned_rad if slumping else -springs.turned_rad
        falls = float(turned.max()) > FALLEN_RAD
        same = answer.outcome is (Outcome.TOPPLED if falls else Outcome.STABLE)
        peak, error = answer.peak_theta_rad, answer.error_estimate
        off = 0.0 if falls or peak is None else abs(peak - float(turned.max()))
        allowed = None
        if error is not None:
            allowed = error + SPRINGS * (peak or 0.0) + ELASTIC_M / block.r3_m
        yield Case(same, off, allowed, answer)


def rows() -> list[Row]:
    """Run the cases."""
    random = np.random.default_rng(SEED)
    springs = "free block on stiff springs, joined record"
    return [
        _row("slides", "slider in rational numbers, joined record", slides(random)),
        _row("topples", "DOP853 at 1e-12, joined record", topples(random)),
        _row("slumps", springs, on_planes(random, "slumping")),
        _row("confined topples", springs, on_planes(random, "confined_toppling")),
    ]


def _row(subject: str, against: str, cases: Iterator[Case]) -> Row:
    wrong = within = undecided = 0
    for number, case in zip(range(OF_EACH), cases, strict=False):
        if case.allowed is None:
            undecided += 1
            continue
        if case.same_outcome and case.off <= case.allowed:
            within += 1
            continue
        wrong += 1
        print(
            f"sequence of {subject} {number}: {case.answer.outcome}, off by {case.off:.2e}, "
            f"allowed {case.allowed:.2e}",
            file=sys.stderr,
        )
    return Row(f"sequences of {subject}", against, OF_EACH, wrong, within, undecided)


if __name__ == "__main__":
    print(*rows(), sep="\n")
