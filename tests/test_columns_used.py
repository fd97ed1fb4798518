"""Every column of a table is used, rejected, or named as ignored, in every output."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from fastapi.testclient import TestClient

import rbfrag
from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.table_answers import predict_table
from rbfrag.fragility import describe
from rbfrag.question.table import field_of
from rbfrag.vocabulary.quantities import column_of
from tests.cli.conftest import Shell
from tests.cli.conftest import shell as shell
from tests.plots.test_report import words_of
from tests.service.page.conftest import browser as browser
from tests.service.page.conftest import chromium as chromium
from tests.service.page.conftest import open_page as open_page
from tests.service.page.conftest import service as service
from tests.test_nothing_ignored import (
    CURVE,
    JOINTS,
    PGA,
    PGV,
    PLANES,
    SLIDE,
    agree,
    from_python,
    rows_of,
    table_answer,
)
from tests.test_nothing_ignored import _built_in_data as _built_in_data
from tests.test_nothing_ignored import client as client

TABLE = {"height_m": [2.1], "width_m": [0.35], "phi_deg": [38.0], "pgv_m_s": [0.5]}


def p_of(**question: Any) -> float:
    return float(rbfrag.predict(**question).probability)


@pytest.mark.parametrize("header", ["Inclination", "Dip of base (°)", "Neigung", "pendage"])
def test_a_dip_in_any_language_is_used(header: str) -> None:
    expected = p_of(height_m=2.1, width_m=0.35, phi_deg=38.0, beta_deg=5.0, pgv_m_s=0.5)
    assert 0.5 < expected < 0.9
    assert table_answer({**TABLE, header: [5.0]}) == pytest.approx(expected, rel=1e-12)
    assert table_answer({**TABLE, header: ["5°"]}) == pytest.approx(expected, rel=1e-12)


def test_an_empty_dip_is_a_missing_value() -> None:
    columns = {name: values * 2 for name, values in TABLE.items()} | {"dip_deg": [5.0, np.nan]}
    pd.DataFrame(columns).to_csv("two.csv", index=False)
    first, second = predict_table("two.csv", inputs={}).blocks
    assert first["probability"] > 0.5
    assert second["probability"] is None
    assert second["reason"] == "dip_deg is empty: enter 0 for a level base"
    # but where planes, or numbers, give the block
    nothing = np.nan
    rows = {
        "base": ["27/200", ""], "face": ["74/205", ""], "height_m": [1.0, nothing],
        "width_m": [1.0, nothing], "p2_1_s2": [nothing, 3.0], "kr": [nothing, 0.1],
        "dip": [nothing, nothing], "phi": [20.0, nothing], "displacement": [0.1, nothing],
    }  # fmt: skip
    pd.DataFrame(rows).to_csv("planes.csv", index=False)
    assert predict_table("planes.csv", inputs={"pgv_m_s": 0.6}).answered == 2


@pytest.mark.parametrize(
    ("header", "cell", "inputs"),
    [
        ("no_back", "yes", {"back_fracture": False}),
        ("Stands free?", "ja", {"kind": "rocking"}),
        ("Cohesion (kPa)", 40.0, {"cohesion_pa": 4e4}),
        ("Water in back joint (m)", 0.3, {"water_m": 0.3}),
    ],
)
def test_columns_about_back_cohesion_and_water_are_used(
    header: str, cell: Any, inputs: dict[str, Any]
) -> None:
    question = {name: values[0] for name, values in TABLE.items()} | {"beta_deg": 4.0}
    result = table_answer({**TABLE, "dip": [4.0], header: [cell]})
    agree(result, from_python({**question, **inputs}), header)


def test_what_is_pasted_on_the_page_is_used(open_page: Any) -> None:
    page = open_page("?height=1&width=1&pgv=0.1").page
    text = (
        "H (cm)\tB (m)\tφ (°)\tkind\tPGV (cm/s)\tdisplacement_m\tDip of base (°)\n"
        "210\t0.35\t38\t\t50\t\t5\n210\t0.35\t38\trocking\t50\t\t0\n100\t1.5\t33\t\t50\t0.1\t20\n"
    )
    page.fill("#table-text", text)
    with page.expect_response(lambda r: "v1/table" in r.url, timeout=90_000) as waited:
        page.click("#table-ask")
    values = [float(row["probability"]) for row in rows_of(waited.value.json()["table"])]
    slab = {"height_m": 2.1, "width_m": 0.35, "phi_deg": 38.0, "pgv_m_s": 0.5}
    assert values == pytest.approx(
        [
            p_of(**slab, beta_deg=5.0),
            p_of(**slab, beta_deg=0.0, kind="rocking"),
            p_of(height_m=1.0, width_m=1.5, phi_deg=33.0, beta_deg=20.0, displacement_m=0.1,
                 pgv_m_s=0.5),
        ],
        rel=1e-9,
    )  # fmt: skip


def test_centimetres_are_questioned_before_the_answer(shell: Shell) -> None:
    command = ("--height", "210", "--width", "35", "--pgv", "0.5")
    lines = shell("predict", *command).stdout.splitlines()
    assert lines[0] == "Check the unit: height 210 m (in cm?)"
    text = "Check the unit: height 210 m (in cm?)"
    assert text in shell.json("predict", *command)["warnings"]
    assert text in rbfrag.predict(height_m=210.0, width_m=35.0, pgv_m_s=0.5).warnings
    many = rbfrag.predict(height_m=np.array([2.0, 210.0]), width_m=0.5, pgv_m_s=0.5)
    assert text in many.warnings
    Path("a.csv").write_text("height_m,width_m,pgv_m_s\n2,0.4,0.5\n210,35,0.5\n")
    prediction = predict_table("a.csv", inputs={})
    assert text in prediction.warnings
    assert [row["warnings"].split().count("check_unit") for row in prediction.blocks] == [0, 1]
    shell("report", *command, "--out", "a.html")
    assert text in words_of(Path("a.html"))
    assert "p² = 0.05 s⁻² is a block of 300 m" in str(
        rbfrag.predict(0.05, 0.1, pgv_m_s=0.5).warnings
    )


def test_radians_are_questioned() -> None:
    document = rbfrag.predict(height_m=2.0, width_m=0.4, beta_deg=0.0873, pgv_m_s=0.6).warnings
    assert any("is it in radians?" in text for text in document)
    for usual in (0.0, 0.5, 1.0, 5.0):
        document = rbfrag.predict(height_m=2.0, width_m=0.4, beta_deg=usual, pgv_m_s=0.6).warnings
        assert not any("radians" in text for text in document)


def test_survival_does_not_guess_the_kind(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    command = ("survival", "curve.csv", "--height", "1.2", "--width", "0.4", "--age", "10000")
    result = shell(*command, expect=2)
    assert result.stderr.startswith("rbfrag: --kind is missing: give rocking (free-standing")
    answer = shell.json(*command, "--kind", "rocking")["probability_standing"]
    backed = shell.json(*command, "--kind", "toppling")["probability_standing"]
    assert answer < 0.5 * backed
    Path("two.csv").write_text("height,width,Stands free?\n1.2,0.4,yes\n")
    document = shell.json("survival", "curve.csv", "--blocks", "two.csv", "--age", "10000")
    assert document["probability_standing"] == pytest.approx(answer, rel=1e-9)
    with pytest.raises(InputError, match="kind is missing"):
        rbfrag.survival("curve.csv", height_m=1.2, width_m=0.4, age_years=1e4)


def test_count_multiplies(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    head = "block_id,height_m,width_m,dip,phi,count\n"
    Path("three.csv").write_text(head + "a,2,0.4,3,38,3\nb,2.4,0.5,2,38,1\n")
    apart = "a1,2,0.4,3,38,\na2,2,0.4,3,38,\na3,2,0.4,3,38,\nb,2.4,0.5,2,38,\n"
    Path("apart.csv").write_text(head + apart)
    results = {}
    for name in ("three", "apart"):
        predicted = predict_table(f"{name}.csv", inputs={"pgv_m_s": 0.6})
        rates = shell.json("hazard", "curve.csv", "--blocks", f"{name}.csv", "--joint",
                           "--component", "single")  # fmt: skip
        stands = shell.json("survival", "curve.csv", "--blocks", f"{name}.csv", "--kind",
                            "rocking", "--age", "100")  # fmt: skip
        results[name] = [
            predicted.expected_failures, rates["expected_failures_per_year"],
            rates["expected_failures_low"], rates["annual_rate_any"],
            *(item["annual_rate"] for item in rates["annual_rate_at_least"]),
            stands["probability_standing"],
        ]  # fmt: skip
        ends = predicted.failures_low, predicted.failures_high
        assert ends == pytest.approx((0.0, 4.0), abs=4.0)
    assert results["three"] == pytest.approx(results["apart"], rel=1e-6)
    with pytest.raises(InputError, match="the column 'weight' is not used by this answer"):
        read_blocks({"height_m": [2.0], "width_m": [0.4], "weight": [2.0]}, reads=("count",))


def test_blocks_elsewhere_are_not_answered_for_the_map(shell: Shell, formats_dir: Path) -> None:
    grid = formats_dir / "shakemap_v3_loma_prieta_grid.xml"
    Path("swiss.csv").write_text(
        "height_m,width_m,x,y,crs\n2,0.4,2600000,1200000,EPSG:2056\n3,0.5,2600100,1200000,EPSG:2056\n"
    )
    command = ("shakemap", str(grid), "--blocks", "swiss.csv", "--out", "a.csv")
    assert "off the map" in shell(*command, expect=2).stderr
    answer = rbfrag.shakemap(grid, 3.0, 0.1)
    best = int(np.nanargmax(answer.columns["probability"]))
    lon, lat = (float(answer.columns[name][best]) for name in ("lon", "lat"))
    from pyproj import Transformer

    zone = f"EPSG:{32600 + int((lon + 180) // 6) + 1 + (100 if lat < 0 else 0)}"
    x, y = Transformer.from_crs("EPSG:4326", zone, always_xy=True).transform(lon, lat)
    Path("here.csv").write_text(f"p2,kr,x,y\n3,0.1,{x!r},{y!r}\n")
    missing = shell("shakemap", str(grid), "--blocks", "here.csv", "--out", "a.csv", expect=2)
    assert "x and y require a coordinate reference system" in missing.stderr
    shell("shakemap", str(grid), "--blocks", "here.csv", "--crs", zone, "--out", "a.csv")
    row = next(csv.DictReader(Path("a.csv").read_text("utf-8").splitlines()))
    assert float(row["lon"]) == pytest.approx(lon, abs=1e-6)
    assert float(row["probability"]) == pytest.approx(answer.columns["probability"][best], rel=1e-3)


def test_a_report_integrates_the_dispersion_of_a_column(shell: Shell) -> None:
    Path("a.csv").write_text("height_m,width_m,dip,phi,pgv_m_s,pgv_sigma\n2,0.4,0,38,0.3,0.65\n")
    answer = shell.json("report", "a.csv", "--out", "a.pdf")["blocks"][0]["probability"]
    expected = p_of(height_m=2.0, width_m=0.4, beta_deg=0.0, phi_deg=38.0, pgv_m_s=0.3,
                    pgv_sigma=0.65)  # fmt: skip
    assert answer == pytest.approx(expected, rel=1e-12)
    assert expected > 1e-3


@pytest.mark.parametrize("suffix", ["pdf", "html"])
def test_a_block_that_is_unstable_at_rest_is_first_in_a_report(shell: Shell, suffix: str) -> None:
    Path("curve.csv").write_text(CURVE)
    Path("a.csv").write_text(
        "block_id,height_m,width_m,dip,phi\nexample,9,9,0,38\nA,2,0.4,3,38\nB,3,0.45,12,36\n"
    )
    out = f"a.{suffix}"
    document = shell.json("report", "a.csv", "--pgv", "0.6", "--hazard", "curve.csv", "--out", out)
    assert (document["blocks"][0]["block_id"], document["blocks"][0]["probability"]) == ("B", 1.0)
    assert document["blocks_unstable"] == 1
    assert document["expected_failures"] == pytest.approx(
        1.0 + document["blocks"][1]["probability"]
    )
    text = words_of(Path(out), pages=2)
    assert text.index(" B ") < text.index(" A ")
    for phrase in (
        "unstable without shaking", "1 unstable without shaking (P = 1)", "return period",
        "P(at least one failure in 50 years)", "curve.csv", "0.6 m/s", "height", "width",
        "he row 'example' of the template is skipped",
    ):  # fmt: skip
        assert phrase in text, phrase


def test_a_single_block_that_is_unstable_at_rest_has_p_1(shell: Shell, client: TestClient) -> None:
    answer = rbfrag.predict(height_m=3.0, width_m=0.45, beta_deg=12.0, phi_deg=36.0, pgv_m_s=0.5)
    assert (answer.probability, answer.ci_low, answer.how) == (1.0, 1.0, "by mechanics")
    codes = [getattr(text, "code", "") for text in answer.warnings]
    assert "unstable_at_rest" in codes
    command = ("--height", "3", "--width", "0.45", "--dip", "12", "--phi", "36", "--pgv", "0.5")
    assert shell.json("predict", *command)["probability"] == 1.0
    printed = shell("predict", *command)
    assert printed.stdout.startswith("P(toppling) = 1   the block is unstable without shaking")
    words = {"height": 3, "width": 0.45, "dip": 12, "phi": 36, "pgv": 0.5}
    assert client.get("/v1/predict", params=words).json()["probability"] == 1.0
    assert client.post("/v1/predict", json=words).json()["how"] == "by mechanics"
    for numbers in ({"p2": 3.0, "kr": -0.1}, {"p2": 3.0, "kr": 0.0, "kind": "rocking"}):
        at_rest = rbfrag.predict(**numbers, pgv_m_s=0.5)
        assert at_rest.probability == 1.0
        assert any(getattr(text, "code", "") == "unstable_at_rest" for text in at_rest.warnings)


# --- values with units ---


def test_values_may_carry_their_unit(shell: Shell) -> None:
    plain = shell.json("predict", "--height", "2", "--width", "0.4", "--dip", "5", "--phi", "38",
                       "--pgv", "0.4", "--pga", "0.4")  # fmt: skip
    units = shell.json("predict", "--height", "200cm", "--width", "0,4 m", "--dip", "5°", "--phi",
                       "38 deg", "--pgv", "40cm/s", "--pga", "40%g")  # fmt: skip
    assert units["probability"] == pytest.approx(plain["probability"], rel=1e-12)
    assert "--width 0,4 m is 0.4" in units["warnings"]
    wrong = shell("predict", "--height", "2 s", "--width", "0.4", "--pgv", "0.4", expect=2)
    assert "--height must be a number" in wrong.stderr
    doubtful = shell("predict", "--height", "2,100", "--width", "0.4", "--pgv", "0.4", expect=2)
    assert "not '2,100'" in doubtful.stderr


# --- every header ---


FIELD_OF = {"name": "block_id"}
USUAL = {
    "height_m": 2.0, "width_m": 0.4, "beta_deg": 3.0, "phi_deg": 38.0, "pgv_m_s": 0.6,
}  # fmt: skip
VALUES = {
    "phi_back_deg": 30.0, "gamma_deg": 45.0, "s1_m": 1.1, "s2_m": 0.6, "water_m": 0.3,
    "cohesion_pa": 5000.0, "density_kg_m3": 2500.0, "displacement_m": 0.1, "pga_g": 0.5,
    "tm_s": 0.6, "count": 3.0, "lat": 46.0, "lon": 8.0, **USUAL,
}  # fmt: skip
SHAPES = {
    "s1_m": JOINTS | PGV, "s2_m": JOINTS | PGV, "gamma_deg": JOINTS | PGV, "base": PLANES | PGV,
    "back": PLANES | PGV, "face": PLANES | PGV, "displacement_m": SLIDE | PGV,
    "cohesion_pa": SLIDE | PGV, "density_kg_m3": SLIDE | PGV | {"cohesion_pa": 5000.0},
    "water_m": SLIDE | PGV, "tm_s": USUAL | PGA,
}  # fmt: skip


def test_every_header_is_used_or_the_table_is_rejected_naming_it(cases_dir: Path) -> None:
    with (cases_dir / "headers.csv").open(encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    assert len(rows) > 200
    wrong = []
    for row in rows:
        try:
            check_header(row)
        except AssertionError as error:
            wrong.append(f"{row['header']}: {error}")
    assert not wrong, "\n".join(wrong)


def check_header(row: dict[str, str]) -> None:
    header, unit = row["header"], row["numbers_of_the_column_divided_by_SI_value"]
    field = FIELD_OF.get(row["field"], row["field"])
    if not field:
        check_not_an_input(header)
        return
    question = dict(SHAPES.get(field, USUAL))
    if unit == "text":
        match = field_of(header)
        assert match is not None
        assert match.field == field
        return
    if "/" in unit and unit != "plane":
        yes = unit.split("/")[0]
        if field == "kind":
            question, cell = {**question, "kind": "rocking"}, yes
        else:
            cell = yes if header == "no_back" else unit.split("/")[1]
            question = {**question, "back_fracture": False}
    elif unit == "plane":
        cell = question[field]
    else:
        value = VALUES[field]
        question = {**question, field: value}
        cell = value if unit == "deg" else float(value * float(unit))
    if field in ("count", "lat", "lon"):
        match = field_of(header)
        assert match is not None
        assert match.field == field
        return
    columns = {column_of(name): [v] for name, v in question.items() if name != field}
    result = table_answer({**columns, header: [cell]})
    if isinstance(result, str) and f"'{header}'" in result:
        return  # rejected, naming it
    agree(result, from_python(question), f"{header}: {result}")


def check_not_an_input(header: str) -> None:
    """Every output names a column that is not an input, unless the table is rejected."""
    frame = pd.DataFrame({**{column_of(name): [v] for name, v in USUAL.items()}, header: ["fresh"]})
    frame.to_csv("in.csv", index=False)
    try:
        texts = predict_table("in.csv", "out.csv", inputs={}).warnings
    except InputError as error:
        texts = (f"ignored or rejected: {error}",)
    ignored = [text for text in texts if header in text and "ignored" in text]
    reason = [text for text in texts if "could not be used" in text and header in text]
    assert ignored or reason, texts


def test_every_output_has_the_notes(shell: Shell) -> None:
    Path("in.csv").write_text(
        "block_id,Höhe [cm],width_m,dip,phi,Colour,Water (m)\n"
        "A,200,0.4,3,,grey,\nB,210,0.4,3,38,,0\n"
    )
    texts = (
        "column Höhe [cm]: converted from cm to m", "column ignored: Colour",
        "water not given in 1 of 2 rows: assumed dry",
    )  # fmt: skip
    answer = shell.json("predict", "--blocks", "in.csv", "--pgv", "0.6")
    for text in texts:
        assert text in answer["warnings"]
    for suffix in ("csv", "xlsx", "parquet"):
        shell("predict", "--blocks", "in.csv", "--pgv", "0.6", "--out", f"out.{suffix}")
    beside = json.loads(Path("out.csv-metadata.json").read_text("utf-8"))
    assert beside["url"] == "out.csv"
    sheet = pd.read_excel("out.xlsx", sheet_name="notes")
    import pyarrow.parquet as parquet

    metadata = json.loads(parquet.read_metadata("out.parquet").metadata[b"notes"])
    for text in texts:
        assert text in [note["text"] for note in beside["notes"]]
        assert text in [*sheet["note"]]
        assert text in [note["text"] for note in metadata]
    for frame in (
        pd.read_csv("out.csv"), pd.read_excel("out.xlsx"), pd.read_parquet("out.parquet"),
    ):  # fmt: skip
        assert "friction_not_given" in frame["warnings"].iloc[0]
        assert "friction_not_given" not in str(frame["warnings"].iloc[1])
    for suffix in ("pdf", "html"):
        shell("report", "in.csv", "--pgv", "0.6", "--out", f"out.{suffix}")
        document = words_of(Path(f"out.{suffix}"), pages=2)
        for text in texts:
            assert text[1:] in document
        assert "Warnings and notes" in document


def test_a_kind_column_is_understood_or_named() -> None:
    slab = {name: [v, v] for name, v in USUAL.items()}
    columns = {**slab, "Block type": ["slab", "column"]}
    pd.DataFrame(columns).to_csv("a.csv", index=False)
    document = predict_table("a.csv", inputs={}).warnings
    assert any("Block type (slab, column): no word names a kind" in text for text in document)
    for words in (["slab", "free-standing"], ["", "rokcing"]):
        pd.DataFrame({**slab, "Type": words}).to_csv("a.csv", index=False)
        with pytest.raises(InputError, match="is not a kind of failure"):
            predict_table("a.csv", inputs={})
    pd.DataFrame({**slab, "Type": ["Freistehend", ""]}).to_csv("a.csv", index=False)
    first, second = predict_table("a.csv", inputs={}).blocks
    assert (first["kind"], second["kind"]) == ("rocking", "toppling")


def test_a_missing_width_names_the_column_that_may_be_it() -> None:
    Path("a.csv").write_text("height_m,Thicknes of slab,pgv_m_s\n2,0.4,0.6\n")
    with pytest.raises(InputError, match=r"width is missing|for the width use"):
        predict_table("a.csv", inputs={})
    Path("a.csv").write_text("height_m,Thicknes of slab,pgv_m_s\n2,0.4,0.6\n")
    assert predict_table("a.csv", inputs={"width_m": 0.4}).answered == 1


def test_ignore_columns_overrules(shell: Shell) -> None:
    Path("a.csv").write_text("height_m,width_m,phi,dip quality,pgv_m_s\n2,0.4,38,good,0.6\n")
    rejected = shell("predict", "--blocks", "a.csv", expect=2).stderr
    assert "'dip quality' is unknown; for the dip of the base" in rejected
    document = shell.json("predict", "--blocks", "a.csv", "--ignore-columns", "dip quality")
    assert "column ignored: dip quality" in document["warnings"]
    assert "unknown column 'depth'" in shell(
        "predict", "--blocks", "a.csv", "--ignore-columns", "depth", expect=2
    ).stderr  # fmt: skip


# --- field notes ---


def test_field_notes_become_one_document(shell: Shell, cases_dir: Path) -> None:
    book, meaning = cases_dir / "fieldnotes.xlsx", cases_dir / "fieldnotes_meaning.csv"
    for suffix in ("pdf", "html"):
        answer = shell.json("report", str(book), "--pgv", "0.5", "--out", f"notes.{suffix}")
    result = {block["block_id"]: block["probability"] for block in answer["blocks"]}
    assert next(iter(result)) == "R5"
    with meaning.open(encoding="utf-8") as file:
        rows = [[*row.values()] for row in csv.DictReader(file)]
    for name, text, *_ in rows:
        if text.startswith("rejected"):
            (reason,) = (r["reason"] for r in answer["rejected"] if r["block_id"] == name)
            assert "dip" in reason
        elif "unstable at rest" in "".join(rows[[r[0] for r in rows].index(name)]):
            assert result[name] == 1.0
        else:
            inputs = rbfrag.predict(**keywords(text), pgv_m_s=0.5)
            assert result[name] == pytest.approx(inputs.probability, rel=1e-12)
            assert (inputs.drained is None) == (name not in ("R8", "R9"))
            (block,) = (block for block in answer["blocks"] if block["block_id"] == name)
            assert block["drained"] == (inputs.drained and pytest.approx(inputs.drained, rel=1e-12))
            if name == "R12":
                assert any("cohesion has no effect on k_r" in w for w in block["warnings"])
    for suffix in ("pdf", "html"):
        document = words_of(Path(f"notes.{suffix}"), pages=7).replace("kᵣ", "k_r")
        for block in answer["blocks"]:
            assert not block["drained"] or describe.drained_bound(block["drained"]) in document
        for text in (*answer["warnings"], *(reason["reason"] for reason in answer["rejected"])):
            assert text[1:40] in document, text
        for block in answer["blocks"]:
            for text in block["warnings"]:
                assert text[1:40] in document, text


def keywords(text: str) -> dict[str, Any]:
    """Return the keywords of a cell such as "height_m=1.8,base=27/200,kind='rocking'"."""
    result: dict[str, Any] = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        try:
            result[name] = float(value)
        except ValueError:
            result[name] = value.strip("'")
    if result.get("density_kg_m3") == 2702.2:  # 26.5 kN/m³ of the table, rounded
        result["density_kg_m3"] = 26.5e3 / 9.80665
    return result
