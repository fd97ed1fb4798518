"""Spectral accelerations in a question: by period in Python, by name everywhere else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError
from rbfrag.fragility.confidence import ParameterErrors
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import LOGIT, OF_OUTCOME, TOPPLING_BLOCK, Form, LinearPredictor, Method
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import Prediction
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.question.document import answer_numbers
from rbfrag.question.question import predict
from tests.fragility.conftest import model_row

G = 9.80665


def velocity(sa_1s_g, _):
    return sa_1s_g * G / (2.0 * math.pi)


def formula(b, v, ns):
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return LinearPredictor(b[0] + b[1] * ratio, (1.0, ratio))


@pytest.fixture
def model() -> FragilityModel:
    """A model of SA(1.0) with SA(0.3) beside it."""
    form = Form(("b0", "b_ln_v_over_y"), formula)
    method = Method(
        "logistic", TOPPLING_BLOCK, LOGIT, {"stand_in": form}, "outcomes", OF_OUTCOME, "a:b"
    )
    row = model_row(
        name="logistic-stand_in",
        term="stand_in",
        method="logistic",
        coefficients={"b0": 0.1, "b_ln_v_over_y": 3.0},
        covariance=((0.01, 0.0), (0.0, 0.04)),
    )
    return FragilityModel(
        row=row,
        term=Term("stand_in", "SA(1.0)", "V", ("sa(1)", "sa(0.3)"), velocity, 1),
        method=method,
        form=form,
        parameters=(0.1, 3.0),
        errors=ParameterErrors((0.01, 0.0, 0.04), ()),
        vertical=False,
    )


def test_accelerations_are_given_by_period(model):
    answer = predict(3.0, 0.1, sa_g={1.0: 0.4, 0.3: 0.9}, model=model)
    assert isinstance(answer, Prediction)
    y = 0.1 * G / math.sqrt(3.0)
    eta = 0.1 + 3.0 * math.log(0.4 * G / (2.0 * math.pi) / y)
    assert answer.probability == pytest.approx(1.0 / (1.0 + math.exp(-eta)), rel=1e-12)
    assert predict(3.0, 0.1, sa_g={1: 0.4, 0.3: 0.9}, model=model) == answer
    document = answer_numbers({"p2": 3.0, "kr": 0.1, "sa(1)": 0.4, "sa(0.3)": 0.9}, model=model)
    assert document.probability == answer.probability


def test_their_values_may_be_arrays(model):
    sa = np.array([0.1, 0.4, 0.8])
    many = predict(3.0, 0.1, sa_g={1.0: sa, 0.3: 0.9}, model=model)
    assert isinstance(many, PredictionArray)
    for i, value in enumerate(sa):
        single = predict(3.0, 0.1, sa_g={1.0: float(value), 0.3: 0.9}, model=model)
        assert many.probability[i] == pytest.approx(single.probability, rel=1e-12)
        assert (many.ci_low[i], many.ci_high[i]) == pytest.approx((single.ci_low, single.ci_high))


@pytest.mark.parametrize(
    ("sa_g", "words"),
    [
        ({20: 0.4}, r"sa_g 20: the period must be from 0\.01 to 10 s"),
        ({"1s": 0.4}, r"sa_g '1s': the period is not a number"),
        (0.4, r"sa_g = 0\.4: give values by period in s"),
        ({1.0: -0.4, 0.3: 0.9}, r"sa\(1\) = -0\.4 g is negative: give the spectral acceleration"),
        ({1.0: None, 0.3: 0.9}, r"sa\(1\) = None is not a number"),
        ({1.0: 0.4}, r"requires sa\(1\) and sa\(0\.3\) .*given: sa\(1\)"),
    ],
)
def test_what_is_rejected(model, sa_g, words):
    with pytest.raises(InputError, match=words):
        predict(3.0, 0.1, sa_g=sa_g, model=model)


@pytest.mark.parametrize("kind", ["toppling", "rocking"])
def test_below_the_stored_periods_pga_stands_for_the_spectrum(kind: str) -> None:
    pga = predict(3.0, 0.1, kind=kind, pga_g=0.5, db=REFERENCE)
    for period_s in (0.01, 0.03, 0.05, 0.099):
        inputs = {"pga_g": 0.5, "sa_g": {period_s: 0.7}}
        answer = predict(3.0, 0.1, kind=kind, **inputs, db=REFERENCE)
        assert (answer.model, answer.probability) == (pga.model, pga.probability)
        assert "below 0.1 s were not used: PGA stands for them" in " ".join(answer.warnings)
    longer = {"pga_g": 0.5, "sa_g": {1.0: 0.5}}
    both = {"pga_g": 0.5, "sa_g": {0.02: 0.5, 1.0: 0.5}}
    first, second = (
        predict(3.0, 0.1, kind=kind, **inputs, db=REFERENCE) for inputs in (longer, both)
    )
    assert first.probability == second.probability
    # without PGA the shortest ordinates are PGA, at 0.03 s
    shortest = [
        predict(3.0, 0.1, kind=kind, sa_g={period_s: 0.5}, db=REFERENCE).probability
        for period_s in (0.01, 0.02, 0.03)
    ]
    assert shortest[0] == pytest.approx(shortest[1], rel=1e-12) == shortest[2]
    assert shortest[0] == pytest.approx(pga.probability, rel=0.4)


def test_a_spectrum_far_above_pga_is_doubted() -> None:
    for period_s, times, doubted in ((0.2, 7.0, False), (0.2, 9.0, True), (5.0, 4.0, True)):
        inputs = {"pga_g": 0.4, "sa_g": {period_s: 0.4 * times}}
        single = predict(3.0, 0.1, **inputs, db=REFERENCE)
        many = predict([3.0, 3.0], 0.1, **inputs, db=REFERENCE)
        for answer in (single, many):
            assert ("times PGA, as in no record" in " ".join(answer.warnings)) is doubted


def test_notes_tell_which_standard_deviations_were_not_used() -> None:
    inputs = {"pga_g": 0.5, "sa_g": {0.05: 0.6, 1.0: 0.4}}
    answer = predict(3.0, 0.1, **inputs, sa_sigma={0.05: 0.3, 1.0: 0.3}, db=REFERENCE)
    certain = predict(3.0, 0.1, **inputs, db=REFERENCE)
    assert answer.probability != certain.probability
    texts = " ".join(answer.warnings)
    assert "below 0.1 s were not used" in texts
    assert "sa_sigma was not used" not in texts
    other = predict(3.0, 0.1, **inputs, sa_sigma={2.0: 0.3}, db=REFERENCE)
    assert other.probability == certain.probability
    assert "sa(2)_sigma was not used: sa(2) is not given" in " ".join(other.warnings)
