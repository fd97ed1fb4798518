"""A record dropped on the page, or chosen by keyboard, gives its toppling spectrum."""

import math
import re
import time
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import numpy as np
import pytest
from playwright.sync_api import expect

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import export_motions
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from tests.service.page.reading import points_of
from tests.service.page.test_page_answers import forgive

STANDARD_GRAVITY = 9.80665

# Handing a file over as a person's mouse does it: over the page, then let go.
DROP = """([name, text]) => {
  const data = new DataTransfer();
  data.items.add(new File([text], name));
  for (const type of ['dragenter', 'dragover', 'drop']) {
    document.querySelector('#chart').dispatchEvent(
      new DragEvent(type, { dataTransfer: data, bubbles: true, cancelable: true }));
  }
}"""


def pulse(amplitude_g=0.4, duration_s=1.0):
    """One sine pulse as a text file."""
    times = np.linspace(0.0, duration_s, 201)
    rows = [f"{t:.6g},{amplitude_g * math.sin(2 * math.pi * t / duration_s):.8g}" for t in times]
    return "\n".join(["# Time (s),Acceleration (g)", *rows, ""])


@pytest.fixture(scope="module", autouse=True)
def compiled(service):
    """The processes that work on records compile their kernels before they take any."""
    inputs = urllib.request.Request(
        f"{service}v1/spectrum", pulse().encode(), {"Content-Type": "text/plain"}
    )
    for _ in range(10):
        try:
            with urllib.request.urlopen(inputs, timeout=300):
                return
        except urllib.error.HTTPError as busy:
            if busy.code != 503:
                raise
            time.sleep(5)
    pytest.fail("the service gives no spectrum")


def drop(page, name, text):
    page.evaluate(DROP, [name, text])


def curve(page, kind):
    """p² and X of a drawn spectrum."""
    frame = page.eval_on_selector(
        "#spectrum .area",
        "a => ['x', 'y', 'width', 'height'].map((name) => Number(a.getAttribute(name)))",
    )
    remaining, _, width, _ = frame
    texts = page.locator("#spectrum .axis").nth(2).locator(".tick")
    ticks = [
        (
            float(texts.nth(i).text_content()),
            points_of(texts.nth(i).get_attribute("transform"))[0][1],
        )
        for i in range(texts.count())
    ]
    (v1, y1), (v2, y2) = ticks[0], ticks[-1]
    scale = math.log(v2 / v1) / (y2 - y1)
    path = points_of(page.get_attribute(f"#spectrum g[clip-path] .spectrum.{kind}", "d"))
    return [
        (0.1 * 300.0 ** ((x - remaining) / width), v1 * math.exp((y - y1) * scale)) for x, y in path
    ]


def test_a_dropped_record_shows_its_spectrum(open_page, tmp_path):
    opened = open_page()
    page = opened.page
    drop(page, "pulse.csv", pulse())
    expect(page.locator("#spectrum-part")).to_be_visible()
    (tmp_path / "pulse.csv").write_text(pulse(), encoding="utf-8")
    from rbfrag import read_motions

    [motion] = read_motions(tmp_path / "pulse.csv")
    for polarity in ("forward", "reverse"):
        drawn = curve(page, polarity)
        assert len(drawn) > 40
        for p2, x in drawn[::5]:
            assert x == pytest.approx(toppling_spectrum(motion, p2, polarity), rel=0.01)
    expect(page.locator("#record-name")).to_have_text("pulse.csv")
    expect(page.locator("#spectrum-words")).to_contain_text(
        f"pulse.csv, PGV {motion.pgv_m_s:.2f} m/s, forward polarity"
    )
    expect(page.locator("#spectrum .dot")).to_have_count(1)


def test_the_words_compare_the_present_block_with_the_record(open_page, tmp_path):
    opened = open_page("?p2=3&kr=0.6&pgv=0.6")
    page = opened.page
    drop(page, "pulse.csv", pulse())
    words = page.locator("#by-record-texts")
    expect(words).to_contain_text("The block (kr = 0.600) does not topple")
    page.fill("#kr", "0.01")
    expect(words).to_contain_text("The block (kr = 0.0100) topples")
    page.fill("#kr", "0.7")
    page.fill("#p2", "7")
    expect(words).to_contain_text("at p² = 7")
    (tmp_path / "pulse.csv").write_text(pulse(), encoding="utf-8")
    from rbfrag import read_motions

    [motion] = read_motions(tmp_path / "pulse.csv")
    x = toppling_spectrum(motion, 7.0, "forward")
    expect(words).to_contain_text(f"kr = {x * math.sqrt(7.0) / STANDARD_GRAVITY:.3f}")


def test_its_pgv_becomes_the_shaking(open_page):
    opened = open_page()
    page = opened.page
    drop(page, "pulse.csv", pulse())
    page.click("#take-pgv")
    opened.settled()
    # the velocity gained over half a sine: 2 a g/ω
    assert float(page.input_value("#pgv")) == pytest.approx(
        0.4 * STANDARD_GRAVITY / math.pi, rel=5e-3
    )


def test_a_record_is_chosen_by_keyboard(open_page, tmp_path):
    opened = open_page()
    page = opened.page
    (tmp_path / "pulse.csv").write_text(pulse(), encoding="utf-8")
    choosers = []
    # before the key, so that the browser has been told
    page.on("filechooser", lambda chooser: choosers.append(chooser))
    page.focus("#record-file")
    page.keyboard.press("Enter")
    for _ in range(200):
        if choosers:
            break
        page.wait_for_timeout(100)
    [chooser] = choosers
    chooser.set_files(tmp_path / "pulse.csv")
    expect(page.locator("#spectrum-part")).to_be_visible()
    page.focus("#drop-record")
    page.keyboard.press("Enter")
    expect(page.locator("#spectrum-part")).to_be_hidden()


def test_a_file_that_is_no_record_is_rejected_in_words(open_page):
    opened = open_page()
    page = opened.page
    drop(page, "shopping.txt", "bread\nbutter\n")
    expect(page.locator("#record-error")).to_contain_text("shopping.txt")
    expect(page.locator("#spectrum-part")).to_be_hidden()
    forgive(opened, "Failed to load resource")


def test_a_unit_that_the_file_leaves_open_is_asked_for(open_page):
    opened = open_page()
    page = opened.page
    bare = "\n".join(f"{i / 100:.2f},{100 * math.sin(i / 16):.4f}" for i in range(200)) + "\n"
    drop(page, "bare.csv", bare)
    expect(page.locator("#units-error, #record-error").filter(has_text="unit")).to_have_count(1)
    page.select_option("#units", "cm/s2")
    expect(page.locator("#spectrum-part")).to_be_visible()
    expect(page.locator("#units-error")).to_have_text("")
    forgive(opened, "Failed to load resource")


def test_half_of_an_interval_is_not_asked(open_page):
    opened = open_page()
    page = opened.page
    column = "\n".join(f"{0.3 * math.sin(i / 16):.6f}" for i in range(200)) + "\n"
    drop(page, "column.txt", column)
    page.select_option("#units", "g")
    expect(page.locator("#dt-error")).to_contain_text("dt")
    page.focus("#dt")
    for key in "0.01":
        page.keyboard.press(key)
        page.wait_for_timeout(600)
    expect(page.locator("#spectrum-part")).to_be_visible()
    expect(page.locator("#dt-error")).to_have_text("")
    halves = ("dt=0&", "dt=0.&", "dt=0.0&")
    assert not [request for request in opened.requests if any(half in request for half in halves)]
    forgive(opened, "Failed to load resource")


def test_the_traces_of_a_file_are_listed(open_page, tmp_path):
    motions = [
        GroundMotion(scale * np.sin(np.linspace(0.0, 6.3, 120)), 0.01, component=name)
        for name, scale in (("N", 0.2), ("E", 0.4))
    ]
    export_motions(motions, tmp_path / "two.csv")
    opened = open_page()
    page = opened.page
    drop(page, "two.csv", (tmp_path / "two.csv").read_text(encoding="utf-8"))
    traces = page.locator("#trace option")
    expect(traces).to_have_text(["1: N", "2: E"])
    expect(page.locator("#record-name")).to_have_text("two.csv, trace 1: N")
    for i, motion in enumerate(motions):
        page.select_option("#trace", str(i))
        expect(page.locator("#spectrum-words")).to_contain_text(f"PGV {motion.pgv_m_s:#.3g} m/s")
    expect(page.locator("#record-name")).to_have_text("two.csv, trace 2: E")
    drop(page, "pulse.csv", pulse())
    expect(page.locator("#record-name")).to_have_text("pulse.csv")
    expect(page.locator("#trace")).to_be_hidden()
    forgive(opened, "Failed to load resource")


def test_there_is_a_record_to_try_and_it_says_what_it_is(open_page):
    opened = open_page("")
    page = opened.page
    page.click("#example-record")
    expect(page.locator("#record-name")).to_have_text(
        "synthetic pulse, one sine of 0.35 g and 0.8 s"
    )
    # the velocity gained over half a sine: a g T/π
    pgv = 0.35 * STANDARD_GRAVITY * 0.8 / math.pi
    expect(page.locator("#spectrum-words")).to_contain_text(f"PGV {pgv:#.3g} m/s")


def test_the_link_on_paper_holds_the_record_too(open_page):
    opened = open_page()
    page = opened.page
    drop(page, "pulse.csv", pulse())
    expect(page.locator("#spectrum-part")).to_be_visible()
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    expect(page.locator("#spectrum svg")).to_be_visible()
    link = page.text_content("#paper-link")
    assert page.get_attribute("#paper-link", "href") == link
    parts = urlsplit(link)
    again = open_page(f"?{parts.query}#{parts.fragment}")
    assert again.text("#spectrum-words") == opened.text("#spectrum-words")
    assert again.text("#probability") == opened.text("#probability")


def test_a_link_holds_the_spectrum(open_page):
    opened = open_page("?p2=3&kr=0.02&pgv=0.6")
    page = opened.page
    drop(page, "pulse.csv", pulse())
    expect(page.locator("#spectrum-part")).to_be_visible()
    expect(page.locator("#by-record-texts")).to_contain_text("certified")
    page.wait_for_timeout(400)  # the address follows after a pause
    parts = urlsplit(page.url)
    again = open_page(f"?{parts.query}#{parts.fragment}")
    expect(again.page.locator("#spectrum-part")).to_be_visible()
    assert not [url for url in again.requests if "v1/spectrum" in url]
    for selector in ("#record-name", "#spectrum-words", "#by-record-texts"):
        assert again.text(selector) == opened.text(selector)
    for (p2, x), (again_p2, again_x) in zip(
        curve(page, "forward"), curve(again.page, "forward"), strict=True
    ):
        assert (again_p2, again_x) == pytest.approx((p2, x), rel=1e-3)


@pytest.mark.parametrize("damaged", ["spectrum=", "spectrum=AAAA", "spectrum=%00", "other=1"])
def test_a_damaged_link_shows_no_record(open_page, damaged):
    opened = open_page(f"?p2=3&kr=0.1&pgv=0.6#{damaged}")
    expect(opened.page.locator("#spectrum-part")).to_be_hidden()


def test_a_recorded_accelerogram(open_page, records_dir):
    path = records_dir / "slammer_csv" / "Coyote_Lake_1979_G02-050.csv"
    opened = open_page("?p2=3&kr=0.01&pgv=0.6")
    page = opened.page
    page.set_input_files("#record-file", path)
    expect(page.locator("#record-name")).to_have_text("Coyote_Lake_1979_G02-050.csv")
    expect(page.locator("#spectrum-words")).to_contain_text("PGV 0.109 m/s")
    expect(page.locator("#by-record-texts")).to_contain_text("The block (kr = 0.0100) topples")


def test_a_record_decides_the_headline(open_page, tmp_path):
    opened = open_page("?p2=3&kr=0.6&pgv=0.6")
    page = opened.page
    expect(page.locator("#by-record")).to_be_hidden()
    # not the same backwards: the two polarities topple different blocks
    text = pulse(0.4, 1.0).splitlines()
    drop(page, "pulse.csv", "\n".join(text[:150]) + "\n")
    expect(page.locator("#by-record-name")).to_have_text("pulse.csv")
    answers = page.locator("#by-record-texts strong")
    expect(answers).to_have_text([re.compile("does not topple")] * 2)
    (tmp_path / "pulse.csv").write_text("\n".join(text[:150]) + "\n", encoding="utf-8")
    import rbfrag

    [motion] = rbfrag.read_motions(tmp_path / "pulse.csv")
    values = {
        item: rbfrag.critical(motion, p2=3.0, polarity=item).kr for item in ("forward", "reverse")
    }
    less, more = sorted(values, key=values.get)
    assert values[less] < 0.95 * values[more]
    for kr in (0.99 * values[less], 1.01 * values[less], 1.01 * values[more]):
        page.fill("#kr", f"{kr:.5f}")
        expect(answers).to_have_text(
            [
                re.compile(
                    rf"{'topples' if kr < values[item] else 'does not topple'}: the critical"
                )
                for item in ("forward", "reverse")
            ]
        )
        expect(page.locator("#probability")).to_contain_text("%")
    page.click("#drop-record")
    expect(page.locator("#by-record")).to_be_hidden()


def test_the_probability_is_that_of_the_record(open_page):
    opened = open_page("?p2=3&kr=0.1&pgv=0.1")
    page = opened.page
    drop(page, "pulse.csv", pulse())
    expect(page.locator("#spectrum-part")).to_be_visible()
    pgv = 0.4 * STANDARD_GRAVITY / math.pi
    page.wait_for_function("() => Number(document.querySelector('#pgv').value) > 1")
    assert float(page.input_value("#pgv")) == pytest.approx(pgv, rel=5e-3)
    # what is typed afterwards stays, also when another block is asked about
    page.fill("#pgv", "0.2")
    page.fill("#p2", "5")
    expect(page.locator("#by-record-texts")).to_contain_text("p² = 5")
    assert page.input_value("#pgv") == "0.2"
