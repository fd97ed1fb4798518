"""Rock masses in which blocks that do not topple freely are answered for too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.question.question import predict
from rbfrag.rockmasses.joint_sets import RockMass
from rbfrag.rockmasses.scenario import Scenario, scenario
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.simulation import shaken_mechanism
from rbfrag.solver.stability.modes import CONFINED_TOPPLE, SLIDE, SLUMP, STABLE

TABLE_3_4 = {
    "base.dip_deg": {"distribution": "normal", "mean": 20.0, "sd": 5.0},
    "base.spacing_m": {"distribution": "normal", "mean": 1.0, "sd": 0.1},
    "back.dip_deg": {"distribution": "normal", "mean": 45.0, "sd": 5.0},
    "back.spacing_m": {"distribution": "normal", "mean": 0.6, "sd": 0.1},
    "friction.phi_deg": 40.0,
}
RESULT = RockMass.of(TABLE_3_4).realise(400, 3)


@pytest.fixture
def answer(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Scenario:
    monkeypatch.chdir(tmp_path_factory.mktemp("empty"))
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    return scenario(RESULT, {"pgv_m_s": 0.6, "pga_g": 0.7}, displacement_m=0.05)


def test_every_stable_block_of_this_rock_mass_has_an_answer(answer: Scenario) -> None:
    assert answer.covered_share == 1.0
    assert answer.uncovered_share == {}
    by_mode = {mode.mode: mode for mode in answer.modes}
    assert set(by_mode) == {"slide", "slump"}
    assert all(mode.has_model for mode in answer.modes)
    assert np.all((answer.ci_low <= answer.probability) & (answer.probability <= answer.ci_high))


def test_blocks_are_answered_as_one_by_one(answer: Scenario) -> None:
    result = RESULT.stability
    slides = np.flatnonzero((result.mode_code == SLIDE) & (result.state_code == STABLE))[:6]
    for i in slides.tolist():
        single = predict(
            ky=float(result.yield_acceleration[i]),
            displacement_m=0.05,
            pgv_m_s=0.6,
            pga_g=0.7,
            beta_deg=float(RESULT.beta_deg[i]),
        )
        assert answer.probability[i] == pytest.approx(single.probability, rel=1e-9, abs=1e-12)
        assert answer.ci_high[i] == pytest.approx(single.ci_high, rel=1e-9, abs=1e-12)
        assert answer.in_domain[i] == single.in_domain
    slumps = np.flatnonzero((result.mode_code == SLUMP) & (result.state_code == STABLE))[:6]
    assert slumps.size == 6
    for i in slumps.tolist():
        shaken = shaken_mechanism(
            model_of_kind("slumping"),
            Block.from_fractures(
                float(RESULT.s1_m[i]), float(RESULT.s2_m[i]), float(RESULT.gamma_deg[i])
            ),
            beta_deg=float(RESULT.beta_deg[i]),
            phi_deg=float(RESULT.phi_deg[i]),
        )
        slump = predict(ks=shaken.yield_g, ps2=shaken.p2, pgv_m_s=0.6, pga_g=0.7)
        assert answer.probability[i] == pytest.approx(slump.probability, rel=1e-9, abs=1e-12)
        assert answer.in_domain[i] == slump.in_domain


def test_confined_topples_are_answered_as_one_by_one() -> None:
    result = RockMass.of({
        "base.dip_deg": 5.0, "back.dip_deg": {"distribution": "normal", "mean": 104.0, "sd": 3.0},
        "base.spacing_m": 0.5, "back.spacing_m": 0.15, "friction.phi_deg": 28.0,
    }).realise(40, 3)  # fmt: skip
    motion = {"pgv_m_s": 0.6, "pga_g": 0.7}
    answer = scenario(result, motion, displacement_m=0.05)
    actual = result.stability
    chosen = (actual.mode_code == CONFINED_TOPPLE) & (actual.state_code == STABLE)
    assert chosen.sum() > 0
    for i in np.flatnonzero(chosen)[:4].tolist():
        single = predict(
            s1_m=float(result.s1_m[i]), s2_m=float(result.s2_m[i]),
            gamma_deg=float(result.gamma_deg[i]),
            beta_deg=float(result.beta_deg[i]), phi_deg=float(result.phi_deg[i]), **motion,
        )  # fmt: skip
        assert single.kind == "confined_toppling"
        assert answer.probability[i] == pytest.approx(single.probability, rel=1e-9, abs=1e-12)
    # of a rotation there is no model
    turned = scenario(result, motion, displacement_m=0.05, rotation_deg=2.0)
    assert np.isnan(turned.probability[chosen]).all()
    assert any("of failure past recovery alone" in text for text in turned.warnings)


def test_a_longer_distance_is_reached_by_fewer(answer: Scenario) -> None:
    far = scenario(RESULT, {"pgv_m_s": 0.6, "pga_g": 0.7}, displacement_m=0.5)
    mean = {mode.mode: mode.covered.probability for mode in answer.modes}
    less = {mode.mode: mode.covered.probability for mode in far.modes}
    assert less["slide"] < mean["slide"]  # type: ignore[operator]
    assert less["slump"] == mean["slump"]


def test_no_shaking_moves_nothing_that_stands() -> None:
    still = scenario(RESULT, {"pgv_m_s": 0.0, "pga_g": 0.0}, displacement_m=0.05)
    stands = RESULT.stability.state_code == STABLE
    assert np.all(still.probability[stands] == 0.0)


def test_what_the_models_lack_is_rejected() -> None:
    with pytest.raises(InputError, match="displacement_m"):
        scenario(RESULT, {"pgv_m_s": 0.6}, displacement_m=0.0)
    without = scenario(RESULT, {"pgv_m_s": 0.6})
    assert without.covered_share < 1.0
    assert math.isclose(sum(without.uncovered_share.values()), 1.0 - without.covered_share)


def test_what_can_be_answered_is_and_the_rest_is_listed() -> None:
    pgv = scenario(RESULT, {"pgv_m_s": 0.6}, displacement_m=0.05)
    covered = {mode.mode: mode.covered.count for mode in pgv.modes}
    assert covered["slide"] > 0
    assert covered["slump"] == 0
    lacks = [text for text in pgv.warnings if text.startswith("slump: ")]
    assert len(lacks) == 1
    assert lacks[0].endswith("no stored slumping model works with pgv_m_s: give pgv_m_s and pga_g")
    slumps = RESULT.of_mode("slump", "stable")
    assert set(pgv.reason[slumps & np.isnan(pgv.probability)]) == {lacks[0].split("answer: ")[1]}
    with pytest.raises(InputError, match="no stored sliding model works with pga_g: give pgv_m_s"):
        scenario(RESULT, {"pga_g": 0.6}, displacement_m=0.1)


def test_slides_that_tip_and_toes_that_slip_are_counted_as_one_by_one() -> None:
    mass = {
        **TABLE_3_4, "back.dip_deg": {"distribution": "uniform", "low": 40.0, "high": 100.0},
        "base.dip_deg": {"distribution": "uniform", "low": -5.0, "high": 25.0},
        "back.water_m": {"distribution": "uniform", "low": 0.0, "high": 0.3},
        "back.spacing_m": 0.5, "block.density_kg_m3": 2650.0,
    }  # fmt: skip
    result = RockMass.of(mass).realise(60, 3)
    motion = {"pgv_m_s": 0.4, "pga_g": 0.7}
    answer = scenario(result, motion, displacement_m=0.05)
    counts = dict.fromkeys(("tip the block", "the toe slips above"), 0)
    for i in np.flatnonzero(result.stability.state_code == STABLE).tolist():
        slide = {"displacement_m": 0.05} if result.stability.mode_code[i] == SLIDE else {}
        single = predict(
            s1_m=float(result.s1_m[i]), s2_m=float(result.s2_m[i]),
            gamma_deg=float(result.gamma_deg[i]),
            beta_deg=float(result.beta_deg[i]), phi_deg=float(result.phi_deg[i]),
            water_m=float(result.water_m[i]), density_kg_m3=2650.0, **slide, **motion,
        )  # fmt: skip
        for text in counts:
            counts[text] += any(text in note for note in single.warnings)
    assert min(counts.values()) > 0
    for text, count in counts.items():
        (note,) = (warning for warning in answer.warnings if text in warning)
        assert note.startswith(f"{count} of ")
