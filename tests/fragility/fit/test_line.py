import subprocess
import sys

import numpy as np
import pytest
import statsmodels.api as sm

from rbfrag.fragility.fit.line import (
    FLOOR_FRACTION,
    TOLERANCE,
    Bins,
    clustered_line,
    event_bootstrap,
    fit_variance,
    iterate,
    powers,
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
    line, covariance, naive_errors, r_squared = clustered_line(x, y, weights, events)
    design = np.column_stack([np.ones_like(x), x])
    bread = np.linalg.inv(design.T @ (weights[:, None] * design))
    beta = bread @ design.T @ (weights * y)
    residuals = y - design @ beta
    meat = np.zeros((2, 2))
    for event in np.unique(events):
        in_event = events == event
        score = design[in_event].T @ (weights[in_event] * residuals[in_event])
        meat += np.outer(score, score)
    n, groups = x.size, np.unique(events).size
    sandwich = bread @ meat @ bread * groups / (groups - 1) * (n - 1) / (n - 2)
    assert line == pytest.approx(beta, rel=1e-10)
    assert covariance == pytest.approx(sandwich, rel=1e-8)
    naive = np.sqrt(np.diag(bread) * (weights @ residuals**2) / (n - 2))
    assert naive_errors == pytest.approx(naive, rel=1e-10)
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
    weight = (events != 3).astype(float)
    assert weighted_line(x, y, weight) == pytest.approx(
        weighted_line(x[weight > 0], y[weight > 0], np.ones(int(weight.sum()))), rel=1e-12
    )


def test_bootstrap_repeats_with_its_seed_and_sees_clusters():
    random = np.random.default_rng(4)
    events = np.repeat(np.arange(30), 20)
    order = np.argsort(x := np.exp(random.uniform(-3, 0, 30))[events], kind="stable")
    sigma = np.sqrt(1e-4 + 2e-3 * x)
    shared = 0.7 * x + sigma * (
        0.9 * random.normal(size=30)[events] + 0.44 * random.normal(size=600)
    )
    response = 0.7 * x + sigma * random.normal(size=600)
    spreads = []
    for y in (shared, response):
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
        ).covariance
        spread = draws[0].std(axis=0, ddof=1)
        assert spread[:2] == pytest.approx(np.sqrt(np.diag(clustered)), rel=0.35)
        spreads.append(spread[1])
    # Twenty points of one earthquake that move together are worth little more than one.
    assert spreads[0] > 2.5 * spreads[1]


def test_bins_hold_equal_counts():
    bins = Bins.equal_count(np.linspace(0.0, 1.0, 1003))
    counts = bins.sums(np.ones(1003))
    assert counts.size == 20
    assert counts.sum() == 1003
    assert counts.max() - counts.min() <= 1
    assert Bins.equal_count(np.linspace(0.0, 1.0, 12)).starts.size == 4


def test_bins_part_no_equal_intensities():
    random = np.random.default_rng(3)
    for _ in range(300):
        x = np.sort(random.integers(random.integers(2, 60), size=random.integers(6, 600)) / 8.0)
        starts = Bins.equal_count(x).starts
        assert starts[0] == 0
        assert np.all(np.diff(starts) > 0)
        assert np.all(x[starts[1:]] > x[starts[1:] - 1])
    x = np.repeat([1.0, 2.0, 3.0, 4.0, 5.0], [15, 10, 20, 30, 5])
    # the quotas of four bins of eighty points end at 20, 40 and 60
    assert Bins.equal_count(x).starts.tolist() == [0, 25, 45, 75]


@pytest.mark.parametrize("truth", [(1e-4, 2e-3), (1e-4, 1e-3, 2e-2)])
def test_exact_bin_variances_give_the_polynomial_back(truth):
    # Squared residuals equal to the bin's own variance leave nothing to estimate.
    x = np.repeat(np.linspace(0.05, 2.0, 20), 20)
    bins = Bins(x, np.arange(20) * 20)
    squared = sum(v * x**k for k, v in enumerate(truth)) * (398 / 400)
    assert fit_variance(bins, squared, np.ones(400), len(truth) - 1) == pytest.approx(
        truth, rel=1e-8
    )


def test_strong_motions_set_the_variance_as_much_as_weak_ones():
    # of a variance that grows with the square, a straight line through the bins is that of
    # ordinary least squares: weights would bend it to the weak motions
    x = np.repeat(np.linspace(0.05, 2.0, 20), 20)
    result = fit_variance(Bins(x, np.arange(20) * 20), 0.05 * x * x, np.ones(400), 1)
    assert result[1] == pytest.approx(0.05 * (400 / 398) * (x**3).sum() / (x**2).sum(), rel=1e-4)


def test_variance_stays_positive_where_a_free_fit_would_not():
    x = np.repeat(np.linspace(0.05, 2.0, 20), 20)
    bins = Bins(x, np.arange(20) * 20)
    squared = 0.02 * (x - 0.04)  # a straight fit would be negative at zero
    result = fit_variance(bins, squared, np.ones(400), 1)
    assert result[0] == pytest.approx(FLOOR_FRACTION * squared.min() * 400 / 398, rel=1e-12)
    assert result[1] > 0.0


def test_a_point_that_counts_twice_equals_two_points():
    random = np.random.default_rng(8)
    x = np.sort(random.uniform(0.1, 1.0, 200))
    squared = random.exponential(x)
    twice = np.repeat(np.arange(200), 2)
    single = fit_variance(Bins(x, np.arange(10) * 20), squared, np.full(200, 2.0), 1)
    double = fit_variance(Bins(x[twice], np.arange(10) * 40), squared[twice], np.ones(400), 1)
    assert single == pytest.approx(double, rel=1e-10)


def test_a_fit_loads_only_the_parts_of_statsmodels_that_it_needs() -> None:
    program = (
        "import sys, numpy as np\n"
        "from rbfrag.fragility.fit.line import clustered_line\n"
        "clustered_line(np.arange(4.0), np.array([0.0, 1.0, 3.0, 2.0]), np.ones(4), np.arange(4))\n"
        "import rbfrag.fragility.fit.likelihood\n"
        "print('statsmodels.api' in sys.modules)\n"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert answer.stdout == "False\n", answer.stderr
