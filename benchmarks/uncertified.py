"""What searches without certificate hide:  python -m benchmarks.uncertified [--count N] [--write].

For each kind of synthetic record of the hard cases, up to 3 g, N searches without certificate (500)
are compared with 20,000 blocks scanned above each answer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.hard_cases._records import SHAPES
from benchmarks.page import parser, report
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.single_run import TOPPLED
from rbfrag.solver.search.critical import critical

SCANNED = 20_000
SEED = 46

WIDE = 0.02
"""(upper - lower)/lower above which an interval counts as wide."""

HIDES = 0.005
"""Distance of a block that topples above `lower`, over it, from which on it counts as hidden."""


def random_motion(rng: np.random.Generator, name: str) -> tuple[GroundMotion, float] | None:
    """Return a motion of 0.5 to 3 g and a p² [1/s²]; None where its samples are all zero."""
    samples = SHAPES[name](rng, int(rng.integers(120, 700)))
    most = float(np.abs(samples).max())
    if most == 0.0:
        return None
    p2 = float(np.exp(rng.uniform(np.log(0.1), np.log(30.0))))
    ph = float(np.exp(rng.uniform(np.log(0.0005), np.log(0.1))))
    return GroundMotion(samples * (rng.uniform(0.5, 3.0) / most), ph / p2**0.5), p2


def row_of(name: str, count: int) -> str:
    """Run the searches of one kind of record; return its row of the table."""
    rng = np.random.default_rng(SEED)
    searches = hidden = wide = 0
    worst = 0.0
    while searches < count:
        drawn = random_motion(rng, name)
        if drawn is None:
            continue
        motion, p2 = drawn
        answer = critical(motion, p2=p2)
        if answer.certified or answer.lower is None or answer.upper is None:
            continue
        searches += 1
        wide += answer.upper / answer.lower - 1.0 > WIDE
        top = max(answer.k_up_over_pga or 0.0, answer.lower) * answer.pga_g
        kr = np.linspace(answer.lower * answer.pga_g, top, SCANNED + 1)[1:]
        toppled = kr[simulate_many(excitation(motion), p2=p2, kr=kr).outcome == TOPPLED]
        if toppled.size:
            beyond = float(toppled.max()) / (answer.lower * answer.pga_g) - 1.0
            worst, hidden = max(worst, beyond), hidden + (beyond > HIDES)
    return f"| {name} | {searches} | {hidden} | {worst:.2%} | {wide} |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=500, help="searches of each kind")
    chosen = options.parse_args(arguments)
    head = (
        "| records | without certificate | hide more than 0.5 % | most | wider than 2 % |\n"
        "| --- | --- | --- | --- | --- |"
    )
    rows = [row_of(name, chosen.count) for name in SHAPES]
    report("uncertified", "\n".join([head, *rows]), write=chosen.write)


if __name__ == "__main__":
    main()
