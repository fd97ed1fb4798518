"""Bins of calibration: counts that add up, shares that are shares, intervals of earthquakes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rbfrag.fragility.fit.calibration_bins import EDGES, calibration_bins
from rbfrag.fragility.fit.judgement import Outcomes


def blocks(seed: int = 0, n: int = 2000, events: int = 40) -> tuple[object, Outcomes, np.ndarray]:
    """Blocks that topple with exactly the probability that was predicted."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(size=(n, 25))
    toppled = (rng.uniform(size=p.shape) < p).astype(float)
    data = SimpleNamespace(event=np.arange(n) % events)
    return data, Outcomes(p, toppled, np.ones(p.shape, dtype=bool), "made up"), p


def test_a_calibrated_model_lies_on_the_diagonal() -> None:
    data, seen, p = blocks()
    bins = calibration_bins(data, seen, p)  # type: ignore[arg-type]
    assert bins.blocks.sum() == p.size
    assert bins.events == 40
    assert bins.predicted.size == EDGES.size - 1
    assert (np.diff(bins.predicted) > 0.0).all()
    np.testing.assert_allclose(bins.observed, bins.predicted, atol=0.02)
    assert ((bins.low <= bins.observed) & (bins.observed <= bins.high)).all()
    inside = (bins.low <= bins.predicted) & (bins.predicted <= bins.high)
    assert inside.mean() > 0.7


def test_an_over_confident_model_does_not() -> None:
    data, seen, p = blocks()
    logit = np.log(p / (1.0 - p))
    bins = calibration_bins(data, seen, 1.0 / (1.0 + np.exp(-3.0 * logit)))  # type: ignore[arg-type]
    low = bins.predicted < 0.3
    assert (bins.observed[low] > bins.predicted[low]).all()


def test_unknown_outcomes_do_not_count() -> None:
    data, seen, p = blocks(n=400)
    known = np.zeros(p.shape, dtype=bool)
    known[:, 3] = True
    bins = calibration_bins(data, Outcomes(p, seen.toppled, known, ""), p)  # type: ignore[arg-type]
    held = np.histogram(p[:, 3], EDGES)[0]
    assert bins.blocks.sum() == held[held >= 20].sum()


def test_intervals_are_wider_where_earthquakes_differ() -> None:
    data, seen, p = blocks()
    same = calibration_bins(data, seen, p)  # type: ignore[arg-type]
    rng = np.random.default_rng(1)
    shift = rng.normal(size=40)[np.arange(2000) % 40][:, None]
    real = 1.0 / (1.0 + np.exp(-(np.log(p / (1.0 - p)) + shift)))
    toppled = (rng.uniform(size=p.shape) < real).astype(float)
    apart = calibration_bins(data, Outcomes(p, toppled, seen.known, ""), p)  # type: ignore[arg-type]
    middle = slice(4, 9)
    assert ((apart.high - apart.low) > 2.0 * (same.high - same.low))[middle].all()
    assert calibration_bins(data, seen, p).low == pytest.approx(same.low)  # type: ignore[arg-type]
