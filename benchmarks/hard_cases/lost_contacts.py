"""Blocks that lose a contact, beside a free block on stiff springs that knows no mechanism.

Half are those of the draws of tests/physics/lost_contacts.py; the others are under pulses of the
recorded motions that are at hand, if there are any. What rigid contact leaves open in impacts is in
the error estimate.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import islice

import numpy as np

from benchmarks.hard_cases import Row
from benchmarks.page import find_records
from rbfrag.motions.ground_motion import GroundMotion
from tests.physics.lost_contacts import SORTS, LostContact, lost_contacts

COUNT = 50
SEED = 1998

AROUND_PEAK_S = 4.0


def of_records(random: np.random.Generator) -> Iterator[GroundMotion]:
    """Some seconds about the peak of recorded motions, scaled to 0.5 to 1.5 g."""
    motions = find_records().motions
    while True:
        motion = motions[int(random.integers(len(motions)))]
        dt_s = motion.dt_s
        if dt_s is None or not motion.pga_g > 0.0:
            continue
        peak = int(np.argmax(np.abs(motion.acceleration_g)))
        half = int(AROUND_PEAK_S / 2.0 / dt_s)
        a = motion.acceleration_g[max(peak - half, 0) : peak + half]
        yield GroundMotion(a * (random.uniform(0.5, 1.5) / np.abs(a).max()), dt_s)


def rows() -> list[Row]:
    """Run the cases."""
    random = np.random.default_rng(SEED)
    drawn = [
        *islice(lost_contacts(SEED), COUNT // 2),
        *islice(lost_contacts(SEED + 1, of_records(random)), COUNT - COUNT // 2),
    ]
    return [_row(sort, [case for case in drawn if case.sort == sort]) for sort in SORTS]


def _row(sort: str, cases: list[LostContact]) -> Row:
    wrong = within = undecided = 0
    parts = []
    for case in cases:
        error = case.answer.error_estimate
        if error is None:
            undecided += 1
            continue
        springs = case.on_springs()
        differences = case.differences(springs)
        parts.append((max(map(abs, differences)) / case.greatest, error / case.greatest))
        if case.is_covered(springs, error):
            within += 1
            continue
        wrong += 1
        print(
            f"{sort}: {case.greatest:.6f}, of springs {differences} less; error estimate "
            f"{error:.1e}",
            file=sys.stderr,
        )
    apart, estimate = np.quantile(np.array(parts), (0.5, 0.9), axis=0).T
    print(
        f"{sort}: difference {apart[0]:.2%} of the peak (median), {apart[1]:.1%} (nine in ten); "
        f"estimate {estimate[0]:.1%} and {estimate[1]:.0%}",
        file=sys.stderr,
    )
    return Row(f"lost contact: {sort}", "free block on stiff springs", len(cases), wrong, within,
               undecided)  # fmt: skip


if __name__ == "__main__":
    print(*rows(), sep="\n")
