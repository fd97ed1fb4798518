"""Probabilities at sites: certain shaking, and the mean over what is not known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import predict
from rbfrag.hazards import site_probability as site_module
from rbfrag.hazards.conversions import component
from rbfrag.hazards.site_probability import site_probability

FloatArray = NDArray[np.float64]

PGV = np.array([0.0, 0.3, 0.7, 1.2])
PGA = np.array([0.0, 0.3, 0.5, 0.9])
SHAKING = {"pgv_m_s": PGV, "pga_g": PGA}


def test_certain_shaking_is_plain_prediction(model: FragilityModel) -> None:
    p2, kr = np.array([3.0, 10.0]), np.array([0.1, 0.2])
    found = site_probability(SHAKING, p2, kr, component=component("single"), model=model,
                             weight=np.array([3.0, 1.0]))  # fmt: skip
    each = predict(p2[None, :], kr[None, :], pgv_m_s=PGV[:, None], model=model).probability
    assert found.probability == pytest.approx(each @ [0.75, 0.25], rel=1e-14)
    assert found.probability[0] == 0.0


def test_own_blocks(model: FragilityModel) -> None:
    p2, kr = np.full(4, 3.0), np.array([0.05, 0.08, 0.1, 0.15])
    found = site_probability(
        SHAKING, p2, kr, component=component("single"), model=model, own_block=True
    )
    assert found.probability == pytest.approx(predict(p2, kr, pgv_m_s=PGV, model=model).probability)


def test_only_sites_where_nothing_can_fail_are_left_out(
    model: FragilityModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answer() -> FloatArray:
        return site_probability(
            {"pgv_m_s": np.geomspace(0.01, 1.0, 40), "pga_g": np.full(40, 0.5)},
            np.array([3.0, 1.0]),
            np.array([0.1, 0.05]), component=component("larger"), model=model,
        ).probability  # fmt: skip

    some = answer()
    monkeypatch.setattr(site_module, "NOTHING", -1.0)
    every = answer()
    left_out = some == 0.0
    assert 0 < left_out.sum() < 40
    assert (every[left_out] <= 1e-9).all()
    assert np.array_equal(some[~left_out], every[~left_out])


@pytest.mark.parametrize("name", ["single", "rotd50", "larger"])
def test_uncertain_shaking_is_the_mean(model: FragilityModel, name: str) -> None:
    # against plain sampling of ln PGV
    meaning = component(name)
    random = np.random.default_rng(5)
    pgv, std = np.array([0.5, 0.7]), np.array([0.3, 0.5])
    found = site_probability(
        {"pgv_m_s": pgv, "pga_g": np.array([0.4, 0.5])}, np.array([3.0]), np.array([0.1]),
        component=meaning, std_ln={"pgv_m_s": std, "pga_g": np.array([0.4, 0.4])}, model=model,
    )  # fmt: skip
    draws = random.standard_normal((2, 200_000)) * np.hypot(std, meaning.scatter)[:, None]
    shaken = (pgv / meaning.ratio)[:, None] * np.exp(draws)
    sampled = predict(3.0, 0.1, pgv_m_s=shaken, model=model).probability.mean(axis=1)
    assert found.probability == pytest.approx(sampled, abs=0.004)
    assert (found.ci_low < found.probability).all()
    assert (found.probability < found.ci_high).all()
