"""Answers to typed inputs: the service's numbers and words, the newest question last."""

import re

import pytest
from playwright.sync_api import expect

from rbfrag.results.diagnostic import Diagnostic, labelled
from tests.service.page.reading import FIRST_ANSWER, agrees, points_of, probability_shown


def listed(answer):
    """The warnings of an answer of the service, as every interface lists them."""
    return [*labelled(Diagnostic(d["text"], d["code"]) for d in answer["diagnostics"])]


REJECTED = "Failed to load resource: the server responded with a status of 422"


def forgive(opened, words):
    """Take back the browser's complaints about answers that the test provoked."""
    assert opened.complaints
    assert all(words in complaint for complaint in opened.complaints)
    opened.complaints.clear()


@pytest.mark.parametrize(
    "typed",
    [
        {},
        {"pgv": "1.2"},
        {"p2": "12.5", "kr": "0.031", "pgv": "0.35"},
        {"pga": "0.4", "tm": "0.5"},
        {"pga": "0.7", "tm": "0.3", "kr": "0.03", "pgv": ""},
        {"pga": "0.4", "tm": "0.6", "level": "0.8", "pgv": ""},
        {"sites": "5", "level": "0.9"},
        {"pgv": "0"},
        {"pgv": "2.9", "kr": "0.0005"},
    ],
)
def test_the_answer_is_the_services(open_page, ask, typed):
    opened = open_page()
    page = opened.page
    if set(typed) & {"tm", "pgd", "level", "sites"}:
        for part in ("more-shaking", "model-part"):
            page.locator(f"#{part} summary").click()
    for name, text in typed.items():
        page.fill(f"#{name}", text)
    inputs = {"p2": "3", "kr": "0.1", "pgv": "0.6", **typed}
    answer = ask("v1/predict", **{name: text for name, text in inputs.items() if text})
    opened.settled()
    assert agrees(probability_shown(page), answer["probability"])
    if answer["how"] != "by mechanics":
        ends = opened.text("#strip").partition("interval ")[2].partition("%")[0].split("–")
        assert agrees(f"{ends[0].strip()} %", answer["ci_low"])
        assert agrees(f"{ends[-1].strip()} %", answer["ci_high"])
    expect(page.locator("#meter .one-event")).to_be_attached()
    if answer["event_low"] is not None and answer["probability"] > 0.0:
        assert "in one earthquake" in opened.text("#lines")
    # a reason that stands in the headline is not repeated below it
    headline = opened.text("#strip")
    warnings = [text for text in listed(answer) if text.partition(": ")[2] not in headline]
    assert page.locator("#warnings li").all_text_contents() == warnings
    inside = "within" if answer["in_domain"] else "outside"
    model = "no fitted model" if answer["how"] == "by mechanics" else inside
    expect(page.locator("#lines")).to_contain_text(model)
    rows = page.locator("#other-answers tr")
    assert rows.count() == len(answer["answers"])


def test_an_extrapolation_is_said_and_its_reasons_are_the_services(open_page, ask):
    opened = open_page("?p2=40&kr=0.1&pgv=6")
    answer = ask("v1/predict", p2=40, kr=0.1, pgv=6)
    assert not answer["in_domain"]
    assert len(answer["warnings"]) >= 3
    expect(opened.page.locator("#lines")).to_contain_text("inputs outside the fitted range")
    assert opened.page.locator("#warnings li").all_text_contents() == listed(answer)


@pytest.mark.parametrize(
    ("field", "text", "words"),
    [
        ("pgv", "abc", "Peak ground velocity PGV = 'abc' is not a number"),
        ("kr", "-0.1", "Uplift acceleration coefficient kr = -0.1 is not above zero"),
        ("p2", "", "Frequency parameter p² is missing"),
        ("level", "2", "level"),
        ("pgv", "-1", "Peak ground velocity PGV = -1 m/s is negative"),
    ],
)
def test_what_is_wrong_is_said_beside_its_field(open_page, field, text, words):
    opened = open_page()
    page = opened.page
    page.locator("#model-part summary").click()
    page.fill(f"#{field}", text)
    expect(page.locator(f"#{field}-error")).to_contain_text(words)
    expect(page.locator(f"#{field}")).to_have_attribute("aria-invalid", "true")
    assert f"{field}-error" in page.get_attribute(f"#{field}", "aria-describedby")
    expect(page.locator("#probability")).to_have_attribute("data-state", "none")
    expect(page.locator(".plot.stale")).not_to_have_count(0)
    page.fill(f"#{field}", {"pgv": "0.6", "kr": "0.1", "p2": "3", "level": "0.95"}[field])
    expect(page.locator(f"#{field}-error")).to_have_text("")
    opened.settled()
    assert probability_shown(page) == FIRST_ANSWER
    forgive(opened, REJECTED)


def test_an_old_answer_never_replaces_a_newer_one(open_page, ask):
    opened = open_page()
    page = opened.page
    held, sent = [], []

    def slow(route):
        sent.append(route.request.url)
        if "pgv=0.9" in route.request.url:
            held.append(route)
        else:
            route.continue_()

    page.context.route("**/v1/predict?**", slow)
    for text in ("0.9", "1.1", "1.3", "1.5"):
        page.fill("#pgv", text)
        page.wait_for_timeout(300)
    assert len(held) == 1
    held[0].continue_()
    expect(page.locator("#lines")).to_contain_text("PGV 1.5 m/s")
    opened.settled()
    page.wait_for_timeout(500)
    assert "PGV 1.5 m/s" in opened.text("#lines")
    assert agrees(probability_shown(page), ask("v1/predict", p2=3, kr=0.1, pgv=1.5)["probability"])
    assert not [url for url in sent if "pgv=1.1" in url or "pgv=1.3" in url]


def test_what_the_chart_lacks_takes_no_answer_away(open_page):
    opened = open_page()
    page = opened.page
    problem = '{"title": "Too large", "status": 413, "detail": "too many rows for this service"}'

    def reject_arrays(route):
        if route.request.method == "POST":
            route.fulfill(status=413, content_type="application/problem+json", body=problem)
        else:
            route.continue_()

    page.context.route("**/v1/predict", reject_arrays)
    page.fill("#p2", "4")
    expect(page.locator("#chart-caption")).to_contain_text("too many rows for this service")
    expect(page.locator("#curve-caption")).to_contain_text("too many rows for this service")
    assert page.get_attribute("#probability", "data-state") == "known"
    expect(page.locator("#chart.stale")).to_have_count(1)
    forgive(opened, "413")


def test_a_busy_service_is_asked_again(open_page):
    opened = open_page()
    page = opened.page
    problem = '{"title": "Busy", "status": 503, "detail": "the service is busy"}'
    busy = True

    def answer(route):
        if busy:
            route.fulfill(status=503, content_type="application/problem+json", body=problem)
        else:
            route.continue_()

    page.context.route("**/v1/**", answer)
    page.fill("#pgv", "1.2")
    expect(page.locator("#unreachable")).to_contain_text("the service is busy")
    busy = False
    expect(page.locator("#unreachable")).to_be_hidden()
    opened.settled()
    assert probability_shown(page) != FIRST_ANSWER
    forgive(opened, "503")


def test_a_service_out_of_reach_is_said_and_asked_again(open_page):
    opened = open_page()
    page = opened.page
    out_of_reach = True
    page.context.route(
        "**/v1/**", lambda route: route.abort() if out_of_reach else route.continue_()
    )
    page.fill("#pgv", "1.2")
    expect(page.locator("#unreachable")).to_contain_text("does not answer")
    assert probability_shown(page) == FIRST_ANSWER
    out_of_reach = False
    expect(page.locator("#unreachable")).to_be_hidden()
    opened.settled()
    assert probability_shown(page) != FIRST_ANSWER
    forgive(opened, "net::ERR_FAILED")


def test_a_token_is_asked_for_and_kept_out_of_the_link(open_page):
    opened = open_page()
    page = opened.page

    def guarded(route):
        if route.request.headers.get("authorization") == "Bearer open-sesame":
            return route.continue_()
        problem = '{"title": "Unauthorized", "status": 401, "detail": "bring the token"}'
        return route.fulfill(status=401, content_type="application/problem+json", body=problem)

    page.context.route("**/v1/**", guarded)
    page.fill("#pgv", "1.2")
    expect(page.locator("#token-form")).to_be_visible()
    page.fill("#token", "open-sesame")
    page.press("#token", "Enter")
    expect(page.locator("#token-form")).to_be_hidden()
    opened.settled()
    assert probability_shown(page) != FIRST_ANSWER
    assert "sesame" not in page.url
    forgive(opened, "401")


def test_a_shape_names_its_mode_and_answers_by_it(open_page, ask):
    opened = open_page()
    page = opened.page
    page.get_by_label("angles", exact=True).check()
    opened.settled()
    block = ask("v1/block", alpha1=-15, alpha3=24, r3=2.5, beta=18, phi=38)
    expect(page.locator("#block-words")).to_contain_text("Uplift acceleration")
    expect(page.locator("#block .outline.topple")).to_have_count(1)
    answer = ask("v1/predict", p2=block["p2"], kr=block["kr"], pgv=0.6)
    assert agrees(probability_shown(page), answer["probability"])
    page.fill("#phi", "15")
    expect(page.locator("#block .outline.slide")).to_have_count(1)
    expect(page.locator("#sentence")).to_have_text(
        "the block is unstable without shaking (by mechanics)"
    )
    expect(page.locator("#chart")).to_be_hidden()
    page.fill("#phi", "38")
    expect(page.locator("#block .outline.topple")).to_have_count(1)
    page.locator("input[name=shape][value=numbers]").check()
    opened.settled()
    assert float(page.input_value("#p2")) == pytest.approx(block["p2"], rel=5e-3)
    assert float(page.input_value("#kr")) == pytest.approx(block["kr"], rel=5e-3)


RECTANGLE = {"height": 2, "width": 0.5, "dip": 6, "pgv": 0.6}


def test_the_page_opens_on_a_rectangle_that_is_answered(open_page, ask):
    opened = open_page("")
    page = opened.page
    expect(page.locator("input[name=shape]").first).to_be_checked()
    assert {name: float(page.input_value(f"#{name}")) for name in RECTANGLE} == RECTANGLE
    answer = ask("v1/predict", **RECTANGLE)
    assert agrees(probability_shown(page), answer["probability"])
    assert 0.05 < answer["probability"] < 0.5
    numbers = ask("v1/drawing", height=2, width=0.5, dip=6)["numbers"]
    assert f"p² = {numbers['p2']:.3g} s⁻², kr = {numbers['kr']:.3g}" in opened.text("#lines")
    assert "backed by a rock face" in opened.text("#lines")
    assert page.locator("#warnings li").all_text_contents() == listed(answer)


def test_a_free_standing_rectangle_says_what_it_is_taken_as(open_page, ask):
    opened = open_page("")
    opened.page.get_by_label("free-standing").check()
    opened.settled()
    answer = ask("v1/predict", **RECTANGLE, kind="rocking")
    assert agrees(probability_shown(opened.page), answer["probability"])
    assert "free-standing" in opened.text("#lines")


@pytest.mark.parametrize(
    ("shape", "kind", "title", "numbers"),
    [
        (
            {"height": 1, "width": 1, "dip": 20, "phi": 30},
            {"kind": "sliding", "displacement": 0.1},
            "P(permanent displacement above 0.1 m)",
            "ky = 0.176",
        ),
        (
            {"s1": 1, "s2": 0.6, "gamma": 25, "beta": 20, "phi": 32, "pga": 0.6},
            {"kind": "slumping"},
            "P(failure past recovery)",
            "ks = 0.202",
        ),
        (
            {"s1": 0.5, "s2": 0.15, "gamma": 95, "beta": 5, "phi": 25, "pga": 0.6},
            {"kind": "confined_toppling"},
            "P(failure past recovery)",
            "kct = 0.202",
        ),
    ],
    ids=["sliding", "slumping", "confined_toppling"],
)
def test_blocks_that_slide_or_slump_have_answers(open_page, ask, shape, kind, title, numbers):
    query = "&".join(f"{name}={value}" for name, value in {**shape, "pgv": 0.8}.items())
    opened = open_page(f"?{query}")
    page = opened.page
    answer = ask("v1/predict", **shape, **kind, pgv=0.8)
    assert agrees(probability_shown(page), answer["probability"])
    expect(page.locator("#answer-title")).to_contain_text(title)
    expect(page.locator("#chart")).to_be_hidden()
    assert numbers in opened.text("#lines")
    remaining, top, width, height = page.eval_on_selector(
        "#curve .area",
        "a => ['x', 'y', 'width', 'height'].map((name) => Number(a.getAttribute(name)))",
    )
    points = points_of(page.get_attribute("#curve .curve", "d"))
    for px, py in [point for point in points if remaining <= point[0] <= remaining + width][10::30]:
        there = ask("v1/predict", **shape, **kind, pgv=0.05 * 60.0 ** ((px - remaining) / width))
        assert 1.0 - (py - top) / height == pytest.approx(there["probability"], abs=3e-3)
    if kind["kind"] == "sliding":
        page.fill("#displacement", "0.5")
        expect(page.locator("#answer-title")).to_contain_text("above 0.5 m")
        page.wait_for_function("() => location.search.includes('displacement=0.5')")


@pytest.mark.parametrize(
    ("typed", "read"), [("0,6", "0.6"), ("1,25", "1.25"), (",8", ".8"), ("6,e-1", "6.e-1")]
)
def test_a_decimal_comma_is_a_point(open_page, ask, typed, read):
    opened = open_page()
    page = opened.page
    page.fill("#pgv", typed)
    opened.settled()
    page.wait_for_function("(text) => location.search.includes(`pgv=${text}`)", arg=read)
    assert agrees(probability_shown(page), ask("v1/predict", p2=3, kr=0.1, pgv=read)["probability"])
    assert page.input_value("#pgv") == typed


@pytest.mark.parametrize("typed", ["1,000", "1.000,5", "1 000", "1'000", "12,500", "1,000,000"])
def test_what_may_be_thousands_is_rejected(open_page, typed):
    opened = open_page()
    page = opened.page
    page.fill("#pgv", typed)
    message = page.locator("#pgv-error")
    expect(message).to_have_text(re.compile("use a decimal point and no thousands separator"))
    assert typed in message.text_content()
    expect(page.locator("#probability")).to_have_attribute("data-state", "none")
    page.fill("#pgv", "0.6")
    opened.settled()
    assert probability_shown(page) == FIRST_ANSWER
    forgive(opened, REJECTED)


def test_each_field_explains_itself(open_page):
    opened = open_page("?p2=3&kr=0.1&pgv=0.6&tm=0.5&level=0.9")
    page = opened.page
    fields = page.locator(".given .field:has(input, select)")
    for i in range(fields.count()):
        field = fields.nth(i)
        words = field.locator(".help")
        assert words.text_content().strip(), field.inner_html()
        control = field.locator("input, select")
        assert words.get_attribute("id") in control.get_attribute("aria-describedby").split()
    words = page.locator("#pgv-help")
    shown = "getComputedStyle(document.querySelector('#pgv-help')).opacity"
    box = page.locator("#pga").bounding_box()
    assert page.evaluate(shown) == "0"
    page.locator("label[for=pgv]").hover()
    assert page.evaluate(shown) == "1"
    page.mouse.move(5, 5)
    page.focus("#pgv")
    assert page.evaluate(shown) == "1"
    assert page.locator("#pga").bounding_box() == box  # nothing moves for it
    assert words.bounding_box()["height"] < 24.0  # one line


def test_a_model_can_be_chosen(open_page, ask):
    opened = open_page()
    page = opened.page
    page.locator("#model-part summary").click()
    page.select_option("#model", "logistic-pgv")
    expect(page.locator("#lines")).to_contain_text("logistic-pgv, models.db")
    opened.settled()
    answer = ask("v1/predict", p2=3, kr=0.1, pgv=0.6, model="logistic-pgv")
    assert agrees(probability_shown(page), answer["probability"])
    offered = page.eval_on_selector_all("#model option", "all => all.map((each) => each.value)")
    assert "record-xp" not in offered
    assert "wls-pgv" in offered
    assert not [name for name in offered if name.startswith(("sliding", "slumping"))]


def test_a_link_is_text_and_never_markup(open_page):
    opened = open_page(
        "?p2=3&kr=0.1&pgv=0.6&model=%3Cimg%20src%3Dx%20onerror%3Dalert(1)%3E", settle=False
    )
    page = opened.page
    expect(page.locator("#model-error")).to_contain_text("<img src=x")
    assert page.locator("main img").count() == 0
    forgive(opened, REJECTED)


def test_a_free_standing_block_is_answered_by_its_own_models(open_page, ask):
    opened = open_page("?p2=3&kr=0.2&pgv=0.6&pga=0.5")
    page = opened.page
    backed = probability_shown(page)
    page.get_by_label("free-standing").check()
    page.fill("#restitution", "0.9")
    opened.settled()
    answer = ask("v1/predict", p2=3, kr=0.2, pgv=0.6, pga=0.5, kind="rocking", restitution=0.9)
    assert agrees(probability_shown(page), answer["probability"])
    assert probability_shown(page) != backed
    expect(page.locator("#answer-title")).to_contain_text("P(overturning)")
    expect(page.locator("#strip")).to_contain_text("overturning")
    expect(page.locator("#about")).to_contain_text("are sensitive")
    expect(page.get_by_text("It rocks about both edges")).to_be_visible()
    offered = page.locator("#model option").all_text_contents()
    assert all(name.startswith(("rocking", "the best")) for name in offered)
    page.get_by_label("backed by a slope").check()
    opened.settled()
    assert probability_shown(page) == backed
    expect(page.locator("#restitution")).to_be_hidden()


def test_a_wrong_restitution_is_said_beside_its_field(open_page):
    opened = open_page("?p2=3&kr=0.2&pgv=0.6&kind=rocking")
    opened.page.fill("#restitution", "1.5")
    expect(opened.page.locator("#restitution-error")).to_contain_text(
        "Coefficient of restitution e = 1.5"
    )
    forgive(opened, REJECTED)


def test_half_of_a_number_is_not_asked(open_page):
    opened = open_page()
    page = opened.page
    page.focus("#kr")
    page.keyboard.press("Control+a")
    for key in "0.08":
        page.keyboard.press(key)
        page.wait_for_timeout(400)
    opened.settled()
    assert not any("kr=0&" in request or "kr=0.&" in request for request in opened.requests)
    assert page.locator("#kr-error").text_content() == ""
    page.focus("#pgv")
    page.keyboard.press("Control+a")
    for key in ".6":
        page.keyboard.press(key)
        page.wait_for_timeout(400)
    opened.settled()
    assert not any("pgv=." in request and "pgv=.6" not in request for request in opened.requests)
    page.focus("#kr")
    page.keyboard.press("Control+a")
    page.keyboard.press("0")
    page.keyboard.press("Tab")  # now it is said that k_r is 0
    expect(page.locator("#kr-error")).not_to_be_empty()
    forgive(opened, REJECTED)
