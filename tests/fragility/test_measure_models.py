"""Models of the measures that a hazard is given in: their forms, their rows, and what they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.fragility.validation import CREDIBLE
from rbfrag.question.question import predict
from rbfrag.vocabulary.quantities import SPECTRAL
from tests.fragility.conftest import model_row
from tests.fragility.outcome_draws import G

TABLE = {
    ("bounded", "pgv_kr"): (
        (-0.988, 2.461, 1.808, -0.176, -1.314), (0.324, 0.180, 0.294, 0.025, 0.342),
        0.1295, 0.1078, 0.87,
    ),
    ("bounded", "pgv_pga"): (
        (2.379, 1.674, 3.361, 2.812, 1.984), (0.392, 0.191, 0.394, 0.293, 0.161),
        0.1128, 0.0860, 0.92,
    ),
    ("bounded", "pgv_pga_tm"): (
        (2.585, 1.859, 3.288, 2.894, 1.001, 1.201), (0.368, 0.166, 0.370, 0.317, 0.232, 0.139),
        0.1075, 0.0797, 0.96,
    ),
    ("bounded", "pgv_pga_sa10_sa30"): (
        (1.483, 2.069, 2.863, 2.818, 2.179, 0.795, 0.100, -0.306),
        (0.349, 0.160, 0.371, 0.291, 0.138, 0.075, 0.109, 0.070), 0.1068, 0.0784, 0.98,
    ),
    ("logistic", "sa10"): (
        (-3.335, 0.524, -0.424, 3.717, -0.458, -2.271),
        (0.343, 0.295, 0.052, 0.225, 0.206, 0.968), 0.1890, 0.1408, 1.02,
    ),
    ("bounded", "pga"): (
        (-3.407, 1.602, -0.224, 1.351, -0.420), (0.236, 0.095, 0.021, 0.080, 0.261),
        0.2495, 0.1695, 0.98,
    ),
    ("bounded", "pga_sa10"): (
        (-2.853, 1.882, -0.266, 2.455, 1.666, -0.333), (0.357, 0.190, 0.031, 0.080, 0.115, 0.071),
        0.1495, 0.1043, 1.07,
    ),
    ("bounded", "pga_sa03_sa10_sa30"): (
        (-2.381, 1.955, -0.338, 2.889, 0.280, 0.928, 0.990, -0.455),
        (0.289, 0.134, 0.029, 0.115, 0.093, 0.068, 0.163, 0.080), 0.1311, 0.0931, 1.03,
    ),
    ("record", "xp"): ((4.124, 3.390, 1.428), (0.322, 0.244, 0.151), 0.0265, 0.0108, 1.08),
}  # fmt: skip
"""Of another study of the same motions by other code: parameters, their CR3 errors, log loss on
earthquakes left out from k_r = 0.02 and 0.05 on, calibration slope of the latter."""

COEFFICIENTS = {key: row[0] for key, row in TABLE.items()}

P2 = np.geomspace(0.1, 30.0, 16)
KR = np.geomspace(0.01, 1.5, 120)


@pytest.mark.parametrize(("method", "term"), TABLE)
def test_shipped_models_are_those_of_the_other_study(method: str, term: str) -> None:
    b, errors, log_loss, log_loss_kr05, slope = TABLE[method, term]
    (row,) = (row for row in read_models(REFERENCE) if row.name == f"{method}-{term}")
    result = np.array(list(row.coefficients.values()))
    assert (np.abs(result - b) < np.array(errors)).all()
    assert result == pytest.approx(b, abs=0.002)
    assert np.sqrt(np.diag(row.covariance)) == pytest.approx(errors, rel=0.16)
    scores = row.diagnostics["scores"]
    assert isinstance(scores, dict)
    assert scores["log_loss_held_out"] == pytest.approx(log_loss, abs=0.002)
    assert scores["log_loss_held_out_kr05"] == pytest.approx(log_loss_kr05, abs=0.002)
    assert scores["calibration_slope_held_out_kr05"] == pytest.approx(slope, abs=0.05)
    assert row.domain["kr"] == (0.02, 1.0)
    assert row.dependence is not None
    assert row.leave_out_steps is not None


@pytest.mark.parametrize(
    ("measures", "term"),
    [
        ({"pgv_m_s": 0.4}, "pgv_kr"),
        ({"pgv_m_s": 0.4, "pga_g": 0.3}, "pgv_pga"),
        ({"pgv_m_s": 0.4, "pga_g": 0.3, "tm_s": 0.5}, "pgv_pga_tm"),
        ({"pgv_m_s": 0.4, "pga_g": 0.3, "sa10_g": 0.3, "sa30_g": 0.06}, "pgv_pga_sa10_sa30"),
        (
            {"pgv_m_s": 0.4, "pga_g": 0.3, "tm_s": 0.5, "sa10_g": 0.3, "sa30_g": 0.06},
            "pgv_pga_sa10_sa30",
        ),
        ({"pgv_m_s": 0.4, "sa10_g": 0.3}, "pgv_kr"),
        ({"pga_g": 0.3}, "pga"),
        ({"pga_g": 0.3, "tm_s": 0.5}, "pga"),
        ({"pga_g": 0.3, "sa10_g": 0.3}, "pga_sa10"),
        ({"pga_g": 0.3, "sa03_g": 0.6, "sa10_g": 0.3, "sa30_g": 0.06}, "pga_sa03_sa10_sa30"),
        ({"sa10_g": 0.3, "sa30_g": 0.1}, "sa10"),
    ],
)
def test_what_is_known_chooses_the_model(measures: dict[str, float], term: str) -> None:
    assert predict(3.0, 0.1, **arguments(term, measures), db=REFERENCE).term == term


def test_models_for_comparison_answer_by_name_alone() -> None:
    answer = predict(3.0, 0.1, pgv_m_s=0.4, model="wls-pgv", db=REFERENCE)
    assert answer.term == "pgv"
    answer = predict(3.0, 0.1, pga_g=0.3, tm_s=0.5, model="logistic-pga_tm", db=REFERENCE)
    assert answer.term == "pga_tm"


def test_blocks_beyond_those_that_were_fitted_are_told() -> None:
    for kr in (0.019, 1.01):
        answer = predict(3.0, kr, pgv_m_s=4.0, db=REFERENCE)
        assert isinstance(answer, Prediction)
        assert not answer.in_domain
        assert any("fitted range 0.02 to 1" in text for text in answer.warnings)
    answer = predict(3.0, 0.1, pgv_m_s=0.4, db=REFERENCE)
    assert isinstance(answer, Prediction)
    assert answer.in_domain


def shipped_form(method: str, term: str) -> FragilityModel:
    """Return a model with the parameters of the recorded motions."""
    names = method_named(method).forms[term].parameters
    values = COEFFICIENTS[method, term]
    size = len(names)
    row = model_row(
        term,
        name=f"{method}-{term}",
        method=method,
        coefficients=dict(zip(names, values, strict=True)),
        covariance=tuple(tuple(0.01 * (i == j) for j in range(size)) for i in range(size)),
        domain={},
    )
    return FragilityModel.from_row(replace(row, leave_out_steps=None))


def arguments(term: str, measures: dict[str, np.ndarray]) -> dict[str, object]:
    """Return measures by name as arguments of predict."""
    periods = {name: period for period, name in SPECTRAL.items()}
    spectral = {periods[name]: value for name, value in measures.items() if name in periods}
    rest = {name: value for name, value in measures.items() if name not in periods}
    return {**rest, **({"sa_g": spectral} if spectral else {})}


def shakings(rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """Return measures that scatter about one another far more widely than those of motions do."""
    pga = np.exp(rng.uniform(np.log(0.01), np.log(2.0), n))
    return {
        "pga_g": pga, "pgv_m_s": pga * np.exp(rng.normal(-0.1, 0.8, n)),
        "sa03_g": pga * np.exp(rng.normal(0.7, 0.5, n)),
        "sa10_g": pga * np.exp(rng.normal(-0.4, 0.8, n)),
        "sa30_g": pga * np.exp(rng.normal(-2.0, 1.0, n)),
        "tm_s": np.exp(rng.uniform(np.log(0.1), np.log(1.9), n)),
        "xp_m_s": pga * np.exp(rng.normal(-0.5, 0.8, n)),
    }  # fmt: skip


@pytest.mark.parametrize(("method", "term"), COEFFICIENTS)
def test_probability_falls_with_strength_and_rises_with_all_measures(
    method: str, term: str
) -> None:
    model, rng = shipped_form(method, term), np.random.default_rng(7)
    n = 20_000
    measures = {name: v[:, None] for name, v in shakings(rng, n).items()}
    p2 = np.exp(rng.uniform(np.log(0.05), np.log(60.0), n))[:, None]
    kr = np.exp(rng.uniform(np.log(0.002), np.log(3.0), n))[:, None]
    block_inputs = {name: measures[name] for name in TERMS[term].inputs}
    up = 1.0 + np.array([0.0, 0.01, 0.05, 0.3, 1.0])

    def steps(kr: np.ndarray, factor: np.ndarray | float) -> np.ndarray:
        # the mean period is that of the same motion, however strong it is
        arguments = {
            name: v * (1.0 if name == "tm_s" else factor) for name, v in block_inputs.items()
        }
        p = answer_given(model, {"p2": p2, "kr": kr, **arguments}, 0.95).probability
        middle = (p[:, 1:] > 1e-9) & (p[:, :-1] > 1e-9) & (np.minimum(p[:, 1:], p[:, :-1]) < 0.999)
        assert middle.sum() > 1000
        change = np.diff(p, axis=1)
        assert (change[middle] != 0.0).all()
        return change

    assert (steps(kr * up, 1.0) <= 0.0).all()
    assert (steps(kr, up) >= 0.0).all()
    if term == "pgv_pga_tm":  # a longer period raises P too
        block_inputs["tm_s"] = block_inputs["tm_s"] * up
        assert (steps(kr, 1.0) >= 0.0).all()


def test_pga_alone_says_that_it_knows_little() -> None:
    answer = predict(3.0, 0.1, pga_g=0.5, model=shipped_form("bounded", "pga"))
    assert isinstance(answer, Prediction)
    assert any("PGA alone predicts" in text for text in answer.warnings)
    other = predict(3.0, 0.1, sa_g={1.0: 0.5}, model=shipped_form("logistic", "sa10"))
    assert not any("PGA alone predicts" in text for text in other.warnings)


def test_intensity_of_an_answer() -> None:
    answer = predict(3.0, 0.1, sa_g={1.0: 0.4}, model=shipped_form("logistic", "sa10"))
    assert answer.intensity_m_s == pytest.approx(0.4 * G / (2.0 * np.pi), rel=1e-14)
    answer = predict(3.0, 0.1, pga_g=0.4, model=shipped_form("bounded", "pga"))
    assert answer.intensity_m_s == pytest.approx(0.4 * G / np.sqrt(3.0), rel=1e-14)


def test_accelerations_in_another_unit_are_doubted() -> None:
    answer = predict(3.0, 0.1, sa_g={1.0: 60.0}, model=shipped_form("logistic", "sa10"))
    assert any("is it in g?" in text for text in answer.warnings)
    assert all(CREDIBLE[name][1] <= 10.0 for name in SPECTRAL.values())


@pytest.mark.parametrize("zero", ["sa03_g", "sa10_g", "sa30_g", "pga_g"])
def test_no_shaking_at_one_period(zero: str) -> None:
    model = shipped_form("bounded", "pga_sa03_sa10_sa30")
    measures = {"pga_g": 0.5, "sa03_g": 0.8, "sa10_g": 0.4, "sa30_g": 0.05, zero: 0.0}
    single = predict(3.0, 0.1, **arguments("", measures), model=model)
    many = predict(np.array([3.0, 3.0]), 0.1, **arguments("", measures), model=model)
    assert single.probability == pytest.approx(many.probability[0], abs=1e-300)
    assert 0.0 <= single.probability <= 1.0
