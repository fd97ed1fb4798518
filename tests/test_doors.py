"""One question through every door: the same answer, or the same rejection in the door's words."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from fastapi.testclient import TestClient
from playwright.sync_api import expect

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError, RbfragError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.table_answers import predict_table
from rbfrag.fragility.model_selection import SHIPPED
from rbfrag.fragility.prediction import Prediction
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.hazards.curve import HazardCurve
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import stability
from rbfrag.vocabulary.quantities import BLOCK, INPUTS, SHAKING, column_of, option_of, parameter_of
from tests.cli.conftest import Shell
from tests.cli.conftest import shell as shell
from tests.exchange.openquake_job import write_job
from tests.service.page.conftest import Opened
from tests.service.page.conftest import browser as browser
from tests.service.page.conftest import chromium as chromium
from tests.service.page.conftest import open_page as open_page
from tests.service.page.conftest import service as service
from tests.service.page.reading import agrees, probability_shown
from tests.synthetic import shaking, write_at2

NUMBERS = ("probability", "ci_low", "ci_high")

# fields of a block, its kind if one is asked for, and PGV
SHAPES: list[dict[str, Any]] = [
    {"height_m": 2.0, "width_m": 0.4},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 10.0},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": -5.0},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 10.0, "phi_deg": 35.0},
    {"height_m": 1.0, "width_m": 0.3, "beta_deg": 3.0, "phi_deg": 40.0, "phi_back_deg": 30.0},
    {"height_m": 8.0, "width_m": 2.0, "phi_deg": 40.0},
    # slides, with and without a displacement that matters
    {"height_m": 2.5, "width_m": 2.5, "beta_deg": 20.0, "phi_deg": 32.0},
    {"height_m": 2.5, "width_m": 2.5, "beta_deg": 20.0, "phi_deg": 32.0, "displacement_m": 0.1},
    {"height_m": 1.0, "width_m": 2.0, "beta_deg": 15.0, "phi_deg": 30.0, "displacement_m": 0.02},
    {"height_m": 1.0, "width_m": 2.0, "beta_deg": -10.0, "phi_deg": 30.0, "displacement_m": 0.5},
    # topples: the displacement is not read
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 4.0, "phi_deg": 35.0, "displacement_m": 0.1},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 4.0, "phi_deg": 35.0, "displacement_m": -0.1},
    # on the boundary between two modes, and beside it
    {"height_m": 1.0, "width_m": 1.0, "phi_deg": 45.0, "displacement_m": 0.1},
    {"height_m": 1.0, "width_m": 1.0, "phi_deg": 45.0000001, "displacement_m": 0.1},
    {"height_m": 1.0, "width_m": 1.0, "phi_deg": 44.9999999, "displacement_m": 0.1},
    # falls at rest
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 12.0, "phi_deg": 35.0},
    {"height_m": 1.0, "width_m": 1.0, "beta_deg": 40.0, "phi_deg": 30.0},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 20.0},
    # stands free
    {"height_m": 2.0, "width_m": 0.4, "kind": "rocking"},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 4.0, "kind": "rocking"},
    {"height_m": 2.0, "width_m": 0.4, "phi_deg": 35.0, "kind": "rocking"},
    {"height_m": 2.0, "width_m": 0.4, "kind": "rocking", "restitution": 0.9},
    {"height_m": 2.0, "width_m": 0.4, "restitution": 0.9},
    # another kind than its mode
    {"height_m": 2.5, "width_m": 2.5, "beta_deg": 20.0, "phi_deg": 32.0, "kind": "toppling"},
    {"height_m": 2.0, "width_m": 0.4, "phi_deg": 35.0, "kind": "sliding", "displacement_m": 0.1},
    {"height_m": 2.0, "width_m": 0.4, "phi_deg": 35.0, "kind": "slumping"},
    {"height_m": 2.0, "width_m": 0.4, "kind": "sliding", "displacement_m": 0.1},
    # other shapes
    {"alpha1_deg": -10.0, "alpha3_deg": 20.0, "r3_m": 1.0, "beta_deg": 5.0, "phi_deg": 35.0},
    {
        "alpha1_deg": -30.0, "alpha3_deg": 10.0, "r3_m": 1.0, "beta_deg": 2.0, "phi_deg": 45.0,
        "pga_g": 0.6,
    },
    {
        "alpha1_deg": 56.0, "alpha3_deg": 76.0, "r3_m": 0.7, "beta_deg": 22.0, "phi_deg": 30.0,
        "pga_g": 0.6,
    },
    {
        "alpha1_deg": -20.0, "alpha3_deg": 25.0, "r3_m": 1.0, "beta_deg": 5.0, "phi_deg": 40.0,
        "kind": "rocking",
    },
    {"s1_m": 1.0, "s2_m": 0.4, "gamma_deg": 25.0, "beta_deg": 20.0, "phi_deg": 40.0, "pga_g": 0.6},
    {"s1_m": 0.5, "s2_m": 0.2, "gamma_deg": 20.0, "beta_deg": 10.0, "phi_deg": 35.0, "pga_g": 0.6},
    {
        "s1_m": 1.0, "s2_m": 0.6, "gamma_deg": 25.0, "beta_deg": 20.0, "phi_deg": 40.0,
        "displacement_m": 0.05,
    },
    {"s1_m": 1.0, "s2_m": 0.6, "gamma_deg": 70.0, "beta_deg": 10.0, "phi_deg": 40.0},
    # topples under its back plane; without a motion of its own
    {"s1_m": 0.5, "s2_m": 0.15, "gamma_deg": 95.0, "beta_deg": 5.0, "phi_deg": 25.0, "pga_g": 0.6},
    {
        "alpha1_deg": -40.0, "alpha3_deg": 20.0, "r3_m": 1.0, "beta_deg": 5.0, "phi_deg": 30.0,
        "phi_back_deg": 26.0, "pga_g": 1.2, "magnitude": 7.0,
    },
    {
        "s1_m": 0.5, "s2_m": 0.15, "gamma_deg": 95.0, "beta_deg": 5.0, "phi_deg": 25.0,
        "pga_g": 0.6, "kind": "slumping",
    },
    {"s1_m": 0.5, "s2_m": 0.1, "gamma_deg": 115.0, "beta_deg": 0.0, "phi_deg": 40.0, "pga_g": 0.6},
    # uncertain, and suspicious
    {"height_m": 2.0, "width_m": 0.4, "phi_deg": 35.0, "kr_sigma": 0.2},
    {"height_m": 2.0, "width_m": 0.4, "phi_deg": 0.61, "displacement_m": 0.1},
    {"height_m": 200.0, "width_m": 40.0, "phi_deg": 35.0},
]  # fmt: skip
BY_NUMBERS: list[dict[str, Any]] = [
    {"p2": 3.0, "kr": 0.1},
    {"p2": 10.0, "kr": 0.3},
    {"p2": 0.3, "kr": 0.05},
    {"p2": 3.0, "kr": 0.1, "kind": "toppling"},
    {"p2": 3.0, "kr": 0.1, "kind": "rocking"},
    {"p2": 3.0, "kr": 0.1, "restitution": 0.8},
    {"p2": 3.0, "kr": 0.1, "kind": "rocking", "restitution": 0.95},
    {"p2": 3.0, "kr": 0.1, "kr_sigma": 0.2},
    {"p2": 3.0, "kr": 0.1, "p2_sigma": 0.3, "kr_sigma": 0.1},
    {"ky": 0.2, "displacement_m": 0.1},
    {"ky": 0.1, "displacement_m": 0.02, "beta_deg": 20.0},
    {"ky": 0.1, "displacement_m": 0.05, "kind": "sliding"},
    {"ky": 0.1, "displacement_m": 0.05, "ky_sigma": 0.2},
    {"ks": 0.2, "ps2": 3.0, "pga_g": 0.6},
    {"ks": 0.1, "ps2": 8.0, "pga_g": 0.6, "magnitude": 7.0, "kind": "slumping"},
    {"ks": 0.2, "ps2": 3.0, "pga_g": 0.6, "ks_sigma": 0.2},
    {"kct": 0.3, "pct2": 8.0, "pga_g": 0.6},
    {"kct": 0.2, "pct2": 30.0, "pga_g": 0.6, "magnitude": 7.0, "kind": "confined_toppling"},
    {"kct": 0.3, "pct2": 8.0, "pga_g": 0.6, "kct_sigma": 0.2},
    {"kct": 0.3, "pct2": 8.0, "pga_g": 0.2},
    {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.0},
    {"p2": 3.0, "kr": 0.1, "pgv_m_s": 60.0},
    {"p2": 3.0, "kr": 6.0},
    {"p2": 300.0, "kr": 0.1},
    {"p2": 0.0, "kr": 0.1},
    {"p2": 3.0, "kr": 0.1, "pgv_m_s": -1.0},
    {"ky": 0.2, "displacement_m": 0.1, "beta_deg": 89.0},
    {"p2": 3.0, "kr": 0.1, "kind": "confined_toppling", "pga_g": 0.6},
    {"ky": 0.1, "displacement_m": 0.1, "pgv_m_s": 0.7, "pga_g": 0.5, "magnitude": 7.0},
    {"ky": 0.1, "displacement_m": 0.1, "pgv_m_s": 0.7, "pga_g": 0.5, "arias_m_s": 3.0},
]
QUESTIONS = [{"pgv_m_s": 0.6, **item} for item in (*SHAPES, *BY_NUMBERS)]


class Reply(NamedTuple):
    """An answer, or why there is none."""

    numbers: tuple[float, ...]
    kind: str
    mode: str
    reason: str


def words(question: dict[str, Any]) -> str:
    return " ".join(f"{name}={value}" for name, value in question.items())


@pytest.fixture(autouse=True)
def _reference(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)


def from_python(question: dict[str, Any]) -> Reply:
    try:
        answer = rbfrag.predict(**question)
    except RbfragError as error:
        return Reply((), "", "", str(error))
    assert isinstance(answer, Prediction)
    return Reply(
        tuple(getattr(answer, name) or math.nan for name in NUMBERS), answer.kind, answer.mode, ""
    )


def agree(output: Reply, expected: Reply, question: dict[str, Any]) -> None:
    """Compare a door that answers one by one, or by rows, with Python's answer to one."""
    if not expected.numbers:
        assert output.reason, words(question)
        assert not output.numbers or math.isnan(output.numbers[0]), (words(question), output)
        return
    assert output.numbers, (words(question), output.reason)
    reference = [(a, b) for a, b in zip(output.numbers, expected.numbers, strict=True) if b == b]
    for result, target in reference:
        assert result == pytest.approx(target, rel=1e-9 if "sigma" in words(question) else 1e-12), (
            words(question), output, expected,
        )  # fmt: skip
    assert (output.kind, output.mode) == (expected.kind, expected.mode), words(question)


PHYSICAL = {*BLOCK, *SHAKING}
REFERENCE_ANSWERS: dict[int, Reply] = {}


def expected_of(i: int) -> Reply:
    if i not in REFERENCE_ANSWERS:
        REFERENCE_ANSWERS[i] = from_python(QUESTIONS[i])
    return REFERENCE_ANSWERS[i]


def same_reason(output: str, expected: str, spell: Callable[[str], str]) -> bool:
    """Return whether a rejection says what Python's says, its fields as a door spells them."""
    shown = expected
    for name in sorted(PHYSICAL, key=len, reverse=True):
        for word in (spell(name), name):
            output, shown = output.replace(word, "~"), shown.replace(word, "~")
    return shown.split("(")[0][:25] in output or output.split("(")[0][:25] in shown


def test_there_are_sixty_questions_of_every_sort() -> None:
    assert len(QUESTIONS) >= 60
    answers = [expected_of(i) for i in range(len(QUESTIONS))]
    assert {output.kind for output in answers if output.numbers} == {
        "toppling", "rocking", "sliding", "slumping", "confined_toppling",
    }  # fmt: skip
    assert sum(not output.numbers for output in answers) > 10


def test_the_shell_answers_likewise(shell: Shell) -> None:
    for i, question in enumerate(QUESTIONS):
        expected = expected_of(i)
        nominal = {name: value for name, value in question.items() if name != "kind"}
        options = [f"{option_of(name)}={value!r}" for name, value in nominal.items()]
        kind = ["--kind", question["kind"]] if "kind" in question else []
        status = 0 if expected.numbers else 2
        result = shell("predict", *options, *kind, "--json", expect=status)
        if not expected.numbers:
            assert result.stderr.strip() == f"rbfrag: {spelled_rejection(question, option_of)}"
            continue
        output = json.loads(result.stdout)
        numbers = tuple(math.nan if output[name] is None else output[name] for name in NUMBERS)
        agree(Reply(numbers, output["kind"], output["mode"], ""), expected, question)


def test_arrays_answer_likewise() -> None:
    for i, question in enumerate(QUESTIONS):
        arrays = {
            name: value if isinstance(value, str) else np.full(2, value)
            for name, value in question.items()
        }
        try:
            answer = rbfrag.predict(**arrays)
        except RbfragError as error:
            agree(Reply((), "", "", str(error)), expected_of(i), question)
            continue
        assert isinstance(answer, PredictionArray)
        for place in range(2):
            document = Reply(
                tuple(float(getattr(answer, name)[place]) for name in NUMBERS),
                answer.kinds[place], answer.modes[place], answer.reason[place],
            )  # fmt: skip
            agree(document, expected_of(i), question)


@pytest.mark.parametrize("size", [None, 2])
def test_what_the_blocks_do_not_read_is_rejected_alone_and_in_arrays(size: int | None) -> None:
    question: dict[str, Any] = {"height_m": 2.0, "width_m": 0.4, "phi_deg": 35.0, "pgv_m_s": 0.6}
    if size is not None:
        question = {name: np.full(size, value) for name, value in question.items()}
    for name in ("restitution", "ky_sigma"):
        with pytest.raises(RbfragError, match=f"{name} cannot be combined with kind toppling"):
            rbfrag.predict(**question, kind="toppling", **{name: 0.5})


UNSTABLE_AT_REST = (1.0, 1.0, 1.0)
"""P and interval of what fails without shaking, which no model answers."""


def table(folder: Path, form: str) -> tuple[Path, list[int]]:
    """Write the questions about certain blocks, by one measure, as the rows of one table."""
    rows = [
        i
        for i, question in enumerate(QUESTIONS)
        if "_sigma" not in words(question) and "pga_g" not in question
    ]
    # an empty dip is a missing value, not a level base
    level = [{"beta_deg": 0.0} if "height_m" in QUESTIONS[i] else {} for i in rows]
    questions = [
        {"block_id": f"b{i}", **dip, **QUESTIONS[i]} for i, dip in zip(rows, level, strict=True)
    ]
    frame = pd.DataFrame(questions)
    frame = frame.rename(columns=column_of_or_itself)
    path = folder / f"questions.{form}"
    if form == "csv":
        frame.to_csv(path, index=False)
    elif form == "xlsx":
        frame.to_excel(path, index=False)
    else:
        frame.to_parquet(path, index=False)
    return path, rows


def column_of_or_itself(name: str) -> str:
    return column_of(name) if name in INPUTS else name


def read(path: Path) -> list[dict[str, Any]]:
    if path.suffix == ".csv":
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    frame = pd.read_excel(path) if path.suffix == ".xlsx" else pd.read_parquet(path)
    rows: list[dict[str, Any]] = frame.to_dict("records")
    return rows


@pytest.mark.parametrize("form", ["csv", "xlsx", "parquet"])
def test_a_mixed_table_answers_each_row_likewise(tmp_path: Path, form: str) -> None:
    source, rows = table(tmp_path, form)
    target = tmp_path / f"answers.{form}"
    predict_table(source, target, inputs={}, model=None, level=0.95, db=None)
    answers = read(target)
    assert len(answers) == len(rows)

    def text(cell: Any) -> str:
        return "" if cell is None or cell != cell else str(cell)

    def number(cell: Any) -> float:
        return math.nan if text(cell) == "" else float(cell)

    for i, row in zip(rows, answers, strict=True):
        document = Reply(
            tuple(number(row[name]) for name in NUMBERS), text(row["kind"]), text(row["mode"]),
            text(row["reason"]),
        )  # fmt: skip
        agree(document, expected_of(i), QUESTIONS[i])


@pytest.fixture(scope="module")
def client() -> Iterator[TestClient]:
    app = make_app(ServiceSettings(db=str(REFERENCE)))
    with TestClient(app, raise_server_exceptions=False) as result:
        yield result


@pytest.mark.parametrize("sites", [1, 5, 30])
def test_the_range_of_some_sites_is_the_same_at_every_door(
    shell: Shell, client: TestClient, sites: int
) -> None:
    question = {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.8, "pga_g": 0.5}
    single = rbfrag.predict(**question, sites=sites)
    assert isinstance(single, Prediction)
    ends = (single.event_low, single.event_high)
    words = {"p2": 3.0, "kr": 0.1, "pgv": 0.8, "pga": 0.5, "sites": sites}
    options = [text for name, value in words.items() for text in (f"--{name}", str(value))]
    answer = shell.json("predict", *options)
    inputs = client.get("/v1/predict", params=words).json()
    for document in (answer, inputs):
        assert document["sites"] == sites
        assert (document["event_low"], document["event_high"]) == ends
    body = {**words, "kr": [0.1, 0.2], "sites": float(sites)}
    rows = client.post("/v1/predict", json=body).json()
    assert (rows["event_low"][0], rows["event_high"][0]) == ends
    many = rbfrag.predict(**{**question, "kr": np.array([0.1, 0.2])}, sites=sites)
    assert isinstance(many, PredictionArray)
    assert (many.event_low[0], many.event_high[0]) == ends
    del words["sites"]
    without = client.get("/v1/predict", params=words).json()
    assert without["event_low"] is without["event_high"] is None


def parameters(question: dict[str, Any]) -> dict[str, Any]:
    return {parameter_of(name): value for name, value in question.items()}


def rejection_of(question: dict[str, Any]) -> str:
    """Return why Python rejects a question, as a request is told."""
    return spelled_rejection(question, parameter_of).replace(SHIPPED, "the database")


def spelled_rejection(question: dict[str, Any], spell: Callable[[str], str]) -> str:
    """Return why Python rejects a question, its fields as a door spells them."""
    with pytest.raises(RbfragError) as rejected:
        rbfrag.predict(**question)
    error = rejected.value
    return error.spelled(spell) if isinstance(error, InputError) else str(error)


def test_requests_for_one_block_answer_likewise(client: TestClient) -> None:
    for i, question in enumerate(QUESTIONS):
        expected = expected_of(i)
        response = client.get("/v1/predict", params=parameters(question))
        document = response.json()
        if response.status_code != 200:
            assert response.status_code == 422, (words(question), document)
            assert document["detail"] == rejection_of(question), words(question)
            continue
        numbers = tuple(math.nan if document[name] is None else document[name] for name in NUMBERS)
        agree(Reply(numbers, document["kind"], document["mode"], ""), expected, question)


def test_requests_for_many_blocks_answer_likewise(client: TestClient) -> None:
    for i, question in enumerate(QUESTIONS):
        lists = {
            name: value if isinstance(value, str) else [value, value]
            for name, value in parameters(question).items()
        }
        arrays = {n: v if isinstance(v, str) else np.full(2, v) for n, v in question.items()}
        response = client.post("/v1/predict", json=lists)
        document = response.json()
        if response.status_code != 200:
            assert response.status_code == 422, (words(question), document)
            assert document["detail"] == rejection_of(arrays), words(question)
            continue
        complete = rbfrag.predict(**arrays)
        assert isinstance(complete, PredictionArray)
        assert document["reason"] == complete.reason.tolist(), words(question)
        for place in range(2):
            numbers = tuple(
                math.nan if document[name][place] is None else document[name][place]
                for name in NUMBERS
            )
            texts = (document[name][place] for name in ("kinds", "modes", "reason"))
            answer = Reply(numbers, *texts)
            agree(answer, expected_of(i), question)


# one of each shape, of each kind, and one of each sort that has no answer
TYPED = [
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 10.0, "phi_deg": 35.0},
    {"height_m": 2.0, "width_m": 0.4, "kind": "rocking", "restitution": 0.9},
    {"height_m": 2.5, "width_m": 2.5, "beta_deg": 20.0, "phi_deg": 32.0, "displacement_m": 0.1},
    {"s1_m": 1.0, "s2_m": 0.4, "gamma_deg": 25.0, "beta_deg": 20.0, "phi_deg": 40.0, "pga_g": 0.6},
    {"alpha1_deg": -10.0, "alpha3_deg": 20.0, "r3_m": 1.0, "beta_deg": 5.0, "phi_deg": 35.0},
    {"height_m": 2.0, "width_m": 0.4, "beta_deg": 20.0},
    {"p2": 10.0, "kr": 0.3},
    {"p2": 3.0, "kr": 0.1, "pgv_m_s": -1.0},
]
FIELDS_OF_SHAPES = {"s1_m": "fractures", "r3_m": "angles", "p2": "numbers", "height_m": "rectangle"}


def test_what_is_typed_into_the_page_is_answered_likewise(
    open_page: Callable[..., Opened],
) -> None:
    opened = open_page("")
    page = opened.page
    for typed in TYPED:
        question = next(
            question_inputs
            for question_inputs in QUESTIONS
            if question_inputs == {"pgv_m_s": 0.6, **typed}
        )
        shape = next(shape for name, shape in FIELDS_OF_SHAPES.items() if name in question)
        page.locator(f"input[name=shape][value={shape}]").check()
        page.locator(f"input[name=kind][value='{question.get('kind', '')}']").check()
        for name in ("beta_deg", "phi_deg", *question):
            word = "dip" if (shape, name) == ("rectangle", "beta_deg") else parameter_of(name)
            field = page.locator(f"input[id={word}]")
            if field.is_visible():
                field.fill(str(question.get(name, "")))
        expected = from_python(question)
        if not expected.numbers:
            expect(page.locator("#probability")).to_have_attribute("data-state", "none")
            if "at rest" not in expected.reason:  # which the page says of its drawing
                message = "async (said) => (await import('/js/fields.js')).inLabels(said)"
                assert opened.text("#sentence") == page.evaluate(message, rejection_of(question))
            continue
        opened.settled()
        if "displacement_m" in question:  # asked for once the block is known to slide
            page.fill("#displacement", str(question["displacement_m"]))
            opened.settled()
        assert agrees(probability_shown(page), expected.numbers[0]), words(question)
    opened.complaints.clear()  # of answers with the status 422


CURVE = HazardCurve("pgv_m_s", np.array([0.05, 0.5, 2.0]), np.array([0.02, 0.002, 1e-4]))


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario: one earthquake with the PGV of the questions at one site."""
    folder: Path = tmp_path_factory.mktemp("job")
    return write_job(
        folder, events=((0, 0, 0),), shaking=((0, 60.0, "here"),), sites=("here",), weights=(1.0,),
        ruptures=False,
    )  # fmt: skip


def of_hazard(block: dict[str, Any], _: Path) -> tuple[str, str, float | None]:
    answer = rbfrag.hazard(CURVE, **block)
    return answer.kinds[0], answer.modes[0], None


def of_survival(block: dict[str, Any], _: Path) -> tuple[str, str, float | None]:
    kind = rbfrag.predict(**block, pgv_m_s=0.6).kind  # which survival does not guess
    answer = rbfrag.survival(CURVE, **{"kind": kind, **block}, age_years=100.0)
    return answer.kind or "", answer.mode, None


def of_losses(block: dict[str, Any], job: Path) -> tuple[str, str, float | None]:
    answer = rbfrag.losses(job, **block, expected=True)
    return answer.kinds[0], answer.modes[0], float(answer.failures[0])


@pytest.mark.parametrize("ask", [of_hazard, of_survival, of_losses])
def test_rates_and_losses_are_of_the_same_kinds_and_reject_the_same_blocks(
    ask: Callable[[dict[str, Any], Path], tuple[str, str, float | None]], job: Path
) -> None:
    for i, question in enumerate(QUESTIONS):
        if question["pgv_m_s"] != 0.6 or any(name.endswith("_sigma") for name in question):
            continue
        if "pga_g" in question:  # the curve is one of PGV alone
            continue
        expected = expected_of(i)
        block = {"component": "single", **question}
        del block["pgv_m_s"]
        if expected.numbers in ((), UNSTABLE_AT_REST):
            with pytest.raises(RbfragError) as rejected:
                ask(block, job)
            document = str(rejected.value)
            assert (
                (expected.numbers == UNSTABLE_AT_REST and "at rest" in document)
                or same_reason(document, expected.reason, str)
                or fails_at_rest(document, expected)
                or f"model of kind {question.get('kind')}" in document
            ), (document, expected.reason)
            continue
        kind, mode, p = ask(block, job)
        assert (kind, mode) == (expected.kind, expected.mode), words(question)
        if p:  # by nodes of ln(shaking)
            assert p == pytest.approx(expected.numbers[0], rel=5e-6), words(question)


def fails_at_rest(output: str, expected: Reply) -> bool:
    return all(
        "at rest" in text or "without an earthquake" in text for text in (output, expected.reason)
    )


def test_tables_of_blocks_are_read_likewise(tmp_path: Path) -> None:
    source, rows = table(tmp_path, "csv")
    read_rows = read_blocks(source)
    valid = dict(zip(read_rows.blocks["row"].tolist(), read_rows.blocks["kind"], strict=True))
    for place, i in enumerate(rows):
        expected = expected_of(i)
        if QUESTIONS[i]["pgv_m_s"] == 0.6:
            answered = expected.numbers not in ((), UNSTABLE_AT_REST)
            assert (place in valid) == answered, words(QUESTIONS[i])
        if place in valid and expected.numbers:
            assert valid[place] == expected.kind, words(QUESTIONS[i])


def test_what_the_table_once_got_wrong() -> None:
    """A dip under another name weakens a block, and one that slides never has P = 0."""
    block = Block.rectangle(2.0, 0.4)
    kr = stability(block, beta_deg=10.0, phi_deg=45.0).kr
    expected = rbfrag.predict(block.p2, kr, pgv_m_s=0.8).probability
    for dip in ("dip", "dip_deg", "beta_deg"):
        rows = read_blocks({"height_m": [2.0], "width_m": [0.4], dip: [10.0]}).blocks
        prediction = rbfrag.predict(rows["p2_1_s2"], rows["kr"], pgv_m_s=0.8)
        assert float(prediction.probability[0]) == pytest.approx(expected, rel=1e-12)
    assert expected > 0.99
    slides = rbfrag.predict(
        height_m=np.array([2.5]), width_m=2.5, beta_deg=20.0, phi_deg=32.0, pgv_m_s=0.5
    )
    assert math.isnan(slides.probability[0])
    assert slides.reason[0].startswith("slides (yield 0.21 g): give displacement_m")


UNSTABLE = {"height_m": 2.0, "width_m": 0.2, "beta_deg": 10.0}
"""A rectangle whose base dips by more than atan(w/h)."""


@pytest.mark.parametrize("planes", [{}, {"phi_deg": 30.0}, {"phi_deg": 5.0}])
@pytest.mark.parametrize("kind", ["toppling", "sliding", "slumping", "confined_toppling", None])
def test_no_critical_value_of_a_block_that_is_unstable_at_rest(
    tmp_path: Path, shell: Shell, planes: dict[str, float], kind: str | None
) -> None:
    """`critical` rejects it in the words of `respond`, in the shell, in Python and over HTTP."""
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    (motion,) = rbfrag.read_motions(record)
    words = [
        text
        for name, value in {**UNSTABLE, **planes}.items()
        for text in (option_of(name), f"{value:g}")
    ]
    arguments = ("--kind", kind) if kind else ()
    needs_friction = not planes and kind not in (None, "toppling")
    if not needs_friction:
        rejections = [
            shell(command, record, *words, *arguments, expect=2).stderr.strip().splitlines()[-1]
            for command in ("respond", "critical")
        ]
        assert rejections[0] == rejections[1]
        assert "unstable at rest" in rejections[0]
    # Python, of a block object
    block = Block.rectangle(2.0, 0.2)
    if planes:
        question: dict[str, Any] = {"block": block, "beta_deg": 10.0, "kind": kind, **planes}
        with pytest.raises(InputError, match="unstable at rest") as of_respond:
            rbfrag.respond(motion, **question)
        if kind == "sliding":
            question["displacement_m"] = 0.1
        with pytest.raises(InputError) as of_critical:
            rbfrag.critical(motion, **question)
        assert str(of_critical.value) == str(of_respond.value)
    backed: dict[str, Any] = {"kind": kind or "toppling", "beta_deg": 10.0, **planes}
    with pytest.raises(InputError, match="unstable at rest"):
        rbfrag.critical(motion, block=block, **backed)
    if kind is None:
        with TestClient(make_app(ServiceSettings(db=str(REFERENCE)))) as client:
            answer = client.post(
                "/v1/critical",
                params=parameters({**UNSTABLE, **planes}),
                content=record.read_bytes(),
            )
        assert answer.status_code == 422
        assert "unstable at rest" in answer.text
