"""axe finds nothing that keeps people out, in every state of the page."""

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from tests.service.page.test_page_answers import REJECTED, forgive

AXE = Axe()

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


def check(page):
    result = AXE.run(page)
    assert len(result.response["passes"]) > 20
    assert result.violations_count == 0, result.generate_report()


STATES = {
    "first": "",
    "extrapolated": "?p2=40&kr=0.1&pgv=6&tm=0.5&level=0.9",
    "free-standing": "?height=2&width=0.5&dip=3&pgv=0.4&kind=rocking",
    "sliding": "?height=1&width=1&dip=20&phi=30&pgv=0.6",
    "unstable": "?height=2&width=0.5&dip=45&phi=10&pgv=0.4",
}


@pytest.mark.parametrize("state", STATES)
def test_an_answer(open_page, state):
    page = open_page(STATES[state]).page
    if page.locator("#others").is_visible():
        page.locator("#others summary").click()
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        check(page)


def test_a_phone(open_page):
    page = open_page("", **PHONE).page
    check(page)
    page.emulate_media(color_scheme="dark")
    check(page)


def test_what_keeps_people_out_is_found(open_page):
    page = open_page("").page
    page.evaluate("document.querySelector('label[for=height]').remove()")
    assert AXE.run(page).generate_snapshot().startswith("label")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_empty_fields_and_wrong_ones(open_page, scheme):
    opened = open_page("?height=&width=abc&pgv=", color_scheme=scheme)
    expect(opened.page.locator(".field .error:not(:empty)")).not_to_have_count(0)
    check(opened.page)
    forgive(opened, REJECTED)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_record(open_page, scheme):
    opened = open_page("", color_scheme=scheme)
    opened.page.click("#example-record")
    expect(opened.page.locator("#spectrum-part")).to_be_visible(timeout=300_000)
    opened.page.locator("#reading-part summary").click()
    check(opened.page)
