"""The printed equation of every form is the formula that answers."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.completion import MOMENTS
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE, TOPPLING_BLOCK
from rbfrag.fragility.methods import method_named, method_names
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.equation import equation_lines, rounded
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, period_of, spectral_name

FORMS = [
    (name, term)
    for name in method_names()
    if method_named(name).block is TOPPLING_BLOCK
    for term in method_named(name).forms
]
EXPECTED = {
    "p2": 7.0, "kr": 0.11, "pgv_m_s": 0.8, "pga_g": 0.5, "tm_s": 0.6, "pgd_m": 0.3, "xp_m_s": 0.7,
    "sa(0.3)": 0.9, "sa(1)": 0.6, "sa(3)": 0.2, "magnitude": 6.1,
}  # fmt: skip


def as_python(text: str) -> str:
    """Return mathtext of the equations as an expression."""
    for name, part in (
        (r"\\mathrm\{(\w+)\}", r"\1"), (r"\\hat ", "hat"), (r"\\(zeta|sigma)", r"\1"),
        (r"\\sqrt\{(.*)\}", r"sqrt(\1)"), (r"\\exp\(", "exp("), (r"p\^\{(.*)\}", r"p**\1"),
        (r"\\min\\\{(.*)\\\}", r"min(\1)"), (r"\\min", "min"), ("p ([XA])", r"p*\1"),
        (r"\\ln\^2 p", "log(p)**2"), (r"\\ln([(\[])", r"log\1"),
        (r"\\ln ([A-Za-z]+(_\{?[\w.]+\}?)?)", r"log(\1)"), (r"\\times10\^\{(-?\d+)\}", r"e\1"),
        (r"\^2", "**2"), (r"\\,", "*"), (r"_\{?([\w.]+)\}?", r"\1"), (r"\\ ", " "),
        (r"\[", "("), (r"\]", ")"),
    ):  # fmt: skip
        text = re.sub(name, part, text)
    return text


@pytest.mark.parametrize(("method", "term"), FORMS)
def test_it_gives_the_same_eta(method: str, term: str) -> None:
    form = method_named(method).forms[term]
    random = np.random.default_rng(5)
    # numbers that are printed in full
    values = [round(float(v), 2) for v in random.uniform(0.11, 0.99, len(form.parameters))]
    values[-1] *= -1.0 if method == "lognormal" else 1.0
    row = ModelRow(
        name="one", term=term, method=method, domain={}, data_fingerprint="",
        coefficients=dict(zip(form.parameters, values, strict=True)),
        covariance=tuple(map(tuple, np.zeros((len(values), len(values))).tolist())),
    )  # fmt: skip
    lines = equation_lines(FragilityModel.from_row(row))
    head, *sums = [line.strip("$") for line in lines if "=" not in line or "eta" in line]
    printed = head.split(r"\eta/h = " if form.size_factor else r"\eta = ")[1] + "".join(sums)

    velocity = 0.55
    v = TOPPLING_BLOCK.completed(
        EXPECTED, TERMS[term], SINGLE, lambda _, __: {"velocity_m_s": velocity}
    )
    x, y, p, g, pga = v["intensity_m_s"], v["y_m_s"], v["p"], STANDARD_GRAVITY_M_S2, v["pga_g"]
    names = {
        "log": math.log, "x": x, "y": y, "p": p, "g": g, "r": v["kr"] / pga, "kr": v["kr"],
        "v": y / (2.0 * v["pgv_m_s"]), "z": p * v["pgv_m_s"] / (pga * g), "s": p * x / (pga * g),
        "X": velocity, "PGV": v["pgv_m_s"], "PGA": pga,
    }  # fmt: skip
    variance = [line for line in lines if r"\sigma^2 =" in line]
    if variance:
        square = variance[0].strip("$").split("= ")[1].split(r"\ \mathrm")[0]
        names["sigma"] = math.sqrt(eval(as_python(square), {}, names))
    eta, _ = form.unscaled(values, v, SINGLE)
    tolerance = 5e-3 if method == "lognormal" else 1e-12  # exp(ln sigma) is rounded
    assert eval(as_python(printed), {}, names) == pytest.approx(eta.eta, rel=tolerance)


@pytest.mark.parametrize(
    ("name", "used"),
    [
        ("toppling-pgv_pga", ("pgv_m_s", "pga_g")),
        ("toppling-pgv_pga", ("pgv_m_s", "pga_g", "tm_s", "sa(0.3)", "sa(1)", "sa(3)")),
        ("toppling-pga", ("pga_g", "tm_s")),
        ("toppling-sa", ("sa(1)",)),
        ("rocking-pga", ("pga_g", "pgv_m_s")),
        ("rocking-pga", ("pga_g", "magnitude")),
        ("rocking-sa", ("sa(0.3)", "sa(1)", "sa(3)")),
    ],
)
def test_a_completed_velocity_is_its_regression(name: str, used: tuple[str, ...]) -> None:
    model = find_model(name, used)
    p2, kr = EXPECTED["p2"], EXPECTED["kr"]
    inputs = {key: EXPECTED[key] for key in ("p2", "kr", *used)}
    v = model.completed(inputs, SINGLE)
    velocity, p, g = model.form.velocity, v["p"], STANDARD_GRAVITY_M_S2
    ordinates = {0.03: EXPECTED["pga_g"]} if "pga_g" in used else {}
    ordinates |= {period: EXPECTED[key] for key in used if (period := period_of(key))}
    pgv, pga = EXPECTED["pgv_m_s"], EXPECTED["pga_g"]
    names = {
        "log": math.log, "exp": math.exp, "sqrt": math.sqrt, "min": min, "p": p, "y": v["y_m_s"],
        "g": g, "PGV": pgv, "PGA": pga, "r": kr / pga, "v": v["y_m_s"] / (2.0 * pgv),
        "z": p * pgv / (pga * g), "Tm": EXPECTED["tm_s"], "M": EXPECTED["magnitude"],
        "s": v.get("speed_loss"),
    }  # fmt: skip
    if ordinates:
        of_ordinates = math.exp(velocity.ln_velocity(ordinates, p, SINGLE))
        names |= {"hatX": of_ordinates, "hatA": of_ordinates}

    def value_of(expression: str) -> float:
        return float(eval(as_python(expression), {}, names))

    lines = [line.strip("$") for line in equation_lines(model, p2)]
    zeta = [line for line in lines if line.startswith(r"\zeta")]
    assert bool(zeta) == ("pgv_m_s" in used)
    if zeta:
        names["zeta"] = value_of(zeta[0].split("= ")[1])
    (regression,) = (line for line in lines if r"\sigma = " in line)
    side, right, sigma, _ = re.split(
        r",\\ \\sigma = |\\ \\mathrm\{at\}| = ", regression, maxsplit=3
    )
    symbol = "A" if "A" in side.replace("PGA", "") else "X"
    # what the logarithm on the left is taken of is in proportion to the velocity
    names[symbol] = 1.0
    names[symbol] = math.exp(value_of(right) - value_of(side))
    assert names[symbol] == pytest.approx(v["velocity_m_s"], rel=0.02)
    assert float(sigma) == pytest.approx(v[MOMENTS].sigma, rel=5e-3)
    names["sigma"] = float(sigma)
    (definitions,) = (line for line in lines if line.startswith("D ="))
    for definition in reversed(definitions.split(r",\ ")[:2]):
        key, expression = definition.split(" = ")
        names[key] = value_of(expression)
    head, *more = [line for line in lines if "eta/h" in line or line[:2] in (" +", " -")]
    eta = value_of(head.split(r"\eta/h = ")[1] + "".join(more))
    predictor, factor = model.linear_predictor(v, SINGLE)
    assert eta * names["h"] / names["D"] == pytest.approx(predictor.eta * factor, abs=0.03)


def test_an_exact_velocity_has_no_regression() -> None:
    model = find_model("toppling-sa", [*map(spectral_name, SPECTRUM_PERIODS_S)])
    lines = "\n".join(equation_lines(model))
    assert "sigma" not in lines
    assert "$X$ = spectral velocity" in lines


def test_numbers_have_three_digits() -> None:
    assert [rounded(v) for v in (1.0, 0.0123, -2.5, 123.4, 0.0)] == [
        "1.00", "0.0123", "-2.50", "123", "0.00",
    ]  # fmt: skip
    assert rounded(2.512e-10) == r"2.51\times10^{-10}"
    assert rounded(45678.0) == r"4.57\times10^{4}"
    assert rounded(9.999e-4) == r"1.00\times10^{-3}"
    assert rounded(-0.5, signed=True) == " - 0.500"
