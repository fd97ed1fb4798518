"""Answers about blocks that slide or slump, by the same `predict`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError, ModelError, UnknownModelError
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import MotionPrediction, Prediction
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.question import predict
from tests.fragility.portfolio_draws import SHARED
from tests.fragility.test_outcome_prediction import shaking

METHODS = {"sliding": "displacement", "slumping": "capacity"}


SLUMPS = (1.2, 3.0, 2.5, 1.2, 0.5)


def row_of(kind: str, term: str = "pgv_pga", **changes: Any) -> ModelRow:
    form = method_named(METHODS[kind]).forms[term]
    size = len(form.parameters)
    covariance = tuple(tuple(0.01 * (i == j) for j in range(size)) for i in range(size))
    values: dict[str, Any] = {
        "name": f"{kind}-{term}",
        "kind": kind,
        "term": term,
        "method": METHODS[kind],
        "coefficients": dict(zip(form.parameters, form.start or SLUMPS, strict=False)),
        "covariance": covariance,
        "domain": {"pgv_over_pga_s": (0.02, 0.4), "k_over_pga": (0.01, 1.0)},
        "data_fingerprint": "f",
        "dependence": SHARED,
        "diagnostics": {"rotation_deg": None},
    }
    return ModelRow(**{**values, **changes})


SLIDE = {"ky": 0.1, "displacement_m": 0.1}
SLUMP = {"ks": 0.15, "ps2": 3.0}


def predict_block(**inputs: Any) -> Prediction:
    answer = predict(**inputs)
    assert isinstance(answer, Prediction)
    return answer


@settings(max_examples=60)
@given(
    ky=st.floats(0.01, 0.5),
    d=st.floats(0.001, 1.0),
    pgv=st.floats(0.01, 2.0),
    pga=st.floats(0.02, 1.5),
)
def test_probabilities_fall_with_strength_and_distance(
    ky: float, d: float, pgv: float, pga: float
) -> None:
    inputs: dict[str, Any] = {"ky": ky, "pgv_m_s": pgv, "pga_g": pga, "model": row_of("sliding")}
    local = predict_block(displacement_m=d, **inputs)
    assert 0.0 <= local.ci_low <= local.probability <= local.ci_high <= 1.0
    further = predict_block(displacement_m=1.5 * d, **inputs)
    assert further.probability <= local.probability
    if ky >= pga:
        assert local.probability == local.ci_high == 0.0
        assert any("does not move" in text for text in local.warnings)
        assert local.median_displacement_m is None
    else:
        assert local.median_displacement_m is not None
        # what is exceeded with P = 1/2 splits the distances
        assert (d < local.median_displacement_m) == (local.probability > 0.5)


def test_a_base_that_dips_is_a_shorter_distance_on_a_level_one() -> None:
    inputs: dict[str, Any] = {"pgv_m_s": 0.5, "pga_g": 0.6, "model": row_of("sliding")}
    factor = math.cos(math.atan(0.1)) / math.cos(math.radians(25.0) + math.atan(0.1))
    inclined = predict_block(ky=0.1, displacement_m=0.2, beta_deg=25.0, **inputs)
    level = predict_block(ky=0.1, displacement_m=0.2 / factor, **inputs)
    assert inclined.probability == pytest.approx(level.probability, rel=1e-12)
    assert inclined.failure == "permanent displacement above 0.2 m"
    assert inclined.median_displacement_m == pytest.approx(factor * level.median_displacement_m)
    for beta in (88.0, 95.0, -10.0):
        with pytest.raises(InputError, match="friction angle"):
            predict(ky=0.1, displacement_m=0.2, beta_deg=beta, **inputs)
    many = predict(ky=0.1, displacement_m=0.2, beta_deg=[25.0, 88.0, -5.0], **inputs)
    assert isinstance(many, PredictionArray)
    assert many.probability[0] == pytest.approx(inclined.probability, rel=1e-12)
    assert np.isnan(many.probability).tolist() == [False, True, False]
    assert "friction angle" in many.reason[1]


def test_a_slump_is_answered_by_its_formula() -> None:
    ks, ps2, pgv, pga = 0.15, 3.0, 0.5, 0.6
    b0, b1, b2, b3, bm = SLUMPS
    inputs: dict[str, Any] = {"ks": ks, "ps2": ps2, "pgv_m_s": pgv}
    result = predict_block(**inputs, pga_g=pga, model=row_of("slumping"))
    r = ks / pga
    z = math.sqrt(ps2) * pgv / (pga * STANDARD_GRAVITY_M_S2)
    eta = b0 + b1 * math.log((1 - r) / r) + b2 * math.log(z) + b3 * math.log(ks)
    assert result.probability == pytest.approx(float(ndtr(eta)), rel=1e-12)
    assert result.y_m_s == pytest.approx(ks * STANDARD_GRAVITY_M_S2 / math.sqrt(ps2))
    assert (result.in_domain, result.kind, result.failure) == (
        True, "slumping", "failure past recovery",
    )  # fmt: skip
    great = predict_block(**inputs, pga_g=pga, magnitude=7.5, model=row_of("slumping", "pgv_pga_m"))
    assert great.probability == pytest.approx(float(ndtr(eta + bm)), rel=1e-12)
    still = predict_block(ks=0.7, ps2=ps2, pgv_m_s=pgv, pga_g=pga, model=row_of("slumping"))
    assert still.probability == 0.0
    far = predict_block(ks=ks, ps2=ps2, pgv_m_s=5.0, pga_g=pga, model=row_of("slumping"))
    assert not far.in_domain
    assert any("PGV/(PGA·g) is" in text for text in far.warnings)


def test_the_same_warnings_and_types_as_for_toppling() -> None:
    for block, kind in ((SLIDE, "sliding"), (SLUMP, "slumping")):
        model = row_of(kind)
        large = predict_block(**block, pgv_m_s=60.0, pga_g=0.5, model=model)
        assert any("did you mean cm/s" in text for text in large.warnings)
        nothing = predict_block(**block, pgv_m_s=0.0, pga_g=0.0, model=model)
        assert (nothing.probability, nothing.ci_high) == (0.0, 0.0)
        assert any("no shaking" in text for text in nothing.warnings)
        plain = predict_block(**block, pgv_m_s=0.5, pga_g=0.5, model=model)
        for number in (np.float32, np.float64, np.array):
            half = {name: number(value) for name, value in block.items()}
            assert predict_block(
                **half, pgv_m_s=0.5, pga_g=0.5, model=model
            ).probability == pytest.approx(plain.probability, rel=1e-5)
        with pytest.raises(InputError, match="lies between 0 and 1"):
            predict(**block, pgv_m_s=0.5, pga_g=0.5, model=model, level=np.array([0.9, 0.95]))


@pytest.mark.parametrize(
    ("kind", "term"),
    [
        ("sliding", "pgv"),
        ("sliding", "pgv_pga"),
        ("slumping", "pgv_pga"),
        ("slumping", "pgv_pga_m"),
    ],
)
def test_arrays_agree_with_scalars(kind: str, term: str) -> None:
    model, rng, n = row_of(kind, term), np.random.default_rng(3), 400
    pga = np.exp(rng.uniform(-4, 1, n))
    names = ("ky", "displacement_m") if kind == "sliding" else ("ks", "ps2")
    columns = {
        names[0]: np.where(rng.uniform(size=n) < 0.05, -0.1, pga * rng.uniform(0.01, 1.2, n)),
        names[1]: np.exp(rng.uniform(-5, 3, n)),
        "pgv_m_s": pga * np.exp(rng.normal(-0.1, 1.0, n)),
        "pga_g": pga,
        **({"magnitude": rng.uniform(5.0, 8.0, n)} if term == "pgv_pga_m" else {}),
    }
    many = predict(**columns, model=model, level=0.9)
    assert isinstance(many, PredictionArray)
    assert many.kind == kind
    for i in range(n):
        if columns[names[0]][i] < 0.0:
            assert (many.probability[i], many.reason[i]) == (1.0, "unstable")
            continue
        alone = predict_block(
            **{name: float(v[i]) for name, v in columns.items()}, model=model, level=0.9
        )
        assert [many.probability[i], many.ci_low[i], many.ci_high[i]] == pytest.approx(
            [alone.probability, alone.ci_low, alone.ci_high], rel=1e-12, abs=1e-250
        )
        assert many.in_domain[i] == alone.in_domain
        expected = [
            text
            for text in alone.warnings
            if "was not used" not in text and text not in many.warnings
        ]
        assert len(expected) == len([r for r in many.reason[i].split("; ") if r])


def test_a_motion_answers_for_every_kind() -> None:
    motion = shaking()
    result = predict_block(**SLUMP, motion=motion, model=row_of("slumping"))
    measured = predict_block(
        **SLUMP, pgv_m_s=motion.pgv_m_s, pga_g=motion.pga_g, model=row_of("slumping")
    )
    assert isinstance(result, MotionPrediction)
    assert result.probability == measured.probability
    assert result.forward == result.reverse
    assert set(result.as_dict()["polarities"]) == {"forward", "reverse"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"displacement_m": math.nan}, "displacement_m = nan"),
        ({"displacement_m": 0.0}, "displacement_m = 0 m is not above zero"),
        ({"displacement_m": None}, "displacement_m is missing"),
        ({"pgv_m_s": -1.0}, "pgv_m_s = -1 m/s is negative"),
        ({"pga_g": None}, "requires pgv_m_s and pga_g"),
        ({"level": 2}, "level"),
        ({"ky": "0.1"}, "ky = '0.1' is not a number"),
        ({"ky": None, "displacement_m": None, **SLUMP}, "of kind sliding: it uses ky and"),
        ({"kr": 0.1}, "kr cannot be combined with kind sliding"),
        ({"kind": "slumping"}, "of kind sliding, not slumping"),
        ({"rotation_deg": 2.0}, "rotation_deg is not a failure criterion"),
    ],
)
def test_what_cannot_be_answered_is_rejected(changes: dict[str, Any], words: str) -> None:
    inputs = {**SLIDE, "pgv_m_s": 0.5, "pga_g": 0.5, "model": row_of("sliding"), **changes}
    with pytest.raises(InputError, match=words):
        predict(**inputs)


def test_a_model_of_another_rotation_is_rejected() -> None:
    inputs: dict[str, Any] = {**SLUMP, "pgv_m_s": 0.5, "pga_g": 1.0, "rotation_deg": 2.0}
    with pytest.raises(InputError, match="failure past recovery, not for a rotation of 2°"):
        predict(**inputs, model=row_of("slumping"))
    two = row_of("slumping", diagnostics={"rotation_deg": 2.0})
    assert (
        predict_block(**inputs, model=two).failure
        == "a rotation of 2 degrees or failure past recovery"
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"term": "xp"},
        {"method": "wls"},
        {"coefficients": {"c": 1.0}},
        {"covariance": ((1.0,),)},
    ],
)
def test_torn_rows_are_rejected(changes: dict[str, Any]) -> None:
    with pytest.raises(ModelError):
        FragilityModel.from_row(replace(row_of("sliding"), **changes))


def test_an_unknown_model_or_kind_is_named(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    with pytest.raises(UnknownModelError, match="none-such"):
        predict(**SLIDE, pgv_m_s=0.5, pga_g=0.5, model="none-such")
    with pytest.raises(UnknownModelError, match="no falls model: there are models of "):
        predict(3.0, 0.1, kind="falls", pgv_m_s=0.5)
    assert predict_block(**SLIDE, pgv_m_s=0.5, pga_g=0.5).model == "sliding-pgv_pga"
    assert predict_block(**SLIDE, pgv_m_s=0.5).model == "sliding-pgv"
    with pytest.raises(UnknownModelError, match="no stored slumping model of a rotation of 7°"):
        predict(**SLUMP, pgv_m_s=0.5, pga_g=0.5, rotation_deg=7.0)


FITTED = {
    "slumping-recovery-pgv_pga_m": (1.346, 2.917, 2.461, 1.175, 0.727),
    "slumping-recovery-pgv_pga": (1.667, 2.536, 2.553, 1.014),
    "slumping-2deg-pgv_pga_m": (3.852, 3.063, 2.219, 1.298, 0.395),
    "slumping-2deg-pgv_pga": (3.977, 2.922, 2.369, 1.232),
}


@pytest.mark.parametrize("name", FITTED)
def test_a_slump_fails_sooner_when_weaker_and_under_stronger_shaking(name: str) -> None:
    term = name.rpartition("-")[2]
    names = method_named("capacity").forms[term].parameters
    model = row_of("slumping", term, coefficients=dict(zip(names, FITTED[name], strict=True)))
    rng, n = np.random.default_rng(7), 20_000
    pga, pulse = (np.exp(rng.uniform(*np.log(ends), n)) for ends in ((0.01, 3.0), (0.01, 1.0)))
    block = {
        "ks": pga * np.exp(rng.uniform(np.log(0.001), 0.1, n)),
        "ps2": np.exp(rng.uniform(np.log(0.05), np.log(50.0), n)),
        **({"magnitude": rng.uniform(4.0, 9.0, n)} if term == "pgv_pga_m" else {}),
    }
    shaking = {"pgv_m_s": pulse * pga * STANDARD_GRAVITY_M_S2, "pga_g": pga}

    def p(more: float = 1.0, **factors: float) -> np.ndarray:
        inputs = {**block, **{item: more * value for item, value in shaking.items()}}
        inputs |= {item: factor * inputs[item] for item, factor in factors.items()}
        answer = predict(**inputs, model=model, interval=False)
        assert isinstance(answer, PredictionArray)
        return answer.probability

    local = p()
    assert 0.0 < local.mean() < 1.0
    assert (p(ks=1.02) <= local).all()
    for factors in ({"more": 1.02}, {"pgv_m_s": 1.02}):
        assert (p(**factors) >= local).all()
    if "magnitude" in block:
        assert (p(magnitude=1.02) >= local).all()
