"""The design chart says what the service says, and its point can be moved in every way."""

import pytest
from playwright.sync_api import expect

from tests.service.page.reading import agrees, plane_of, points_of, probability_shown

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


PIXELS = 2.0
"""How near a line is to where the service has its probability."""


def field(page, name):
    return float(page.input_value(f"#{name}"))


def on_screen(page, place):
    page.locator("#chart").scroll_into_view_if_needed()
    box = page.locator("#chart svg").bounding_box()
    return box["x"] + place[0], box["y"] + place[1]


def kr_at(y_m_s, p2=3.0):
    """k_r of a block of some toppling velocity y = k_r g/p."""
    return y_m_s * p2**0.5 / 9.80665


@pytest.mark.parametrize("rest", [{}, {"pga": 0.5, "tm": 0.5}], ids=["pgv", "pgv_pga_tm"])
def test_on_each_line_the_service_gives_the_lines_probability(open_page, ask, rest):
    question = {"p2": 3, "kr": 0.1, "pgv": 0.6, **rest}
    page = open_page("?" + "&".join(f"{name}={value}" for name, value in question.items())).page
    model = ask("v1/predict", **question)["model"]
    plane = plane_of(page)
    paths = page.eval_on_selector_all(
        "#chart .line", "all => all.map((path) => path.getAttribute('d'))"
    )
    levels = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99)
    inputs = 0
    for level, path in zip(levels, paths, strict=True):
        points = [
            (px, py)
            for px, py in points_of(path)
            if 0.06 < plane.value(px, py)[0] < 2.5 and 0.03 < plane.value(px, py)[1] < 2.5
        ]
        for px, py in points[:: max(len(points) // 4, 1)]:
            above, below = (
                ask("v1/predict", p2=3, kr=kr_at(y), pgv=x, model=model, **rest)["probability"]
                for x, y in (plane.value(px, py - PIXELS), plane.value(px, py + PIXELS))
            )
            assert above <= level <= below
            inputs += 1
    assert inputs > 20


def test_what_is_hatched_begins_where_the_fitted_range_ends(open_page, ask):
    page = open_page().page
    plane = plane_of(page)
    remaining, top, width, height = plane.box
    edge = [
        plane.value(px, py)
        for px, py in points_of(page.get_attribute("#chart .outside", "d"))
        if remaining + 2 < px < remaining + width - 2 and top + 2 < py < top + height - 2
    ]
    assert len(edge) > 5
    # the edge is drawn between the nodes of a grid, whose neighbours differ by 7.6 %
    for pgv, y in edge[:: len(edge) // 5]:
        around = {
            ask("v1/predict", p2=3, kr=kr_at(b * y), pgv=a * pgv)["in_domain"]
            for a in (1 / 1.1, 1.0, 1.1)
            for b in (1 / 1.1, 1.0, 1.1)
        }
        assert around == {True, False}


def test_the_point_is_dragged(open_page, ask):
    opened = open_page()
    page = opened.page
    plane = plane_of(page)
    start = plane.place(0.6, 0.566)
    goal = plane.place(1.2, 0.3)
    page.mouse.move(*on_screen(page, start))
    page.mouse.down()
    page.mouse.move(*on_screen(page, goal), steps=25)
    page.mouse.up()
    assert field(page, "pgv") == pytest.approx(1.2, rel=0.02)
    assert field(page, "kr") == pytest.approx(kr_at(0.3), rel=0.02)
    expect(page.locator("#lines")).to_contain_text(f"PGV {field(page, 'pgv'):.4g} m/s")
    opened.settled()
    answer = ask("v1/predict", p2=3, kr=page.input_value("#kr"), pgv=page.input_value("#pgv"))
    assert agrees(probability_shown(page), answer["probability"])
    shown = page.get_attribute(".point", "transform")
    [(px, py)] = points_of(shown)
    assert plane.value(px, py) == pytest.approx((field(page, "pgv"), answer["y_m_s"]), rel=1e-3)


def test_a_dragged_point_stays_on_the_chart(open_page):
    opened = open_page()
    page = opened.page
    page.mouse.move(*on_screen(page, plane_of(page).place(0.6, 0.566)))
    page.mouse.down()
    page.mouse.move(1360, 5, steps=10)
    page.mouse.up()
    assert field(page, "pgv") == pytest.approx(3.0)
    assert field(page, "kr") == pytest.approx(kr_at(3.0), rel=0.01)


def test_a_click_moves_the_point(open_page):
    opened = open_page()
    page = opened.page
    page.mouse.click(*on_screen(page, plane_of(page).place(0.2, 0.1)))
    opened.settled()
    assert field(page, "pgv") == pytest.approx(0.2, rel=0.02)
    assert field(page, "kr") == pytest.approx(kr_at(0.1), rel=0.02)


def test_a_finger_moves_the_point(open_page):
    opened = open_page(**PHONE)
    page = opened.page
    plane = plane_of(page)
    touch = page.context.new_cdp_session(page)

    def send(kind, positions):
        points = [{"x": x, "y": y} for x, y in positions]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    start, goal = on_screen(page, plane.place(0.6, 0.566)), on_screen(page, plane.place(1.0, 0.3))
    before = page.locator("#chart").bounding_box()
    send("touchStart", [start])
    for i in range(1, 11):
        send("touchMove", [tuple(a + (b - a) * i / 10 for a, b in zip(start, goal, strict=True))])
    send("touchEnd", [])
    opened.settled()
    assert page.locator("#chart").bounding_box() == pytest.approx(before, abs=1.0)
    assert field(page, "pgv") == pytest.approx(1.0, rel=0.06)
    assert field(page, "kr") == pytest.approx(kr_at(0.3), rel=0.06)


def test_a_block_of_a_shape_moves_along_the_shaking_only(open_page):
    opened = open_page("?alpha1=-15&alpha3=24&r3=2.5&beta=18&phi=38&pgv=0.6")
    page = opened.page
    block = page.locator("#lines dd").nth(1)
    before = block.text_content()
    page.focus(".point")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowRight")
    opened.settled()
    assert field(page, "pgv") == pytest.approx(0.612)
    assert block.text_content() == before


def test_another_measure_runs_across_where_pgv_is_not_known(open_page, ask):
    opened = open_page("?p2=3&kr=0.05&pga=0.4&tm=0.5")
    page = opened.page
    expect(page.locator("#chart .axis .title").first).to_have_text(
        "peak ground acceleration, PGA [g]"
    )
    page.focus(".point")
    page.keyboard.press("Shift+ArrowRight")
    opened.settled()
    assert field(page, "pga") == pytest.approx(0.44)
    answer = ask("v1/predict", p2=3, kr=0.05, pga=0.44, tm=0.5)
    assert agrees(probability_shown(page), answer["probability"])


def test_the_curve_is_the_services(open_page, ask):
    page = open_page().page
    path = page.get_attribute("#curve .curve", "d")
    box = page.eval_on_selector(
        "#curve .area",
        "a => ['x', 'y', 'width', 'height'].map((name) => Number(a.getAttribute(name)))",
    )
    remaining, top, width, height = box
    points = [p for p in points_of(path) if remaining <= p[0] <= remaining + width]
    for px, py in points[::12]:
        pgv = 0.05 * 60.0 ** ((px - remaining) / width)
        shown = 1.0 - (py - top) / height
        answer = ask("v1/predict", p2=3, kr=0.1, pgv=pgv)
        assert shown == pytest.approx(answer["probability"], abs=2e-3)


def test_both_bands_of_the_curve_are_the_services(open_page, ask):
    page = open_page("?p2=3&kr=0.1&pgv=0.6&sites=50").page
    box = page.eval_on_selector(
        "#curve .area",
        "a => ['x', 'y', 'width', 'height'].map((name) => Number(a.getAttribute(name)))",
    )
    remaining, top, width, height = box
    for kind, ends, apart in (
        ("confidence", ("ci_low", "ci_high"), 3e-3),
        ("one-event", ("event_low", "event_high"), 8e-3),  # a block of 200 more or less
    ):
        outline = points_of(page.get_attribute(f"#curve .{kind}", "d"))
        for px in sorted({p[0] for p in outline if remaining <= p[0] <= remaining + width})[5::25]:
            edges = sorted(1.0 - (py - top) / height for x, py in outline if x == px)
            pgv = 0.05 * 60.0 ** ((px - remaining) / width)
            answer = ask("v1/predict", p2=3, kr=0.1, pgv=pgv, sites=50)
            command = [answer[name] for name in ends]
            assert [edges[0], edges[-1]] == pytest.approx(command, abs=apart)


def ticks(page, axis):
    """Numbers written along an axis of the design chart, the first below it."""
    return page.locator("#chart .axis").nth(axis).locator(".tick").all_text_contents()


def test_the_ranges_follow_the_inputs_back(open_page):
    opened = open_page("")
    page = opened.page
    usual = [ticks(page, axis) for axis in range(3)]
    for name, mistaken, meant in (("pgv", "600", "0.6"), ("width", "50", "0.5")):
        page.fill(f"#{name}", mistaken)
        opened.settled()
        assert [ticks(page, axis) for axis in range(3)] != usual
        page.fill(f"#{name}", meant)
        opened.settled()
        assert [ticks(page, axis) for axis in range(3)] == usual


def test_a_point_that_is_moved_finds_the_ranges_where_they_were(open_page):
    opened = open_page("?p2=3&kr=0.1&pgv=20")
    page = opened.page
    wide = ticks(page, 0)
    assert "20" in wide
    page.focus(".point")
    for _ in range(25):
        page.keyboard.press("Shift+ArrowLeft")
    opened.settled()
    assert field(page, "pgv") < 3.0
    assert ticks(page, 0) == wide
    page.fill("#pgv", "1")
    opened.settled()
    assert "20" not in ticks(page, 0)


OVERLAPS = """(id) => {
  const all = [...document.querySelectorAll(`#${id} text`)].filter((each) =>
    each.checkVisibility() && each.textContent.trim() && !each.closest('[display=none]'));
  const boxes = all.map((each) => [each.textContent, each.getBoundingClientRect()]);
  return boxes.flatMap(([a, p], i) => boxes.slice(i + 1)
    .filter(([, q]) => p.left < q.right && q.left < p.right
      && p.top + 3 < q.bottom && q.top + 3 < p.bottom)
    .map(([b]) => `${a} over ${b}`));
}"""


@pytest.mark.parametrize(
    "query",
    [
        "",
        "?p2=3&kr=0.1&pgv=0.6",
        "?p2=3&kr=0.1&pgv=2.9",
        "?p2=3&kr=0.02&pgv=0.3&kind=rocking",
        "?p2=20&kr=0.3&pga=0.5&sa=1=0.4",
    ],
)
def test_no_label_lies_over_another(open_page, query):
    opened = open_page(query)
    page = opened.page
    for width in (390, 800, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(100)
        for figure in ("chart", "curve"):
            assert page.evaluate(OVERLAPS, figure) == [], width
    label = page.locator(".point text")
    # "P < 0.01 %" in a sentence, "<0.01 %" on a label
    shown = probability_shown(page).replace("< ", "<")
    assert label.text_content().replace("\u00a0", " ") == shown
    dot, text = page.locator(".point .dot").bounding_box(), label.bounding_box()
    assert abs(dot["y"] + dot["height"] / 2 - text["y"] - text["height"] / 2) < 4.0  # beside
    assert text["x"] > dot["x"] + dot["width"] or text["x"] + text["width"] < dot["x"]
