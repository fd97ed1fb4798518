import numpy as np
import pytest

from rbfrag.fragility.fit.variance import FLOOR_SHARE, Bins, fit_variance


def test_bins_hold_equal_counts():
    bins = Bins.equal_count(np.linspace(0.0, 1.0, 1003))
    counts = bins.sums(np.ones(1003))
    assert counts.size == 20
    assert counts.sum() == 1003
    assert counts.max() - counts.min() <= 1
    assert Bins.equal_count(np.linspace(0.0, 1.0, 12)).starts.size == 4


@pytest.mark.parametrize("truth", [(1e-4, 2e-3), (1e-4, 1e-3, 2e-2)])
def test_exact_bin_variances_give_the_polynomial_back(truth):
    # Squared residuals equal to the bin's own variance leave nothing to estimate.
    x = np.repeat(np.linspace(0.05, 2.0, 20), 20)
    bins = Bins(x, np.arange(20) * 20)
    squared = sum(v * x**k for k, v in enumerate(truth)) * (398 / 400)
    ones = np.ones(400)
    first = fit_variance(bins, squared, ones, len(truth) - 1, None)
    again = fit_variance(bins, squared, ones, len(truth) - 1, first)
    assert first == pytest.approx(truth, rel=1e-8)
    assert again == pytest.approx(truth, rel=1e-8)


def test_variance_stays_positive_where_a_free_fit_would_not():
    x = np.repeat(np.linspace(0.05, 2.0, 20), 20)
    bins = Bins(x, np.arange(20) * 20)
    squared = 0.02 * (x - 0.04)  # a straight fit would be negative at zero
    result = fit_variance(bins, squared, np.ones(400), 1, None)
    assert result[0] == pytest.approx(FLOOR_SHARE * squared.min() * 400 / 398, rel=1e-12)
    assert result[1] > 0.0


def test_a_point_that_counts_twice_equals_two_points():
    random = np.random.default_rng(8)
    x = np.sort(random.uniform(0.1, 1.0, 200))
    squared = random.exponential(x)
    twice = np.repeat(np.arange(200), 2)
    single = fit_variance(Bins(x, np.arange(10) * 20), squared, np.full(200, 2.0), 1, None)
    double = fit_variance(Bins(x[twice], np.arange(10) * 40), squared[twice], np.ones(400), 1, None)
    assert single == pytest.approx(double, rel=1e-10)
