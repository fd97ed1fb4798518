"""Every input is used, rejected, or named as ignored, by every interface and in every output."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from fastapi.testclient import TestClient

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError, RbfragError
from rbfrag.exchange.table_answers import predict_table
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.vocabulary.quantities import (
    BLOCK,
    COLUMNS,
    COMMON,
    COMPONENT,
    INPUTS,
    INTENSITY,
    MEASURED,
    QUANTITIES,
    SCENE,
    SOURCE,
    column_of,
    option_of,
    parameter_of,
    word_of,
)
from rbfrag.vocabulary.spectral import input_of
from tests.by_period import by_period
from tests.cli.conftest import Shell
from tests.cli.conftest import shell as shell
from tests.service.page.conftest import browser as browser
from tests.service.page.conftest import chromium as chromium
from tests.service.page.conftest import open_page as open_page
from tests.service.page.conftest import service as service

CURVE = "pgv_m_s,annual_rate\n0.05,0.08\n0.1,0.03\n0.2,0.009\n0.4,0.0022\n0.8,0.0004\n1.6,5e-5\n"
SLAB: dict[str, Any] = {"height_m": 2.0, "width_m": 0.4, "beta_deg": 3.0, "phi_deg": 38.0}
SLIDE: dict[str, Any] = {
    "height_m": 1.0, "width_m": 1.5, "beta_deg": 20.0, "phi_deg": 33.0, "displacement_m": 0.1,
}  # fmt: skip
JOINTS: dict[str, Any] = {
    "s1_m": 1.1, "s2_m": 0.6, "gamma_deg": 45.0, "beta_deg": 20.0, "phi_deg": 34.0,
    "displacement_m": 0.1,
}  # fmt: skip
PLANES: dict[str, Any] = {
    "base": "27/200", "back": "72/215", "face": "74/205", "s1_m": 1.1, "s2_m": 0.6,
    "phi_deg": 34.0, "displacement_m": 0.1,
}  # fmt: skip
ANGLES = {"alpha1_deg": -15.0, "alpha3_deg": 16.0, "r3_m": 1.2, "beta_deg": 3.0, "phi_deg": 40.0}
NUMBERS = {"p2": 3.0, "kr": 0.1}
SCENARIO = {"magnitude": 7.0, "rjb_km": 4.0, "vs30_m_s": 700.0}
PGV, PGA = {"pgv_m_s": 0.6}, {"pgv_m_s": 0.6, "pga_g": 0.7}
STANDING = {"base": "4/150", "back": "78/095", "face": "80/090", "s1_m": 2.0, "s2_m": 0.4,
            "phi_deg": 40.0, "pgv_m_s": 2.0}  # fmt: skip
SLENDER = {"s1_m": 2.0, "s2_m": 0.5, "gamma_deg": 74.0, "beta_deg": 4.0, "phi_deg": 40.0,
           "pgv_m_s": 2.0}  # fmt: skip
AFTER = {"phi_residual_deg": 30.0}

# by field: a question, and the value that is put in or exchanged
CASES: dict[str, tuple[dict[str, Any], Any]] = {
    "p2": (NUMBERS | PGV, 5.0),
    "kr": (NUMBERS | PGV, 0.13),
    "ky": ({"ky": 0.2, "displacement_m": 0.1, **PGV}, 0.15),
    "ks": ({"ks": 0.2, "ps2": 3.0, **PGA}, 0.15),
    "ps2": ({"ks": 0.2, "ps2": 3.0, **PGA}, 6.0),
    "kct": ({"kct": 0.3, "pct2": 8.0, **PGA}, 0.25),
    "pct2": ({"kct": 0.3, "pct2": 8.0, **PGA}, 12.0),
    "displacement_m": (SLIDE | PGV, 0.05),
    "restitution": (NUMBERS | {"kind": "rocking", **PGV}, 0.8),
    "height_m": (SLAB | PGV, 2.4),
    "width_m": (SLAB | PGV, 0.45),
    **{name: (ANGLES | PGV, value) for name, value in
       (("alpha1_deg", -14.0), ("alpha3_deg", 15.0), ("r3_m", 1.0))},
    **{name: (SLENDER, value) for name, value in
       (("s1_m", 1.8), ("s2_m", 0.6), ("gamma_deg", 80.0))},
    "beta_deg": (SLAB | PGV, 5.0),
    "phi_deg": (SLIDE | PGV, 30.0),
    "phi_back_deg": ({"s1_m": 0.5, "s2_m": 0.15, "gamma_deg": 95.0, "beta_deg": 5.0,
                      "phi_deg": 25.0, **PGA}, 30.0),
    "base": (STANDING, "2/150"),
    "back": (STANDING, "80/095"),
    "face": (STANDING, "80/085"),
    "water_m": (SLIDE | PGV, 0.3),
    "drainage": (SLIDE | {"water_m": 0.3, **PGV}, "drained"),
    "jrc": (SLIDE | {"jcs_mpa": 60.0, **PGV}, 8.0),
    "jcs_mpa": (SLIDE | {"jrc": 8.0, **PGV}, 60.0),
    "joint_length_m": (SLIDE | {"jrc": 8.0, "jcs_mpa": 60.0, **PGV}, 2.0),
    "phi_residual_deg": (SLIDE | PGV, 30.0),
    "cohesion_pa": (SLIDE | PGV, 5000.0),
    "density_kg_m3": (SLIDE | {"cohesion_pa": 5000.0, **PGV}, 2200.0),
    "back_fracture": (SLAB | PGV, False),
    "kind": (SLAB | PGV, "rocking"),
    "p2_sigma": (NUMBERS | PGV, 0.3),
    "kr_sigma": (NUMBERS | PGV, 0.3),
    "ky_sigma": ({"ky": 0.2, "displacement_m": 0.1, **PGV}, 0.3),
    "ks_sigma": ({"ks": 0.2, "ps2": 3.0, **PGA}, 0.3),
    "ps2_sigma": ({"ks": 0.2, "ps2": 3.0, **PGA}, 0.3),
    "kct_sigma": ({"kct": 0.3, "pct2": 8.0, **PGA}, 0.3),
    "pct2_sigma": ({"kct": 0.3, "pct2": 8.0, **PGA}, 0.3),
    "restitution_sigma": (NUMBERS | {"kind": "rocking", "restitution": 0.9, **PGV}, 0.05),
    "pgv_m_s": (SLAB | PGV, 0.7),
    "pga_g": (SLAB | PGV, 0.5),
    "tm_s": (SLAB | PGV | PGA, 0.6),
    "pgd_m": (SLAB | PGV, 0.1),
    "sa(0.3)": (SLAB | {"pga_g": 0.5, "sa(1)": 0.5, "sa(3)": 0.2}, 1.0),
    "sa(1)": (SLAB | {"sa(1)": 0.5}, 0.7),
    "sa(3)": (SLAB | {"pga_g": 0.5, "sa(1)": 0.5}, 0.2),
    "arias_m_s": (SLIDE | PGV | PGA, 2.0),
    "magnitude": (SLIDE | PGV | PGA, 7.4),
    "pgv_sigma": (SLAB | PGV, 0.6),
    "pga_sigma": (SLAB | PGV | PGA, 0.6),
    "sa(0.3)_sigma": (SLAB | {"pga_g": 0.5, "sa(0.3)": 1.0, "sa(1)": 0.5, "sa(3)": 0.2}, 0.6),
    "sa(1)_sigma": (SLAB | {"sa(1)": 0.5}, 0.6),
    "sa(3)_sigma": (SLAB | {"pga_g": 0.5, "sa(1)": 0.5, "sa(3)": 0.2}, 0.6),
    "pgv_tau": (SLAB | PGV | {"pgv_sigma": 0.6}, 0.3),
    "rjb_km": (SLAB | SCENARIO, 8.0),
    "vs30_m_s": (SLAB | SCENARIO, 300.0),
    "mechanism": (SLAB | SCENARIO, "reverse"),
    "amplification": (SLAB | PGV, 1.3),
    "amplification_sigma": (SLAB | PGV, 0.4),
    "component": (SLAB | PGV, "rotd50"),
    **{name: (SLAB | PGV, value) for name, value in
       (("height_sigma_m", 0.2), ("width_sigma_m", 0.04), ("beta_sigma_deg", 2.0),
        ("phi_sigma_deg", 0.5))},
    **dict.fromkeys(("alpha1_sigma_deg", "alpha3_sigma_deg"), (ANGLES | PGV, 1.0)),
    "r3_sigma_m": (ANGLES | PGV, 0.1),
    **{name: (SLENDER, value) for name, value in
       (("s1_sigma_m", 0.2), ("s2_sigma_m", 0.05), ("gamma_sigma_deg", 2.0))},
    "phi_back_sigma_deg": ({"s1_m": 0.5, "s2_m": 0.15, "gamma_deg": 95.0, "beta_deg": 5.0,
                            "phi_deg": 25.0, "phi_back_deg": 30.0, **PGA}, 2.0),
    "base_sigma_deg": (STANDING, 1.0),
    "back_sigma_deg": (STANDING, 1.0),
    "water_sigma_m": (SLIDE | {"water_m": 0.3, **PGV}, 0.05),
    "cohesion_sigma_pa": (SLIDE | PGV, 500.0),  # rejected without a cohesion
    "density_sigma_kg_m3": (SLIDE | {"water_m": 0.3, "density_kg_m3": 2600.0, **PGV}, 200.0),
    "gmm_sigma": (SLAB | SCENARIO, 0.4),
}  # fmt: skip
ONLY_WITH_SITES = ("pgv_tau",)
"""Fields that change the prediction interval for one earthquake alone."""


@pytest.fixture(autouse=True)
def _built_in_data(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(make_app(ServiceSettings(db=str(REFERENCE))))


def from_python(question: dict[str, Any]) -> float | str:
    """Return P, or why there is none."""
    try:
        return float(rbfrag.predict(**question).probability)
    except RbfragError as error:
        return str(error)


def agree(result: float | str | None, expected: float | str, subject: str) -> None:
    """Compare P of an interface with that of Python; what one rejects, the other rejects."""
    if isinstance(expected, str):
        assert isinstance(result, str) or result is None or math.isnan(result), (
            subject,
            result,
            expected,
        )
        return
    assert isinstance(result, float), (subject, result, expected)
    assert result == pytest.approx(expected, rel=1e-9), subject


def changed(name: str) -> dict[str, Any]:
    question, value = CASES[name]
    return {**question, name: value}


def test_every_field_of_a_question_has_a_case() -> None:
    every = dict.fromkeys((*BLOCK, *MEASURED, *COMMON, *INTENSITY, *SCENE, *SOURCE, *COMPONENT))
    assert {*every} - {*map(input_of, CASES)} == {
        "block",
        "gmm",
    }  # a shape as an object, and a file


@pytest.mark.parametrize("name", CASES)
def test_a_keyword_changes_the_answer_or_is_rejected(name: str) -> None:
    question = CASES[name][0]
    if name in ONLY_WITH_SITES:
        of = {"sites": 10}
        ends = [rbfrag.predict(**q, **of).event_high for q in (question, changed(name))]
        assert ends[0] != ends[1]
        return
    before, after = from_python(question), from_python(changed(name))
    if before == after and isinstance(after, float):
        document = rbfrag.predict(**changed(name)).warnings
        assert any(name in text and "not used" in text for text in document), (name, document)
        return
    assert before != after, name
    for alias in {column_of(name), word_of(name), *INPUTS[name].aliases}:
        if name == "back_fracture":
            assert from_python({**question, "no_back": True}) == after
        else:
            assert from_python({**without(question, name), alias: CASES[name][1]}) == after, alias


def without(question: dict[str, Any], name: str) -> dict[str, Any]:
    return {field: value for field, value in question.items() if field != name}


@pytest.mark.parametrize("name", CASES)
def test_an_option_answers_as_the_keyword(shell: Shell, name: str) -> None:
    question = changed(name)
    flags = ["--no-back"] if question.pop("back_fracture", True) is False else []
    options = [
        f"{option_of(field)}={text}"
        for field, value in by_period(question, "=").items()
        for text in (value if isinstance(value, list) else [value])
    ]
    expected = from_python(changed(name))
    status = 2 if isinstance(expected, str) else 0
    result = shell("predict", *options, *flags, "--json", expect=status)
    answer = result.stderr if status else json.loads(result.stdout)["probability"]
    agree(answer, expected, name)


@pytest.mark.parametrize("name", CASES)
def test_requests_answer_as_the_keyword(client: TestClient, name: str) -> None:
    expected = from_python(changed(name))
    words = {parameter_of(field): value for field, value in by_period(changed(name), ":").items()}
    if words.pop("no_back", True) is False:
        words["no_back"] = True
    keywords, texts = by_period(changed(name)), by_period(changed(name), ":")
    bodies = {parameter_of(field): value for field, value in keywords.items()}
    bodies |= {field: value for field, value in words.items() if field == "no_back"}
    bodies.pop("back_fracture", None)
    for ask in (
        lambda: client.get("/v1/predict", params=words),
        lambda: client.get("/v1/predict", params=texts),
        lambda: client.post("/v1/predict", json=bodies),
        lambda: client.post("/v1/predict", json=keywords),
    ):
        answer = ask()
        reply = answer.json().get("probability", answer.json().get("detail"))
        agree(reply, expected, f"{name}: {answer.json()}")
    lists = {field: {period: [number] for period, number in value.items()}
             if isinstance(value, dict) else [value] if QUANTITIES[field].unit or field in BLOCK
             else value for field, value in keywords.items()}  # fmt: skip
    if any(isinstance(value, list | dict) for value in lists.values()):
        answer = client.post("/v1/predict", json=lists)
        document = answer.json()
        reply = document["probability"][0] if answer.status_code == 200 else document["detail"]
        agree(reply, expected, name)


def one_row(question: dict[str, Any], header: str, value: Any, name: str) -> dict[str, list[Any]]:
    rest = {column_of(field): [cell] for field, cell in without(question, name).items()}
    return {**rest, header: [value]}


def aliases_of(name: str) -> list[str]:
    return sorted({name, column_of(name), word_of(name), *INPUTS[name].aliases})


def table_answer(columns: dict[str, list[Any]]) -> float | str:
    pd.DataFrame(columns).to_csv("one.csv", index=False)
    try:
        row = predict_table("one.csv", inputs={}).blocks[0]
    except InputError as error:
        return str(error)
    return row["reason"] if row["probability"] is None else float(row["probability"])


@pytest.mark.parametrize("name", [name for name in CASES if input_of(name) in COLUMNS])
def test_a_column_answers_as_the_keyword_by_each_of_its_names(name: str) -> None:
    question, value = CASES[name]
    expected = from_python(changed(name))
    for alias in aliases_of(name):
        cell = "no" if name == "back_fracture" else value
        if alias == "no_back":
            cell = "yes"
        result = table_answer(one_row(question, alias, cell, name))
        agree(result, expected, f"{alias}: {result}")


def rows_of(table: str) -> list[dict[str, str]]:
    """Return the rows of a table that the page offers, without its notes."""
    rows = csv.DictReader(io.StringIO(table.partition("# note")[0]), delimiter="\t")
    return [row for row in rows if any(row.values())]


def test_pasted_text_answers_as_the_keyword(open_page: Any) -> None:
    opened = open_page("?height=1&width=1&pgv=0.6")
    page = opened.page
    for name in [name for name in CASES if input_of(name) in COLUMNS]:
        question, value = CASES[name]
        cell = "no" if name == "back_fracture" else value
        columns = one_row(question, column_of(name), cell, name)
        text = pd.DataFrame(columns).to_csv(index=False, sep="\t")
        page.fill("#table-text", text)
        with page.expect_response(lambda r: "v1/table" in r.url, timeout=90_000) as waited:
            page.click("#table-ask")
        document = waited.value.json()
        answer: float | str = document.get("detail", "")
        if waited.value.ok:
            (row, *_) = rows_of(document["table"])
            answer = float(row["probability"]) if row["probability"] else row["reason"]
        agree(answer, from_python(changed(name)), name)
    opened.complaints.clear()  # the browser reports requests that are rejected
