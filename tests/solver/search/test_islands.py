"""The map as it is handed on."""

from __future__ import annotations

import numpy as np

from rbfrag.solver.search.certified import CertifiedMap
from rbfrag.solver.search.islands import outcome_intervals
from rbfrag.solver.search.march import SAFE, TOPPLES


def test_ends_that_fall_together_in_the_quotient_leave_no_interval() -> None:
    # two neighbouring numbers whose quotients by this PGA are one
    pga = 3.0
    edge = next(x for x in np.linspace(0.1, 0.2, 997) if x / pga == np.nextafter(x, 1.0) / pga)
    above = np.nextafter(edge, 1.0)
    high = np.array([1.0, above, edge])
    low = np.array([above, edge, 0.01])
    found = CertifiedMap(
        k_up=1.0, low=low, high=high, verdict=np.array([SAFE, TOPPLES, SAFE]),
        point=np.full(3, np.nan), reached=0.01, complete=True, runs=3, steps=3,
    )  # fmt: skip
    kept = outcome_intervals(found, pga, 1.0)
    assert kept.outcome == ("safe", "safe")
    assert (kept.k_hi > kept.k_lo).all()
    np.testing.assert_array_equal(kept.k_lo[1:], kept.k_hi[:-1])
