"""The whole page by keyboard alone: reached by Tab, seen to be reached, and worked."""

import pytest
from playwright.sync_api import expect

from tests.service.page.reading import agrees, probability_shown

FOCUSED = """() => {
  const at = document.activeElement;
  return at.id || at.getAttribute('class') || at.tagName.toLowerCase();
}"""

# A ring around the focused element, or around what stands for it.
RINGED = """() => {
  const at = document.activeElement;
  const seen = [at, at.nextElementSibling, at.previousElementSibling, at.querySelector('.ring')];
  return seen.filter(Boolean).some((each) => {
    const style = getComputedStyle(each);
    const outlined = style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2;
    const ring = each.classList.contains('ring') && !/, 0\\)|transparent|none/.test(style.stroke);
    return outlined || ring;
  });
}"""


def walk(page):
    """Press Tab through the page; return what was reached, and what showed no focus."""
    reached, unseen = [], []
    for _ in range(80):
        page.keyboard.press("Tab")
        name = page.evaluate(FOCUSED)
        if name == "body" or (reached and name == reached[0]):
            break
        reached.append(name)
        if not page.evaluate(RINGED):
            unseen.append(name)
    return reached, unseen


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_is_reached_and_shows_its_focus(open_page, scheme):
    opened = open_page("?p2=3&kr=0.1&pgv=0.6&pga=0.5&tm=0.5&level=0.9", color_scheme=scheme)
    reached, unseen = walk(opened.page)
    for name in ("copy-link", "print", "p2", "kr", "pgv", "pga", "tm", "pgd", "model", "level"):
        assert name in reached
    for name in ("point", "record-file", "example-record", "summary"):
        assert name in reached
    assert unseen == []


def test_a_question_is_asked_and_answered_without_a_mouse(open_page, ask):
    opened = open_page()
    page = opened.page
    while page.evaluate(FOCUSED) != "kr":
        page.keyboard.press("Tab")
    page.keyboard.press("Control+a")
    # at once: a slow machine would ask about the 0 of a half-typed number
    page.keyboard.insert_text("0.08")
    while page.evaluate(FOCUSED) != "point":
        page.keyboard.press("Tab")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowDown")
    opened.settled()
    assert float(page.input_value("#pgv")) == pytest.approx(0.612)
    assert float(page.input_value("#kr")) == pytest.approx(0.08 / 1.1, rel=5e-3)
    answer = ask("v1/predict", p2=3, kr=page.input_value("#kr"), pgv=page.input_value("#pgv"))
    assert agrees(probability_shown(page), answer["probability"])


def test_the_way_a_block_is_given_is_chosen_by_arrows(open_page):
    opened = open_page()
    page = opened.page
    page.focus("input[value=numbers]")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    expect(page.locator("#alpha1")).to_be_visible()
    expect(page.locator("#p2")).to_be_hidden()


def test_the_point_tells_where_it_is(open_page):
    opened = open_page()
    page = opened.page
    point = page.get_by_role("slider", name="Point on the chart")
    page.focus(".point")
    page.keyboard.press("Shift+ArrowRight")
    opened.settled()
    expect(point).to_have_attribute("aria-valuenow", "0.66")
    text = point.get_attribute("aria-valuetext").replace("\u00a0", " ")
    assert "PGV 0.66 m/s" in text
    assert probability_shown(page) in text


def test_a_change_is_said_once_it_has_settled(open_page):
    opened = open_page()
    page = opened.page
    page.fill("#pgv", "6")
    expect(page.locator("#live")).to_contain_text("outside the fitted range")
    assert page.locator("#live").get_attribute("aria-live") == "polite"


def test_every_field_has_a_name_and_its_unit(open_page):
    opened = open_page("?alpha1=-15&alpha3=24&r3=2.5&beta=18&phi=38&pgv=0.6")
    page = opened.page
    nameless = page.eval_on_selector_all(
        "input:not([type=radio]), select",
        "all => all.filter((each) => !each.labels.length).map((each) => each.id)",
    )
    assert nameless == []
    undescribed = page.eval_on_selector_all(
        "main input, main select",
        """all => all.flatMap((each) => (each.getAttribute('aria-describedby') ?? '')
            .split(' ').filter((id) => id && !document.getElementById(id)))""",
    )
    assert undescribed == []
