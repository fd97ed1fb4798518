"""Spectral accelerations at any oscillator period: names, forms of input, and what is rejected."""

import numpy as np
import pandas as pd
import pytest

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError, UnknownFieldError
from rbfrag.exchange.table_answers import predict_table
from rbfrag.fragility.measures import (
    ABOUT_SCATTER,
    AMPLIFIED,
    CREDIBLE,
    MEASURES,
    SCATTERED,
    SIGMAS,
)
from rbfrag.question.table import field_of
from rbfrag.vocabulary import quantities
from rbfrag.vocabulary.spectral import (
    input_of,
    period_of,
    spectral_inputs,
    spectral_name,
    spectral_names,
)

BLOCK = {"p2": 3.0, "kr": 0.1}
SPECTRUM = {0.3: 0.9, 1.0: 0.5, 3.0: 0.15}


def answer(**question):
    return rbfrag.predict(**BLOCK, db=REFERENCE, **question)


@pytest.mark.parametrize(
    ("name", "period"),
    [
        ("sa(0.5)", 0.5), ("sa(1)", 1.0), ("sa(0.01)", 0.01), ("sa(10)", 10.0), ("sa(1.0)", None),
        ("sa(0.009)", None), ("sa(10.1)", None), ("sa(nan)", None), ("sa(0.5)_sigma", None),
        ("sa()", None), ("sa03_g", None), ("pga_g", None),
    ],
)  # fmt: skip
def test_a_name_has_one_period(name, period):
    assert period_of(name) == period
    assert period is None or spectral_name(period) == name


def test_the_vocabulary_has_every_period():
    about = quantities.QUANTITIES["sa(0.5)"]
    assert (about.label, about.symbol) == ("Spectral acceleration at 0.5 s", "SA(0.5 s)")
    assert (about.unit, about.measure.imt, about.measure.power) == ("g", "SA(0.5)", 1)
    assert CREDIBLE["sa(0.5)"][1] == 10.0
    assert CREDIBLE["sa(3)"][1] == 5.0
    for names in (quantities.QUANTITIES, quantities.INPUTS, quantities.MEASURES, MEASURES,
                  quantities.INTENSITY, quantities.SHAKING, SIGMAS, AMPLIFIED):  # fmt: skip
        assert "sa(0.25)" in names
        assert "sa(25)" not in names
        assert "sa(0.25)" not in [*names]
    assert (SIGMAS["sa(0.25)"], SCATTERED["sa(0.25)_sigma"]) == ("sa(0.25)_sigma", "sa(0.25)")
    assert "sa(0.25)_sigma" not in quantities.INTENSITY
    assert MEASURES.issuperset(["pgv_m_s", "sa(0.25)", "sa(0.25)_sigma"])
    assert not ABOUT_SCATTER.isdisjoint(["sa(0.25)_sigma"])
    assert ABOUT_SCATTER.intersection(["sa(2)", "sa(2)_sigma"]) == {"sa(2)_sigma"}
    assert quantities.QUANTITIES.get("sa(25)") is None
    with pytest.raises(KeyError):
        quantities.QUANTITIES["sa(25)"]
    assert [input_of(n) for n in ("sa(2)", "sa(2)_sigma", "pga_g")] == ["sa_g", "sa_sigma", "pga_g"]
    assert spectral_names(["sa(3)", "pga_g", "sa(0.3)"]) == ["sa(0.3)", "sa(3)"]


def test_every_form_of_keyword_is_the_same_question():
    expected = answer(pga_g=0.4, sa_g=SPECTRUM)
    assert expected.inputs["sa(0.3)"] == 0.9
    texts = {f"{period}": value for period, value in SPECTRUM.items()}
    columns = {f"SA({period} s)": value for period, value in SPECTRUM.items()}
    assert answer(pga_g=0.4, sa_g=texts) == expected
    assert answer(pga_g=0.4, **columns) == expected
    many = answer(pga_g=0.4, sa_g={**SPECTRUM, 1.0: np.array([0.5, 0.6])})
    assert many.probability[0] == pytest.approx(expected.probability, rel=1e-12)
    assert spectral_inputs("sa_g", ["0.5=0.4", "1:0.2 3=0.1"]) == {
        "sa(0.5)": 0.4, "sa(1)": 0.2, "sa(3)": 0.1,
    }  # fmt: skip


def test_a_period_that_the_model_does_not_use_is_named():
    result = answer(pgv_m_s=0.5, sa_g={0.5: 0.7}, sa_sigma={0.5: 0.3})
    assert result.probability == answer(pgv_m_s=0.5).probability
    unused = [text for text in result.warnings if "was not used" in text]
    assert [text.split()[0] for text in unused] == ["sa_g", "sa_sigma"]
    assert any("PGA would help" in text for text in result.warnings)


def test_its_dispersion_is_integrated():
    uncertain = answer(sa_g={1: 0.3}, sa_sigma={"1": 0.6})
    assert uncertain.shaking == {"sa(1)": {"median": 0.3, "sigma": 0.6}}
    assert uncertain.probability > answer(sa_g={1: 0.3}).probability


@pytest.mark.parametrize(
    ("question", "words"),
    [
        ({"sa_g": {20: 0.4}}, r"sa_g 20: the period must be from 0\.01 to 10 s"),
        ({"sa_g": {0.001: 0.4}}, r"sa_g 0\.001: the period must be from 0\.01 to 10 s"),
        ({"sa_g": {"1s": 0.4}}, r"sa_g '1s': the period is not a number"),
        ({"sa_g": {True: 0.4}}, r"sa_g True: the period is not a number"),
        ({"sa_g": {1.0: 0.4, "1": 0.4}}, r"sa_g '1': the period 1 s is given twice"),
        ({"sa_g": {1.0: -0.4}}, r"sa\(1\) = -0\.4 g is negative: give the spectral acceleration"),
        ({"sa_g": {1.0: "x"}}, r"sa\(1\) = 'x' is not a number"),
        ({"sa_g": 0.4}, r"sa_g = 0\.4: give values by period in s, such as \{1: 0\.4\}"),
        ({"sa_sigma": {1.0: -0.4}, "sa_g": {1.0: 0.4}}, r"sa\(1\)_sigma = -0\.4: give a standard"),
        ({"sa_sigma": {11: 0.4}}, "sa_sigma 11: the period must be"),
        ({"tm_s": 0.4}, r"tm_s is given: a prediction requires pga_g, or pgv_m_s, or sa_g"),
    ],
)
def test_what_is_rejected(question, words):
    with pytest.raises(InputError, match=words):
        answer(**question)


@pytest.mark.parametrize("name", ["sa03_g", "sa10_g", "sa30_g"])
def test_the_former_fields_are_unknown(name):
    with pytest.raises(UnknownFieldError, match=f"unknown field '{name}'; did you mean 'sa_g'"):
        answer(**{name: 0.4})


@pytest.mark.parametrize(
    ("header", "field", "unit"),
    [
        ("sa(0.5)", "sa(0.5)", None),
        ("SA(0.5)", "sa(0.5)", None),
        ("SA(0.5) [g]", "sa(0.5)", "g"),
        ("SA(0.5s)", "sa(0.5)", None),
        ("SA(.50 s) [cm/s²]", "sa(0.5)", "cm/s²"),
        ("SA(0,5) (%g)", "sa(0.5)", "%g"),
        ("sa(0.5)_sigma", "sa(0.5)_sigma", None),
    ],
)
def test_headers(header, field, unit):
    match = field_of(header)
    assert (match.field, match.unit) == (field, unit)


def test_a_table_has_columns_by_period(tmp_path):
    path = tmp_path / "blocks.csv"
    pd.DataFrame({
        "p2": [3.0], "kr": [0.1], "PGA [cm/s2]": [0.4 * 980.665], "SA(0.3s)": [0.9],
        "SA(1.0) [m/s2]": [0.5 * 9.80665], "sa(3)": [0.15], "sa(1)_sigma": [0.2],
    }).to_csv(path, index=False)  # fmt: skip
    row = predict_table(path, inputs={}, db=str(REFERENCE)).blocks[0]
    expected = answer(pga_g=0.4, sa_g=SPECTRUM, sa_sigma={1: 0.2})
    assert row["probability"] == pytest.approx(expected.probability, rel=1e-9)
    option = predict_table(path, inputs={"sa(3)": 5.0}, db=str(REFERENCE)).blocks[0]
    assert option["probability"] == row["probability"]  # a cell goes before an option


@pytest.mark.parametrize("header", ["sa10_g", "SA03", "SA(20)", "PSA10"])
def test_a_column_without_a_valid_period_is_rejected(header, tmp_path):
    path = tmp_path / "blocks.csv"
    path.write_text(f"p2,kr,pgv_m_s,{header}\n3,0.1,0.5,0.4\n")
    with pytest.raises(InputError, match="Name it by its period") as error:
        predict_table(path, inputs={}, db=str(REFERENCE))
    assert repr(header) in str(error.value)
    ignored = predict_table(path, inputs={}, db=str(REFERENCE), ignore_columns=[header])
    assert ignored.answered == 1
