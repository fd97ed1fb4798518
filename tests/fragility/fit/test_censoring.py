"""Weights of known outcomes, bounds of scores and shares of what is not known."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.fragility.fit.censoring import (
    LEAST_FOLLOWED,
    NODES,
    censoring_weights,
    score_bounds,
    unknown_shares,
)
from rbfrag.fragility.fit.scores import ScoredBlocks, critical_outcomes, log_loss

ASKED = np.array([0.9, 0.6, 0.4, 0.3, 0.2])


def searched(n: int = 60_000, seed: int = 3):
    """Critical k/PGA of a block, and where its model ends, drawn apart."""
    rng = np.random.default_rng(seed)
    true = np.exp(rng.normal(-1.0, 0.5, n))
    ends = np.exp(rng.normal(-1.3, 0.6, n))
    observed = true >= ends
    return true, np.where(observed, true, ends), observed


def test_known_outcomes_stand_for_those_not_known():
    true, critical, observed = searched()
    asked = np.tile(ASKED, (true.size, 1))
    failed, known = critical_outcomes(critical, observed, asked)
    weights = censoring_weights(critical, observed, asked, np.ones(true.size))
    assert not weights[~known].any()
    share = (true[:, None] >= asked).mean(axis=0)
    found = np.average(failed, axis=0, weights=weights)
    assert found == pytest.approx(share, abs=0.01)
    # each column's weights make up for what is missing in it
    assert weights.mean(axis=0) == pytest.approx(1.0, abs=0.02)
    # what is known counts too many failures: a block that fails is known to, one that stands is
    # known to stand only while its model holds
    plain = np.average(failed, axis=0, weights=known)
    assert np.all(plain[2:] > share[2:] + 0.03)


def test_without_ends_of_the_model_every_outcome_counts_once():
    true, _, _ = searched(500)
    asked = np.tile(ASKED, (true.size, 1))
    weights = censoring_weights(true, np.ones(true.size, dtype=bool), asked, np.ones(true.size))
    assert np.array_equal(weights, np.ones(asked.shape))


def test_shaking_that_few_runs_reach_is_not_judged():
    n = 1000
    ends = np.linspace(0.1, 1.0, n)
    asked = np.tile([0.9, 0.5, 0.2], (n, 1))
    weights = censoring_weights(ends, np.zeros(n, dtype=bool), asked, np.ones(n))
    # of all runs 8/9, 4/9 and 1/9 hold at that shaking
    assert weights[:, :2].max(axis=0) == pytest.approx([9 / 8, 9 / 4], rel=0.01)
    assert LEAST_FOLLOWED > 1 / 9
    assert not weights[:, 2].any()


def test_each_block_has_its_own_curve_and_rare_ones_share_one():
    rng = np.random.default_rng(0)
    block = np.repeat([1.0, 2.0], 300)
    ends = np.where(block == 1.0, 0.01, rng.uniform(0.2, 0.6, 600))
    asked = np.full((600, 1), 0.4)
    weights = censoring_weights(ends, np.zeros(600, dtype=bool), asked, block)
    assert np.array_equal(weights[:300], np.ones((300, 1)))
    assert weights[300:].max() == pytest.approx(2.0, rel=0.2)
    alone = censoring_weights(ends, np.zeros(600, dtype=bool), asked, np.arange(600.0))
    together = censoring_weights(ends, np.zeros(600, dtype=bool), asked, np.zeros(600))
    assert np.array_equal(alone, together)


def test_bounds_enclose_the_score_whatever_the_unknown_outcomes_are():
    rng = np.random.default_rng(1)
    p = rng.uniform(size=(200, 4))
    truth = (rng.uniform(size=p.shape) < 0.5) * 1.0
    known = rng.uniform(size=p.shape) < 0.7
    asked = np.ones(p.shape, dtype=bool)
    judged = ScoredBlocks(np.where(known, truth, 0.0), known, np.zeros(200, dtype=int), "")
    low, high = score_bounds(judged, p, asked)
    assert low < log_loss(p, truth, asked) < high
    best = np.where(known, truth, p > 0.5)
    assert low == pytest.approx(log_loss(p, best, asked))
    everything = ScoredBlocks(truth, asked, judged.event, "")
    assert score_bounds(everything, p, asked) == pytest.approx([log_loss(p, truth, asked)] * 2)


def test_shares_are_those_of_like_blocks_and_shaking():
    ratio = np.tile(np.geomspace(0.02, 0.95, NODES), (90, 1))
    strength = np.repeat([0.1, 0.3, 0.5], 30)
    # the weak blocks' model never ends, the others' below a ratio that rises with strength
    known = (ratio > (strength[:, None] - 0.1)) | (strength[:, None] == 0.1)
    curves = unknown_shares("k_over_pga", ratio, strength, known)
    assert curves["edges"] == pytest.approx([np.sqrt(0.03), np.sqrt(0.15)])
    table = np.array(curves["shares"])
    assert table.shape == (3, NODES)
    assert not table[0].any()
    assert np.array_equal(table[1], (ratio[0] <= 0.2) * 1.0)
    assert np.array_equal(table[2], (ratio[0] <= 0.4) * 1.0)
    assert np.exp(curves["first"]) == pytest.approx(0.02)
    assert np.exp(curves["first"] + (NODES - 1) * curves["step"]) == pytest.approx(0.95)
