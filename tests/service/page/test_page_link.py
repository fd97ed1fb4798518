"""The address holds all that is shown."""

from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

SHOWN = """() => [...document.querySelectorAll('#form input, #form select')]
  .map((each) => [each.id, each.type === 'radio' ? each.checked : each.value])
  .concat([...document.querySelectorAll('main p:not(#live), main li, main td, main path')]
    .map((each) => each.getAttribute('d') ?? each.textContent))
  .concat(document.querySelector('.point').getAttribute('transform'))"""


@pytest.mark.parametrize(
    "typed",
    [
        {"pgv": "0.9"},
        {"p2": "8", "kr": "0.2", "pga": "0.7", "tm": "0.4", "level": "0.9"},
        {"pga": "0.5", "tm": "0.4", "pgv": ""},
        {"model": "wls-pgv"},
        {"kind": "free-standing", "restitution": "0.85", "pga": "0.5"},
    ],
)
def test_a_link_shows_the_same_in_another_window(open_page, typed):
    opened = open_page()
    page = opened.page
    for part in ("more-shaking", "model-part"):
        page.locator(f"#{part} summary").click()
    for name, text in typed.items():
        if name == "model":
            page.select_option("#model", text)
        elif name == "kind":
            page.get_by_label(text).check()
        else:
            page.fill(f"#{name}", text)
    opened.settled()
    page.wait_for_timeout(400)
    again = open_page("?" + urlsplit(page.url).query)
    assert again.page.evaluate(SHOWN) == page.evaluate(SHOWN)


def test_a_link_holds_a_shape(open_page):
    opened = open_page()
    page = opened.page
    page.get_by_label("fractures", exact=True).check()
    page.fill("#s1", "4")
    page.get_by_label("free-standing").check()
    opened.settled()
    page.wait_for_timeout(400)
    query = urlsplit(page.url).query
    names = {"s1", "s2", "gamma", "beta", "phi", "kind", "pgv"}
    assert set(parse_qs(query)) == names
    again = open_page("?" + query)
    assert again.page.evaluate(SHOWN) == page.evaluate(SHOWN)


def test_the_link_is_copied(open_page):
    opened = open_page("?p2=5&kr=0.07&pgv=0.8", permissions=["clipboard-read", "clipboard-write"])
    page = opened.page
    page.click("#copy-link")
    expect(page.locator("#link-copied")).to_be_visible()
    copied = page.evaluate("navigator.clipboard.readText()")
    assert parse_qs(urlsplit(copied).query) == {"p2": ["5"], "kr": ["0.07"], "pgv": ["0.8"]}


def test_a_block_without_a_back_plane_stands_free(open_page):
    shown = [
        open_page(f"?p2=3&kr=0.2&pgv=0.6&{free_standing}").page
        for free_standing in ("no_back=true", "kind=rocking")
    ]
    expect(shown[0].get_by_label("free-standing")).to_be_checked()
    assert shown[0].evaluate(SHOWN) == shown[1].evaluate(SHOWN)
