"""Lines of equal probability: the answers of predict, turned round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.fragility.model import FragilityModel
from rbfrag.plots.model_lines import failure_line, held_measures
from rbfrag.question.question import predict
from tests.plots.critical_values import straight_line_model

X = np.array([0.05, 0.3, 1.0])


@pytest.mark.parametrize("probability", [0.02, 0.5, 0.9])
@pytest.mark.parametrize(
    ("term", "measures"),
    [
        ("pgv", lambda x: {"pgv_m_s": x}),
        ("pga_tm", lambda x: {"pga_g": x * 2.0 * np.pi / (9.80665 * 0.4), "tm_s": 0.4}),
        ("pgd_tm", lambda x: {"pgd_m": x * 0.7 / (2.0 * np.pi), "tm_s": 0.7}),
    ],
)
def test_blocks_on_a_line_have_its_probability(term, measures, probability) -> None:
    model = straight_line_model(term)
    for x, y in zip(X, failure_line(model, X, probability), strict=True):
        if np.isnan(y):
            assert probability > 0.5  # the line of a straight-line model may run below zero
            continue
        for p2 in (0.2, 0.5):
            answer = predict(p2, y * p2**0.5 / 9.80665, model=model, **measures(x))
            assert answer.probability == pytest.approx(probability, rel=1e-9)


def test_a_line_below_zero_is_none() -> None:
    assert np.isnan(failure_line(straight_line_model(), np.array([1e-3]), 0.999)).all()


def test_an_estimated_exponent_holds_the_size() -> None:
    row = straight_line_model().row
    names = ("ln_median", "slope", "ln_sigma", "m_minus_1")
    coefficients = dict(zip(names, (-0.2, 1.0, -1.2, 0.1), strict=True))
    row = replace(row, method="lognormal", coefficients=coefficients)
    model = FragilityModel.from_row(row)
    lines = []
    for p2 in (0.3, 10.0):
        held = held_measures(model, p2=p2)
        assert held.words == f"at p² = {p2:g} 1/s²"
        lines.append(failure_line(model, X, 0.5, held))
        for x, y in zip(X, lines[-1], strict=True):
            answer = predict(p2, y * p2**0.5 / 9.80665, model=model, pgv_m_s=float(x))
            assert answer.probability == pytest.approx(0.5, rel=1e-9)
    # ln y has 0.1 ln p beside the line in ln x
    assert lines[1] / lines[0] == pytest.approx((10.0 / 0.3) ** 0.05, rel=1e-9)
