"""Numbers on the page: never more, and never else, than the number itself."""

from itertools import pairwise

import numpy as np
import pytest

from rbfrag.results import numbers
from tests.service.page.reading import agrees


@pytest.fixture
def run(open_page):
    """Call a function of one of the page's modules for each of many arguments."""
    page = open_page().page

    def call(module, name, arguments):
        return page.evaluate(
            """async ([module, name, every]) => {
              const found = await import(new URL(`js/${module}`, document.baseURI).href);
              return every.map((given) => found[name](...given));
            }""",
            [module, name, arguments],
        )

    return call


def test_percent_agrees_with_the_probability(run):
    small = np.geomspace(1e-9, 0.5, 700)
    values = [*small.tolist(), *(1.0 - small).tolist(), 0.0, 1.0, 0.1, 0.9, 0.99, 0.999, 0.9999]
    written = run("percent.js", "percent", [[p] for p in values])
    for p, text in zip(values, written, strict=True):
        plain = text.replace("\u00a0", " ")
        if p in (0.0, 1.0):
            assert plain == f"{100 * p:g} %"
        else:
            assert plain not in ("0 %", "100 %")
            assert agrees(plain, p), (p, plain)


def test_percentages_and_intervals_are_those_of_every_interface(run):
    ends = [*np.geomspace(1e-9, 1.0, 200).tolist(), 0.0, 0.0995, 0.9949, 0.99995]
    pairs = [[low, high] for low, high in pairwise(ends)]
    shown = run("percent.js", "percent", [[p] for p in ends])
    assert [text.replace("\u00a0", " ") for text in shown] == [numbers.percent(p) for p in ends]
    shown = run("percent.js", "interval", pairs)
    assert [text.replace("\u00a0", " ") for text in shown] == [
        numbers.interval(low, high) for low, high in pairs
    ]


def test_a_decimal_comma_is_read_and_nothing_else_is_changed(run):
    read = {
        **{"0,1": "0.1", " 12,5 ": "12.5", ",5": ".5", "1,5e-3": "1.5e-3", "0,125": "0.125"},
        **{"1,2500": "1.2500", "1000,125": "1000.125", "1,25": "1.25", "\u22125": "-5"},
    }
    either = ["1,000", "12,500", "-999,125", "1,000e-3", "1,000,000", "1.000,5", "1 000", "0.1,2"]
    alike = [*either, "1e-3", "0.1", "1.000", "abc", "1,a"]
    assert run("numbers.js", "plain", [[text] for text in read]) == list(read.values())
    assert run("numbers.js", "plain", [[text] for text in alike]) == alike


def test_readable_numbers_keep_their_value(run):
    values = [*np.geomspace(1e-8, 1e9, 300).tolist(), 0.0, -0.25, 1234.5]
    written = run("numbers.js", "readable", [[v] for v in values])
    for value, text in zip(values, written, strict=True):
        assert float(text.replace("\u2212", "-")) == pytest.approx(value, rel=5.1e-3)


def test_a_spectrum_survives_a_link(run):
    spectrum = {
        "name": "Größe 記録 <b>&",
        "pgv_m_s": 0.25,
        "p2": [0.1, 1.0, 30.0],
        "forward": [0.3, 0.2, 0.1],
        "reverse": [0.31, 0.21, 0.0],
        "warnings": ["a doubt; and another"],
        "texts": [["X(p) of the record", "forward polarity"]],
        "verdict": {"p2": 3.0, "kr": 0.1, "texts": [["The block topples", "certified"]]},
    }
    [fragment] = run("record.js", "toFragment", [[spectrum]])
    assert all(item.isascii() and (item.isalnum() or item in "=-_") for item in fragment)
    assert run("record.js", "fromFragment", [[fragment]]) == [spectrum]
