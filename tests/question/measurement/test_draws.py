"""Draws of measured blocks: one answer for single blocks and arrays, and its properties."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError, RbfragError
from rbfrag.exchange.table_answers import predict_table
from rbfrag.fragility.dependence import normal_share
from rbfrag.fragility.method import SINGLE
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.question.measurement import (
    CLIP,
    PointAnswer,
    mixture_of,
)
from rbfrag.question.measurement_draws import (
    STEPS,
    DrawnBlock,
    draw_count,
    drawn_values,
    lattice,
    scores_of,
    split_sigmas,
)
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from tests.cli.conftest import Shell
from tests.cli.conftest import shell as shell
from tests.question.measurement.test_check_values import ROWS, SIGMAS

SLAB: dict[str, Any] = {"height_m": 2.0, "width_m": 0.4, "phi_deg": 40.0, "pgv_m_s": 0.9}
FOUR = {"height_sigma_m": 0.1, "width_sigma_m": 0.04, "beta_sigma_deg": 2.0, "phi_sigma_deg": 3.0}
JOINTS: dict[str, Any] = {
    "s1_m": 2.0, "s2_m": 0.8, "gamma_deg": 80.0, "beta_deg": 18.0, "phi_deg": 40.0,
    "phi_back_deg": 35.0, "displacement_m": 0.1, "pgv_m_s": 0.9, "pga_g": 0.8,
}  # fmt: skip
SIX = {
    "s1_sigma_m": 0.2, "s2_sigma_m": 0.08, "gamma_sigma_deg": 3.0, "beta_sigma_deg": 2.0,
    "phi_sigma_deg": 3.0, "phi_back_sigma_deg": 3.0,
}  # fmt: skip
SPACE: dict[str, Any] = {
    "base": "4/150", "back": "78/095", "face": "80/090", "s1_m": 2.0, "s2_m": 0.4,
    "phi_deg": 40.0, "pgv_m_s": 2.0, "base_sigma_deg": 3.0, "back_sigma_deg": 3.0,
}  # fmt: skip
WET: dict[str, Any] = {
    "height_m": 1.0, "width_m": 1.5, "beta_deg": 10.0, "phi_deg": 38.0, "displacement_m": 0.1,
    "water_m": 0.3, "pgv_m_s": 0.6, "water_sigma_m": 0.1, "density_kg_m3": 2600.0,
    "density_sigma_kg_m3": 100.0,
}  # fmt: skip
SCENARIO: dict[str, Any] = {"magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0}
NAMES = ("probability", "ci_low", "ci_high")


def named(number: int) -> dict[str, Any]:
    inputs, sigmas = ROWS[number - 1]
    return {**inputs, **{SIGMAS[name]: value for name, value in sigmas.items()}}


QUESTIONS: dict[str, dict[str, Any]] = {
    **{f"row {number}": named(number) for number in (1, 4, 5, 7, 8)},
    "six fields": {**JOINTS, **SIX},
    "in space": SPACE,
    "wet": WET,
    "ground-motion model": {"p2": 7.2, "kr": 0.2, **SCENARIO},
    "uncertain restitution": {
        "height_m": 1.6, "width_m": 0.5, "kind": "rocking", "pgv_m_s": 0.6, "pga_g": 0.6,
        "restitution": 0.9, "restitution_sigma": 0.05, "beta_sigma_deg": 1.0,
    },
    "per cent": {**SLAB, "width_sigma_m": "10%", "height_sigma_m": "5 %"},
    "residual friction": {
        "height_m": 1.0, "width_m": 1.5, "beta_deg": 12.0, "phi_deg": 38.0, "cohesion_pa": 3e3,
        "phi_residual_deg": 33.0, "displacement_m": 0.1, "pgv_m_s": 0.6, "phi_sigma_deg": 3.0,
        "cohesion_sigma_pa": "30%",
    },
}  # fmt: skip


@pytest.mark.parametrize("name", QUESTIONS)
def test_arrays_answer_as_single_blocks(name: str) -> None:
    question = QUESTIONS[name]
    single = rbfrag.predict(**question)
    size = next(n for n in ("height_m", "s1_m", "kr") if n in question)
    many = rbfrag.predict(**{**question, size: np.full(2, question[size])}, sensitivity=True)
    sources = {row["source"]: [pytest.approx(row["fraction"], abs=1e-9)] * 2
               for row in single.uncertainty}  # fmt: skip
    assert {n: column.tolist() for n, column in (many.uncertainty or {}).items()} == sources
    for field in NAMES:
        assert getattr(many, field).tolist() == pytest.approx(
            [getattr(single, field)] * 2, rel=1e-9
        )
        if single.as_stated is not None:
            assert many.as_stated[field][1] == pytest.approx(single.as_stated[field], rel=1e-9)
    assert many.in_domain.tolist() == [single.in_domain] * 2
    assert {*map(str, many.warnings)} >= {
        str(text) for text in single.warnings if "measured range" in text
    }


def test_rows_with_different_errors_have_their_own_lattice() -> None:
    many = rbfrag.predict(
        **SLAB, width_sigma_m=[0.04, 0.0, 0.04], beta_sigma_deg=[0.0, 2.0, 2.0],
        beta_deg=[0.0, 0.0, 9.0],
    )  # fmt: skip
    for i, sigmas in enumerate(({"width_sigma_m": 0.04}, {"beta_sigma_deg": 2.0},
                                {"width_sigma_m": 0.04, "beta_sigma_deg": 2.0})):  # fmt: skip
        single = rbfrag.predict(**SLAB, **sigmas, beta_deg=(0.0, 0.0, 9.0)[i])
        assert many.probability[i] == pytest.approx(single.probability, rel=1e-9)
        assert many.ci_low[i] == pytest.approx(single.ci_low, rel=1e-9)


@pytest.mark.parametrize("sigmas", [
    {"width_sigma_m": 1e-9}, {"beta_sigma_deg": 1e-9}, {"phi_sigma_deg": 1e-9},
    {"height_sigma_m": 1e-10, "width_sigma_m": 1e-10, "beta_sigma_deg": 1e-10},
])  # fmt: skip
def test_small_errors_leave_the_answer_as_it_is(sigmas: dict[str, float]) -> None:
    for question in (SLAB, {**SLAB, "beta_deg": 3.0}, {**SLAB, "width_m": 0.6}):
        nominal, answer = rbfrag.predict(**question), rbfrag.predict(**question, **sigmas)
        for field in NAMES:
            expected = getattr(nominal, field)
            if field != "probability":  # ends are not followed beyond 1e-6
                expected = min(max(expected, normal_share(-CLIP)), normal_share(CLIP))
            assert getattr(answer, field) == pytest.approx(expected, abs=1e-9)


def test_no_errors_are_no_draws() -> None:
    nominal = rbfrag.predict(**SLAB)
    zero = rbfrag.predict(**SLAB, width_sigma_m=0.0, beta_sigma_deg=0.0)
    assert [getattr(zero, name) for name in NAMES] == [getattr(nominal, name) for name in NAMES]
    assert zero.uncertainty == ()
    assert zero.as_stated is None
    scenario = {"p2": 7.2, "kr": 0.1, **SCENARIO}
    off = rbfrag.predict(**scenario, gmm_sigma=0.0)
    on = rbfrag.predict(**scenario)
    assert on.as_stated == {name: getattr(off, name) for name in NAMES}
    assert on.uncertainty[0]["source"] == "gmm"
    assert on.ci_low < off.ci_low < off.ci_high < on.ci_high


@pytest.mark.parametrize("seed", range(20))
def test_more_error_never_narrows_an_interval(seed: int) -> None:
    generator = np.random.default_rng(seed)
    height, ratio = generator.uniform(0.8, 3.0), generator.uniform(0.15, 0.35)
    dip = generator.uniform(0.0, 4.0)
    block = {"height_m": height, "width_m": ratio * height, "beta_deg": dip, "phi_deg": 42.0}
    levels = np.geomspace(0.1, 3.0, 60)
    p = rbfrag.predict(**block, pgv_m_s=levels).probability
    block["pgv_m_s"] = float(levels[np.argmin(abs(p - 0.5))])
    for field in ("width_sigma_m", "beta_sigma_deg"):
        steps = [0.01, 0.02, 0.04, 0.08] if field == "width_sigma_m" else [0.25, 0.5, 1.0, 2.0]
        answers = [rbfrag.predict(**block, **{field: sigma}) for sigma in steps]
        widths = [answer.ci_high - answer.ci_low for answer in answers]
        assert widths == sorted(widths)


def test_scores_of_the_lattice_are_not_correlated() -> None:
    for count, fields in ((512, 5), (1024, len(STEPS))):
        z = np.array(scores_of(count))
        assert z.sum() == pytest.approx(0.0, abs=1e-9)
        columns = [z[np.arange(count) * step % count] for step in STEPS[:fields]]
        assert abs(np.corrcoef(columns) - np.eye(fields)).max() < 0.1
    assert [draw_count([""] * n) for n in (1, 5, 6)] == [512, 512, 1024]


def test_a_block_that_is_unstable_as_stated_is_answered() -> None:
    nominal = rbfrag.predict(**SLAB, beta_deg=12.0)
    assert (nominal.probability, nominal.how) == (1.0, "by mechanics")
    answer = rbfrag.predict(**SLAB, beta_deg=12.0, beta_sigma_deg=2.0)
    assert answer.probability < 1.0
    assert answer.as_stated is None
    (note,) = [text for text in answer.warnings if text.code == "check_stability"]
    assert "would not stand at rest: check dip and friction" in note
    with pytest.raises(InputError, match="would not stand at rest"):
        rbfrag.predict(**SLAB, beta_deg=15.0, beta_sigma_deg=2.0)
    rows = rbfrag.predict(**SLAB, beta_deg=[12.0, 15.0], beta_sigma_deg=2.0)
    assert rows.probability[0] == pytest.approx(answer.probability, rel=1e-9)
    assert np.isnan(rows.probability[1])
    assert "would not stand at rest" in rows.reason[1]
    assert np.isnan(rows.as_stated["probability"][0])


def test_draws_that_slide_need_a_displacement_limit() -> None:
    block = {**SLAB, "width_m": 1.6, "phi_deg": 40.0, "phi_sigma_deg": 3.0}
    with pytest.raises(InputError, match=r"% of the measured range slides: give displacement_m"):
        rbfrag.predict(**block)
    assert 0.0 < rbfrag.predict(**block, displacement_m=0.05).probability < 1.0


REJECTED: list[tuple[dict[str, Any], str]] = [
    ({"p2": 7.2, "kr": 0.2, "beta_sigma_deg": 2.0, "pgv_m_s": 0.9}, "requires the geometry"),
    ({**SLAB, "s1_sigma_m": 0.1}, "s1_sigma_m requires s1_m"),
    ({**SLAB, "width_sigma_m": -0.1}, "0 or more"),
    ({**SLAB, "width_sigma_m": "x%"}, "per cent"),
    ({**SLAB, "beta_sigma_deg": "5%"}, "in degrees"),
    ({**SLAB, "gmm_sigma": 0.2}, "gmm_sigma requires a scenario"),
    ({**SLAB, "width_sigma_m": 0.04, "kr_sigma": 0.1}, "kr_sigma cannot be combined"),
]  # fmt: skip


@pytest.mark.parametrize(("question", "reason"), REJECTED, ids=str)
def test_errors_without_their_field_are_rejected(question: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        rbfrag.predict(**question)


def test_a_single_block_loads_no_numpy() -> None:
    program = (
        "import sys, rbfrag\n"
        f"rbfrag.predict(**{SLAB!r}, width_sigma_m=0.04, beta_sigma_deg=2.0)\n"
        "rbfrag.predict(p2=7.2, kr=0.2, pgv_m_s=0.4, pgv_sigma=0.6)\n"
        "print('numpy' in sys.modules)\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == "False"


@pytest.mark.parametrize("name", ["row 1", "row 5", "row 7"])
def test_sources_add_up(name: str) -> None:
    uncertainty = rbfrag.predict(**QUESTIONS[name]).uncertainty
    assert sum(row["fraction"] for row in uncertainty) == pytest.approx(1.0)
    assert uncertainty[-1]["source"] == "together"
    first = {"row 1": "beta_deg", "row 5": "phi_deg", "row 7": "width_m"}[name]
    assert uncertainty[0]["source"] == first


RECORD = GroundMotion(
    0.35 * np.sin(2.0 * np.pi * np.arange(0.0, 6.0, 0.01) / 1.1) * np.linspace(1.0, 0.0, 600), 0.01
)  # fmt: skip


@pytest.mark.parametrize("kind", [None, "rocking"])
def test_a_record_has_the_draws_of_its_measures(kind: str | None) -> None:
    block: dict[str, Any] = {"height_m": 2.0, "width_m": 0.4, "beta_deg": 0.0, "kind": kind}
    sigmas = {"height_sigma_m": 0.1, "beta_sigma_deg": 1.0}
    prediction = rbfrag.predict(**block, **sigmas, motion=RECORD, polarity="forward")
    assert prediction.as_stated is not None
    inputs, errors = split_sigmas({**block, **sigmas}, is_scenario=False)
    drawn = DrawnBlock({n: v for n, v in inputs.items() if n != "kind"}, kind)
    draws = [drawn.draw(drawn_values(drawn.fields, errors, point, SINGLE))
             for point in zip(*lattice(2, 512), strict=True)]  # fmt: skip
    points = []
    for draw in draws:
        numbers = {n: draw.numbers[n] for n in ("p2", "kr", "restitution") if n in draw.numbers}
        point = rbfrag.predict(**numbers, kind=draw.kind, motion=RECORD, polarity="forward")
        points.append(PointAnswer(point.probability, point.ci_low, point.ci_high, in_domain=True))
    mixture = mixture_of(points, 0.95)
    assert prediction.probability == pytest.approx(mixture.probability, rel=1e-12)
    assert (prediction.ci_low, prediction.ci_high) == pytest.approx(
        (mixture.low, mixture.high), rel=1e-9
    )
    value = rbfrag.predict(**block, motion=RECORD, polarity="forward")
    assert prediction.as_stated["probability"] == value.probability
    assert prediction.ci_high - prediction.ci_low > value.ci_high - value.ci_low


CURVE = "pgv_m_s,annual_rate\n0.05,0.08\n0.1,0.03\n0.4,0.0022\n0.8,0.0004\n1.6,5e-5\n"
ELSEWHERE = "only predictions"


def test_other_answers_reject_errors_of_measurement_with_the_reason(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("curve.csv").write_text(CURVE)
    Path("blocks.csv").write_text(
        "height_m,width_m,dip_deg,phi_deg,dip_sigma_deg,lon,lat\n2,0.4,0,40,2,8,46\n"
    )
    block = ["--height", "2", "--width", ".4", "--phi", "40"]
    for command in (
        ("hazard", "curve.csv", *block, "--dip-sigma", "2"),
        ("survival", "curve.csv", "--blocks", "blocks.csv", "--age", "100"),
        ("hazard", "curve.csv", "--blocks", "blocks.csv"),
        ("rockmass", "rock.toml", "--dip-sigma", "2"),
    ):
        assert ELSEWHERE in shell(*command, expect=2).stderr, command
    with pytest.raises(RbfragError, match=ELSEWHERE):
        rbfrag.hazard("curve.csv", height_m=2.0, width_m=0.4, beta_sigma_deg=2.0)
    client = TestClient(make_app(ServiceSettings(db=str(REFERENCE))))
    answer = client.post(
        "/v1/hazard", params={"height": 2, "width": 0.4, "dip_sigma": 2}, content=CURVE,
        headers={"content-type": "text/csv"},
    )  # fmt: skip
    assert ELSEWHERE in answer.json()["detail"]


def test_every_interface_gives_the_same_answer(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    expected = rbfrag.predict(**SLAB, width_sigma_m="10%", beta_sigma_deg=2.0)
    options = "--height 2 --width .4 --phi 40 --pgv .9 --width-sigma 10% --dip-sigma 2"
    documents = [json.loads(shell("predict", *options.split(), "--json").stdout)]
    client = TestClient(make_app(ServiceSettings(db=str(REFERENCE))))
    words = {"height": 2.0, "width": 0.4, "phi": 40.0, "pgv": 0.9, "width_sigma": "10%",
             "dip_sigma": 2.0}  # fmt: skip
    answers = [client.get("/v1/predict", params=words), client.post("/v1/predict", json=words)]
    documents += [answer.json() for answer in answers]
    for document in documents:
        for name in NAMES:
            assert document[name] == getattr(expected, name)
        assert document["as_stated"] == expected.as_stated
        assert document["uncertainty"] == [*expected.uncertainty]
        assert document["answers"][0]["probability"] == expected.probability
    text = "height_m,width_m,dip_deg,phi_deg,pgv_m_s,width_sigma,dip_sigma\n2,.4,0,40,.9,10%,2\n"
    Path("blocks.csv").write_text(text + "2,.4,0,40,.9,0.04,2\n2,.4,0,40,.9,,\n")
    rows = predict_table("blocks.csv", inputs={}).blocks
    lists = {**words, "height": [2.0, 2.0]}
    many = client.post("/v1/predict", json=lists).json()
    for name in NAMES:
        value = pytest.approx(getattr(expected, name), rel=1e-9)
        assert rows[0][name] == rows[1][name] == value
        assert rows[2][name] == rows[0][f"as_stated_{name}"]
        assert rows[2][name] == pytest.approx(expected.as_stated[name], rel=1e-12)
        assert many[name] == [value, value]
    for cell in ("-0.1", "abc", "-5%"):
        Path("wrong.csv").write_text(text + f"2,.4,0,40,.9,{cell},2\n")
        row = predict_table("wrong.csv", inputs={}).blocks[1]
        assert row["probability"] is None
        assert "width_sigma" in row["reason"]
    served = client.post("/v1/table", content=text, headers={"content-type": "text/csv"},
                         params={"sensitivity": True})  # fmt: skip
    (answered,) = csv.DictReader(served.json()["table"].splitlines()[:2])
    for name in NAMES:
        assert float(answered[name]) == pytest.approx(getattr(expected, name), rel=1e-5)
    for row in expected.uncertainty:
        fraction = float(answered[f"uncertainty_{row['source']}"])
        assert fraction == pytest.approx(row["fraction"], abs=1e-5)
    assert 0.0 < float(answered["sensitivity_beta_deg_low"]) < expected.as_stated["probability"]
    of_all = predict_table(
        "blocks.csv", inputs={"phi_sigma_deg": 0.0, "height_sigma_m": "5%"}
    ).blocks[2]  # fmt: skip
    single = rbfrag.predict(**SLAB, height_sigma_m="5%")
    assert of_all["probability"] == pytest.approx(single.probability, rel=1e-9)
