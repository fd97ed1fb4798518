"""The censored regression against an independent likelihood, and the known truth."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from rbfrag.fragility.fit.likelihood import CensoredNormal, censored_line, from_olsen, maximise
from rbfrag.fragility.fit.result import cr3, jackknife_steps, sandwich


def drawn(seed=1, events=40, per_event=20, cut=-0.3):
    random = np.random.default_rng(seed)
    event = np.repeat(np.arange(events), per_event)
    x = random.normal(0.0, 1.0, event.size)
    noise = np.sqrt(0.3) * random.normal(size=events)[event]
    noise += np.sqrt(0.7) * random.normal(size=event.size)
    y = 0.2 + 0.9 * x + 0.5 * noise
    limit = 0.2 + 0.9 * x + cut
    is_found = y > limit
    columns = np.column_stack([np.ones(x.size), x])
    return columns, np.where(is_found, y, limit), is_found, event


def fitted(data):
    """The likelihood, the parameters (beta, ln sigma), Olsen's, and the derivatives of the two."""
    rows, start = censored_line(*data)
    theta, settled = maximise(rows, start)
    assert settled
    b, jacobian = from_olsen(theta)
    return rows, b, theta, jacobian


def jackknife(rows, theta, jacobian):
    return cr3(jackknife_steps(rows, theta) @ jacobian.T)


def log_likelihood(b, data):
    columns, y, is_found, _ = data
    mean, sigma = columns @ b[:-1], np.exp(b[-1])
    return np.where(is_found, norm.logpdf(y, mean, sigma), norm.logcdf(y, mean, sigma))


def test_the_maximum_is_that_of_an_independent_likelihood():
    data = drawn()
    assert 0.1 < (~data[2]).mean() < 0.5
    rows, b, theta, _ = fitted(data)
    assert rows.log_likelihood(theta) == pytest.approx(log_likelihood(b, data), rel=1e-12)
    minimum = minimize(lambda b: -log_likelihood(b, data).sum(), [0, 1, 0], method="Nelder-Mead",
                    options={"xatol": 1e-10, "fatol": 1e-12, "maxiter": 9999})  # fmt: skip
    assert b == pytest.approx(minimum.x, abs=2e-6)


def test_errors_equal_an_independent_matrix_computation():
    data = drawn()
    rows, b, theta, jacobian = fitted(data)
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
    meat = sum(np.outer(*(2 * [scores[data[3] == e].sum(axis=0)])) for e in range(40))
    expected = bread @ meat @ bread * 40 / 39 * 799 / 797
    clustered, naive = (jacobian @ c @ jacobian.T for c in sandwich(rows, theta))
    assert clustered == pytest.approx(expected, rel=1e-4)
    assert naive == pytest.approx(bread, rel=1e-4)
    larger = np.diag(jackknife(rows, theta, jacobian))
    assert np.all(larger > np.diag(expected) * 0.95)
    assert larger == pytest.approx(np.diag(expected), rel=0.15)


def test_without_censored_points_it_is_least_squares():
    data = drawn(cut=-1e3)
    _, b, _, _ = fitted(data)
    columns, y, _, _ = data
    beta = np.linalg.lstsq(columns, y, rcond=None)[0]
    assert b[:-1] == pytest.approx(beta, rel=1e-7)
    assert np.exp(b[-1]) == pytest.approx((y - columns @ beta).std(), rel=1e-7)


def test_the_truth_comes_back_where_leaving_out_would_bias_it():
    data = drawn(events=200)
    rows, b, theta, jacobian = fitted(data)
    errors = np.sqrt(np.diag(jackknife(rows, theta, jacobian)))
    assert np.all(np.abs(b - [0.2, 0.9, np.log(0.5)]) < 3 * errors)
    columns, y, is_found, _ = data
    biased = np.linalg.lstsq(columns[is_found], y[is_found], rcond=None)[0]
    assert biased[0] - 0.2 > 5 * errors[0]


def test_a_formula_in_its_own_parameters_has_the_same_maximum():
    columns, y, is_found, event = data = drawn()
    _, b, _, _ = fitted(data)

    def formula(p, values):
        eta = (values["columns"] @ p[:-1] - values["y"]) * np.exp(-p[-1])
        slopes = [*(values["columns"].T * np.exp(-p[-1])), -eta]
        return eta, p[-1], slopes, (0.0, 0.0, 1.0)

    rows = CensoredNormal(formula, {"columns": columns, "y": y}, is_found, event)
    other, settled = maximise(rows, np.array([0.0, 0.5, 0.0]), tolerance=1e-15)
    assert settled
    assert other == pytest.approx(b, rel=1e-6)


def test_values_known_between_two_ends_count_as_intervals():
    """Against an independent likelihood; a quarter of the values is known to ± 0.4 only."""
    columns, y, is_found, event = drawn()
    random = np.random.default_rng(3)
    between = is_found & (random.random(y.size) < 0.25)
    least, upper = y - random.uniform(0.0, 0.4, y.size), y + random.uniform(0.0, 0.4, y.size)
    top, exact = np.where(between, upper, y), is_found & ~between
    bottom = np.where(between, least, top)
    rows, start = censored_line(columns, top, exact, event, bottom)
    theta, settled = maximise(rows, start)
    assert settled

    def independent(b):
        mean, sigma = columns @ b[:-1], np.exp(b[-1])
        below = norm.cdf(top, mean, sigma) - np.where(between, norm.cdf(bottom, mean, sigma), 0.0)
        return np.where(exact, norm.logpdf(y, mean, sigma), np.log(below))

    b, _ = from_olsen(theta)
    assert rows.log_likelihood(theta) == pytest.approx(independent(b), rel=1e-9)
    minimum = minimize(lambda b: -independent(b).sum(), [0, 1, 0], method="Nelder-Mead",
                    options={"xatol": 1e-10, "fatol": 1e-12, "maxiter": 9999})  # fmt: skip
    assert b == pytest.approx(minimum.x, abs=2e-6)
    # the information is the curvature of the likelihood
    h, steps = 1e-5, np.eye(3) * 1e-5
    curvature = [
        (rows.derivatives(theta + s)[0] - rows.derivatives(theta - s)[0]) / (2 * h) for s in steps
    ]
    assert -np.array(curvature) == pytest.approx(rows.derivatives(theta)[1], rel=1e-6, abs=1e-4)
    # as if they were exact at their lower ends the line would lie too low
    low, _ = from_olsen(maximise(*censored_line(columns, bottom, is_found, event))[0])
    assert low[0] < b[0] - 0.02
