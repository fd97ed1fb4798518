"""What searches without certificate hide, and how tight they are.

    python -m benchmarks.uncertified [--count N] [--records FOLDER ...] [--write]

For each kind of synthetic record of the hard cases, up to 3 g, N searches without certificate (500)
are compared with 20,000 blocks scanned above each answer. Of the recorded motions with a PGA of
1 g and more, all combinations of the default campaign are searched; a line says why an interval is
wide. The built-in data set has 47 with a critical value, on four motions.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.hard_cases._records import SHAPES
from benchmarks.page import ROOT, find_records, report
from rbfrag.fragility.fit.data import NARROW
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import POLARITIES
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.toppling_kernel import TOPPLED
from rbfrag.solver.results import DEFAULT_P2
from rbfrag.solver.search.critical import critical

SCANNED = 20_000
SEED = 46

STRONG_G = 1.0
"""PGA from which on recorded motions are searched [g]: proofs fail above it alone."""

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


def hidden(motion: GroundMotion, answer: CriticalResult) -> float:
    """Return how far above `lower` a scanned block topples, over it; zero where none does."""
    assert answer.lower is not None
    lower = answer.lower * answer.pga_g
    kr = np.linspace(lower, max(answer.k_up_over_pga or 0.0, answer.lower) * answer.pga_g,
                     SCANNED + 1)[1:]  # fmt: skip
    shaken = excitation(motion, None, answer.polarity)
    toppled = kr[simulate_many(shaken, p2=answer.p2, kr=kr).outcome == TOPPLED]
    return float(toppled.max(initial=lower)) / lower - 1.0


def row_of(name: str, count: int) -> str:
    """Run the searches of one kind of record; return its row of the table."""
    rng = np.random.default_rng(SEED)
    searches = hiding = wide = 0
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
        wide += answer.upper / answer.lower - 1.0 > NARROW
        beyond = hidden(motion, answer)
        worst, hiding = max(worst, beyond), hiding + (beyond > HIDES)
    return f"| {name} | {searches} | {hiding} | {worst:.2%} | {wide} |"


def recorded(folders: Sequence[Path]) -> str:
    """Search the strong motions of some folders; return a table of counts and the wide ones."""
    by_samples = {
        motion.sha256: motion
        for folder in folders
        for motion in find_records(folder).motions
        if motion.pga_g >= STRONG_G
    }
    with_value = certified = narrow = 0
    worst = 0.0
    wide = []
    for motion in by_samples.values():
        for polarity in POLARITIES:
            for p2 in DEFAULT_P2:
                answer = critical(motion, p2=p2, polarity=polarity)
                if answer.lower is None or answer.upper is None:
                    continue
                with_value += 1
                if answer.certified:
                    certified += 1
                    continue
                worst = max(worst, hidden(motion, answer))
                if answer.upper / answer.lower - 1.0 <= NARROW:
                    narrow += 1
                else:
                    wide.append(
                        f"- {motion.name}, {polarity}, p² = {p2:g} s⁻²: {answer.lower:.4g} to "
                        f"{answer.upper:.4g} PGA; {'; '.join(answer.warnings)}"
                    )
    table = (
        "| recorded motions with PGA ≥ 1 g | critical value found | certified | not certified, at "
        "most 2 % wide | wider | most hidden |\n| --- | --- | --- | --- | --- | --- |\n"
        f"| {len(by_samples)} | {with_value} | {certified} | {narrow} | {len(wide)} | {worst:.2%} |"
    )
    return "\n".join([table, *(["", *wide] if wide else [])])


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=500, help="searches of each kind")
    options.add_argument(
        "--records", type=Path, nargs="*", default=[], help="folders of recorded motions"
    )
    options.add_argument("--write", action="store_true", help="keep the tables in results")
    chosen = options.parse_args(arguments)
    tables = []
    if chosen.count:
        head = (
            "| records | without certificate | hide more than 0.5 % | most | wider than 2 % |\n"
            "| --- | --- | --- | --- | --- |"
        )
        tables.append("\n".join([head, *(row_of(name, chosen.count) for name in SHAPES)]))
    if chosen.records:
        tables.append(recorded(chosen.records))
    page = ROOT / "docs" / "evidence" / "certificate.md"
    report("uncertified", "\n\n".join(tables), write=chosen.write, page=page)


if __name__ == "__main__":
    main()
