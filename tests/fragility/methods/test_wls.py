import math

import numpy as np
import pytest

from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.methods.wls import (
    METHOD,
    mean_m_s,
    negative_probability,
    rise,
    variance_m2_s2,
)


def score(parameters, x, y):
    result = METHOD.forms["pgv"].eta(parameters, {"intensity_m_s": x, "y_m_s": y}, SINGLE)
    return result.eta, result.slopes


CASES = [(0.002, 0.72, 4e-5, 3e-3), (-0.01, 0.6, 1e-4, 1e-3, 2e-2), (0.02, 0.5, 1e-3, 0.0, 0.04)]


@pytest.mark.parametrize("parameters", CASES)
def test_variance_is_the_polynomial(parameters):
    for x in (0.0, 0.3, 2.0):
        expected = sum(v * x**k for k, v in enumerate(parameters[2:]))
        assert variance_m2_s2(parameters, x) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("parameters", CASES)
@pytest.mark.parametrize(("x", "y"), [(0.05, 0.01), (0.5, 0.3), (1.2, 1.5)])
def test_slopes_are_the_derivatives(parameters, x, y):
    z, slopes = score(parameters, x, y)
    assert z == pytest.approx(
        (mean_m_s(parameters, x) - y) / math.sqrt(variance_m2_s2(parameters, x)), rel=1e-15
    )
    assert len(slopes) == len(parameters)
    for i, slope in enumerate(slopes):
        step = 1e-6 * max(abs(parameters[i]), 1e-4)
        moved = [list(parameters), list(parameters)]
        moved[0][i] -= step
        moved[1][i] += step
        low, high = (score(m, x, y)[0] for m in moved)
        assert slope == pytest.approx((high - low) / (2 * step), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("parameters", CASES)
def test_rise_has_the_sign_of_the_slope_in_x(parameters):
    seen = set()
    for x in np.linspace(0.01, 5.0, 60).tolist():
        for y in (0.001, 0.01, 0.1, 1.0):
            step = 1e-6 * x
            low, high = (score(parameters, v, y)[0] for v in (x - step, x + step))
            slope = (high - low) / (2 * step)
            expected = rise(parameters, x, y) / variance_m2_s2(parameters, x) ** 1.5
            assert slope == pytest.approx(expected, rel=1e-5, abs=1e-7)
            seen.add(slope > 0)
            if y >= parameters[0]:
                assert rise(parameters, x, y) > 0.0
    assert True in seen
    if parameters == CASES[2]:
        assert False in seen  # a line that starts well above zero falls for the weakest blocks


def test_negative_probability_is_the_mass_below_zero():
    z, _ = score(CASES[0], 0.01, 0.0)
    assert negative_probability(CASES[0], 0.01, SINGLE) == pytest.approx(1.0 - SINGLE.ndtr(z))
