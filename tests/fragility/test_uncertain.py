"""Uncertain blocks: the integral against closed forms and other ways, its limits and rejections."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm, truncnorm

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.joint import share_range
from rbfrag.fragility.method import SINGLE, arrays
from rbfrag.fragility.methods import method_named, methods
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.question.document import answer_numbers
from rbfrag.question.question import predict
from rbfrag.solver.scatter import fraction
from tests.fragility.test_rocking_models import PGA, predict_block, stored

G = 9.80665


B0, B_Z, B_K = 6.5, 4.0, -3.6
COVARIANCE = np.array([[0.1, 0.02, 0.01], [0.02, 0.04, 0.01], [0.01, 0.01, 0.03]])


def lognormal() -> FragilityModel:
    """P = Φ(b0 + b_z ln z + b_k ln k_s): lognormal in a slumping block's strength and size."""
    method = method_named("capacity")
    covariance = np.zeros((4, 4))
    covariance[np.ix_((0, 2, 3), (0, 2, 3))] = COVARIANCE
    names = method.forms["pgv_pga"].parameters
    row = ModelRow(
        name="closed",
        kind=method.block.kind,
        term="pgv_pga",
        method="capacity",
        coefficients=dict(zip(names, (B0, 0.0, B_Z, B_K), strict=True)),
        covariance=tuple(map(tuple, covariance.tolist())),
        domain={},
        data_fingerprint="f",
        diagnostics={},
        dependence={"rho_e": 0.3},
    )
    return FragilityModel.from_row(row)


# PGA far above k_s: no block that it may be stays at rest
QUESTION = {"ks": 0.2, "ps2": 4.0, "pgv_m_s": 0.9, "pga_g": 4.0}


@pytest.mark.parametrize("sigmas", [(0.3, 0.0), (0.0, 0.5), (0.15, 0.4), (0.6, 0.6)])
def test_lognormal_blocks_and_fragilities_add_their_variances(sigmas: tuple[float, float]) -> None:
    ln_z = math.log(math.sqrt(QUESTION["ps2"]) * QUESTION["pgv_m_s"] / (QUESTION["pga_g"] * G))
    ln_k = math.log(QUESTION["ks"])
    of_block = math.hypot(B_K * sigmas[0], 0.5 * B_Z * sigmas[1])
    total = math.hypot(1.0, of_block)
    eta = (B0 + B_Z * ln_z + B_K * ln_k) / total
    answer = predict_block(lognormal(), **QUESTION, ks_sigma=sigmas[0], ps2_sigma=sigmas[1])
    assert 0.01 < answer.probability < 0.99
    assert answer.probability == pytest.approx(norm.cdf(eta), abs=1e-6)
    # Φ(a + s z)² is that two normal variables of correlation ρ are both below the quantile
    rho = (of_block / total) ** 2
    both = multivariate_normal([0.0, 0.0], [[1.0, rho], [rho, 1.0]]).cdf([eta, eta])
    assert answer.block_sd == pytest.approx(math.sqrt(both - norm.cdf(eta) ** 2), abs=1e-5)
    # the quantile moves with each parameter by its term, less what it adds to the scatter
    x = np.array([1.0, ln_z, ln_k]) / total
    x -= eta / total**2 * np.array([0.0, B_Z * (0.5 * sigmas[1]) ** 2, B_K * sigmas[0] ** 2])
    reach = norm.ppf(0.975) * math.sqrt(x @ COVARIANCE @ x)
    assert answer.ci_low == pytest.approx(norm.cdf(eta - reach), abs=2e-6)
    assert answer.ci_high == pytest.approx(norm.cdf(eta + reach), abs=2e-6)


def test_ranges_at_sites_are_taken_at_the_mean() -> None:
    question: dict[str, Any] = {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.6, "sites": 5}
    answer: Any = predict(**question, kr_sigma=0.3)
    law = find_model(answer.model, ("pgv_m_s",)).dependence
    assert law is not None
    ends = share_range(answer.probability, law, 5)
    assert (answer.event_low, answer.event_high) == ends
    assert answer.event_low < answer.probability < answer.event_high


@pytest.mark.parametrize("pga", [None, 0.5, 0.19])
def test_as_the_scatter_vanishes_the_answer_is_that_of_the_block(pga: float | None) -> None:
    question: dict[str, Any] = {"p2": 3.0, "kr": 0.2, "pgv_m_s": 0.9}
    question |= {} if pga is None else {"pga_g": pga}
    certain = predict(**question)
    nearly = predict(**question, kr_sigma=1e-9, p2_sigma=1e-9)
    for name in ("probability", "ci_low", "ci_high"):
        assert getattr(nearly, name) == pytest.approx(getattr(certain, name), abs=1e-8)
    assert nearly.block_sd == pytest.approx(0.0, abs=1e-7)
    assert certain.block_sd is None
    nothing = predict(**question, kr_sigma=0.0)
    assert nothing == certain


def test_mechanics_is_asked_of_each_block_that_it_may_be() -> None:
    question: dict[str, Any] = {"p2": 3.0, "pgv_m_s": 0.6, "pga_g": 0.3}
    z = np.linspace(-8.0, 8.0, 40001)
    weight = np.exp(-0.5 * z * z) / np.exp(-0.5 * z * z).sum()
    strength = 0.35 * np.exp(0.3 * z)
    expected = weight @ predict(**question, kr=strength, interval=False).probability
    answer = predict(**question, kr=0.35, kr_sigma=0.3)
    assert predict(**question, kr=0.35).probability == 0.0
    assert answer.probability == pytest.approx(expected, abs=1e-6)
    assert answer.probability > 0.0
    assert not any("mechanics" in text for text in answer.warnings)


def test_a_restitution_is_normal_between_0_and_1() -> None:
    z = np.linspace(-4.0, 4.0, 9)
    drawn = fraction(z, 0.9, 0.1)
    law = truncnorm(-9.0, 1.0, loc=0.9, scale=0.1)
    assert drawn == pytest.approx(law.ppf(norm.cdf(z)), abs=1e-9)
    assert np.all(drawn <= 1.0)
    assert fraction(z, 0.9, np.zeros(9)) == pytest.approx([0.9] * 9)


def test_rocking_blocks_of_uncertain_strength_size_and_restitution() -> None:
    model = stored("pga", PGA)
    question = {"p2": 3.0, "kr": 0.2, "restitution": 0.85, "pgv_m_s": 0.6, "pga_g": 0.5}
    answer = predict_block(model, **question, kr_sigma=0.2, p2_sigma=0.1, restitution_sigma=0.05)
    draws = 200_000
    random = np.random.default_rng(5)
    drawn = {
        "kr": 0.2 * np.exp(0.2 * random.normal(size=draws)),
        "p2": 3.0 * np.exp(0.1 * random.normal(size=draws)),
        "restitution": truncnorm(-17.0, 3.0, loc=0.85, scale=0.05).rvs(draws, random_state=random),
    }
    of_each = answer_given(model, {**question, **drawn}, 0.95, interval=False).probability
    error = of_each.std() / math.sqrt(draws)
    assert answer.probability == pytest.approx(of_each.mean(), abs=4.0 * error)
    assert answer.block_sd == pytest.approx(of_each.std(), rel=0.01)


def test_without_a_stated_restitution_each_block_has_its_own() -> None:
    model = stored("pga", PGA)
    question = {"p2": 3.0, "kr": 0.3, "pgv_m_s": 0.9, "pga_g": 0.7}
    z = np.linspace(-8.0, 8.0, 4001)
    weight = np.exp(-0.5 * z * z) / np.exp(-0.5 * z * z).sum()
    strengths = 0.3 * np.exp(0.2 * z)
    expected = weight @ answer_given(model, {**question, "kr": strengths}, 0.95).probability
    assert predict_block(model, **question, kr_sigma=0.2).probability == pytest.approx(
        expected, abs=1e-6
    )


@pytest.mark.parametrize("kind", ["toppling", "sliding"])
def test_arrays_answer_as_single_blocks_do(kind: str) -> None:
    random = np.random.default_rng(3)
    n = 40
    strength = random.uniform(0.05, 0.4, n)
    block = (
        {"p2": random.uniform(0.5, 20.0, n), "kr": strength, "p2_sigma": np.full(n, 0.1)}
        if kind == "toppling"
        else {"ky": strength, "displacement_m": np.full(n, 0.05), "beta_deg": np.full(n, 12.0)}
    )
    name = "kr_sigma" if kind == "toppling" else "ky_sigma"
    block |= {name: np.where(np.arange(n) % 3, random.uniform(0.01, 0.4, n), 0.0)}
    motion = {"pgv_m_s": random.uniform(0.1, 1.0, n), "pga_g": np.full(n, 0.45)}
    many = predict(**block, **motion)
    assert isinstance(many, PredictionArray)
    assert many.block_sd is not None
    for i in range(n):
        single: Any = predict(**{k: float(v[i]) for k, v in {**block, **motion}.items()})
        for answered in ("probability", "ci_low", "ci_high"):
            value = getattr(single, answered)
            assert getattr(many, answered)[i] == pytest.approx(value, rel=1e-9, abs=2e-8)
        if block[name][i] > 0.0:
            assert many.block_sd[i] == pytest.approx(single.block_sd, abs=1e-6)


def test_draws_are_answered_by_their_weighted_mean() -> None:
    p2, kr, weights = [3.0, 2.5, 4.0], [0.1, 0.14, 0.12], [1.0, 2.0, 1.0]
    motion = {"pgv_m_s": 0.6, "pga_g": 0.3}
    separate: Any = predict(p2, kr, **motion)
    answer: Any = predict(p2, kr, **motion, weights=weights)
    assert isinstance(answer, Prediction)
    w = np.array(weights) / 4.0
    assert answer.probability == pytest.approx(w @ separate.probability, rel=1e-12)
    variance = w @ (separate.probability - answer.probability) ** 2
    assert answer.block_sd == pytest.approx(math.sqrt(variance), rel=1e-12)
    assert answer.ci_low < answer.probability < answer.ci_high
    same: Any = predict([3.0] * 4, [0.1] * 4, **motion, weights=1.0)
    certain: Any = predict(3.0, 0.1, **motion)
    assert same.probability == pytest.approx(certain.probability, rel=1e-12)
    assert same.ci_high == pytest.approx(certain.ci_high, rel=1e-9)


def test_extrapolation_is_said_where_part_of_the_block_is_outside() -> None:
    answer = predict(28.0, 0.1, pgv_m_s=0.6, p2_sigma=0.3)
    assert answer.in_domain
    (text,) = (text for text in answer.warnings if "of the block uncertainty lies" in text)
    high = find_model(None, ("p2", "kr", "pgv_m_s")).row.domain["p2"][1]
    assert f"(mostly p² above {high:.3g} 1/s²)" in text
    share = norm.sf(math.log(high / 28.0) / 0.3)  # ln p² has a standard deviation of 0.3
    assert float(text.split()[0]) == pytest.approx(100.0 * share, abs=8.0)
    many = predict(np.array([28.0, 3.0]), 0.1, pgv_m_s=0.6, p2_sigma=0.3)
    assert "block uncertainty" in many.reason[0]
    assert many.reason[1] == ""


@pytest.mark.parametrize("block", [{}, {"kr_sigma": 0.1}])
def test_extrapolation_names_what_most_of_p_lies_beyond(block: dict[str, float]) -> None:
    answer = predict(3.0, 0.1, pgv_m_s=0.6, pgv_sigma=0.8, **block)
    high = find_model(None, ("p2", "kr", "pgv_m_s")).row.domain["intensity_m_s"][1]
    (text,) = (text for text in answer.warnings if "of P comes from" in text)
    assert f"(mostly PGV above {high:.3g} m/s)" in text
    # P is near 1 there: the part of PGV beyond, over P
    share = norm.sf(math.log(high / 0.6) / 0.8) / answer.probability
    assert float(text.split()[0]) == pytest.approx(100.0 * share, rel=0.25)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"kr_sigma": -0.1}, "kr_sigma = -0.1: give a standard deviation of 0 or more"),
        ({"kr_sigma": math.nan}, "kr_sigma = nan"),
        ({"ky_sigma": 0.1}, "ky_sigma"),
        ({"kr": [0.1, 0.2], "weights": [1.0, -1.0]}, "weights of draws must be 0 or more"),
        ({"kr": [0.1, 0.2], "weights": [0.0, 0.0]}, "not all 0"),
        ({"kr": [0.1, 0.2], "weights": [1.0, 1.0, 1.0]}, "one length"),
        ({"kr": [0.1, -0.2], "weights": 1.0}, "draw 2: kr = -0.2"),
        (
            {"kr": [0.1, 0.2], "kr_sigma": 0.1, "weights": 1.0},
            "kr_sigma cannot be combined with draws",
        ),
        ({"pgv_m_s": [0.1, 0.2], "weights": 1.0}, "a single motion is required"),
    ],
)
def test_what_is_no_uncertainty_is_rejected(inputs: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        predict(**{"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.6, **inputs})


def test_a_sigma_without_its_value_is_rejected() -> None:
    with pytest.raises(InputError, match="restitution_sigma requires restitution"):
        predict_block(
            stored("pga", PGA), p2=3.0, kr=0.2, pgv_m_s=0.6, pga_g=0.5, restitution_sigma=0.1
        )


def test_in_arrays_a_negative_sigma_has_its_reason() -> None:
    answer: Any = predict(3.0, 0.1, pgv_m_s=0.6, kr_sigma=np.array([0.1, -0.1, np.nan]))
    assert np.isnan(answer.probability).tolist() == [False, True, True]
    assert np.isnan(answer.block_sd).tolist() == [False, True, True]
    assert "is negative" in answer.reason[1]


def test_links_know_their_density_and_quantile() -> None:
    eta = np.array([0.2, 0.7, 1.6, 2.9])
    for link in {method.link.name: method.link for method in methods()}.values():
        p = link.probability(eta, arrays())
        assert link.quantile(p, arrays()) == pytest.approx(eta, rel=1e-9)
        step = 1e-5
        ends = (link.probability(eta + sign * step, arrays()) for sign in (1.0, -1.0))
        high, low = ends
        assert link.density(eta, arrays()) == pytest.approx((high - low) / (2 * step), rel=1e-6)
        assert link.density(0.7, SINGLE) == pytest.approx(link.density(eta, arrays())[1])


def test_other_models_are_asked_of_the_uncertain_block_too():
    question = {
        **{"p2": 0.677, "kr": 0.081, "kr_sigma": 0.575},
        **{"pgv_m_s": 0.194, "pga_g": 0.212, "tm_s": 0.984},
    }
    document = answer_numbers(question, db=REFERENCE).as_dict()
    assert len(document["answers"]) == 3
    for answer in document["answers"]:
        alone = predict(**question, db=REFERENCE, model=answer["model"])
        assert answer["probability"] == alone.probability
        certain = predict(**{**question, "kr_sigma": 0.0}, db=REFERENCE, model=answer["model"])
        assert answer["probability"] != certain.probability
    *warnings, note = predict(**question, db=REFERENCE).warnings
    assert warnings == document["warnings"][:-1]
    assert note.code == document["warnings"][-1].code == "single_component"
