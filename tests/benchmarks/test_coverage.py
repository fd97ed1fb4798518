"""Intervals hold the truth as often as they say, where models are simulated from themselves."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.coverage import INTERVALS, coverage
from benchmarks.held_out import outcomes, read, studied
from benchmarks.joint_failures import PUBLISHED
from rbfrag.db.location import REFERENCE


@pytest.mark.parametrize("name", ["pgv_pga", "record"])
def test_intervals_hold_the_truth_as_often_as_they_say(name: str) -> None:
    source, _ = read(REFERENCE)
    some = source.only(np.isin(source.table.p2, (10.0, 1.0)))
    data = outcomes(some)
    result = coverage(studied(some, data, name), PUBLISHED[name], sets=60, seed=1)
    share = dict(zip(INTERVALS, result.share.tolist(), strict=True))
    assert 0.93 < share["CR3, t with nu(x)"] < 0.98
    assert share["naive"] < 0.8
    assert share["CR1, normal"] < share["CR3, t with G-1"] < share["CR3, t with nu(x)"]
    assert result.error.max() < 0.04
