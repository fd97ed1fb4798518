"""The page in a narrow window, on paper, in the dark, and cut off from every network."""

import re

import pytest
from playwright.sync_api import expect

from tests.service.page.reading import FIRST_ANSWER

NARROW = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

QUERIES = [
    "",
    "?p2=3&kr=0.1&pgv=0.6",
    "?height=1&width=1&dip=20&phi=30&pgv=0.6",
    "?alpha1=-15&alpha3=24&r3=2.5&beta=18&phi=38&pgv=0.6&pga=0.5&tm=0.4",
    "?p2=40&kr=0.1&pgv=6",
]

# Contrast of each visible text with what lies behind it (WCAG 2: relative luminance).
CONTRASTS = """() => {
  const canvas = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true });
  const colour = (text) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = text;
    canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data];
  };
  const light = (rgb) => {
    const [r, g, b] = rgb.slice(0, 3).map((v) => {
      const s = v / 255;
      return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const found = colour(getComputedStyle(at).backgroundColor);
      if (found[3] === 255) return found;
    }
    return [255, 255, 255, 255];
  };
  const found = [];
  for (const element of document.querySelectorAll('body *')) {
    const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    const field = element.matches('input, select');
    if (!(own || field) || !element.checkVisibility() || element.closest('.unseen')) continue;
    if (element.matches('option, title, [type=radio], [type=checkbox]')) continue;
    const style = getComputedStyle(element);
    const ink = colour(element.ownerSVGElement ? style.fill : style.color);
    const [a, b] = [light(ink), light(behind(element))].sort((x, y) => y - x);
    found.push([(a + 0.05) / (b + 0.05), element.outerHTML.slice(0, 80)]);
  }
  return found;
}"""


@pytest.mark.parametrize("query", QUERIES)
def test_nothing_sticks_out_of_the_window(open_page, query):
    page = open_page(query).page
    for width in (320, 390, 700, 1100):
        page.set_viewport_size({"width": width, "height": 844})
        page.wait_for_function(
            """() => [...document.querySelectorAll('#chart, #curve, #block')].every((each) =>
              !each.checkVisibility() ||
              each.querySelector('svg').getAttribute('width') == Math.floor(each.clientWidth))"""
        )
        check_that_nothing_sticks_out(page, width)


def check_that_nothing_sticks_out(page, width):
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    outside = page.eval_on_selector_all(
        "main *:not(.unseen)",
        """(all, width) => all.filter((each) => each.checkVisibility()
            && !each.closest('details, clipPath, [clip-path], defs')
            && each.getBoundingClientRect().right > width + 1)
          .map((each) => each.outerHTML.slice(0, 80))""",
        arg=width,
    )
    assert outside == []


def test_on_a_phone_the_answer_stays_in_sight_and_fields_can_be_hit(open_page):
    opened = open_page(**NARROW)
    page = opened.page
    page.locator("#curve").scroll_into_view_if_needed()
    expect(page.locator("#strip")).to_be_in_viewport()
    assert FIRST_ANSWER in opened.text("#strip").replace("\u00a0", " ")
    small = page.eval_on_selector_all(
        "button, select, input:not([type]), .choice label, .button",
        """all => all.filter((each) => each.checkVisibility()
            && each.getBoundingClientRect().height < 43).map((each) => each.outerHTML)""",
    )
    assert small == []
    page.fill("#pgv", "1.2")
    opened.settled()
    assert FIRST_ANSWER not in opened.text("#strip")


@pytest.mark.parametrize("query", QUERIES)
def test_text_stands_out_from_what_is_behind_it(open_page, query):
    page = open_page(query).page
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        contrasts = page.evaluate(CONTRASTS)
        assert len(contrasts) > 50
        assert [contrast for contrast in contrasts if contrast[0] < 4.5] == []


def test_on_paper_are_the_answer_the_charts_and_the_link(open_page):
    opened = open_page("?p2=40&kr=0.1&pgv=0.7&pga=0.5", color_scheme="dark")
    page = opened.page
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print", color_scheme="dark")
    for hidden in (".tools", "#drop", ".hint.screen", ".record", ".help >> nth=0"):
        expect(page.locator(hidden)).to_be_hidden()
    for shown in ("#probability", "#chart svg", "#curve svg", "#block svg", "#warnings li"):
        expect(page.locator(shown).first).to_be_visible()
    expect(page.locator("#paper-link")).to_have_text(page.url)
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert [item for item in page.evaluate(CONTRASTS) if item[0] < 4.5] == []
    sheet = page.pdf(prefer_css_page_size=True)
    assert sheet.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", sheet)) == 1


def test_nothing_is_asked_of_another_host(open_page, service):
    opened = open_page()
    page = opened.page
    page.fill("#pgv", "1.1")
    opened.settled()
    page.click("#example-record")
    # the first spectrum of a service waits for its kernels to be compiled
    expect(page.locator("#spectrum-part")).to_be_visible(timeout=300_000)
    page.get_by_label("angles", exact=True).check()
    opened.settled()
    assert len(opened.requests) > 20
    assert [url for url in opened.requests if not url.startswith(service)] == []
    # What the document itself may load is held to the same by its headers.
    blocked = page.evaluate("fetch('http://127.0.0.2:9/').then(() => 'loaded', () => 'rejected')")
    assert blocked == "rejected"
    assert any("Content Security Policy" in complaint for complaint in opened.complaints)
    opened.complaints.clear()
