"""Intervals with errors of measurement, against joint Monte Carlo of block and parameters."""

from __future__ import annotations

import numpy as np

from benchmarks.measurement_errors import end_errors, surveys


def test_the_ends_are_those_of_joint_monte_carlo() -> None:
    errors = end_errors(12, 20_000, 7)
    mean, low, high = np.sqrt(np.square(errors).mean(axis=0))
    assert mean < 0.8
    assert low < 2.0
    assert high < 2.0


def test_intervals_contain_the_true_probability() -> None:
    results = surveys(300, 3)
    assert results["blocks"] > 40
    assert 0.85 < results["measured"] <= 1.0
    assert results["stated"] < 0.5
