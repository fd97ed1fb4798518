"""Models of free-standing blocks: restitution, what mechanics rules out, what is rejected."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.errors import InputError
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.methods.overturning import BLOCK
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import block_of, find_model, unused_measures
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.fragility.prediction_array import PredictionArray

G = 9.80665
T2 = (7.862, -1.901, 5.122, -9.677, -2.390)
"""Coefficients of the model of (p, k_r, e, PGV, PGA), near those that are fitted."""


PGV = (0.656, -2.932, 1.915, -5.180, -0.747)


def stored(term: str, b: tuple[float, ...], **changes: Any) -> FragilityModel:
    names = method_named("overturning").forms[term].parameters
    values: dict[str, Any] = {
        "name": f"{BLOCK.kind}-{term}",
        "kind": BLOCK.kind,
        "term": term,
        "method": "overturning",
        "coefficients": dict(zip(names, b, strict=True)),
        "covariance": tuple(tuple(0.01 * (i == j) for j in names) for i in names),
        "domain": {"restitution": (0.6, 1.0)},
        "data_fingerprint": "f",
        "diagnostics": {},
    }
    return FragilityModel.from_row(ModelRow(**{**values, **changes}))


def predict_block(model: FragilityModel, **inputs: float) -> Prediction:
    answer = answer_given(model, inputs, 0.95)
    assert isinstance(answer, Prediction)
    return answer


def five_terms(p2: float, kr: float, e: float, pgv: float, pga: float) -> float:
    log_odds = math.log(kr / (pga - kr))
    z, s = math.sqrt(p2) * pgv / (pga * G), math.sqrt(1.0 - e)
    eta = 7.862 - 1.901 * log_odds + 5.122 * math.log(z) - 9.677 * s - 2.390 * s * log_odds
    return 1.0 / (1.0 + math.exp(-eta))


SPECTRAL = (5.228, -2.360, 4.288, -11.091, 1.157, -0.303, 2.522, -2.392, 1.823, -1.085)
"""The same of the model with spectral accelerations."""


def test_the_form_with_spectral_accelerations() -> None:
    """1, L, ln z, s, l, w1, w3, s L, w1 l, w3 l, times h of A, B."""
    p2, kr, e, pgv, pga, sa10, sa30 = 7.0, 0.15, 0.92, 0.7, 0.45, 0.5, 0.12
    p, l = math.sqrt(p2), 0.5 * math.log(p2)  # noqa: E741  as in the formula
    log_odds, s = math.log(kr / (pga - kr)), math.sqrt(1.0 - e)
    w1 = math.log(sa10 * G * 1.0 / (2.0 * math.pi) / pgv)
    w3 = math.log(sa30 * G * 3.0 / (2.0 * math.pi) / pgv)
    terms = (
        1.0, log_odds, math.log(p * pgv / (pga * G)), s, l, w1, w3, s * log_odds, w1 * l, w3 * l
    )  # fmt: skip
    eta = sum(b * x for b, x in zip(SPECTRAL, terms, strict=True))
    eta *= math.exp(0.15 * l - 0.08 * l * l)
    answer = predict_block(
        stored("pgv_pga_sa10_sa30", SPECTRAL), p2=p2, kr=kr, restitution=e, pgv_m_s=pgv, pga_g=pga,
        sa10_g=sa10, sa30_g=sa30,
    )  # fmt: skip
    assert answer.probability == pytest.approx(1.0 / (1.0 + math.exp(-eta)), rel=1e-12)


def test_only_magnitudes_below_6_5_make_a_difference() -> None:
    model = stored("pga_m", (-1.7, -1.0, 3.4, -4.5, -1.9, 2.4, -0.34, -0.6))
    p = [
        predict_block(model, p2=3.0, kr=0.1, pga_g=0.4, magnitude=m).probability
        for m in (5.0, 6.0, 6.5, 7.0, 8.0)
    ]
    assert p[0] < p[1] < p[2] == p[3] == p[4]
    assert "say little of overturning" in " ".join(
        predict_block(model, p2=3.0, kr=0.1, pga_g=0.4, magnitude=7.0).warnings
    )


@pytest.mark.parametrize("e", [None, 1.0, 0.7])
def test_restitution_is_that_of_the_rectangle_unless_it_is_given(e: float | None) -> None:
    model = stored("pgv_pga", T2)
    p2, kr, pgv, pga = 3.0, 0.2, 0.6, 0.5
    block = {"p2": p2, "kr": kr} | ({} if e is None else {"restitution": e})
    housner = 1.0 - 1.5 * math.sin(math.atan(kr)) ** 2
    answer = predict_block(model, **block, pgv_m_s=pgv, pga_g=pga)
    expected = five_terms(p2, kr, housner if e is None else e, pgv, pga)
    assert answer.probability == pytest.approx(expected, rel=1e-12)
    assert (answer.kind, answer.failure) == ("rocking", "overturning")
    assert answer.in_domain
    columns = {name: np.array([value, value]) for name, value in block.items()}
    many = answer_given(model, {**columns, "pgv_m_s": pgv, "pga_g": pga}, 0.95)
    assert isinstance(many, PredictionArray)
    assert many.probability == pytest.approx([answer.probability] * 2, rel=1e-12)


def test_a_block_that_the_ground_cannot_lift_cannot_overturn() -> None:
    for term, b in (("pgv_pga", T2), ("pgv", PGV)):
        model = stored(term, b)
        answer = predict_block(model, p2=3.0, kr=0.5, pgv_m_s=2.0, pga_g=0.5)
        assert answer.probability == answer.ci_high == 0.0
        assert any("the block cannot uplift" in text for text in answer.warnings)
        weaker = predict_block(model, p2=3.0, kr=0.49, pgv_m_s=2.0, pga_g=0.5)
        assert weaker.probability > 0.0
        assert not any("the block cannot uplift" in text for text in weaker.warnings)
        safe = predict_block(model, p2=3.0, kr=0.49, pgv_m_s=1e-3, pga_g=0.5)
        assert 0.0 < safe.probability < 1e-3
        assert not any("the block cannot uplift" in text for text in safe.warnings)


@pytest.mark.parametrize("e", [0.0, -0.1, 1.0001, math.nan, math.inf])
def test_restitution_is_above_zero_and_up_to_one(e: float) -> None:
    model = stored("pgv_pga", T2)
    with pytest.raises(InputError, match="restitution = "):
        predict_block(model, p2=3.0, kr=0.2, restitution=e, pgv_m_s=0.6, pga_g=0.5)
    inputs = {"p2": 3.0, "kr": 0.2, "restitution": np.array([e, 0.9]), "pgv_m_s": 0.6, "pga_g": 0.5}
    many = answer_given(model, inputs, 0.95)
    assert isinstance(many, PredictionArray)
    assert np.isnan(many.probability).tolist() == [True, False]
    assert "restitution" in many.reason[0]


def test_restitution_that_was_not_fitted_is_outside_the_domain() -> None:
    model = stored("pgv_pga", T2)
    inputs = predict_block(model, p2=3.0, kr=0.2, restitution=0.5, pgv_m_s=0.6, pga_g=0.5)
    # a stocky block: its formula gives less than 0.6
    stocky = predict_block(model, p2=3.0, kr=0.7, pgv_m_s=2.0, pga_g=1.5)
    for answer in (inputs, stocky):
        assert not answer.in_domain
        assert any("restitution = " in text for text in answer.warnings)
    # so stocky that the formula is below zero: as if no speed were left
    assert 0.0 < predict_block(model, p2=3.0, kr=2.0, pgv_m_s=5.0, pga_g=2.1).probability < 1.0


def test_less_restitution_less_shaking_and_more_strength_are_safer() -> None:
    models = (
        stored("pgv_pga", T2),
        stored("pgv", PGV),
    )
    block = {"p2": 3.0, "kr": 0.2, "restitution": 0.9}
    for model in models:

        def p(model: FragilityModel = model, **changes: float) -> float:
            return predict_block(
                model, **{**block, "pgv_m_s": 0.5, "pga_g": 0.5, **changes}
            ).probability

        assert p(restitution=0.8) < p() < p(restitution=1.0)
        assert p(kr=0.25) < p() < p(kr=0.15)
        assert p(pgv_m_s=0.4, pga_g=0.4) < p() < p(pgv_m_s=0.6, pga_g=0.6)
        # also far outside what is fitted
        rising = [p(pgv_m_s=v) for v in np.geomspace(1e-4, 10.0, 60).tolist()]
        assert np.all(np.diff(rising) >= 0.0)
        assert rising[0] < 1e-3


def test_pga_alone_is_rejected_and_told_what_would_suffice(tmp_path: Path) -> None:
    path = tmp_path / "rocking.db"
    with opened_database(path, create=True) as engine, engine.begin() as connection:
        for term, b in (("pgv", PGV), ("pga_m", (0.0,) * 8), ("pgv_pga", T2)):
            save_model(connection, stored(term, b).row)
    block = ["p2", "kr"]
    with pytest.raises(InputError, match=r"give pga_g and magnitude, or pgv_m_s$") as rejected:
        find_model(None, [*block, "pga_g"], path, kind="rocking")
    assert len(str(rejected.value)) < 500
    assert (
        find_model(None, [*block, "pga_g", "magnitude"], path, kind="rocking").term.name == "pga_m"
    )
    most = [*block, "pgv_m_s", "pga_g", "magnitude"]
    chosen = find_model(None, most, path, kind="rocking")
    assert chosen.term.name == "pgv_pga"
    assert unused_measures(chosen, most) == (
        "magnitude was not used: model rocking-pgv_pga uses pgv_m_s and pga_g",
    )


def test_a_description_says_which_blocks_are_meant() -> None:
    assert block_of(["p2", "kr", "pgv_m_s"]).kind == "toppling"
    assert block_of(["pgv_m_s"]).kind == "toppling"
    assert block_of(["p2", "kr", "restitution"]) is BLOCK
    assert block_of(["ky"]).kind == "sliding"
    with pytest.raises(InputError, match="ky"):
        find_model(stored("pgv", (0.0,) * 5), ["ky", "displacement_m", "pgv_m_s"])
