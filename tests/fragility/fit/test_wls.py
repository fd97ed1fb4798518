import numpy as np
import pytest
import statsmodels.api as sm

from rbfrag.fragility.fit.variance import Bins, powers
from rbfrag.fragility.fit.wls import (
    TOLERANCE,
    clustered_line,
    event_bootstrap,
    iterate,
    weighted_line,
)


@pytest.fixture(scope="module")
def points():
    random = np.random.default_rng(11)
    n = 600
    x = np.sort(np.exp(random.uniform(-4, 0.5, n)))
    y = 0.002 + 0.72 * x + random.normal(size=n) * np.sqrt(1e-4 + 3e-3 * x)
    return x, y, random.uniform(0.1, 5.0, n), random.integers(25, size=n)


def test_own_line_equals_statsmodels(points):
    x, y, weights, _ = points
    theirs = sm.WLS(y, sm.add_constant(x), weights=weights).fit().params
    assert weighted_line(x, y, weights) == pytest.approx(theirs, rel=1e-11)


def test_clustered_covariance_equals_the_sandwich(points):
    x, y, weights, events = points
    line, covariance, r_squared = clustered_line(x, y, weights, events)
    design = np.column_stack([np.ones_like(x), x])
    bread = np.linalg.inv(design.T @ (weights[:, None] * design))
    beta = bread @ design.T @ (weights * y)
    residuals = y - design @ beta
    meat = np.zeros((2, 2))
    for event in np.unique(events):
        own = events == event
        score = design[own].T @ (weights[own] * residuals[own])
        meat += np.outer(score, score)
    n, groups = x.size, np.unique(events).size
    sandwich = bread @ meat @ bread * groups / (groups - 1) * (n - 1) / (n - 2)
    assert line == pytest.approx(beta, rel=1e-10)
    assert covariance == pytest.approx(sandwich, rel=1e-8)
    mean = weights @ y / weights.sum()
    share = 1 - weights @ residuals**2 / (weights @ (y - mean) ** 2)
    assert r_squared == pytest.approx(share, rel=1e-10)


@pytest.mark.parametrize("degree", [1, 2])
def test_the_fit_is_a_fixed_point(points, degree):
    x, y, _, _ = points
    bins = Bins.equal_count(x)
    fit = iterate(bins, y, np.ones(x.size), degree)
    assert fit.converged
    weights = 1.0 / (powers(x, degree) @ fit.parameters[2:])
    assert weighted_line(x, y, weights) == pytest.approx(fit.parameters[:2], rel=1e-12)
    again = iterate(bins, y, np.ones(x.size), degree, fit.parameters)
    assert again.converged
    assert again.iterations <= 2
    assert again.parameters == pytest.approx(fit.parameters, rel=1e3 * TOLERANCE)


def test_a_start_elsewhere_ends_at_the_same_fit(points):
    x, y, _, _ = points
    bins = Bins.equal_count(x)
    fit = iterate(bins, y, np.ones(x.size), 1)
    other = iterate(bins, y, np.ones(x.size), 1, np.array([0.1, 0.3, 1e-2, 1e-1]))
    assert other.parameters == pytest.approx(fit.parameters, rel=1e-5)


def test_leaving_points_out_equals_zero_weight(points):
    x, y, _, events = points
    kept = (events != 3).astype(float)
    assert weighted_line(x, y, kept) == pytest.approx(
        weighted_line(x[kept > 0], y[kept > 0], np.ones(int(kept.sum()))), rel=1e-12
    )


def test_bootstrap_repeats_with_its_seed_and_sees_clusters():
    random = np.random.default_rng(4)
    events = np.repeat(np.arange(30), 20)
    order = np.argsort(x := np.exp(random.uniform(-3, 0, 30))[events], kind="stable")
    sigma = np.sqrt(1e-4 + 2e-3 * x)
    shared = 0.7 * x + sigma * (
        0.9 * random.normal(size=30)[events] + 0.44 * random.normal(size=600)
    )
    own = 0.7 * x + sigma * random.normal(size=600)
    spreads = []
    for y in (shared, own):
        bins = Bins.equal_count(x[order])
        fit = iterate(bins, y[order], np.ones(600), 1)
        draws = [
            event_bootstrap(
                bins, y[order], events[order], 1, fit.parameters, replicates=200, seed=seed
            )[0]
            for seed in (0, 0, 1)
        ]
        assert np.array_equal(draws[0], draws[1])
        assert not np.array_equal(draws[0], draws[2])
        clustered = clustered_line(
            x[order],
            y[order],
            1.0 / (powers(x[order], 1) @ fit.parameters[2:]),
            events[order],
        )[1]
        spread = draws[0].std(axis=0, ddof=1)
        assert spread[:2] == pytest.approx(np.sqrt(np.diag(clustered)), rel=0.35)
        spreads.append(spread[1])
    # Twenty points of one earthquake that move together are worth little more than one.
    assert spreads[0] > 2.5 * spreads[1]
