"""Rock masses whose bases have cohesion: the exact yield of each block, and what is rejected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbfrag.cli.inputs import charted_blocks
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.rockmasses.counts import failures, mode_counts
from rbfrag.rockmasses.file import rock_mass_of_toml
from rbfrag.rockmasses.joint_sets import IMPOSSIBLE, Realisations, RockMass
from rbfrag.rockmasses.report import as_dict, block_columns
from rbfrag.rockmasses.scenario import BONDED, scenario
from rbfrag.rockmasses.shaking import AT_REST, BOND_BREAKS, plan_shaking, run_blocks
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import STABLE, TOPPLE
from rbfrag.solver.stability.single import stability

TOML = """
[base]
dip_deg = { distribution = "uniform", low = -20, high = 35 }
spacing_m = { distribution = "lognormal", median = 1.0, sd_ln = 0.7 }
[back]
dip_deg = { distribution = "uniform", low = 25, high = 175 }
spacing_m = { distribution = "lognormal", median = 1.0, sd_ln = 0.7 }
[friction]
phi_deg = { distribution = "uniform", low = 15, high = 50 }
"""
COHESION = """cohesion_pa = { distribution = "lognormal", median = 3000, sd_ln = 1.0 }
[block]
density_kg_m3 = { distribution = "normal", mean = 2600, sd = 60 }
"""
LEVEL = GroundMotion(np.array([0.0, 2.0, -2.0, 0.0]), 0.5)


def drawn(text: str, n: int = 600) -> Realisations:
    return rock_mass_of_toml(text).realise(n, 4)


def test_each_block_yields_as_it_would_alone() -> None:
    many = drawn(TOML + COHESION)
    density = many.rock_mass.draw(600, 4)["block.density_kg_m3"]
    assert many.cohesion_pa.std() > 0.0
    for i in np.flatnonzero(many.is_block).tolist():
        single = stability(
            Block.from_fractures(many.s1_m[i], many.s2_m[i], many.gamma_deg[i]),
            beta_deg=many.beta_deg[i],
            phi_deg=many.phi_deg[i],
            cohesion_pa=many.cohesion_pa[i],
            density_kg_m3=density[i],
        )
        assert many.stability.mode[i] == single.mode
        assert many.stability.state[i] == single.state
        assert many.stability.yield_acceleration[i] == single.yield_acceleration
    assert {mode.count > 0 for mode in mode_counts(many).values()} == {True}


def test_cohesion_holds_slides_and_none_changes_nothing() -> None:
    without = drawn(TOML)
    none = drawn(TOML + "cohesion_pa = 0\n[block]\ndensity_kg_m3 = 2700\n")
    for name in ("mode_code", "state_code", "yield_acceleration", "ky", "p2"):
        assert np.array_equal(
            getattr(without.stability, name), getattr(none.stability, name), equal_nan=True
        )
    assert block_columns(without).keys() == block_columns(none).keys()
    bonded = drawn(TOML + COHESION)
    # the same blocks: only the bond is new
    assert np.array_equal(bonded.s1_m, without.s1_m)
    there = without.is_block
    assert np.all(bonded.stability.ky[there] >= without.stability.ky[there])
    before, after = mode_counts(without), mode_counts(bonded)
    # a bond hinders sliding on the base: blocks that slid turn instead, and fewer fail at rest
    assert after["slide"].count < before["slide"].count
    assert after["topple"].count > before["topple"].count
    assert after["slide"].states["unstable"] < before["slide"].states["unstable"]
    assert np.array_equal(block_columns(bonded)["cohesion_pa"], bonded.cohesion_pa)


def test_a_toe_that_lifts_before_the_bond_breaks_is_told() -> None:
    many = drawn(TOML + COHESION.replace("3000", "100000"))
    lifts = int(many.stability.toe_lifts.sum())
    assert lifts > 0
    warnings = as_dict(many, mode_counts(many), [])["warnings"]
    assert any(text.startswith(f"{lifts} confined topples") for text in warnings)


def test_a_bond_holds_up_to_its_yield_and_its_break_is_counted() -> None:
    many = drawn(TOML + COHESION, 60)
    plan = plan_shaking(many, LEVEL, scales=(0.2, 1.0))
    expected = (many.cohesion_pa > 0.0) & (many.stability.state_code == STABLE) & many.is_block
    expected &= (many.stability.mode_code != TOPPLE) & (many.stability.yield_acceleration > 0.0)
    assert not plan.moves[:, expected].any()
    for code, peak_g in zip(plan.code[:, expected], (0.4, 2.0), strict=True):
        breaks = many.stability.yield_acceleration[expected] < peak_g
        assert breaks.any()
        assert not breaks.all()
        assert np.array_equal(code == BOND_BREAKS, breaks)
        assert (code[~breaks] == AT_REST).all()
    count = int((plan.code[1] == BOND_BREAKS).sum())
    assert any(text.startswith(f"{count} blocks with cohesion") for text in plan.warnings)
    shaken = plan.gathered(run_blocks(work) for work in plan.work())
    assert np.isnan(shaken.displacement_m[1, shaken.code[1] == BOND_BREAKS]).all()
    total = failures(shaken)[1].total
    assert total.outcomes["bond_breaks"] == count <= total.open
    assert sum(total.outcomes.values()) == many.n_blocks


def test_topples_with_a_bond_are_shaken_as_without() -> None:
    alone = {
        "base.dip_deg": 5.0, "base.spacing_m": 1.0, "back.dip_deg": 85.0, "back.spacing_m": 0.4,
        "friction.phi_deg": 40.0,
    }  # fmt: skip
    bond = {"friction.cohesion_pa": 500.0, "block.density_kg_m3": 2700.0}
    ends = []
    for description in (alone, {**alone, **bond}):
        topples = RockMass.of(description).realise(2, 1)
        assert set(topples.stability.mode) == {"topple"}
        (work,) = plan_shaking(topples, LEVEL).work()
        ends.append(run_blocks(work))
    assert ends[0].runs == ends[1].runs == 2
    assert np.array_equal(ends[0].rotation_rad, ends[1].rotation_rad, equal_nan=True)


def test_a_scenario_leaves_out_slides_with_a_bond(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path_factory.mktemp("empty"))
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    many = drawn(TOML + COHESION, 300)
    answer = scenario(many, {"pgv_m_s": 0.6}, displacement_m=0.05)
    for mode in ("slide", "slump"):
        stable = many.of_mode(mode, "stable")  # type: ignore[arg-type]
        assert stable.any()
        assert np.isnan(answer.probability[stable]).all()
        assert set(answer.reason[stable]) == {BONDED}
    assert np.isfinite(answer.probability[many.of_mode("topple", "stable")]).all()
    assert any(BONDED in text for text in answer.warnings)
    assert not any(
        text.endswith("no fragility model for this mode") and text.startswith("sl")
        for text in answer.warnings
    )


def test_a_chart_of_modes_says_that_it_knows_no_cohesion(tmp_path: Path) -> None:
    for text, output in ((TOML, False), (TOML + COHESION, True)):
        file = tmp_path / "mass.toml"
        file.write_text("realisations = 50\n" + text)
        shown = charted_blocks(None, str(file), {"phi_deg": 30.0})
        assert any("without cohesion" in warning for warning in shown.warnings) == output


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cohesion_pa = -1\n[block]\ndensity_kg_m3 = 2700\n", "give 0 or more"),
        ("cohesion_pa = 1\n[block]\ndensity_kg_m3 = 0\n", "give above 0"),
    ],
)
def test_rejected(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        rock_mass_of_toml(TOML + text)


def test_a_cohesion_that_scatters_below_zero_is_no_block() -> None:
    text = 'cohesion_pa = { distribution = "normal", mean = 100, sd = 100 }\n'
    many = drawn(TOML + text + "[block]\ndensity_kg_m3 = 2700\n")
    below = IMPOSSIBLE.index("the cohesion is below zero")
    assert np.any(many.reason_code == below)
    assert not np.any(many.is_block & (many.cohesion_pa < 0.0))
    assert set(many.stability.mode[many.reason_code == below]) == {""}
