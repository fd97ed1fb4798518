"""The censored regression against an independent likelihood, and the known truth."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from rbfrag.fragility.fit.censored_normal import (
    CensoredData,
    clustered_covariance,
    jackknife_covariance,
    maximise,
    naive_covariance,
)


def drawn(seed=1, events=40, each=20, cut=-0.3):
    random = np.random.default_rng(seed)
    event = np.repeat(np.arange(events), each)
    x = random.normal(0.0, 1.0, event.size)
    noise = np.sqrt(0.3) * random.normal(size=events)[event]
    noise += np.sqrt(0.7) * random.normal(size=event.size)
    y = 0.2 + 0.9 * x + 0.5 * noise
    limit = 0.2 + 0.9 * x + cut
    found = y > limit
    columns = np.column_stack([np.ones(x.size), x])
    return CensoredData(columns, np.where(found, y, limit), found, event)


def log_likelihood(b, data):
    mean = data.columns @ b[:-1]
    sigma = np.exp(b[-1])
    return np.where(data.found, norm.logpdf(data.y, mean, sigma), norm.logcdf(data.y, mean, sigma))


def test_the_maximum_is_that_of_an_independent_likelihood():
    data = drawn()
    assert 0.1 < (~data.found).mean() < 0.5
    b = maximise(data)
    free = minimize(lambda b: -log_likelihood(b, data).sum(), [0, 1, 0], method="Nelder-Mead",
                    options={"xatol": 1e-10, "fatol": 1e-12, "maxiter": 9999})  # fmt: skip
    assert b == pytest.approx(free.x, abs=2e-6)


def test_errors_equal_an_independent_matrix_computation():
    data = drawn()
    b = maximise(data)
    h = 1e-4
    steps = np.eye(3) * h
    scores = np.column_stack(
        [(log_likelihood(b + s, data) - log_likelihood(b - s, data)) / (2 * h) for s in steps]
    )
    hessian = np.array([
        [
            sum(
                s1 * s2 * log_likelihood(b + s1 * a + s2 * c, data).sum()
                for s1 in (1, -1) for s2 in (1, -1)
            ) / (4 * h * h)
            for c in steps
        ]
        for a in steps
    ])  # fmt: skip
    bread = np.linalg.inv(-hessian)
    meat = sum(np.outer(*(2 * [scores[data.event == e].sum(axis=0)])) for e in range(40))
    expected = bread @ meat @ bread * 40 / 39 * 799 / 797
    assert clustered_covariance(data, b) == pytest.approx(expected, rel=1e-4)
    assert naive_covariance(data, b) == pytest.approx(bread, rel=1e-4)
    jackknife = np.diag(jackknife_covariance(data, b))
    assert np.all(jackknife > np.diag(expected) * 0.95)
    assert jackknife == pytest.approx(np.diag(expected), rel=0.15)


def test_without_censored_points_it_is_least_squares():
    data = drawn(cut=-1e3)
    b = maximise(data)
    beta = np.linalg.lstsq(data.columns, data.y, rcond=None)[0]
    assert b[:-1] == pytest.approx(beta, rel=1e-7)
    assert np.exp(b[-1]) == pytest.approx((data.y - data.columns @ beta).std(), rel=1e-7)


def test_the_truth_comes_back_where_leaving_out_would_bias_it():
    data = drawn(events=200)
    b = maximise(data)
    errors = np.sqrt(np.diag(jackknife_covariance(data, b)))
    assert np.all(np.abs(b - [0.2, 0.9, np.log(0.5)]) < 3 * errors)
    only_found = data.only(data.found)
    biased = np.linalg.lstsq(only_found.columns, only_found.y, rcond=None)[0]
    assert biased[0] - 0.2 > 5 * errors[0]
