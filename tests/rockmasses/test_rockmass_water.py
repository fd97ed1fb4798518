"""Water and roughness of rock masses: printed yields, undrained and drained answers."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag import Block, GroundMotion, InputError, predict, respond, stability
from rbfrag.campaign.rock_mass_answer import shake
from rbfrag.rockmasses.counts import mode_counts
from rbfrag.rockmasses.joint_sets import Realisations, RockMass
from rbfrag.rockmasses.report import (
    as_dict,
    block_columns,
    final_modes,
    outcome_columns,
    toppling_blocks,
)
from rbfrag.rockmasses.scenario import ENDS, SLIPS_ON, Scenario, scenario
from rbfrag.rockmasses.shaking import BOND_BREAKS, FAILS, OUTCOMES, ShakenMass, plan_shaking
from rbfrag.solver.stability.joint import ASSUMED_DENSITY, IS_DRAINED, STAYS_UNDRAINED
from rbfrag.solver.stability.modes import MODES, STABLE

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
    single = RockMass.of(description).realise(1, 1)
    assert single.stability.mode[0] == mode
    assert single.stability.yield_acceleration[0] == pytest.approx(k, abs=6e-6)
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
        single = stability(
            Block.from_fractures(2.0, 3.0, 60.0), beta_deg=20.0, phi_deg=38.0,
            water_m=many.water_m[i], jrc=many.jrc[i], jcs_mpa=60.0, density_kg_m3=2650.0,
        )  # fmt: skip
        assert many.stability.mode[i] == single.mode
        assert many.stability.yield_acceleration[i] == pytest.approx(
            single.yield_acceleration, rel=1e-12
        )
    assert {"water_m", "jrc"} <= block_columns(many).keys()


FOUR_MODES: dict[str, object] = {
    "base.dip_deg": {"distribution": "uniform", "low": -20.0, "high": 35.0},
    "base.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
    "back.dip_deg": {"distribution": "uniform", "low": 25.0, "high": 175.0},
    "back.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
    "friction.phi_deg": {"distribution": "uniform", "low": 15.0, "high": 50.0},
    "block.density_kg_m3": 2600.0,
}
WATER: dict[str, object] = {"back.water_m": {"distribution": "uniform", "low": 0.0, "high": 0.6}}
DRAINED: dict[str, object] = {"back.drainage": "drained"}
SHAKING = {"pgv_m_s": 0.6, "pga_g": 0.7}


def assess_masses(description: dict[str, object], n: int = 400) -> tuple[Realisations, Scenario]:
    blocks = RockMass.of(description).realise(n, 2)
    return blocks, scenario(blocks, SHAKING, displacement_m=0.05)


def test_each_wet_block_has_the_probability_it_would_have_alone() -> None:
    blocks, answer = assess_masses({**FOUR_MODES, **WATER})
    stable = blocks.is_block & (blocks.stability.state_code == STABLE) & (answer.how != "")
    modes = set()
    assert answer.drained is not None
    for i in np.flatnonzero(stable)[:80].tolist():
        modes.add(str(blocks.stability.mode[i]))
        for drainage, many in (("undrained", answer), ("drained", answer.drained)):
            shape = {
                "s1_m": float(blocks.s1_m[i]), "s2_m": float(blocks.s2_m[i]),
                "gamma_deg": float(blocks.gamma_deg[i]), "beta_deg": float(blocks.beta_deg[i]),
                "phi_deg": float(blocks.phi_deg[i]), "density_kg_m3": 2600.0,
            }  # fmt: skip
            if drainage == "undrained":
                shape["water_m"] = float(blocks.water_m[i])
            expected = blocks if drainage == "undrained" else blocks.drained
            assert expected is not None
            if expected.stability.mode[i] == "slide":
                shape["displacement_m"] = 0.05
            elif np.isnan(many.probability[i]):
                continue
            alone = predict(**shape, **SHAKING)
            assert many.probability[i] == pytest.approx(alone.probability, rel=1e-9, abs=1e-12)
            assert many.ci_high[i] == pytest.approx(alone.ci_high, rel=1e-9, abs=1e-12)
    assert modes == set(MODES)


def test_a_wet_slide_is_as_likely_as_elsewhere() -> None:
    blocks = RockMass.of(WET_SLIDE).realise(2, 1)
    answer = scenario(blocks, {"pgv_m_s": 0.5, "pga_g": 0.6, "magnitude": 6.9}, displacement_m=0.05)
    # docs: undrained 61 %, drained 8.4 %
    assert answer.probability[0] == pytest.approx(0.61, abs=0.005)
    document = as_dict(blocks, mode_counts(blocks), [], answer)
    total = document["scenario"]["covered_only"]
    assert total["drained"]["probability"] == pytest.approx(0.084, abs=0.0005)
    assert document["scenario"]["modes"]["slide"]["drained"] == total["drained"]
    drained = document["modes"]["slide"]["drained"]
    assert drained["yield_g"]["q50"] == pytest.approx(0.32492, abs=6e-6)
    assert document["drainage"] == "undrained"
    assert STAYS_UNDRAINED in document["warnings"]


@pytest.fixture(scope="module")
def dry() -> tuple[Realisations, Scenario, ShakenMass]:
    blocks, answer = assess_masses(FOUR_MODES)
    return blocks, answer, shake(blocks, PUSH, jobs=1)


def test_a_drained_rock_mass_is_a_dry_one(dry: tuple[Realisations, Scenario, ShakenMass]) -> None:
    drained, answer = assess_masses({**FOUR_MODES, **WATER, **DRAINED})
    assert drained.water_m.any()
    assert drained.drained is not None
    assert np.array_equal(
        drained.stability.yield_acceleration, dry[0].stability.yield_acceleration, equal_nan=True
    )
    assert np.array_equal(answer.probability, dry[1].probability, equal_nan=True)
    shaken = shake(drained, PUSH, jobs=1)
    assert np.array_equal(shaken.code, dry[2].code)
    assert np.array_equal(shaken.displacement_m, dry[2].displacement_m, equal_nan=True)
    document = as_dict(drained, mode_counts(drained), [], answer)
    assert IS_DRAINED in document["warnings"]
    assert document["drainage"] == "drained"
    total = document["scenario"]["covered_only"]
    assert total["drained"]["probability"] == total["probability"]
    dry_document = as_dict(dry[0], mode_counts(dry[0]), [], dry[1])
    assert dry_document["drainage"] is None
    assert dry_document["scenario"]["covered_only"]["drained"] is None
    assert dry_document["modes"]["slide"]["drained"] is None


def test_water_that_vanishes_leaves_a_dry_rock_mass(
    dry: tuple[Realisations, Scenario, ShakenMass],
) -> None:
    wet, answer = assess_masses({**FOUR_MODES, "back.water_m": 1e-9})
    assert wet.is_wet.any()
    assert np.array_equal(wet.stability.mode_code, dry[0].stability.mode_code)
    assert answer.probability == pytest.approx(dry[1].probability, abs=1e-7, nan_ok=True)
    shaken = shake(wet, PUSH, jobs=1)
    assert np.array_equal(shaken.code, dry[2].code)
    assert shaken.displacement_m == pytest.approx(dry[2].displacement_m, abs=1e-6, nan_ok=True)
    assert shaken.rotation_rad == pytest.approx(dry[2].rotation_rad, abs=1e-6, nan_ok=True)


def test_drained_is_the_lower_bound() -> None:
    blocks, answer = assess_masses({**FOUR_MODES, **WATER})
    assert blocks.drained is not None
    assert answer.drained is not None
    same_mode = blocks.stability.mode_code == blocks.drained.stability.mode_code
    expected = same_mode & np.isfinite(answer.probability) & np.isfinite(answer.drained.probability)
    assert np.all(answer.probability[expected] >= answer.drained.probability[expected] - 1e-12)
    assert expected.sum() > 200
    assert answer.covered.probability > answer.drained.covered.probability  # type: ignore[operator]
    columns = block_columns(blocks, answer)
    assert np.array_equal(
        columns["drained_probability"], answer.drained.probability, equal_nan=True
    )
    assert np.array_equal(
        columns["drained_yield_g"], blocks.drained.stability.yield_acceleration, equal_nan=True
    )


def test_toppling_blocks_are_those_with_the_water() -> None:
    p2, kr, share = toppling_blocks(RockMass.of(WET_TOPPLE).realise(3, 1))
    assert kr == pytest.approx([0.238] * 3, abs=6e-6)
    assert share == 1.0
    assert p2.size == 3


def test_roughness_still_ends_with_the_first_slip() -> None:
    rough = {"friction.jrc": 8.0, "friction.jcs_mpa": 60.0}
    blocks = RockMass.of({**WET_SLIDE, **rough}).realise(3, 1)
    answer = scenario(blocks, {"pgv_m_s": 0.6, "pga_g": 0.5}, displacement_m=0.05)
    assert np.isnan(answer.probability).all()
    assert set(answer.reason) == {ENDS}
    assert any("friction.phi_residual_deg" in text for text in answer.warnings)
    plan = plan_shaking(blocks, PUSH.scaled(3.0))
    assert not plan.moves.any()
    assert (plan.code == BOND_BREAKS).all()


def test_water_stays_on_residual_friction() -> None:
    wet = RockMass.of({**WET_SLIDE, "friction.phi_residual_deg": 30.0}).realise(4, 1)
    slips = RockMass.of({**WET_SLIDE, "friction.phi_deg": 30.0}).realise(4, 1)
    assert wet.stability.yield_acceleration[0] == pytest.approx(0.21820, abs=6e-6)
    measures = {"pgv_m_s": 0.6, "pga_g": 0.5}
    answers = [scenario(item, measures, displacement_m=0.05) for item in (wet, slips)]
    assert np.array_equal(answers[0].probability, answers[1].probability)
    assert np.isfinite(answers[0].probability).all()
    shaken = [shake(item, PUSH, jobs=1) for item in (wet, slips)]
    assert np.array_equal(shaken[0].displacement_m, shaken[1].displacement_m)
    assert final_modes(shaken[0], 0)["slide"]["slide"] == 4
    alone = respond(
        PUSH, block=Block.from_fractures(2.0, 3.0, 60.0), beta_deg=20.0, phi_deg=38.0,
        phi_residual_deg=30.0, water_m=1.1372, density_kg_m3=2650.0,
    )  # fmt: skip
    assert shaken[0].displacement_m[0, 0] == alone.peak_displacement_m
    # below the yield with all of its friction nothing slips, whatever is left after it
    weak = GroundMotion(np.array([0.0, 0.2, 0.0]), 0.2)
    assert not plan_shaking(wet, weak).moves.any()
    assert plan_shaking(slips, weak).moves.all()


def test_a_density_that_is_not_given_is_assumed() -> None:
    value = {k: v for k, v in WET_SLIDE.items() if k != "block.density_kg_m3"}
    assumed, inputs = RockMass.of(value), RockMass.of(WET_SLIDE)
    assert assumed.remarks == (ASSUMED_DENSITY,)
    assert inputs.remarks == ()
    assert assumed.realise(1, 1).stability.ky == inputs.realise(1, 1).stability.ky


def test_the_water_of_a_vertical_acceleration_leaves_the_yield_at_rest() -> None:
    yields = [
        RockMass.of({**WET_TOPPLE, "block.kv": kv}).realise(1, 1).kr_at_rest for kv in (0.0, 0.2)
    ]
    assert yields[0] == pytest.approx([0.238], abs=6e-6)
    assert yields[1] == pytest.approx(yields[0], rel=1e-12)


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
        ({"back.drainage": "dry"}, "it must be undrained or drained"),
        ({"back.water_m": None, **DRAINED}, "back.drainage requires back.water_m"),
        ({"block.back_fracture": False}, "without a back fracture"),
        ({"friction.jrc": 8.0}, "jcs_mpa is missing"),
        ({"back.water_m": -1.0}, "back.water_m: -1 is out of range"),
    ],
)
def test_rejections(changes: dict[str, object], words: str) -> None:
    description = {k: v for k, v in {**WET_SLIDE, **changes}.items() if v is not None}
    with pytest.raises(InputError, match=words):
        RockMass.of(description)


def test_the_document_names_what_is_stated() -> None:
    blocks = RockMass.of({**WET_SLIDE, "back.water_m": LAW}).realise(50, 1)
    assert as_dict(blocks, {}, [])["variables"]["back.water_m"] == "uniform from 0 to 1.2"
