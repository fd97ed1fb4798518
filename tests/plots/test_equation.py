"""The printed equation of every form is the formula that answers."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE, TOPPLING_BLOCK
from rbfrag.fragility.methods import method_named, method_names
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.fit import equation_lines, rounded

FORMS = [
    (name, term)
    for name in method_names()
    if method_named(name).block is TOPPLING_BLOCK
    for term in method_named(name).forms
]
EXPECTED = {
    "p2": 7.0, "kr": 0.11, "pgv_m_s": 0.8, "pga_g": 0.5, "tm_s": 0.6, "pgd_m": 0.3, "sa03_g": 0.9,
    "sa10_g": 0.6, "sa30_g": 0.2, "xp_m_s": 0.7,
}  # fmt: skip


def as_python(text: str) -> str:
    """Return mathtext of the equations as an expression."""
    for name, part in (
        (r"\\ln\\frac\{1 - (\w)\}\{\1\}", r"log((1-\1)/\1)"), (r"\\ln\^2 p", "log(p)**2"),
        (r"\\ln\(", "log("), (r"\\ln ([A-Za-z]+(_\{?[\w.]+\}?)?)", r"log(\1)"), (r"k'", "kp"),
        (r"\\times10\^\{(-?\d+)\}", r"e\1"), (r"x\^2", "x**2"), (r"\\sigma", "sigma"),
        (r"\\,", "*"), (r"_\{?([\w.]+)\}?", lambda match: match[1].replace(".", "")),
    ):  # fmt: skip
        text = re.sub(name, part, text)
    return text


@pytest.mark.parametrize(("method", "term"), FORMS)
def test_it_gives_the_same_eta(method: str, term: str) -> None:
    form = method_named(method).forms[term]
    random = np.random.default_rng(5)
    # numbers that are printed in full
    values = [round(float(v), 2) for v in random.uniform(0.11, 0.99, len(form.parameters))]
    values[-1] *= -1.0 if method in ("bounded", "lognormal") else 1.0
    row = ModelRow(
        name="one", term=term, method=method, domain={}, data_fingerprint="",
        coefficients=dict(zip(form.parameters, values, strict=True)),
        covariance=tuple(map(tuple, np.zeros((len(values), len(values))).tolist())),
    )  # fmt: skip
    lines = equation_lines(FragilityModel.from_row(row))
    head, *sums = [line.strip("$") for line in lines if "=" not in line or "eta" in line]
    printed = head.split(r"\eta/h = " if form.size_factor else r"\eta = ")[1] + "".join(sums)

    v = TOPPLING_BLOCK.completed(EXPECTED, TERMS[term], SINGLE)
    x, y, p, g = v["intensity_m_s"], v["y_m_s"], v["p"], STANDARD_GRAVITY_M_S2
    r = v["kr"] / v["pga_g"]
    names = {
        "log": math.log, "x": x, "y": y, "p": p, "r": r, "v": y / (2.0 * x),
        "z": p * x / (v["pga_g"] * g), "s": p * x / (v["pga_g"] * g),
        "zT": p * v["tm_s"] / (2.0 * math.pi), "kp": math.log(1.0 + v["kr"] / 0.3),
        **{
            f"Q{name}": v[sa] * period / (2.0 * math.pi * v["pga_g"])
            for name, period, sa in (
                ("03", 0.3, "sa03_g"), ("1", 1.0, "sa10_g"), ("3", 3.0, "sa30_g"),
            )
        },
        **{
            f"w{name}": math.log(v[sa] * g * period / (2.0 * math.pi) / v["pgv_m_s"])
            for name, period, sa in (("1", 1.0, "sa10_g"), ("3", 3.0, "sa30_g"))
        },
    }  # fmt: skip
    variance = [line for line in lines if r"\sigma^2 =" in line]
    if variance:
        square = variance[0].strip("$").split("= ")[1].split(r"\ \mathrm")[0]
        names["sigma"] = math.sqrt(eval(as_python(square), {}, names))
    eta, _ = form.unscaled(values, v, SINGLE)
    tolerance = 5e-3 if method == "lognormal" else 1e-12  # exp(ln sigma) is rounded
    assert eval(as_python(printed), {}, names) == pytest.approx(eta.eta, rel=tolerance)


def test_numbers_have_three_digits() -> None:
    assert [rounded(v) for v in (1.0, 0.0123, -2.5, 123.4, 0.0)] == [
        "1.00", "0.0123", "-2.50", "123", "0.00",
    ]  # fmt: skip
    assert rounded(2.512e-10) == r"2.51\times10^{-10}"
    assert rounded(45678.0) == r"4.57\times10^{4}"
    assert rounded(9.999e-4) == r"1.00\times10^{-3}"
    assert rounded(-0.5, signed=True) == " - 0.500"
