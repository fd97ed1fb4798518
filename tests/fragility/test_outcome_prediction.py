"""Answers of the outcome models: monotone, bounded, the same for one and many."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility import prediction_array
from rbfrag.fragility.completion import Regression, encode_regressions
from rbfrag.fragility.dependence import normal_share
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import MotionPrediction, answer_given
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.question.question import predict
from tests.fragility.outcome_draws import TRUTH
from tests.fragility.portfolio_draws import SHARED

G = 9.80665
COEFFICIENTS = {
    **TRUTH,
    ("logistic", "pga_tm"): (-1.1, 4.5),
    ("logistic", "pgd_tm"): (-3.5, 1.9),
    ("logistic", "xp"): (-0.9, 5.9),
    ("lognormal", "pgv"): (-0.41, 0.95, -1.25),
    ("lognormal", "pga_tm"): (-0.21, 0.98, -1.16, -0.1),
    ("toppling", "pgv"): (1.9, 0.6, 4.7, -0.15, -1.5),
    ("toppling", "pga"): (-1.2, 0.1, 3.0, 1.9, 3.3),
}

REGRESSIONS = {
    "pgv_m_s pga_g": Regression([[0.3, -0.1, -0.02]] * 6, [0.2] * 6, [[0.2, 0.5]] * 6),
    "pga_g": Regression([[-2.2]] * 6, [0.5] * 6, [[0.5, 0.8]] * 6),
}
"""Of the spectral velocity, at all sizes alike."""


def model_of(method, term, **diagnostics):
    values = COEFFICIENTS[method, term]
    names = method_named(method).forms[term].parameters[: len(values)]
    size = len(values)
    covariance = 1e-3 * (0.7 * np.eye(size) + 0.3)
    return FragilityModel.from_row(
        ModelRow(
            name=f"{method}-{term}",
            term=term,
            method=method,
            coefficients=dict(zip(names, values, strict=True)),
            covariance=tuple(map(tuple, covariance.tolist())),
            domain={"p2": (0.1, 30.0), "intensity_m_s": (0.01, 2.0), "tm_s": (0.05, 2.0)},
            data_fingerprint="",
            dependence=SHARED,
            completions=encode_regressions(REGRESSIONS),
            diagnostics=diagnostics,
        )
    )


MODELS = {f"{m}-{t}": model_of(m, t) for m, t in COEFFICIENTS}


def measures(model, pgv, pga, tm, xp):
    every = {"pgv_m_s": pgv, "pga_g": pga, "tm_s": tm, "pgd_m": pgv * tm / 6, "xp_m_s": xp}
    return {name: every[name] for name in model.term.inputs}


@pytest.mark.parametrize("name", MODELS)
@given(
    p2=st.floats(0.1, 30.0),
    kr=st.floats(1e-5, 3.0),
    pgv=st.floats(1e-3, 4.0),
    ratio=st.floats(0.02, 0.5),
    tm=st.floats(0.05, 2.0),
    factor=st.floats(1.0, 4.0),
)
def test_stronger_shaking_and_weaker_blocks_topple_no_less(name, p2, kr, pgv, ratio, tm, factor):
    model = MODELS[name]
    pga = pgv / (ratio * G)
    base = predict_known(model, p2, kr, measures(model, pgv, pga, tm, 0.8 * pgv))
    assert 0.0 <= base.ci_low <= base.probability <= base.ci_high <= 1.0
    stronger_block = predict_known(model, p2, kr * factor, measures(model, pgv, pga, tm, 0.8 * pgv))
    assert stronger_block.probability <= base.probability + 1e-15
    shaken = measures(model, pgv * factor, pga, tm, 0.8 * pgv * factor)
    if "pga_g" in shaken and model.term.name != "xp":
        shaken["pga_g"] = pga * factor
    harder = predict_known(model, p2, kr, shaken)
    assert harder.probability >= base.probability - 1e-15


def predict_known(model, p2, kr, expected):
    if "xp_m_s" not in expected:
        return predict(p2, kr, **expected, model=model)
    return answer_given(model, {"p2": p2, "kr": kr, **expected}, 0.95)


@pytest.mark.parametrize("name", MODELS)
def test_limits(name):
    model = MODELS[name]
    expected = measures(model, 0.5, 0.5, 0.5, 0.4)
    assert predict_known(model, 3.0, 1e-9, expected).probability == pytest.approx(1.0, abs=1e-6)
    assert predict_known(model, 3.0, 100.0, expected).probability < 1e-3
    nothing = predict_known(
        model, 3.0, 0.1, {key: 0.0 if key != "tm_s" else 0.5 for key in expected}
    )
    assert (nothing.probability, nothing.ci_high) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "kr", "words"),
    [
        ("toppling-pgv_pga", 0.6, "not below PGA"),
        ("toppling-pga", 0.6, "not below PGA"),
        ("logistic-pga_tm", 0.6, "not below PGA"),
        ("toppling-pgv", 0.19, "at most half the toppling velocity"),
        ("record-xp", 0.15, "is at most the toppling velocity"),
    ],
)
def test_mechanics_is_stated(name, kr, words):
    model = MODELS[name]
    expected = measures(model, 0.5, 0.5, 0.5, 0.8)
    answer = predict_known(model, 3.0, kr * (10 if name == "toppling-pgv" else 1), expected)
    if name == "record-xp":
        answer = predict_known(model, 3.0, 0.2, expected)
    assert (answer.probability, answer.ci_low, answer.ci_high) == (0.0, 0.0, 0.0)
    assert any(words in text for text in answer.warnings)
    assert answer.in_domain
    assert answer.how == ("by the spectrum bound" if name == "record-xp" else "by mechanics")
    assert predict_known(model, 3.0, 0.05, expected).how == f"model {name}"


def test_the_gate_does_not_act_with_vertical_motion():
    with_vertical = model_of("logistic", "pgv", vertical="with")
    expected = {"pgv_m_s": 2.0, "pga_g": 0.2}
    assert predict(30.0, 0.25, **expected, model=with_vertical).probability > 0.1
    assert predict(30.0, 0.25, **expected, model=MODELS["logistic-pgv"]).probability == 0.0


@pytest.mark.parametrize("name", MODELS)
def test_arrays_agree_with_scalars(name):
    model = MODELS[name]
    random = np.random.default_rng(4)
    n = 300
    pgv = np.exp(random.uniform(-6, 1.5, n))
    expected = measures(
        model,
        pgv,
        pgv / np.exp(random.normal(0, 1, n)),
        np.exp(random.uniform(-3, 1, n)),
        pgv * random.uniform(0.3, 1.0, n),
    )
    columns = {"p2": np.exp(random.uniform(-4, 5, n)), "kr": np.exp(random.uniform(-9, 1, n))}
    columns = {**columns, **expected}
    many = answer_given(model, columns, 0.9)
    for i in range(n):
        single = answer_given(model, {key: float(c[i]) for key, c in columns.items()}, 0.9)
        assert [
            many.probability[i], many.ci_low[i], many.ci_high[i], many.y_m_s[i],
            many.intensity_m_s[i],
        ] == pytest.approx(
            [single.probability, single.ci_low, single.ci_high, single.y_m_s, single.intensity_m_s],
            rel=1e-12, abs=1e-250,
        )  # fmt: skip
        assert single.in_domain == many.in_domain[i]
        findings = len(single.warnings) - len(model.for_inputs(columns).notes)
        assert findings == len([r for r in many.reason[i].split("; ") if r])


def test_many_chunks_are_one_answer(monkeypatch):
    model = MODELS["toppling-pgv_pga"]
    random = np.random.default_rng(0)
    kr = np.exp(random.uniform(-4, 0, 1000))
    complete = predict(3.0, kr, pgv_m_s=0.5, pga_g=0.4, model=model)
    monkeypatch.setattr(prediction_array, "CHUNK", 64)
    parts = predict(3.0, kr.reshape(20, 50), pgv_m_s=0.5, pga_g=0.4, model=model)
    assert parts.probability.ravel().tolist() == complete.probability.tolist()
    assert parts.reason.ravel().tolist() == complete.reason.tolist()
    kr[-1] = np.nan
    with pytest.raises(InputError, match=r"element \(19, 49\): kr = nan"):
        predict(3.0, kr.reshape(20, 50), pgv_m_s=0.5, pga_g=0.4, model=model, nan="raise")


def shaking(n=800, dt=0.01):
    time = np.arange(n) * dt
    envelope = np.exp(-(((time - 3.0) / 1.5) ** 2))
    return GroundMotion(0.4 * envelope * np.sin(2 * np.pi * 1.3 * time + 0.4 * time**2), dt)


def test_a_motion_is_answered_by_its_spectrum():
    model, motion = MODELS["record-xp"], shaking()
    both = predict(3.0, 0.05, motion=motion, model=model)
    assert isinstance(both, MotionPrediction)
    for name, item in (("forward", both.forward), ("reverse", both.reverse)):
        x = toppling_spectrum(motion, 3.0, name)
        assert item.intensity_m_s == x
        eta = 2.2 + 1.6 * math.log(x / item.y_m_s)
        eta += 0.7 * math.log(math.sqrt(3.0) * x / (motion.pga_g * G))
        eta *= math.sqrt(3.0) ** 0.18
        assert item.probability == pytest.approx(normal_share(eta), rel=1e-9)
        assert predict(3.0, 0.05, motion=motion, polarity=name, model=model) == item
    assert both.probability == 0.5 * (both.forward.probability + both.reverse.probability)
    assert set(both.as_dict()["polarities"]) == {"forward", "reverse"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pgv_m_s": 0.3}, "pgv_m_s cannot be combined with a motion"),
        ({"polarity": "up"}, "polarity = 'up'"),
        ({"p2": [3.0, 1.0]}, "single numbers with a motion"),
        ({"p2": -3.0}, "p2 = -3 1/s² is not above zero"),
        ({"kr": math.nan}, "kr = nan"),
    ],
)
def test_motions_that_cannot_be_answered(changes, words):
    arguments = {"p2": 3.0, "kr": 0.05, "motion": shaking(), **changes}
    with pytest.raises(InputError, match=words):
        predict(**arguments, model=MODELS["record-xp"])
