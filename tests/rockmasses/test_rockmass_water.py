"""Water and roughness of rock masses: the printed yields, and what follows the first slip."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag import Block, GroundMotion, InputError, stability
from rbfrag.campaign.shake_rockmass import shake
from rbfrag.rockmasses.failures import final_modes, outcome_columns
from rbfrag.rockmasses.joint_sets import RockMass
from rbfrag.rockmasses.report import as_dict, block_columns, toppling_blocks
from rbfrag.rockmasses.scenario import ENDS, SLIPS_ON, scenario
from rbfrag.rockmasses.shaking import BOND_BREAKS, FAILS, OUTCOMES, plan_shaking

WET_SLIDE: dict[str, object] = {
    "base.dip_deg": 20.0, "base.spacing_m": 2.0, "back.dip_deg": 80.0, "back.spacing_m": 3.0,
    "friction.phi_deg": 38.0, "block.density_kg_m3": 2650.0, "back.water_m": 1.1372,
}  # fmt: skip
WET_TOPPLE = {
    **WET_SLIDE, "base.dip_deg": 5.0, "base.spacing_m": 3.0, "back.dip_deg": 85.0,
    "back.spacing_m": 0.8, "friction.phi_deg": 35.0, "back.water_m": 1.5173,
}  # fmt: skip
LAW = {"distribution": "uniform", "low": 0.0, "high": 1.2}
PUSH = GroundMotion(np.array([0.0, 0.5, 0.0]), 0.2)


@pytest.mark.parametrize(
    ("description", "mode", "k"), [(WET_SLIDE, "slide", 0.21820), (WET_TOPPLE, "topple", 0.23800)]
)
def test_printed_yields(description: dict[str, object], mode: str, k: float) -> None:
    one = RockMass.of(description).realise(1, 1)
    assert one.stability.mode[0] == mode
    assert one.stability.yield_acceleration[0] == pytest.approx(k, abs=6e-6)
    full = RockMass.of({**description, "back.water_m": 50.0}).realise(1, 1)
    fills = {"slide": 2.2743, "topple": 3.0347}[mode]
    assert full.water_m[0] == pytest.approx(fills, abs=6e-5)


def test_each_block_yields_as_it_would_alone() -> None:
    rough = {
        "friction.jrc": {"distribution": "uniform", "low": 2.0, "high": 14.0},
        "friction.jcs_mpa": 60.0,
    }
    many = RockMass.of({**WET_SLIDE, **rough, "back.water_m": LAW}).realise(100, 3)
    assert many.is_block.all()
    assert many.water_m.std() > 0.2
    for i in range(100):
        one = stability(
            Block.from_fractures(2.0, 3.0, 60.0), beta_deg=20.0, phi_deg=38.0,
            water_m=many.water_m[i], jrc=many.jrc[i], jcs_mpa=60.0, density_kg_m3=2650.0,
        )  # fmt: skip
        assert many.stability.mode[i] == one.mode
        assert many.stability.yield_acceleration[i] == pytest.approx(
            one.yield_acceleration, rel=1e-12
        )
    assert {"water_m", "jrc"} <= block_columns(many).keys()


def test_nothing_follows_from_the_first_slip_without_a_residual_friction() -> None:
    for description, displacement in ((WET_SLIDE, 0.05), (WET_TOPPLE, None)):
        blocks = RockMass.of(description).realise(3, 1)
        answer = scenario(blocks, {"pgv_m_s": 0.6, "pga_g": 0.5}, displacement_m=displacement)
        assert np.isnan(answer.probability).all()
        assert set(answer.reason) == {ENDS}
        assert any("friction.phi_residual_deg" in text for text in answer.warnings)
        plan = plan_shaking(blocks, PUSH)
        assert not plan.moves.any()
        assert (plan.code == BOND_BREAKS).all()
        assert toppling_blocks(blocks)[0].size == 0


def test_on_residual_friction_blocks_are_answered_for_as_after_their_first_slip() -> None:
    wet = RockMass.of({**WET_SLIDE, "friction.phi_residual_deg": 30.0}).realise(4, 1)
    plain = {key: value for key, value in WET_SLIDE.items() if key != "back.water_m"}
    dry = RockMass.of({**plain, "friction.phi_deg": 30.0}).realise(4, 1)
    assert wet.stability.yield_acceleration[0] == pytest.approx(0.21820, abs=6e-6)
    measures = {"pgv_m_s": 0.6, "pga_g": 0.5}
    answers = [scenario(each, measures, displacement_m=0.05) for each in (wet, dry)]
    assert np.array_equal(answers[0].probability, answers[1].probability)
    assert np.isfinite(answers[0].probability).all()
    shaken = [shake(each, PUSH, jobs=1) for each in (wet, dry)]
    assert np.array_equal(shaken[0].displacement_m, shaken[1].displacement_m)
    assert final_modes(shaken[0], 0)["slide"]["slide"] == 4
    # below the yield with water nothing slips, whatever is left after it
    weak = GroundMotion(np.array([0.0, 0.2, 0.0]), 0.2)
    assert not plan_shaking(wet, weak).moves.any()
    assert plan_shaking(dry, weak).moves.all()


def test_what_does_not_stand_after_its_first_slip_fails() -> None:
    blocks = RockMass.of({**WET_SLIDE, "friction.phi_residual_deg": 15.0}).realise(2, 1)
    answer = scenario(blocks, {"pgv_m_s": 0.6, "pga_g": 0.5}, displacement_m=0.05)
    assert set(answer.reason) == {SLIPS_ON}
    shaken = shake(blocks, PUSH, jobs=1)
    assert shaken.code.tolist() == [[FAILS, FAILS]]
    assert shaken.runs == 0
    assert set(outcome_columns(shaken)["outcome"]) == {OUTCOMES[FAILS]}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"block.density_kg_m3": None}, "back.water_m needs block.density_kg_m3"),
        ({"block.back_fracture": False}, "without a back fracture"),
        ({"friction.jrc": 8.0}, "jcs_mpa is missing"),
        ({"back.water_m": -1.0}, "back.water_m: -1 is out of range"),
    ],
)
def test_refusals(changes: dict[str, object], words: str) -> None:
    description = {k: v for k, v in {**WET_SLIDE, **changes}.items() if v is not None}
    with pytest.raises(InputError, match=words):
        RockMass.of(description)


def test_the_document_names_what_is_stated() -> None:
    blocks = RockMass.of({**WET_SLIDE, "back.water_m": LAW}).realise(50, 1)
    assert as_dict(blocks, {}, [])["variables"]["back.water_m"] == "uniform from 0 to 1.2"
