"""Water behind a block: the page gives the undrained answer and the drained bound."""

from __future__ import annotations

import csv
import io

from playwright.sync_api import expect

import rbfrag
from rbfrag.db.location import REFERENCE
from tests.service.page.reading import agrees, probability_shown

SLAB = {"height_m": 2.2, "width_m": 0.55, "beta_deg": 5.0, "phi_deg": 36.0, "water_m": 0.6,
        "density_kg_m3": 2702.2, "pgv_m_s": 0.5}  # fmt: skip


def test_water_is_a_field_of_backed_blocks(open_page):
    opened = open_page("?height=2.2&width=0.55&dip=5&phi=36&water=0.6&pgv=0.5")
    page = opened.page
    question = {name: value for name, value in SLAB.items() if name != "density_kg_m3"}
    answer = rbfrag.predict(**question, db=REFERENCE)
    assert agrees(probability_shown(page), answer.probability)
    assert answer.drained is not None
    assert f"kr = {answer.drained['kr']:.3g}, P = 0.030 %" in opened.text("#lines")
    expect(page.locator("#lines")).to_contain_text("without water pressure")
    expect(page.locator("#warnings")).to_contain_text("water pressure keeps acting")
    page.check("input[name=kind][value=rocking]", force=True)
    opened.settled()
    expect(page.locator("#water")).to_be_hidden()
    expect(page.locator("#lines")).not_to_contain_text("Drained")


def test_a_pasted_table_has_both_bounds(open_page):
    page = open_page("?height=1&width=1&pgv=0.5").page
    rows = "name\tHeight (m)\tWidth (m)\tDip (°)\tφ (°)\tWater (m)\tUnit weight (kN/m³)\n"
    rows += "R8\t2.2\t0.55\t5\t36\t0.6\t26.5\n"
    page.fill("#table-text", rows)
    page.click("#table-ask")
    expect(page.locator("#table-said")).to_have_text("The block is answered.")
    expect(page.locator("#table-notes")).to_contain_text("water pressure keeps acting")
    with page.expect_download() as waited:
        page.click("#table-file")
    text = waited.value.path().read_text(encoding="utf-8-sig").partition("# note")[0]
    (row,) = csv.DictReader(io.StringIO(text.strip()), delimiter="\t")
    answer = rbfrag.predict(**{**SLAB, "density_kg_m3": 26500.0 / 9.80665}, db=REFERENCE)
    assert answer.drained is not None
    for name in ("probability", "ci_low", "ci_high"):
        assert abs(float(row[name]) - getattr(answer, name)) < 1e-9
        assert abs(float(row[f"drained_{name}"]) - answer.drained[name]) < 1e-9
