"""Both ends of a bracket lie outside the error of the runs that decided them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.extended.toppling import truth
from benchmarks.hard_cases._records import made_up
from rbfrag.solver.excitation import excitation
from rbfrag.solver.search.critical import critical

ROUGH = (1, 3, 54, 100, 381, 490)
"""Made-up records of coarse levels, of which a cubic over several samples says little."""


@pytest.mark.parametrize("number", ROUGH)
def test_the_lower_end_topples_and_the_upper_stays(number: int) -> None:
    rng = np.random.default_rng(21)
    for _ in range(number + 1):
        motion, p2 = made_up(rng)
    result = critical(motion, p2=p2)
    assert result.certified
    assert result.lower is not None
    assert result.upper is not None
    drive = excitation(motion)
    assert truth(drive, p2=p2, kr=result.lower * drive.pga_g).outcome == "toppled"
    assert truth(drive, p2=p2, kr=result.upper * drive.pga_g).outcome == "stable"
    # the ends are near one another all the same
    assert result.upper - result.lower < 2e-9 * result.upper


def test_where_no_run_can_tell_an_interval_that_is_proven_to_topple_does() -> None:
    """The block at the border chatters: its run is undetermined, and its neighbour is safe."""
    rng = np.random.default_rng(21)
    for _ in range(1688):
        motion, p2 = made_up(rng)
    result = critical(motion, p2=p2)
    assert result.certified
    assert result.lower is not None
    drive = excitation(motion)
    assert "toppled" not in result.points.outcome
    assert truth(drive, p2=p2, kr=result.lower * drive.pga_g).outcome == "toppled"
