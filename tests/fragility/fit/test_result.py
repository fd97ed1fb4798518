"""Scores by hand, bins of calibration that add up, scatter against drawn data."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.fragility.fit.data import ScoredBlocks, critical_outcomes
from rbfrag.fragility.fit.result import (
    CLIP,
    EDGES,
    brier,
    calibration,
    calibration_bins,
    log_loss,
    nested_scatter,
)


def test_outcomes_of_found_and_censored_points():
    y = np.array([0.5, 0.05, np.nan])
    is_found = np.array([True, False, True])
    y0 = np.array([[1.0], [0.2], [np.nan]]) * np.geomspace(0.1, 4.0, 25)
    outcome, is_known = critical_outcomes(y, is_found, y0)
    assert np.array_equal(outcome[0], (y0[0] <= 0.5).astype(float))
    assert is_known[0].all()
    # The censored value lies below 0.05: blocks above are safe, of those below nothing is known.
    assert np.array_equal(is_known[1], y0[1] > 0.05)
    assert not outcome[1].any()
    assert not is_known[2].any()


def test_scores_by_hand():
    p = np.array([[0.8, 0.4, 0.0]])
    outcome = np.array([[1.0, 0.0, 1.0]])
    is_known = np.array([[True, True, False]])
    assert log_loss(p, outcome, is_known) == pytest.approx(-(math.log(0.8) + math.log(0.6)) / 2)
    assert brier(p, outcome, is_known) == pytest.approx((0.04 + 0.16) / 2)
    everything = np.ones((1, 3), dtype=bool)
    assert log_loss(p, outcome, everything) == pytest.approx(
        -(math.log(0.8) + math.log(0.6) + math.log(CLIP)) / 3
    )


@pytest.mark.parametrize("between", [0, 5, 50])
def test_calibration_of_a_model_that_is_far_too_sure(between):
    from scipy.optimize import minimize

    # nearly all probabilities are 0 or 1 and many of them wrong: whole Newton steps run away
    rng = np.random.default_rng(0)
    p = np.concatenate([np.zeros(500), np.ones(500), rng.uniform(size=between)])
    toppled = (rng.uniform(size=p.size) < np.repeat([0.02, 0.9, 0.5], [500, 500, between])) * 1.0
    score = calibration(p[None], toppled[None], np.ones((1, p.size), dtype=bool))
    x = np.log(np.clip(p, CLIP, 1 - CLIP) / (1 - np.clip(p, CLIP, 1 - CLIP)))

    def loss(b):
        eta = b[0] + b[1] * x
        return float(np.sum(np.logaddexp(0.0, eta) - toppled * eta))

    best = minimize(loss, [0.0, 0.3], method="BFGS", tol=1e-10)
    assert loss([score.intercept, score.slope]) <= best.fun + 1e-9
    assert (score.intercept, score.slope) == pytest.approx(best.x, abs=1e-4)


def blocks(seed: int = 0, n: int = 2000, events: int = 40) -> tuple[ScoredBlocks, np.ndarray]:
    """Blocks that topple with exactly the probability that was predicted."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(size=(n, 25))
    toppled = (rng.uniform(size=p.shape) < p).astype(float)
    return ScoredBlocks(toppled, np.ones(p.shape, dtype=bool), np.arange(n) % events, "made up"), p


def test_a_calibrated_model_lies_on_the_diagonal() -> None:
    seen, p = blocks()
    bins = calibration_bins(seen, p)
    assert bins.blocks.sum() == p.size
    assert bins.events == 40
    assert bins.predicted.size == EDGES.size - 1
    assert (np.diff(bins.predicted) > 0.0).all()
    np.testing.assert_allclose(bins.observed, bins.predicted, atol=0.02)
    assert ((bins.low <= bins.observed) & (bins.observed <= bins.high)).all()
    inside = (bins.low <= bins.predicted) & (bins.predicted <= bins.high)
    assert inside.mean() > 0.7


def test_an_over_confident_model_does_not() -> None:
    seen, p = blocks()
    logit = np.log(p / (1.0 - p))
    bins = calibration_bins(seen, 1.0 / (1.0 + np.exp(-3.0 * logit)))
    low = bins.predicted < 0.3
    assert (bins.observed[low] > bins.predicted[low]).all()


def test_unknown_outcomes_do_not_count() -> None:
    seen, p = blocks(n=400)
    is_known = np.zeros(p.shape, dtype=bool)
    is_known[:, 3] = True
    bins = calibration_bins(ScoredBlocks(seen.failed, is_known, seen.event, ""), p)
    held = np.histogram(p[:, 3], EDGES)[0]
    assert bins.blocks.sum() == held[held >= 20].sum()


def test_intervals_are_wider_where_earthquakes_differ() -> None:
    seen, p = blocks()
    same = calibration_bins(seen, p)
    rng = np.random.default_rng(1)
    shift = rng.normal(size=40)[np.arange(2000) % 40][:, None]
    real = 1.0 / (1.0 + np.exp(-(np.log(p / (1.0 - p)) + shift)))
    toppled = (rng.uniform(size=p.shape) < real).astype(float)
    apart = calibration_bins(ScoredBlocks(toppled, seen.is_known, seen.event, ""), p)
    middle = slice(4, 9)
    assert ((apart.high - apart.low) > 2.0 * (same.high - same.low))[middle].all()
    assert calibration_bins(seen, p).low == pytest.approx(same.low)


def residuals(events, motions, points, sd, seed=1):
    random = np.random.default_rng(seed)
    motion = np.repeat(np.arange(events * motions), points)
    event = motion // motions
    residual = (
        sd[0] * random.normal(size=events)[event]
        + sd[1] * random.normal(size=events * motions)[motion]
        + sd[2] * random.normal(size=motion.size)
    )
    return residual, event, motion


def test_known_parts_come_back():
    scatter = nested_scatter(*residuals(400, 4, 6, (0.08, 0.11, 0.25)))
    assert scatter["between_events"] == pytest.approx(0.08, rel=0.2)
    assert scatter["between_motions"] == pytest.approx(0.11, rel=0.1)
    assert scatter["within_motion"] == pytest.approx(0.25, rel=0.02)
    assert scatter["total"] == pytest.approx(np.hypot(np.hypot(0.08, 0.11), 0.25), rel=0.05)


def test_balanced_data_agree_with_the_textbook_table():
    residual, event, motion = residuals(6, 3, 4, (0.5, 0.3, 0.2))
    y = residual.reshape(6, 3, 4)
    within = y.var(axis=2, ddof=1).mean()
    of_motions = 4 * y.mean(axis=2).var(axis=1, ddof=1).mean()
    of_events = 12 * y.mean(axis=(1, 2)).var(ddof=1)
    scatter = nested_scatter(residual, event, motion)
    assert scatter["within_motion"] ** 2 == pytest.approx(within)
    assert scatter["between_motions"] ** 2 == pytest.approx(max((of_motions - within) / 4, 0))
    assert scatter["between_events"] ** 2 == pytest.approx(max((of_events - of_motions) / 12, 0))


def test_data_without_nesting_have_no_split():
    assert nested_scatter(np.ones(4), np.arange(4), np.arange(4)) is None
    assert nested_scatter(np.ones(4), np.zeros(4, int), np.arange(4)) is None
