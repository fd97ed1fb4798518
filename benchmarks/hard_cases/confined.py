"""Confined topples through to rest or fall, beside a free block on stiff springs.

Wrong is another end, or a peak that is off by more than the error estimate.
"""

from __future__ import annotations

import sys
from itertools import islice

from benchmarks.hard_cases import Row
from rbfrag.solver.results import Outcome
from tests.physics.confined_draws import confined_topples

COUNT = 200
SEED = 77


def rows() -> list[Row]:
    """Run the cases."""
    wrong = within = undecided = 0
    for number, case in enumerate(islice(confined_topples(SEED), COUNT)):
        answer = case.answer
        if answer.error_estimate is None or answer.outcome is Outcome.UNDETERMINED:
            undecided += 1
            continue
        springs = case.on_springs()
        falls = answer.outcome is Outcome.TOPPLED
        if case.ends_as(springs) and (falls or case.is_covered(springs)):
            within += 1
            continue
        wrong += 1
        print(
            f"confined {number}: {answer.outcome}, {answer.peak_theta_rad} rad; springs "
            f"{-springs.turned_rad.min()!r}; error estimate {answer.error_estimate:.1e}",
            file=sys.stderr,
        )
    return [Row("confined topples to rest or fall", "free block on stiff springs", COUNT, wrong,
                within, undecided)]  # fmt: skip


if __name__ == "__main__":
    print(*rows(), sep="\n")
