"""Errors of measurement on the page: its fields, and the same answer as from Python."""

from __future__ import annotations

from playwright.sync_api import expect

import rbfrag
from rbfrag.db.location import REFERENCE
from tests.service.page.reading import agrees, probability_shown

SLAB = {"height_m": 2.0, "width_m": 0.4, "beta_deg": 0.0, "phi_deg": 40.0, "pgv_m_s": 0.9}


def test_errors_of_measurement_are_fields_of_a_shape(open_page):
    opened = open_page("?height=2&width=0.4&dip=0&phi=40&pgv=0.9&width_sigma=10%25&dip_sigma=2")
    page = opened.page
    answer = rbfrag.predict(**SLAB, width_sigma_m="10%", beta_sigma_deg=2.0, db=REFERENCE)
    assert agrees(probability_shown(page), answer.probability)
    expect(page.locator("#lines")).to_contain_text("As stated")
    expect(page.locator("#lines")).to_contain_text("base dip ±2°")
    expect(page.locator("#dip_sigma")).to_be_visible()
    page.fill("#dip_sigma", "1")
    opened.settled()
    answer = rbfrag.predict(**SLAB, width_sigma_m="10%", beta_sigma_deg=1.0, db=REFERENCE)
    assert agrees(probability_shown(page), answer.probability)
    page.fill("#dip_sigma", "")
    page.fill("#width_sigma", "")
    opened.settled()
    assert agrees(probability_shown(page), rbfrag.predict(**SLAB, db=REFERENCE).probability)
    expect(page.locator("#lines")).to_contain_text("Sensitivity")
    page.check("input[name=shape][value=numbers]", force=True)
    expect(page.locator("#errors-part")).to_be_hidden()
