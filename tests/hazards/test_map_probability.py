"""Probabilities at sites: certain shaking, and the mean over what is not known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.uncertain import correlations
from rbfrag.hazards import map_probability as site_module
from rbfrag.hazards.map_probability import site_probability
from rbfrag.question.components import component_named
from rbfrag.question.question import predict
from tests.hazards.conftest import measure_row

FloatArray = NDArray[np.float64]

PGV = np.array([0.0, 0.3, 0.7, 1.2])
PGA = np.array([0.0, 0.3, 0.5, 0.9])
SHAKING = {"pgv_m_s": PGV, "pga_g": PGA}
SINGLE = component_named("single")


def test_certain_shaking_is_plain_prediction(model: FragilityModel) -> None:
    p2, kr = np.array([3.0, 10.0]), np.array([0.1, 0.2])
    result = site_probability(SHAKING, p2, kr, component=SINGLE, model=model,
                             weight=np.array([3.0, 1.0]))  # fmt: skip
    separate = predict(p2[None, :], kr[None, :], pgv_m_s=PGV[:, None], model=model).probability
    assert result.probability == pytest.approx(separate @ [0.75, 0.25], rel=1e-14)
    assert result.probability[0] == 0.0


def test_own_blocks(model: FragilityModel) -> None:
    p2, kr = np.full(4, 3.0), np.array([0.05, 0.08, 0.1, 0.15])
    result = site_probability(SHAKING, p2, kr, component=SINGLE, model=model, own_block=True)
    assert result.probability == pytest.approx(
        predict(p2, kr, pgv_m_s=PGV, model=model).probability
    )


def test_only_sites_where_nothing_can_fail_are_left_out(
    model: FragilityModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answer() -> FloatArray:
        return site_probability(
            {"pgv_m_s": np.geomspace(0.01, 1.0, 40), "pga_g": np.full(40, 0.5)},
            np.array([3.0, 1.0]),
            np.array([0.1, 0.05]), component=component_named("larger"), model=model,
        ).probability  # fmt: skip

    subset = answer()
    monkeypatch.setattr(site_module, "NOTHING", -1.0)
    monkeypatch.setattr(site_module, "RARE", -1.0)
    every = answer()
    left_out = subset == 0.0
    assert 0 < left_out.sum() < 40
    assert (every[left_out] <= 8e-7).all()
    assert subset[~left_out] == pytest.approx(every[~left_out], abs=1e-6)


@pytest.mark.parametrize("name", ["single", "rotd50", "larger"])
def test_uncertain_shaking_is_the_mean(model: FragilityModel, name: str) -> None:
    # against plain sampling of ln PGV
    meaning = component_named(name)
    random = np.random.default_rng(5)
    pgv, std = np.array([0.5, 0.7]), np.array([0.3, 0.5])
    result = site_probability(
        {"pgv_m_s": pgv, "pga_g": np.array([0.4, 0.5])}, np.array([3.0]), np.array([0.1]),
        component=meaning, std_ln={"pgv_m_s": std, "pga_g": np.array([0.4, 0.4])}, model=model,
    )  # fmt: skip
    draws = random.standard_normal((2, 200_000)) * np.hypot(std, meaning.sigma)[:, None]
    shaken = (pgv / meaning.ratio("pgv_m_s"))[:, None] * np.exp(draws)
    sampled = predict(3.0, 0.1, pgv_m_s=shaken, model=model).probability.mean(axis=1)
    assert result.probability == pytest.approx(sampled, abs=0.004)
    assert (result.ci_low < result.probability).all()
    assert (result.probability < result.ci_high).all()


def measured(*names: str) -> dict[str, FloatArray]:
    values = {"pga_g": [0.5, 0.7], "sa(0.3)": [0.9, 1.1], "sa(1)": [0.5, 0.6], "sa(3)": [0.1, 0.2]}
    return {name: np.array(values[name]) for name in names}


ALL = ("pga_g", "sa(0.3)", "sa(1)", "sa(3)")


@pytest.mark.parametrize(
    ("names", "term"),
    [
        (ALL, "pga"),
        (("pga_g", "sa(1)"), "pga"),
        (("pga_g", "sa(0.3)", "sa(1)"), "pga"),
        (("sa(1)",), "sa"),
        (("pga_g",), "pga"),
    ],
)
def test_without_pgv_the_best_of_what_is_there_answers(
    measures_db: str, names: tuple[str, ...], term: str
) -> None:
    shaking = measured(*names)
    result = site_probability(
        shaking,
        np.array([3.0]),
        np.array([0.1]),
        component=SINGLE,
        db=measures_db,
    )
    assert result.shaking.model.term.name == term
    chosen = FragilityModel.from_row(measure_row(term)).for_inputs(names)
    assert set(chosen.term.inputs) == set(names)
    block_inputs = {name: shaking[name] for name in chosen.term.inputs}
    expected = answer_given(chosen, {"p2": 3.0, "kr": 0.1, **block_inputs}, 0.95)
    assert result.probability == pytest.approx(expected.probability, rel=1e-12)
    assert result.shaking.integrated == ()


@pytest.mark.parametrize("names", [ALL, ("pga_g", "sa(1)"), ("sa(1)",)])
def test_uncertain_spectral_accelerations_are_the_mean(
    measures_db: str, names: tuple[str, ...]
) -> None:
    # against plain sampling of the measures' logarithms with the published correlations
    shaking, meaning = measured(*names), component_named("larger")
    std = {name: np.full(2, 0.5 + 0.05 * i) for i, name in enumerate(names)}
    result = site_probability(
        shaking, np.array([3.0]), np.array([0.1]), component=meaning, std_ln=std, db=measures_db
    )
    assert set(result.shaking.integrated) == set(names)
    random = np.random.default_rng(2)
    deviations = np.array([std[name][0] for name in names])
    covariance = correlations(names) * np.outer(deviations, deviations) + meaning.sigma**2
    drawn = random.multivariate_normal(np.zeros(len(names)), covariance, 200_000)
    sampled = {
        name: shaking[name][:, None] / meaning.ratio(name) * np.exp(drawn[:, i])
        for i, name in enumerate(names)
    }
    chosen = find_model(None, ("p2", "kr", *names), measures_db)
    expected = answer_given(chosen, {"p2": 3.0, "kr": 0.1, **sampled}, 0.95).probability
    # the spectral velocity of uncertain ordinates is taken as lognormal
    assert result.probability == pytest.approx(expected.mean(axis=1), rel=0.08)


@pytest.mark.parametrize(
    ("names", "value"),
    [(ALL, "pga_g"), (("pga_g", "sa(1)"), "pga_g"), (("pga_g", "sa(1)"), "sa(1)")],
)
def test_one_deviation_alone_is_used(measures_db: str, names: tuple[str, ...], value: str) -> None:
    # grids of version 3 state that of PGA alone; the last case has a first measure that is certain
    shaking, std = measured(*names), np.array([0.5, 0.5])
    result = site_probability(
        shaking, np.array([3.0]), np.array([0.1]), component=SINGLE, db=measures_db,
        std_ln={value: std},
    )  # fmt: skip
    assert result.shaking.integrated == (value,)
    draws = np.exp(0.5 * np.random.default_rng(7).standard_normal((2, 100_000)))
    shaken = {name: values[:, None] * np.ones_like(draws) for name, values in shaking.items()}
    shaken[value] = shaken[value] * draws
    chosen = result.shaking.model
    block_inputs = {name: shaken[name] for name in chosen.term.inputs}
    sampled = answer_given(chosen, {"p2": 3.0, "kr": 0.1, **block_inputs}, 0.95).probability
    assert result.probability == pytest.approx(sampled.mean(axis=1), abs=0.004)
    assert np.ptp(sampled, axis=1).min() > 0.1  # it matters


def test_correlations_of_the_residuals() -> None:
    every = correlations(("pgv_m_s", "pga_g", "sa(0.3)", "sa(1)", "sa(3)"))
    assert every[0, 1] == pytest.approx(0.733, abs=0.02)
    assert every == pytest.approx(every.T)
    assert np.linalg.eigvalsh(every).min() > 0.0


@pytest.mark.parametrize("names", [("pgv_m_s",), ALL])
def test_weak_shaking_at_which_nothing_fails_is_not_missed(
    model: FragilityModel, measures_db: str, names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = model if names == ("pgv_m_s",) else find_model(None, ("p2", "kr", *names), measures_db)
    scale = np.geomspace(0.05, 3.0, 30)

    def answer() -> FloatArray:
        return site_probability(
            dict.fromkeys(names, 0.5 * scale), np.array([3.0, 1.0]), np.array([0.1, 0.05]),
            component=component_named("larger"), std_ln=dict.fromkeys(names, np.full(30, 0.5)),
            model=chosen,
        ).probability  # fmt: skip

    subset = answer()
    monkeypatch.setattr(site_module, "_SILENT", ())
    assert subset == pytest.approx(answer(), abs=1e-7)
