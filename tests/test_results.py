"""One answer in every interface: the same headline, and each warning in each of them."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as parquet
import pytest
from fastapi.testclient import TestClient

import rbfrag
from rbfrag.errors import spelled
from rbfrag.question.document import answer_block
from rbfrag.results.diagnostic import by_severity, diagnostics, labelled
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.vocabulary.quantities import QUESTION, option_of, parameter_of
from tests.cli.conftest import Shell
from tests.cli.conftest import shell as shell
from tests.conftest import ROOT
from tests.exchange.test_shakemap_grid import GRID
from tests.plots.test_report import words_of
from tests.service.page.conftest import browser as browser
from tests.service.page.conftest import chromium as chromium
from tests.service.page.conftest import open_page as open_page
from tests.service.page.conftest import service as service

SLAB: dict[str, Any] = {"height_m": 2.2, "width_m": 0.55, "beta_deg": 5.0, "phi_deg": 36.0}

QUESTIONS: dict[str, dict[str, Any]] = {
    "toppling": {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.6},
    "shape": {"height_m": 2.0, "width_m": 0.4, "pgv_m_s": 0.9, "pga_g": 0.5},
    "water": {**SLAB, "water_m": 0.6, "pgv_m_s": 0.5},
    "rocking": {"p2": 3.0, "kr": 0.2, "kind": "rocking", "pgv_m_s": 0.6, "restitution": 0.9},
    "sliding": {"ky": 0.12, "displacement_m": 0.1, "pgv_m_s": 0.6, "pga_g": 0.4},
    "slumping": {
        "s1_m": 1.0, "s2_m": 0.6, "gamma_deg": 25.0, "beta_deg": 20.0, "phi_deg": 32.0,
        "pgv_m_s": 0.6, "pga_g": 0.6,
    },
    "confined toppling": {
        "s1_m": 0.5, "s2_m": 0.15, "gamma_deg": 95.0, "beta_deg": 5.0, "phi_deg": 25.0,
        "pgv_m_s": 0.6, "pga_g": 0.6,
    },
    "scenario": {
        "p2": 3.0, "kr": 0.1, "magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0,
        "mechanism": "reverse",
    },
    "unit": {"p2": 3.0, "kr": 0.1, "pgv_m_s": 40.0},
    "extrapolation": {"p2": 40.0, "kr": 0.1, "pgv_m_s": 2.9},
    "unstable": {**SLAB, "beta_deg": 40.0, "pgv_m_s": 0.5},
    "below yield": {"p2": 3.0, "kr": 0.4, "pgv_m_s": 0.6, "pga_g": 0.3},
}  # fmt: skip
"""Questions about one block: every kind of failure, and every sort of warning."""

OPTIONS = ("excel_text", *(name for name in QUESTION if "_" in name))


def words(question: dict[str, Any]) -> list[str]:
    return [part for name, value in question.items() for part in (option_of(name), f"{value}")]


def plain(text: str) -> str:
    """A text without the marks of symbols and spaces that interfaces write in their own way."""
    text = html.unescape(text).replace("\N{LATIN SUBSCRIPT SMALL LETTER R}", "_r")
    text = text.replace("\N{LATIN SUBSCRIPT SMALL LETTER S}", "_s").replace("\u00a0", " ")
    return " ".join(text.replace("_", "").split())


@pytest.mark.parametrize("name", QUESTIONS)
def test_each_interface_has_the_headline_and_every_warning(name: str, shell: Shell) -> None:
    question = QUESTIONS[name]
    kind = question.get("kind")
    inputs = {field: value for field, value in question.items() if field != "kind"}
    options = {n: inputs.pop(n) for n in ("mechanism",) if n in inputs}
    answer = answer_block(inputs, kind=kind, **options)
    headline, notes = answer.headline(), diagnostics(answer.warnings)
    assert notes or name in ("below yield", "scenario")

    printed = shell("predict", *words(question)).stdout
    lines = printed.splitlines()
    assert headline in lines
    shown = [note for note in by_severity(notes) if note not in headline]
    assert [line for line in lines if line.startswith(("Warning ", "Note "))] == [
        f"{note.label:<10}{spelled(note, OPTIONS, option_of)}"
        for note in shown
        if note.code != "check_unit"
    ]

    document = json.loads(shell("predict", *words(question), "--json").stdout)
    assert document["warnings"] == [*notes]
    assert [(d["code"], d["text"]) for d in document["diagnostics"]] == [
        (note.code, note) for note in notes
    ]

    client = TestClient(make_app(ServiceSettings(db=None, early=False)))
    request = {parameter_of(field): value for field, value in question.items()}
    result = client.get("/v1/predict", params={**request, "text": True}).json()
    assert result["text"]["sentences"] == [*answer.sentences()]
    assert result["text"]["lines"] == [line._asdict() for line in answer.lines()]
    assert result["diagnostics"] == document["diagnostics"]
    assert client.post("/v1/predict", json={**request, "text": True}).json() == result

    for suffix in ("pdf", "html"):
        rbfrag.report(f"answer.{suffix}", **question)
        shown = plain(words_of(Path(f"answer.{suffix}")))
        for text in (headline, *answer.sentences(), *(line.text for line in answer.lines())):
            assert plain(text) in shown
        assert all(plain(text) in shown for text in labelled(notes))

    html_text = answer._repr_html_()
    assert all(plain(text) in plain(html_text) for text in (headline, *labelled(notes)))


@pytest.mark.parametrize("name", ["shape", "water", "rocking", "slumping"])
def test_the_page_shows_the_same_text(name: str, open_page: Any) -> None:
    question = QUESTIONS[name]
    inputs = {field: value for field, value in question.items() if field != "kind"}
    answer = answer_block(inputs, kind=question.get("kind"))
    names = {name: parameter_of(name) for name in question}
    if "height_m" in question:
        names["beta_deg"] = "dip"
    query = "&".join(f"{names[field]}={value}" for field, value in question.items())
    page = open_page(f"?{query}").page
    shown = f"{page.text_content('#probability')} {page.text_content('#sentence')}"
    assert plain(shown) == plain(answer.headline())
    lines = page.locator("#lines dd").all_text_contents()
    expected = [line.text.replace(str(answer.data), "models.db") for line in answer.lines()]
    assert [plain(text) for text in lines] == [plain(text) for text in expected]
    notes = page.locator("#warnings li").all_text_contents()
    assert notes == [*labelled(answer.warnings)]


CURVE = "pgv_m_s,annual_rate\n0.05,0.08\n0.1,0.03\n0.2,0.009\n0.4,0.0022\n0.8,0.0004\n1.6,5e-5\n"
BLOCKS = (
    "block_id,Höhe [cm],width_m,dip,phi,Colour,Water (m),lon,lat,loss\n"
    "A,200,0.4,3,,grey,,20.0,40.5,10\nB,210,0.4,3,38,,0.5,20.0,40.5,5\nC,x,0.4,3,38,,0,20,40.5,5\n"
)
EVENTS = ROOT / "docs" / "examples" / "event-set"

TABLES: dict[str, tuple[str | Path, ...]] = {
    "predict": ("predict", "--blocks", "blocks.csv", "--pgv", "0.6"),
    "hazard": ("hazard", "curve.csv", "--blocks", "blocks.csv", "--joint"),
    "losses": ("losses", EVENTS, "--blocks", EVENTS / "blocks.csv"),
    "map": ("shakemap", "grid.xml", "--blocks", "blocks.csv"),
    "rate": ("hazard", "curve.csv", "--height", "2", "--width", "0.4", "--phi", "38"),
}
"""Questions about many blocks, and an annual rate."""


@pytest.mark.parametrize("name", TABLES)
def test_written_tables_have_every_warning(name: str, shell: Shell) -> None:
    for file, text in (("curve.csv", CURVE), ("blocks.csv", BLOCKS), ("grid.xml", GRID)):
        Path(file).write_text(text, encoding="utf-8")
    command = TABLES[name]
    out = ("--out", "out.csv") if name == "map" else ()
    document = json.loads(shell(*command, *out, "--json").stdout)
    notes = document["diagnostics"]
    assert [note["text"] for note in notes] == [*dict.fromkeys(document["warnings"])]
    assert len(notes) > 1

    printed = shell(*command, *out).stdout
    lines = printed.splitlines()
    for note in notes:
        label = note["severity"].capitalize()
        # the measures of a map and the columns of a table are no options
        texts = (spelled(note["text"], fields, option_of) for fields in ((), OPTIONS))
        assert {f"{label:<10}{text}" for text in texts} & {*lines}

    for suffix in ("csv", "xlsx", "parquet"):
        shell(*command, "--out", f"out.{suffix}")
    metadata = json.loads(Path("out.csv-metadata.json").read_text("utf-8"))["notes"]
    sheet = pd.read_excel("out.xlsx", sheet_name="notes")
    stored = json.loads(parquet.read_metadata("out.parquet").metadata[b"notes"])
    for note in notes:
        assert note["text"] in [text["text"] for text in metadata]
        assert note["text"] in [*sheet["note"]]
        assert note["text"] in [text["text"] for text in stored]


def test_a_table_over_http_has_the_same_warnings(shell: Shell) -> None:
    Path("blocks.csv").write_text(BLOCKS, encoding="utf-8")
    document = json.loads(shell(*TABLES["predict"], "--json").stdout)
    client = TestClient(make_app(ServiceSettings(db=None, early=False)))
    result = client.post("/v1/table?pgv=0.6", content=Path("blocks.csv").read_bytes()).json()
    assert result["diagnostics"] == document["diagnostics"]
    for note in document["diagnostics"]:
        assert note["text"] in result["table"]


def test_a_rate_over_http_has_the_same_warnings(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE, encoding="utf-8")
    document = json.loads(shell(*TABLES["rate"], "--json").stdout)
    client = TestClient(make_app(ServiceSettings(db=None, early=False)))
    inputs = "/v1/hazard?height=2&width=0.4&phi=38"
    result = client.post(inputs, content=CURVE.encode()).json()
    # rates over HTTP are those of the curve's sites, so that warnings name rows
    assert [(note["code"], note["text"]) for note in result["diagnostics"]] == [
        (note["code"], note["text"]) for note in document["diagnostics"]
    ]
