"""The methods: slopes, one formula for numbers and arrays, links, and what a registry finds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.fragility.fit.fitting import ESTIMATORS
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import LOGIT, NORMAL, SINGLE, arrays
from rbfrag.fragility.methods import method_named, method_names, methods

INPUTS = {
    "p2": 3.0, "kr": 0.1, "ky": 0.1, "displacement_m": 0.05, "ks": 0.15, "ps2": 3.0,
    "kct": 0.15, "pct2": 8.0,
    "pgv_m_s": 0.4, "pga_g": 0.5, "tm_s": 0.6, "pgd_m": 0.1, "xp_m_s": 0.7,
    "velocity_m_s": 0.6, "arias_m_s": 0.8, "magnitude": 6.1,
}  # fmt: skip
FORMS = [(method.name, term) for method in methods() for term in method.forms]


def reference_case(name, term):
    method = method_named(name)
    form, velocity = method.forms[term], ()
    if form.velocity is not None:
        velocity = ("velocity_m_s",)
    arguments = {n: INPUTS[n] for n in (*method.block.names, *TERMS[term].inputs, *velocity)}
    b = [value + 0.1 for value in form.start] or [
        0.7 + 0.1 * i for i in range(len(form.parameters))
    ]
    return method, form, arguments, b


@pytest.mark.parametrize(("name", "term"), FORMS)
def test_slopes_are_the_derivatives(name, term):
    method, form, inputs, b = reference_case(name, term)
    values = method.block.completed(inputs, TERMS[term], SINGLE)
    assert not any(bound.holds(values) for bound in form.bounds)
    local = form.eta(b, values, SINGLE)
    step = 1e-6
    for i in range(len(b)):
        up, down = list(b), list(b)
        up[i] += step
        down[i] -= step
        above, below = form.eta(up, values, SINGLE), form.eta(down, values, SINGLE)
        slope = (above.eta - below.eta) / (2 * step)
        assert local.slopes[i] == pytest.approx(slope, rel=1e-6, abs=1e-9)
        if local.log_sigma is not None:
            slope = (above.log_sigma - below.log_sigma) / (2 * step)
            assert local.sigma_slopes[i] == pytest.approx(slope, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("name", "term"), FORMS)
def test_arrays_follow_the_same_formula(name, term):
    method, form, inputs, b = reference_case(name, term)
    many = {n: np.array([v, 1.1 * v]) for n, v in inputs.items()}
    result = form.eta(b, method.block.completed(many, TERMS[term], arrays()), arrays())
    for i, factor in enumerate((1.0, 1.1)):
        values = {n: factor * v for n, v in inputs.items()}
        single = form.eta(b, method.block.completed(values, TERMS[term], SINGLE), SINGLE)
        assert result.eta[i] == pytest.approx(single.eta, rel=1e-13)
        for array, number in zip(result.slopes, single.slopes, strict=True):
            assert np.broadcast_to(array, 2)[i] == pytest.approx(number, rel=1e-13)


@pytest.mark.parametrize("link", [NORMAL, LOGIT])
def test_links_are_distribution_functions_for_numbers_and_arrays(link):
    eta = np.linspace(-30.0, 30.0, 241)
    expected = {
        "normal": ndtr(eta),
        "logit": 1.0 / (1.0 + np.exp(-eta)),
    }[link.name]
    many = link.probability(eta, arrays())
    assert many == pytest.approx(expected, rel=1e-12, abs=1e-300)
    assert np.all(np.diff(many) >= 0.0)
    for value, probability in zip(eta.tolist(), many.tolist(), strict=True):
        assert link.probability(value, SINGLE) == pytest.approx(probability, rel=1e-12, abs=1e-300)
    assert link.probability(-1e4, SINGLE) == 0.0
    assert link.probability(1e4, SINGLE) == 1.0


def test_every_file_is_a_method_and_fits_by_a_function_that_is_there():
    assert set(method_names()) == {method.name for method in methods()}
    for method in methods():
        assert callable(ESTIMATORS[method.fit])
        assert method.forms
    for name in ("oracle", "weibull"):
        with pytest.raises(InputError, match=f"unknown method '{name}': use one of capacity"):
            method_named(name)
