"""The horizontal component: its conversion, and the answers of every interface for it."""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

import rbfrag
from rbfrag.cli.main import app
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError
from rbfrag.exchange.table_answers import predict_table
from rbfrag.fragility.measures import AMPLIFIED
from rbfrag.fragility.prediction import Prediction
from rbfrag.hazards.curve import hazard_curve
from rbfrag.hazards.curve_file import hazard_curves_in
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.question.components import COMPONENT_SIGMA, COMPONENTS, SINGLE_ASSUMED, component_named
from rbfrag.question.document import answer_numbers
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.vocabulary.quantities import option_of, parameter_of
from tests.by_period import by_period

TOPPLING, ROCKING = {"p2": 3.0, "kr": 0.1}, {"p2": 3.0, "kr": 0.15, "kind": "rocking"}
SLIDING = {"ky": 0.12, "displacement_m": 0.1}
SLUMPING, CONFINED = {"ks": 0.12, "ps2": 3.0}, {"kct": 0.12, "pct2": 3.0}
STRONG = {"pgv_m_s": 0.6, "pga_g": 0.45}

CASES: dict[str, dict[str, Any]] = {
    "toppling-pgv": {**TOPPLING, "pgv_m_s": 0.6},
    "toppling-pgv-pga": {**TOPPLING, "pgv_m_s": 0.5, "pga_g": 0.3},
    "toppling-pgv-pga-tm": {**TOPPLING, "pgv_m_s": 0.5, "pga_g": 0.4, "tm_s": 0.7},
    "toppling-pga-sa": {**TOPPLING, "pga_g": 0.4, "sa(0.3)": 0.9, "sa(1)": 0.5, "sa(3)": 0.15},
    "toppling-pga-near-kr": {**TOPPLING, "pga_g": 0.11, "sa(1)": 0.4},
    "rocking-pgv": {**ROCKING, "pgv_m_s": 0.8},
    "rocking-pgv-pga-sa": {**ROCKING, **STRONG, "sa(1)": 0.6, "sa(3)": 0.2},
    "sliding-pgv-pga-arias": {**SLIDING, **STRONG, "arias_m_s": 3.0},
    "slumping-pgv-pga": {**SLUMPING, **STRONG, "magnitude": 6.8},
    "confined-pgv-pga": {**CONFINED, **STRONG},
}


def dense(question: dict[str, Any], name: str) -> float:
    """P by 2,001 points of the common residual, from -6 to 6 standard deviations."""
    definition, x = COMPONENTS[name], np.linspace(-6.0, 6.0, 2001)
    weight = np.exp(-0.5 * x * x)
    measures = {
        n: value / definition.ratio(n) * np.exp(AMPLIFIED[n] * definition.sigma * x)
        for n, value in question.items()
        if n in AMPLIFIED
    }
    p = rbfrag.predict(**{**question, **measures}, db=REFERENCE, interval=False).probability
    return float(p @ weight / weight.sum())


def answer(question: dict[str, Any], **about: Any) -> Prediction:
    prediction = rbfrag.predict(**question, db=REFERENCE, **about)
    assert isinstance(prediction, Prediction)
    return prediction


@pytest.fixture(scope="module")
def client() -> Any:
    with TestClient(make_app(ServiceSettings(db=str(REFERENCE)))) as result:
        yield result


def test_the_ratios_are_those_of_the_papers() -> None:
    rotd100, larger = COMPONENTS["rotd100"], COMPONENTS["larger"]
    for period, ratio in ((0.01, 1.19), (0.05, 1.19), (0.2, 1.21), (1.0, 1.24), (10.0, 1.29)):
        assert rotd100.spectral_ratio(period) == pytest.approx(ratio)
    assert rotd100.spectral_ratio(np.sqrt(3.0)) == pytest.approx(1.245)  # linear in ln T
    assert (rotd100.spectral_ratio(0.001), rotd100.spectral_ratio(20.0)) == (1.19, 1.29)
    names = ("pga_g", "pgv_m_s", "pgd_m", "sa(0.3)", "arias_m_s", "tm_s", "magnitude")
    expected = (1.19, 1.25, 1.25, 1.22, 1.19**2, 1.0, 1.0)
    assert [rotd100.ratio(n) for n in names] == pytest.approx(expected)
    assert [larger.ratio(n) for n in names] == pytest.approx([1.14] * 4 + [1.14**2, 1.0, 1.0])
    assert COMPONENTS["single"].sigma == 0.0
    assert {c.sigma for n, c in COMPONENTS.items() if n != "single"} == {COMPONENT_SIGMA}
    assert pickle.loads(pickle.dumps(rotd100)) == rotd100  # workers get it


@pytest.mark.parametrize("name", COMPONENTS)
@pytest.mark.parametrize("question", CASES.values(), ids=list(CASES))
def test_every_interface_equals_a_dense_integration(
    question: dict[str, Any], name: str, client: TestClient, tmp_path: Path
) -> None:
    expected = dense(question, name)
    reply = answer(question, component=name)
    assert reply.probability == pytest.approx(expected, abs=1e-3)
    document = answer_numbers(
        {n: v for n, v in question.items() if n != "kind"}, kind=question.get("kind"),
        component=name, db=REFERENCE,
    )  # fmt: skip
    assert document.probability == reply.probability
    numbers = {n: [v, v] for n, v in question.items() if n != "kind"}
    many = rbfrag.predict(
        **numbers, kind=question.get("kind"), component=["single", name], db=REFERENCE
    )
    assert many.probability[1] == pytest.approx(reply.probability, rel=1e-6)
    assert many.probability[0] == pytest.approx(answer(question).probability, rel=1e-6)
    options = [
        part for n, value in by_period({**question, "component": name}, "=").items()
        for text in (value if isinstance(value, list) else [value])
        for part in (option_of(n), str(text))
    ]  # fmt: skip
    printed = CliRunner().invoke(app, ["predict", *options, "--db", str(REFERENCE), "--json"])
    assert json.loads(printed.stdout)["probability"] == reply.probability
    texts = by_period({**question, "component": name}, ":")
    sent = {parameter_of(n): value for n, value in texts.items()}
    got = client.get("/v1/predict", params=sent).json()
    assert got["probability"] == reply.probability
    sent = {
        parameter_of(n): value for n, value in by_period({**question, "component": name}).items()
    }
    of_all = client.post("/v1/predict", json=sent).json()
    assert of_all["probability"] == reply.probability
    listed = {**sent, "component": [None, name]}
    posted = client.post("/v1/predict", json=listed).json()
    assert posted["probability"] == pytest.approx(many.probability.tolist(), rel=1e-9)
    header = ",".join(["component", *question])
    cells = ",".join(str(value) for value in question.values())
    (tmp_path / "b.csv").write_text(f"{header}\n{name},{cells}\n,{cells}\nrotd5,{cells}\n")
    table = predict_table(tmp_path / "b.csv", inputs={}, db=str(REFERENCE))
    by_row = [row["probability"] for row in table.blocks]
    assert by_row[:2] == pytest.approx(many.probability[::-1].tolist(), rel=1e-6)
    assert by_row[2] is None
    assert "did you mean 'rotd50'" in table.blocks[2]["reason"]
    assert not any("component" in text for text in table.warnings[:-1])
    # an option is for the rows that name none
    filled = predict_table(tmp_path / "b.csv", inputs={}, component=name, db=str(REFERENCE))
    assert [row["probability"] for row in filled.blocks[:2]] == [by_row[0]] * 2


def test_scatter_of_block_and_shaking_adds_to_that_of_the_component() -> None:
    question = {**TOPPLING, "pgv_m_s": 0.6, "kr_sigma": 0.2, "component": "larger"}
    same = {**TOPPLING, "pgv_m_s": 0.6 / 1.14, "kr_sigma": 0.2, "pgv_sigma": COMPONENT_SIGMA}
    assert answer(question).probability == pytest.approx(answer(same).probability, rel=1e-9)
    question = {**TOPPLING, "pgv_m_s": 0.6, "pgv_sigma": 0.5, "amplification_sigma": 0.2}
    same = {**TOPPLING, "pgv_m_s": 0.6, "pgv_sigma": np.hypot(0.5, np.hypot(0.2, COMPONENT_SIGMA))}
    document = answer(question, component="rotd50").probability
    assert document == pytest.approx(answer(same).probability, rel=1e-9)
    with pytest.raises(InputError, match=r"amplification_sigma = -0\.2"):
        answer({**question, "amplification_sigma": -0.2}, component="rotd50")
    doubled = answer({**TOPPLING, "pgv_m_s": 0.3, "amplification": 2.0}, component="rotd50")
    plain = answer({**TOPPLING, "pgv_m_s": 0.6}, component="rotd50")
    assert doubled.probability == pytest.approx(plain.probability, rel=1e-9)


def test_sites_of_an_earthquake_do_not_share_the_direction() -> None:
    document = answer({**TOPPLING, "pgv_m_s": 0.6}, component="rotd50", sites=5)
    single = answer({**TOPPLING, "pgv_m_s": 0.6}, sites=5)
    assert document.event_low is not None
    assert single.event_low is not None
    assert document.event_low == pytest.approx(single.event_low, abs=0.1)


@pytest.mark.parametrize(
    ("question", "expected"),
    [
        (
            {"magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0},
            "cannot be combined with a scenario",
        ),
        ({"motion": "record"}, "component cannot be combined with a motion"),
        ({"pgv_m_s": 0.6, "component": "RotD50"}, "did you mean 'rotd50'"),
        ({"pgv_m_s": [0.6, 0.7], "component": ["rotd50", "horizontal"]}, "'horizontal'.*larger"),
    ],
)
def test_what_does_not_go_with_a_component(
    question: dict[str, Any], expected: str, tmp_path: Path
) -> None:
    question = {**TOPPLING, "component": "single", **question}
    if "motion" in question:
        motion = rbfrag.GroundMotion(np.sin(np.arange(500) * 0.05), 0.01)
        question["motion"] = motion
        inputs = {"p2": 3.0, "kr": 0.1}
        with pytest.raises(InputError, match="component"):
            answer_numbers(inputs, motion=motion, component="rotd50", db=REFERENCE)
    with pytest.raises(InputError, match=expected) as error:
        rbfrag.predict(**question, db=REFERENCE)
    assert error.value.fields == ("component",)


def test_the_note_names_the_measures_and_p_for_rotd50() -> None:
    question = {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.5, "pga_g": 0.3}
    note = answer_numbers(question, db=REFERENCE).warnings[-1]
    p = dense(question, "rotd50")
    assert note == (
        "PGV and PGA are assumed to be of a single horizontal component; as RotD50 P would be "
        f"{percent(p)}"
    )
    assert isinstance(note, Diagnostic)
    assert note.code == "single_component"
    assert SINGLE_ASSUMED in answer(question).warnings
    assert SINGLE_ASSUMED in rbfrag.predict(3.0, [0.1, 0.2], pgv_m_s=0.5, db=REFERENCE).warnings
    for same in (pickle.loads(pickle.dumps(note)), copy.deepcopy(note)):
        assert (same, same.code) == (note, "single_component")
    assert json.loads(json.dumps({"warnings": [note]})) == {"warnings": [str(note)]}


@pytest.mark.parametrize(
    "question",
    [
        {**TOPPLING, "pgv_m_s": 0.6, "component": "single"},
        {**TOPPLING, "pgv_m_s": 0.6, "component": "rotd50"},
        {**TOPPLING, "pgv_m_s": 0.0},
        {**TOPPLING, "pgv_m_s": 0.6, "pga_g": 0.09},
        {**TOPPLING, "magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0},
        {**TOPPLING, "magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0, "amplification": 1.5},
    ],
)
def test_there_is_no_note_where_the_component_is_known_or_does_not_matter(
    question: dict[str, Any],
) -> None:
    assert not any("component" in text for text in answer(question).warnings)
    numbers, name = {**question}, question.get("component")
    numbers.pop("component", None)
    document = answer_numbers(numbers, component=name, db=REFERENCE)
    assert not any("component" in text for text in document.warnings)
    many = rbfrag.predict(**{**numbers, "kr": [0.1, 0.1]}, component=name, db=REFERENCE)
    assert not any("component" in text for text in many.warnings)


@pytest.mark.parametrize(
    "text",
    [
        "# component = RotD100\npgv_m_s,annual_rate\n0.1,1e-2\n1,1e-4\n",
        "#,,,\"kind='mean', investigation_time=1.0, imt='PGV', component='rotd100'\"\n"
        "lon,lat,depth,poe-10,poe-100\n7,46,0,1e-2,1e-4\n",
    ],
)
def test_a_curve_file_that_names_its_component_is_believed(text: str) -> None:
    (curve,) = hazard_curves_in(text, "curve.csv")
    assert curve.component == "rotd100"
    shaking = HazardLevel.of(curve)
    assert shaking.median == pytest.approx(1.0 / 1.25)
    assert any("RotD100" in note for note in shaking.warnings)
    assert HazardLevel.of(curve, component="single").median == 1.0
    (unnamed,) = hazard_curves_in(text.replace("omponent", "omment"), "curve.csv")
    assert unnamed.component == ""
    (note,) = (n for n in HazardLevel.of(unnamed).warnings if isinstance(n, Diagnostic))
    assert note.code == "single_component"


def test_a_spectral_curve_is_converted_at_its_own_period() -> None:
    curve = hazard_curve("sa_g", [0.1, 1.0], [1e-2, 1e-4], period_s=0.5)
    about = {"convert": "bommer_alarcon_2006", "convert_sigma": 0.3}
    result = HazardLevel.of(curve, component="rotd100", **about)  # type: ignore[arg-type]
    single = HazardLevel.of(curve, component="single", **about)  # type: ignore[arg-type]
    assert result.median == pytest.approx(single.median / 1.23)


def test_the_nearest_name_is_offered() -> None:
    with pytest.raises(InputError, match="did you mean 'geometric_mean'"):
        component_named("geometric mean")
