"""The drained bound is the same question without water; arrays and interfaces agree with it."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError
from rbfrag.fragility.prediction import Prediction
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.results.diagnostic import codes_by_row
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from tests.cli.conftest import Rejects, Shell, rejects, shell

__all__ = ["rejects", "shell"]

BOUND = ("probability", "ci_low", "ci_high")
TOPPLE: dict[str, Any] = {
    "height_m": 4.0, "width_m": 2.0, "beta_deg": 20.0, "phi_deg": 40.0, "pgv_m_s": 0.5,
    "pga_g": 0.6,
}  # fmt: skip
SLIDE: dict[str, Any] = {
    "s1_m": 2.0, "s2_m": 3.0, "gamma_deg": 60.0, "beta_deg": 20.0, "phi_deg": 38.0,
    "density_kg_m3": 2650.0, "displacement_m": 0.05, "pgv_m_s": 0.5, "pga_g": 0.6,
    "magnitude": 6.9,
}  # fmt: skip
CURVE = "pgv_m_s,annual_rate\n0.05,0.08\n0.1,0.03\n0.2,0.009\n0.4,0.0022\n0.8,0.0004\n1.6,5e-5\n"


@pytest.fixture(autouse=True)
def _built_in_data(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)


def bound_of(answer: Prediction) -> dict[str, float | None]:
    assert answer.drained is not None
    return {name: answer.drained[name] for name in BOUND}


@pytest.mark.parametrize(
    ("block", "water_m", "undrained", "drained", "strength"),
    [
        (TOPPLE, 1.0, 0.27, 0.0033, ("kr", 0.115)),
        (SLIDE, 1.1372, 0.61, 0.084, ("ky", 0.325)),
    ],
)
def test_both_bounds_stand_in_one_answer(
    block: dict[str, Any], water_m: float, undrained: float, drained: float,
    strength: tuple[str, float],
) -> None:  # fmt: skip
    wet, dry = rbfrag.predict(**block, water_m=water_m), rbfrag.predict(**block)
    assert wet.probability == pytest.approx(undrained, abs=0.02)
    assert dry.probability == pytest.approx(drained, rel=0.2)
    assert bound_of(wet) == {name: getattr(dry, name) for name in BOUND}
    assert wet.drained is not None
    assert wet.drained[strength[0]] == pytest.approx(strength[1], abs=5e-4)
    value = rbfrag.predict(**block, water_m=water_m, drainage="drained")
    assert value.probability == dry.probability
    assert dry.drained is None
    assert rbfrag.predict(**block, water_m=0.0).drained is None


@pytest.mark.parametrize("block", [TOPPLE, SLIDE])
def test_a_little_water_changes_little(block: dict[str, Any]) -> None:
    dry = rbfrag.predict(**block).probability
    steps = [abs(rbfrag.predict(**block, water_m=w).probability - dry) for w in (1e-2, 1e-4, 1e-7)]
    assert steps[0] > steps[1] > steps[2]
    assert steps[2] < 1e-6


def test_arrays_have_the_bounds_and_codes_of_single_blocks() -> None:
    rng, n = np.random.default_rng(46), 120
    height = rng.uniform(0.5, 4.0, n)
    blocks: dict[str, Any] = {
        "height_m": height,
        "width_m": height * rng.uniform(0.2, 2.0, n),
        "beta_deg": rng.uniform(-5.0, 25.0, n),
        "phi_deg": rng.uniform(15.0, 45.0, n),
        "pga_g": rng.uniform(0.1, 1.2, n),
        "cohesion_pa": np.where(rng.random(n) < 0.2, 2e4, 0.0),
        "water_m": np.where(rng.random(n) < 0.6, rng.uniform(0.0, 0.5, n) * height, 0.0),
        "drainage": np.where(rng.random(n) < 0.3, "drained", "undrained"),
    }
    rest = {"pgv_m_s": 0.5, "displacement_m": 0.1}
    prediction = rbfrag.predict(**blocks, **rest)
    assert isinstance(prediction, PredictionArray)
    assert prediction.drained is not None
    codes = codes_by_row(prediction.warnings, n)
    seen: set[str] = set()
    about = {"undrained", "drained", "no_drained_bound", "density_assumed", "toe_slips",
             "heel_tips", "cohesion_without_effect", "check_unit"}  # fmt: skip
    for i in range(n):
        block = {name: str(v[i]) if name == "drainage" else v[i] for name, v in blocks.items()}
        try:
            single = rbfrag.predict(**block, **rest)
        except InputError:
            assert np.isnan(prediction.probability[i])
            continue
        block_inputs = {text.code for text in single.warnings if hasattr(text, "code")}
        if single.probability < 1.0:
            assert block_inputs & about == {*codes[i].split()} & about
        seen |= block_inputs
        bound = [prediction.drained[name][i] for name in BOUND]
        expected = [np.nan] * 3 if single.drained is None else [*bound_of(single).values()]
        np.testing.assert_allclose(bound, np.array(expected, dtype=float), rtol=1e-10, atol=1e-15)
    assert {"undrained", "drained", "toe_slips", "cohesion_without_effect"} <= seen


def test_a_pulse_that_tips_a_slide_is_a_warning_of_each_such_row() -> None:
    # tan(β - α1) = tan(20° - 1.4°) = 0.336
    block = {"s1_m": 2.0, "s2_m": 1.5, "gamma_deg": 40.0, "beta_deg": 20.0, "phi_deg": 30.0,
             "pgv_m_s": 0.5, "displacement_m": 0.1}  # fmt: skip
    pga_g = np.array([0.33, 0.34])
    arrays = rbfrag.predict(**block, pga_g=pga_g)
    assert isinstance(arrays, PredictionArray)
    assert codes_by_row(arrays.warnings, 2).tolist() == ["", "heel_tips"]
    single = [rbfrag.predict(**block, pga_g=value).warnings for value in pga_g.tolist()]
    assert [any("tip the block" in text for text in texts) for texts in single] == [False, True]


def test_interfaces_give_the_same_bounds(shell: Shell) -> None:
    wet = {**TOPPLE, "water_m": 1.0}
    expected = rbfrag.predict(**wet).drained
    words = ("--height", "4", "--width", "2", "--dip", "20", "--phi", "40", "--water", "1")
    shaking = ("--pgv", "0.5", "--pga", "0.6")
    assert shell.json("predict", *words, *shaking)["drained"] == expected
    printed = shell("predict", *words, *shaking).stdout
    assert "Drained   k_r = 0.115, P = 0.33 %" in printed
    client = TestClient(make_app(ServiceSettings(db=str(REFERENCE))))
    assert client.get("/v1/predict", params=wet).json()["drained"] == expected
    listed = client.post(
        "/v1/predict", json={**wet, "water_m": [1.0, 0.0], "drainage": [None, None]}
    )
    assert expected is not None
    for name in BOUND:
        assert listed.json()["drained"][name] == [pytest.approx(expected[name], rel=1e-12), None]
    with Path("blocks.csv").open("w", encoding="utf-8", newline="") as file:
        header = ("height_m", "width_m", "dip_deg", "phi_deg", "water_m", "Drainage?")
        rows = [(4, 2, 20, 40, 1, ""), (4, 2, 20, 40, 1, "oui"), (4, 2, 20, 40, "", "")]
        csv.writer(file).writerows([header, *rows])
    shell("predict", "--blocks", "blocks.csv", *shaking, "--out", "answers.csv")
    with Path("answers.csv").open(encoding="utf-8") as file:
        first, drained, dry = csv.DictReader(file)
    assert float(first["drained_probability"]) == pytest.approx(expected["probability"], rel=1e-12)
    assert drained["probability"] == drained["drained_probability"]
    assert dry["drained_probability"] == ""
    expected_codes = ["back_friction_neglected", "density_assumed", "undrained"]
    assert sorted(first["warnings"].split()) == expected_codes


def test_rates_have_the_drained_bound(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    block = {name: value for name, value in TOPPLE.items() if name not in ("pgv_m_s", "pga_g")}
    wet = rbfrag.hazard("curve.csv", **block, water_m=1.0)
    dry = rbfrag.hazard("curve.csv", **block)
    assert wet.drained is not None
    assert wet.drained.tolist() == dry.annual_rate.tolist()
    assert wet.annual_rate[0] > 2.0 * dry.annual_rate[0]
    words = ("--height", "4", "--width", "2", "--dip", "20", "--phi", "40", "--water", "1")
    document = shell.json("hazard", "curve.csv", *words)
    assert document["drained"] == {"annual_rate": pytest.approx(dry.annual_rate[0], rel=1e-12)}
    assert "Drained return period 3,200 years" in shell("hazard", "curve.csv", *words).stdout
    assert shell.json("hazard", "curve.csv", *words[:-2])["drained"] is None
    Path("blocks.csv").write_text(
        "height_m,width_m,dip_deg,phi_deg,water_m\n4,2,20,40,1\n4,2,20,40,0\n"
    )
    rows = shell.json("hazard", "curve.csv", "--blocks", "blocks.csv")["blocks"]
    assert rows[0]["drained"]["annual_rate"] == pytest.approx(dry.annual_rate[0], rel=1e-12)
    assert rows[1]["drained"] is None
    report = shell.json("report", "blocks.csv", "--pgv", "0.5", "--hazard", "curve.csv", "--out",
                        "a.html")  # fmt: skip
    assert report["blocks"][0]["hazard"]["drained"] == {
        "annual_rate": pytest.approx(dry.annual_rate[0], rel=1e-12)
    }


def test_a_drainage_without_water_or_of_another_name_is_rejected(rejects: Rejects) -> None:
    words = ("predict", "--height", "4", "--width", "2", "--phi", "40", "--pgv", "0.5")
    assert "--drainage requires --water" in rejects(*words, "--drainage", "drained")
    assert "it must be undrained or drained" in rejects(*words, "--water", "1", "--drainage", "no")
    with pytest.raises(InputError, match="water_m"):
        rbfrag.predict(**{**TOPPLE, "height_m": [4.0, 4.0]}, drainage="drained")
    arrays = rbfrag.predict(**TOPPLE, water_m=[1.0, 1.0], drainage=["no", ""])
    assert isinstance(arrays, PredictionArray)
    assert arrays.reason[0] == "drainage = 'no': it must be undrained or drained"
    assert arrays.probability[1] == rbfrag.predict(**TOPPLE, water_m=1.0).probability


def test_a_bound_that_has_no_answer_is_named(shell: Shell) -> None:
    # it topples; dry it slides, and no displacement limit is given
    block = {"height_m": 2.0, "width_m": 2.73, "beta_deg": 12.7, "phi_deg": 53.4, "pgv_m_s": 0.5}
    answer = rbfrag.predict(**block, water_m=0.93)
    assert (answer.kind, answer.drained) == ("toppling", None)
    assert any("no drained bound: the block slides" in text for text in answer.warnings)
    arrays = rbfrag.predict(**block, water_m=[0.93, 0.0])
    assert "no_drained_bound" in codes_by_row(arrays.warnings, 2)[0].split()
    words = [f"--{name.partition('_')[0]}={value}" for name, value in block.items()]
    document = shell.json("predict", *words, "--water", "0.93")
    assert document["drained"] is None
    assert any("no drained bound" in text for text in document["warnings"])
