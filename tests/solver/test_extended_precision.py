"""Real records: outcomes, peaks and error estimates against numbers of 32 digits.

The larger study of the same is `python -m benchmarks.certify --only borders accuracy`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.certify.borders import border
from benchmarks.extended.toppling import truth
from rbfrag.motions.readers import read_motions
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import POLARITIES, Polarity
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import OUTCOMES, simulate

DISTANCES = tuple(10.0**-n for n in range(3, 11))
"""Relative distances from the critical k_r at which the outcome must be the true one."""

NEAR_CRITICAL: tuple[tuple[str, str | None, float, Polarity], ...] = (
    ("nga_at2_misc/RSN30_PARKF_C05085.AT2", None, 30.0, "forward"),
    ("nga_at2_misc/RSN33_PARKF_TMB205.AT2", None, 10.0, "reverse"),
    ("nga_at2_misc/RSN77_SFERN_PUL164.AT2", None, 1.0, "forward"),
    ("nga_at2_misc/RSN763_LOMAP_GIL067.AT2", None, 0.1, "reverse"),
    ("nga_at2_misc/RSN31_PARKF_C08050.AT2", None, 3.0, "forward"),
    ("nga_at2_misc/Rinaldi228.AT2", None, 0.3, "reverse"),
    ("nga_at2_misc/Rinaldi228.AT2", "nga_at2_misc/RinaldiUP.AT2", 10.0, "reverse"),
    ("nga_at2_misc/Rinaldi318.AT2", "nga_at2_misc/RinaldiUP.AT2", 0.3, "forward"),
)


@pytest.mark.parametrize(("file", "up", "p2", "polarity"), NEAR_CRITICAL)
def test_outcome_next_to_critical(
    records_dir: Path, file: str, up: str | None, p2: float, polarity: Polarity
) -> None:
    motion = read_motions(records_dir / file)[0]
    vertical = None if up is None else read_motions(records_dir / up)[0]
    result = critical(motion, p2=p2, vertical=vertical, polarity=polarity)
    assert result.status == "found"
    assert result.lower is not None
    assert result.upper is not None
    excited = excitation(motion, vertical, polarity)
    # where the border lies, the reference decides by itself, to 17 digits
    upper = result.upper if result.certified else result.lower * (1.0 + 1e-9)
    answer = border(excited, p2, result.lower * excited.pga_g, upper * excited.pga_g)
    assert answer is not None
    assert result.kr == pytest.approx(answer[0], rel=2e-9)
    outcomes = set()
    for distance in DISTANCES:
        for side in (-1.0, 1.0):
            kr = answer[0] * (1.0 + side * distance)
            mine = OUTCOMES[simulate(excited, p2=p2, kr=kr).outcome].value
            assert mine == truth(excited, p2=p2, kr=kr).outcome, (distance, side)
            outcomes.add((side, mine))
    assert {(-1.0, "toppled"), (1.0, "stable")} <= outcomes


def test_peaks_errors_and_their_estimates(records_dir: Path) -> None:
    """Peaks within 1e-9 relative, and the error estimate no less than the true error.

    The estimate adds up, step by step, bounds of what a step leaves out and rounds off, each
    grown by the stiffness of the equation: pessimistic by design, so every one must hold here.
    """
    rng = np.random.default_rng(5)
    stays = 0
    for file in sorted({name for name, *_ in NEAR_CRITICAL}):
        motion = read_motions(records_dir / file)[0]
        for polarity in POLARITIES:
            excited = excitation(motion, None, polarity)
            for p2 in (30.0, 10.0, 3.0, 1.0, 0.3, 0.1):
                kr = float(excited.pga_g * np.exp(rng.uniform(np.log(0.05), np.log(0.9))))
                run = simulate(excited, p2=p2, kr=kr)
                true = truth(excited, p2=p2, kr=kr)
                assert OUTCOMES[run.outcome].value == true.outcome
                assert run.samples_moved == true.intervals_moved
                if true.outcome != "stable" or true.peak_rad == 0.0:
                    continue
                stays += 1
                error = abs((run.peak_rad - true.peak_rad) - true.peak_low_rad)
                assert error <= 1e-9 * true.peak_rad
                assert error <= run.error_rad
                # an estimate that were always huge would bound everything and tell nothing
                assert run.error_rad < 1e-6 * true.peak_rad
    assert stays > 40
