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
from rbfrag.fragility.completion import Regression, encode_regressions
from rbfrag.fragility.dependence import normal_share
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.methods.rocking import BLOCK
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import block_of, find_model, unused_measures
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.question.question import predict

G = 9.80665
PGA = (2.175, 1.789, 1.011, 0.576, -0.272, -4.656, 2.202)
"""Coefficients of the model of PGA and the spectral velocity, near those that are fitted."""

SA = (1.065, 0.519, -0.401, -4.102, 2.229)
PGV = (0.344, 1.612, 1.046, -0.407, -2.845)

REGRESSIONS = {
    "pga_g": Regression([[-2.7]] * 6, [1.1] * 6, [[0.6, 0.9]] * 6),
    "pga_g magnitude": Regression([[-2.2, 0.8]] * 6, [0.8] * 6, [[0.4, 0.8]] * 6),
    "pga_g pgv_m_s": Regression([[0.5, 0.8, -0.2]] * 6, [0.4] * 6, [[0.3, 0.5]] * 6),
    "sa(1)": Regression([[-0.3, 0.9]] * 6, [0.3] * 6, [[0.1, 0.5]] * 6),
}
"""Of ln A, at all sizes alike."""


def stored(term: str, b: tuple[float, ...], **changes: Any) -> FragilityModel:
    names = method_named("rocking").forms[term].parameters
    values: dict[str, Any] = {
        "name": f"{BLOCK.kind}-{term}",
        "kind": BLOCK.kind,
        "term": term,
        "method": "rocking",
        "coefficients": dict(zip(names, b, strict=True)),
        "covariance": tuple(tuple(0.01 * (i == j) for j in names) for i in names),
        "domain": {"restitution": (0.6, 1.0)},
        "data_fingerprint": "f",
        "diagnostics": {},
        "completions": encode_regressions(REGRESSIONS),
    }
    return FragilityModel.from_row(ModelRow(**{**values, **changes}))


def predict_block(model: FragilityModel, **inputs: float) -> Prediction:
    answer = answer_given(model, inputs, 0.95)
    assert isinstance(answer, Prediction)
    return answer


def from_pgv(p2: float, kr: float, e: float, pgv: float, pga: float) -> float:
    l, s, r = 0.5 * math.log(p2), math.sqrt(1.0 - e), kr / pga  # noqa: E741
    zeta = min(math.log(pgv / (pga * G)), 2.0)  # 2: the top of the parabola
    ln_a = 0.5 + 0.8 * zeta - 0.2 * zeta * zeta
    terms = 1.0, -math.log(r), math.log(1.0 - r), l, l * l, s, l + ln_a
    eta = math.exp(s) * sum(b * x for b, x in zip(PGA, terms, strict=True))
    return normal_share(eta / math.sqrt(1.0 + (math.exp(s) * PGA[-1] * 0.4) ** 2))


def test_only_magnitudes_below_6_5_make_a_difference() -> None:
    model = stored("pga", PGA)
    p = [
        predict_block(model, p2=3.0, kr=0.1, pga_g=0.4, magnitude=m).probability
        for m in (5.0, 6.0, 6.5, 7.0, 8.0)
    ]
    assert p[0] < p[1] < p[2] == p[3] == p[4]
    # with PGV it says no more
    with_pgv = {"p2": 3.0, "kr": 0.1, "pga_g": 0.4, "pgv_m_s": 0.5}
    answer = predict_block(model, **with_pgv, magnitude=5.0)
    assert answer.probability == predict_block(model, **with_pgv).probability


def test_the_velocity_does_not_fall_as_pgv_rises() -> None:
    falling = Regression([[0.5, 0.8, -0.2]] * 6, [0.4] * 6, [[0.3, 0.5]] * 6)
    model = stored("pga", PGA, completions=encode_regressions({"pga_g pgv_m_s": falling}))
    pgv = np.geomspace(0.01, 100.0, 200)
    many = answer_given(model, {"p2": 3.0, "kr": 0.1, "pga_g": 0.4, "pgv_m_s": pgv}, 0.95)
    assert np.diff(many.probability).min() >= 0.0
    for i in (0, 90, 199):
        single = predict_block(model, p2=3.0, kr=0.1, pga_g=0.4, pgv_m_s=float(pgv[i]))
        assert many.probability[i] == pytest.approx(single.probability, rel=1e-12)


@pytest.mark.parametrize("e", [None, 1.0, 0.7])
def test_restitution_is_that_of_the_rectangle_unless_it_is_given(e: float | None) -> None:
    model = stored("pga", PGA)
    p2, kr, pgv, pga = 3.0, 0.2, 0.6, 0.5
    block = {"p2": p2, "kr": kr} | ({} if e is None else {"restitution": e})
    housner = 1.0 - 1.5 * math.sin(math.atan(kr)) ** 2
    answer = predict_block(model, **block, pgv_m_s=pgv, pga_g=pga)
    expected = from_pgv(p2, kr, housner if e is None else e, pgv, pga)
    assert answer.probability == pytest.approx(expected, rel=1e-12)
    assert (answer.kind, answer.failure) == ("rocking", "overturning")
    assert answer.in_domain
    columns = {name: np.array([value, value]) for name, value in block.items()}
    many = answer_given(model, {**columns, "pgv_m_s": pgv, "pga_g": pga}, 0.95)
    assert isinstance(many, PredictionArray)
    assert many.probability == pytest.approx([answer.probability] * 2, rel=1e-12)


def test_a_block_that_the_ground_cannot_lift_cannot_overturn() -> None:
    for term, b in (("pga", PGA), ("pgv", PGV)):
        model = stored(term, b)
        answer = predict_block(model, p2=3.0, kr=0.5, pgv_m_s=2.0, pga_g=0.5)
        assert answer.probability == answer.ci_high == 0.0
        assert any("the block cannot uplift" in text for text in answer.warnings)
        weaker = predict_block(model, p2=3.0, kr=0.49, pgv_m_s=2.0, pga_g=0.5)
        assert weaker.probability > 0.0
        assert not any("the block cannot uplift" in text for text in weaker.warnings)
        safe = predict_block(model, p2=3.0, kr=0.49, pgv_m_s=0.03, pga_g=0.5)
        assert 0.0 < safe.probability < 1e-3
        assert not any("the block cannot uplift" in text for text in safe.warnings)


@pytest.mark.parametrize("e", [0.0, -0.1, 1.0001, math.nan, math.inf])
def test_restitution_is_above_zero_and_up_to_one(e: float) -> None:
    model = stored("pga", PGA)
    with pytest.raises(InputError, match="restitution = "):
        predict_block(model, p2=3.0, kr=0.2, restitution=e, pgv_m_s=0.6, pga_g=0.5)
    inputs = {"p2": 3.0, "kr": 0.2, "restitution": np.array([e, 0.9]), "pgv_m_s": 0.6, "pga_g": 0.5}
    many = answer_given(model, inputs, 0.95)
    assert isinstance(many, PredictionArray)
    assert np.isnan(many.probability).tolist() == [True, False]
    assert "restitution" in many.reason[0]


def test_restitution_that_was_not_fitted_is_outside_the_domain() -> None:
    model = stored("pga", PGA)
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
        stored("pga", PGA),
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


def test_the_measures_that_are_given_choose_model_and_regression(tmp_path: Path) -> None:
    path = tmp_path / "rocking.db"
    with opened_database(path, create=True) as engine, engine.begin() as connection:
        for term, b in (("pgv", PGV), ("sa", SA), ("pga", PGA)):
            save_model(connection, stored(term, b).row)
    block = ["p2", "kr"]
    for measures, name, used in (
        (["pga_g"], "rocking-pga", ("pga_g",)),
        (["pga_g", "magnitude"], "rocking-pga", ("pga_g", "magnitude")),
        (["magnitude", "pga_g", "pgv_m_s"], "rocking-pga", ("pga_g", "pgv_m_s")),
        (["pgv_m_s", "sa(1)"], "rocking-pgv", ("pgv_m_s",)),
        (["sa(1)"], "rocking-sa", ("sa(1)",)),
    ):
        chosen = find_model(None, [*block, *measures], path, kind="rocking")
        assert (chosen.name, chosen.term.inputs) == (name, used)
    most = [*block, "pgv_m_s", "pga_g", "magnitude"]
    chosen = find_model(None, most, path, kind="rocking")
    assert unused_measures(chosen, most) == (
        "magnitude was not used: model rocking-pga uses pga_g and pgv_m_s",
    )
    with pytest.raises(InputError, match=r"a prediction requires pga_g, or pgv_m_s, or sa_g"):
        find_model(None, [*block, "magnitude"], path, kind="rocking")


def test_a_description_says_which_blocks_are_meant() -> None:
    assert block_of(["p2", "kr", "pgv_m_s"]).kind == "toppling"
    assert block_of(["pgv_m_s"]).kind == "toppling"
    assert block_of(["p2", "kr", "restitution"]) is BLOCK
    assert block_of(["ky"]).kind == "sliding"
    with pytest.raises(InputError, match="ky"):
        find_model(stored("pgv", (0.0,) * 5), ["ky", "displacement_m", "pgv_m_s"])


@pytest.mark.parametrize("kind", ["rocking", "toppling"])
@pytest.mark.parametrize("shaking", [(0.0, 1.0), (0.6, 0.0)])
def test_no_peak_velocity_or_acceleration_is_no_shaking(
    kind: str, shaking: tuple[float, float]
) -> None:
    pgv, pga = shaking
    answer = predict(0.25, 0.062, pgv_m_s=pgv, pga_g=pga, kind=kind)
    assert (answer.probability, answer.ci_low, answer.ci_high) == (0.0, 0.0, 0.0)
