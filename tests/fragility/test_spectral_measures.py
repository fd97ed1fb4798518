"""Spectral accelerations in a question: by period in Python, by name everywhere else."""

from __future__ import annotations

import math

import numpy as np
import pytest

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


def velocity(sa10_g, _):
    return sa10_g * G / (2.0 * math.pi)


def formula(b, v, ns):
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return LinearPredictor(b[0] + b[1] * ratio, (1.0, ratio))


@pytest.fixture
def model() -> FragilityModel:
    """A model of SA(1.0) with SA(0.3) beside it."""
    form = Form(("b0", "b_ln_v_over_y"), formula, 0)
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
        term=Term("stand_in", "SA(1.0)", "V", ("sa10_g", "sa03_g"), velocity, 1),
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
    document = answer_numbers({"p2": 3.0, "kr": 0.1, "sa10_g": 0.4, "sa03_g": 0.9}, model=model)
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
        ({0.5: 0.4}, r"period 0\.5 s: SA is supported at 0\.3, 1, 3 s"),
        ({"1.0": 0.4}, r"period '1\.0' s: SA is supported"),
        (0.4, r"sa_g = 0\.4: give accelerations \[g\] by period"),
        ({1.0: -0.4, 0.3: 0.9}, r"sa10_g = -0\.4 g is negative: give the spectral acceleration"),
        ({1.0: None, 0.3: 0.9}, "sa10_g = None is not a number"),
        ({1.0: 0.4}, "requires sa10_g and sa03_g .*given: sa10_g"),
    ],
)
def test_what_is_rejected(model, sa_g, words):
    with pytest.raises(InputError, match=words):
        predict(3.0, 0.1, sa_g=sa_g, model=model)
