"""GLM fits and their clustered errors against independent matrices and a published example."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from rbfrag.fragility.fit.likelihood import Binomial, fit_by_statsmodels, maximise, most_likely
from rbfrag.fragility.fit.result import cr3, jackknife_steps, sandwich
from rbfrag.fragility.method import LOGIT, NORMAL, arrays

ALL = [LOGIT, NORMAL]


def drawn(link, seed=1, events=20, per_event=30):
    random = np.random.default_rng(seed)
    event = np.repeat(np.arange(events), per_event)
    x = np.column_stack([np.ones(event.size), random.uniform(0.0, 1.0, (event.size, 2))])
    eta = x @ [0.3, 1.1, 0.5] + (0.3 * random.normal(size=events)[event] if link is LOGIT else 0.0)
    outcome = (random.random(event.size) < link.probability(eta, arrays())).astype(float)
    return Binomial(link, x, outcome, random.uniform(0.5, 2.0, event.size), event)


def loss(b, data, link):
    p = link.probability(data.columns @ b, arrays())
    if not np.all((p > 0) & (p < 1)):
        return np.inf
    return -(data.weights * np.where(data.outcome > 0.5, np.log(p), np.log(1 - p))).sum()


def numeric_scores(b, data, link, step=1e-5):
    """Scores of each row by central differences."""
    result = np.empty((data.outcome.size, b.size))
    for j in range(b.size):
        ends = []
        for sign in (1, -1):
            moved = b.copy()
            moved[j] += sign * step
            p = link.probability(data.columns @ moved, arrays())
            ends.append(data.weights * np.where(data.outcome > 0.5, np.log(p), np.log(1 - p)))
        result[:, j] = (ends[0] - ends[1]) / (2 * step)
    return result


def observed_information(b, data, link, step=1e-4):
    """Minus the second derivatives of the log likelihood, by central differences."""
    moves = np.eye(b.size) * step
    return np.array([
        [
            sum(s1 * s2 * loss(b + s1 * a + s2 * c, data, link) for s1 in (1, -1) for s2 in (1, -1))
            / (4 * step * step)
            for c in moves
        ]
        for a in moves
    ])  # fmt: skip


@pytest.mark.parametrize("link", ALL, ids=lambda link: link.name)
def test_estimates_and_errors_equal_an_independent_computation(link):
    data = drawn(link)
    b, covariance, naive = fit_by_statsmodels(data)
    minimum = minimize(loss, b * 1.01, args=(data, link), method="Nelder-Mead",
                    options={"xatol": 1e-12, "fatol": 1e-14, "maxiter": 20000})  # fmt: skip
    assert b == pytest.approx(minimum.x, rel=2e-7)
    fitted_values = most_likely(data)
    assert fitted_values == pytest.approx(b, rel=1e-8 if link is LOGIT else 2e-6)
    scores = numeric_scores(b, data, link)
    assert np.abs(scores.sum(axis=0)).max() < 1e-5 * np.abs(scores).sum()
    bread = np.linalg.inv(observed_information(b, data, link))
    meat = np.zeros((3, 3))
    for event in range(20):
        total = scores[data.event == event].sum(axis=0)
        meat += np.outer(total, total)
    n, g, k = 600, 20, 3
    expected = bread @ meat @ bread * g / (g - 1) * (n - 1) / (n - k)
    assert covariance == pytest.approx(expected, rel=1e-4)
    if link is LOGIT:  # elsewhere statsmodels gives the inverse of the expected information
        assert naive == pytest.approx(bread, rel=1e-4)


def test_clustered_errors_of_the_logit_in_matrices_to_eight_digits():
    data = drawn(LOGIT, seed=3)
    b, covariance, _ = fit_by_statsmodels(data)
    p = 1 / (1 + np.exp(-data.columns @ b))
    x, w = data.columns, data.weights
    bread = np.linalg.inv(x.T @ np.diag(w * p * (1 - p)) @ x)
    residual = w * (data.outcome - p)
    meat = np.zeros((3, 3))
    for event in range(20):
        in_event = data.event == event
        score = x[in_event].T @ residual[in_event]
        meat += np.outer(score, score)
    expected = bread @ meat @ bread * 20 / 19 * 599 / 597
    assert np.abs(covariance / expected - 1).max() < 1e-8
    cr1, naive = sandwich(data, b)
    assert cr1 == pytest.approx(expected, rel=1e-8)
    assert naive == pytest.approx(bread, rel=1e-8)


@pytest.mark.parametrize("link", ALL, ids=lambda link: link.name)
def test_the_jackknife_is_that_of_left_out_earthquakes(link):
    data = drawn(link, events=30, per_event=60)
    b = most_likely(data)
    steps = np.array([maximise(data.only(data.event != e), b)[0] - b for e in range(30)])
    expected = 29 / 30 * steps.T @ steps
    assert np.diag(cr3(jackknife_steps(data, b))) == pytest.approx(np.diag(expected), rel=0.15)


def test_a_published_logistic_regression():
    # Spector and Mazzeo (1980), the example of Greene, Econometric Analysis, chapter 21 of the 5th
    # edition. Coefficients as printed in the documentation of statsmodels, "Discrete Choice Models
    # Overview"; standard errors from the covariance by Stata 11 that statsmodels' tests keep.
    from statsmodels.datasets import spector

    loaded = spector.load_pandas()
    columns = np.column_stack([np.ones(32), loaded.exog.to_numpy()])
    data = Binomial(LOGIT, columns, loaded.endog.to_numpy(), np.ones(32), np.arange(32))
    b = most_likely(data)
    assert [round(v, 3) for v in b.tolist()] == [-13.021, 2.826, 0.095, 2.379]
    _, _, naive = fit_by_statsmodels(data)
    errors = [round(v, 3) for v in np.sqrt(np.diag(naive)).tolist()]
    assert errors == [4.931, 1.263, 0.142, 1.065]


@settings(max_examples=50)
@given(st.floats(-6, 6))
def test_slopes_and_inverses_of_the_links(eta):
    for link in ALL:
        at = np.array([eta])
        p = link.probability(at, arrays())
        h = 1e-6
        slope = (link.probability(at + h, arrays()) - link.probability(at - h, arrays())) / (2 * h)
        assert link.density(at, arrays()) == pytest.approx(slope, rel=1e-5, abs=1e-9)
        if 1e-9 < p[0] < 1 - 1e-9:
            assert link.quantile(p, arrays()) == pytest.approx(at, rel=1e-5, abs=1e-5)
