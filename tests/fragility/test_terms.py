import math

import numpy as np
import pytest

from rbfrag.db.model_file import ANSWER_ORDER
from rbfrag.errors import InputError
from rbfrag.fragility.measures import (
    MEASURES,
    TERMS,
    intensity_term,
    least_inputs,
    terms_from,
)


def test_terms_of_one_harmonic_motion_agree():
    # A sine of velocity amplitude V at Tm has PGA = V·2π/Tm and PGD = V·Tm/2π.
    v, tm = 0.4, 0.7
    measures = {
        "pgv_m_s": v,
        "pga_g": v * 2 * math.pi / tm / 9.80665,
        "pgd_m": v * tm / (2 * math.pi),
        "tm_s": tm,
        "xp_m_s": v,
        "arias_m_s": 1.0,
        "magnitude": 6.5,
        "p": 2 * math.pi / tm,
        "velocity_m_s": v,
    }
    for term in TERMS.values():
        assert term.intensity_m_s(measures) == pytest.approx(v, rel=1e-14)


@pytest.mark.parametrize("name", TERMS)
def test_array_and_scalar_have_the_same_bits(name):
    random = np.random.default_rng(3)
    names = ("pgv_m_s", "pga_g", "pgd_m", "tm_s", "xp_m_s", "p", "velocity_m_s")
    names += ("arias_m_s", "magnitude")
    columns = {key: random.uniform(0.01, 2.0, 200) for key in names}
    together = TERMS[name].intensity_m_s(columns)
    for i in range(200):
        single = TERMS[name].intensity_m_s({key: float(col[i]) for key, col in columns.items()})
        assert single == together[i]


def test_labels_name_the_unit():
    for name, term in TERMS.items():
        assert term.name == name
        assert term.symbol in term.label
        assert term.label.endswith("[m/s]")


def test_terms_that_measures_suffice_for():
    assert terms_from(["tm_s", "pga_g"]) == ("pga", "pga_tm")
    assert terms_from(["pgv_m_s", "pgd_m", "tm_s"]) == ("pgv", "pgd_tm")
    assert terms_from(["tm_s"]) == terms_from(["magnitude"]) == ()
    assert terms_from(["pga_g"]) == ("pga",)
    assert set(terms_from(["pgv_m_s", "pga_g"])) == {"pgv_pga", "pgv", "pga"}
    assert terms_from([*MEASURES, "sa(2)"]) == tuple(TERMS) == ANSWER_ORDER
    assert terms_from(["sa(1)", "pga_g"]) == ("pga", "sa")
    assert set(terms_from(["xp_m_s", "pga_g"])) == {"xp", "pga"}
    assert set(terms_from(["magnitude", "pga_g"])) == {"pga"}


def test_the_least_that_suffices():
    values = {frozenset(inputs) for inputs in least_inputs(TERMS)}
    least = (["pgv_m_s"], ["sa_g"], ["pga_g"], ["pgd_m", "tm_s"])
    assert values == {frozenset(names) for names in least}
    assert least_inputs(["pgv_pga", "pgv", "sa", "xp"]) == [("pgv_m_s",), ("sa_g",)]


def test_unknown_term_lists_the_known_ones():
    with pytest.raises(InputError, match=r"'pgx'.*pgv_pga, pga, pgv, "):
        intensity_term("pgx")
