"""One block, an array of one and a table of one row have warnings of the same codes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError
from rbfrag.exchange.table_answers import predict_table
from rbfrag.question.document import answer_block
from rbfrag.question.drained_bound import with_drained_bound
from rbfrag.question.question import ask
from rbfrag.results.diagnostic import diagnostics
from rbfrag.vocabulary.quantities import column_of

NUMBERS = {"p2": 3.0, "kr": 0.1}
SLAB = {"height_m": 2.0, "width_m": 0.4, "beta_deg": 3.0, "phi_deg": 38.0}
SLIDE = {"height_m": 1.0, "width_m": 1.5, "beta_deg": 20.0, "phi_deg": 33.0, "displacement_m": 0.1}
SLUMP = {"s1_m": 0.5, "s2_m": 0.15, "gamma_deg": 95.0, "beta_deg": 5.0, "phi_deg": 25.0}
PLANES = {"base": "2/150", "back": "78/095", "face": "80/090", "s1_m": 2.0, "s2_m": 0.4,
          "phi_deg": 40.0}  # fmt: skip
PGV = {"pgv_m_s": 0.6}
BOTH = {"pgv_m_s": 0.6, "pga_g": 0.7}
SCENARIO = {"magnitude": 7.0, "rjb_km": 4.0, "vs30_m_s": 700.0}

QUESTIONS: dict[str, dict[str, Any]] = {
    "numbers": NUMBERS | PGV,
    "numbers of a slide": {"ky": 0.2, "displacement_m": 0.1} | BOTH,
    "numbers of a slump": {"ks": 0.2, "ps2": 3.0} | BOTH,
    "numbers of a confined topple": {"kct": 0.3, "pct2": 8.0} | BOTH,
    "numbers of a rocking block": NUMBERS | PGV | {"kind": "rocking"},
    "topple": SLAB | PGV,
    "topple whose toe slips": {"s1_m": 1.7, "s2_m": 0.6, "gamma_deg": 80.0, "beta_deg": 25.0,
                               "phi_deg": 30.0} | BOTH,
    "rough topple": SLAB | {"jrc": 6.0, "jcs_mpa": 60.0, "phi_deg": 25.0, "pgv_m_s": 2.0,
                            "pga_g": 2.0},
    "topple after its first slip": SLAB | PGV | {"phi_residual_deg": 30.0},
    "topple with a displacement limit": SLAB | PGV | {"displacement_m": 0.1},
    "slide": SLIDE | PGV,
    "slide whose heel tips": {"s1_m": 1.4, "s2_m": 1.5, "gamma_deg": 65.0, "beta_deg": 0.0,
                              "phi_deg": 40.0, "displacement_m": 0.1, "pgv_m_s": 1.5, "pga_g": 1.5},
    "slide that leans": {"s1_m": 1.6, "s2_m": 1.2, "gamma_deg": 30.0, "beta_deg": -5.0,
                         "phi_deg": 15.0, "displacement_m": 0.1} | BOTH,
    "rough back plane": {"s1_m": 1.7, "s2_m": 1.9, "gamma_deg": 25.0, "beta_deg": 0.0,
                         "phi_deg": 15.0, "phi_back_deg": 60.0, "displacement_m": 0.1} | BOTH,
    "slump": SLUMP | BOTH,
    "free-standing": SLAB | PGV | {"back_fracture": False},
    "free-standing as if backed": SLAB | PGV | {"back_fracture": False, "kind": "toppling"},
    "friction unknown": {"height_m": 2.0, "width_m": 0.4} | PGV,
    "planes in space": PLANES | PGV,
    "water": SLAB | PGV | {"water_m": 0.5},
    "water, drained": SLAB | PGV | {"water_m": 0.5, "drainage": "drained"},
    "water without a drained bound": {"s1_m": 1.9, "s2_m": 1.9, "gamma_deg": 120.0, "beta_deg": 5.0,
                                      "phi_deg": 30.0, "water_m": 0.2} | BOTH,
    "cohesion": SLAB | PGV | {"cohesion_pa": 5000.0},
    "scenario": SLAB | SCENARIO,
    "scenario of one model": SLAB | SCENARIO | {"gmm_sigma": 0.0},
    "errors of measurement": SLAB | PGV | {"beta_deg": 9.0, "beta_sigma_deg": 2.0},
    "mostly unstable": SLAB | PGV | {"beta_deg": 12.0, "beta_sigma_deg": 2.0},
    "component": SLAB | PGV | {"component": "rotd50"},
    "PGA alone": NUMBERS | {"pga_g": 0.7},
    "unused measure": SLAB | PGV | {"pgd_m": 0.1},
    "uncertain block": NUMBERS | PGV | {"kr_sigma": 0.3},
    "uncertain shaking": NUMBERS | PGV | {"pgv_sigma": 0.6},
    "out of range": {"p2": 60.0, "kr": 0.1} | PGV,
    "uncertain and out of range": {"p2": 40.0, "kr": 0.1, "kr_sigma": 0.3} | PGV,
    "measures that contradict": NUMBERS | {"pgv_m_s": 3.0, "pga_g": 0.2},
    "value in cm/s": NUMBERS | {"pgv_m_s": 60.0},
    "dip in radians": SLAB | PGV | {"beta_deg": 0.06},
    "length in cm": SLAB | PGV | {"height_m": 200.0, "width_m": 40.0},
    "length in mm": SLAB | PGV | {"height_m": 0.02, "width_m": 0.004},
    "size in other units": {"p2": 0.05, "kr": 0.1} | PGV,
    "P = 0 below PGA": {"p2": 3.0, "kr": 0.7} | BOTH,
    "P = 0 above 2 PGV": {"p2": 3.0, "kr": 0.9, "pgv_m_s": 0.1},
    "P = 0 without shaking": NUMBERS | {"pgv_m_s": 0.0},
    "P = 1 by numbers": {"p2": 3.0, "kr": -0.1} | PGV,
    "P = 1 by shape": SLAB | PGV | {"beta_deg": 12.0},
    "P = 1 with water": SLAB | PGV | {"beta_deg": 12.0, "water_m": 0.5},
}  # fmt: skip

OF_WHOLE = ("kind", "component", "back_fracture")


@pytest.fixture(autouse=True)
def _built_in_data(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)


def codes(warnings: Iterable[str]) -> list[str]:
    return sorted({warning.code for warning in diagnostics(warnings)})


def arrays(question: dict[str, Any]) -> dict[str, Any]:
    return {
        name: value if name in OF_WHOLE else np.array([value], dtype=object)
        if isinstance(value, str) else np.array([value])
        for name, value in question.items()
    }  # fmt: skip


@pytest.mark.parametrize("name", QUESTIONS)
def test_codes_are_those_of_an_array_and_a_row(name: str) -> None:
    question = QUESTIONS[name]
    expected = codes(rbfrag.predict(**question).warnings)
    assert "note" not in expected
    assert codes(rbfrag.predict(**arrays(question)).warnings) == expected
    how = {n: question.get(n) for n in ("kind", "component")}
    fields = {n: value for n, value in question.items() if n not in how}
    assert codes(answer_block(fields, **how).warnings) == expected
    cells = {column_of(n): ["no" if value is False else value] for n, value in question.items()}
    pd.DataFrame(cells).to_csv("row.csv", index=False)
    assert codes(predict_table("row.csv", inputs={}).warnings) == expected


def test_the_questions_cover_the_warnings() -> None:
    result = {code for q in QUESTIONS.values() for code in codes(rbfrag.predict(**q).warnings)}
    assert result >= {
        "after_first_slip", "back_friction_neglected", "by_mechanics", "check_stability",
        "check_unit", "excluded_draws",
        "cohesion_without_effect", "cross_tilt_neglected", "density_assumed", "drained",
        "extrapolation", "friction_not_given", "heel_tips", "leans_on_back_plane",
        "model_choice", "no_drained_bound", "no_shaking", "not_backed", "not_symmetric",
        "rough_back_plane", "single_component", "single_gmm", "suspicious_value",
        "toe_slips", "undrained", "unstable_at_rest", "unused_input", "unused_measures",
    }  # fmt: skip


def test_rows_are_those_a_warning_is_about() -> None:
    prediction = rbfrag.predict(
        [3.0, 60.0, 3.0, 3.0, 3.0, 60.0], [0.1, 0.1, 0.9, 0.1, -0.1, 0.1],
        pgv_m_s=[0.6, 0.6, 0.1, 0.0, 0.6, 0.6],
    )  # fmt: skip
    rows = {warning.code: [*warning.rows] for warning in diagnostics(prediction.warnings)}
    assert rows == {
        "extrapolation": [1, 5], "by_mechanics": [2], "no_shaking": [3], "unstable_at_rest": [4],
        "single_component": [],
    }  # fmt: skip
    shapes = rbfrag.predict(
        height_m=[1.0, 2.0, 2.0], width_m=[1.5, 0.4, 0.4], beta_deg=[20.0, 3.0, 12.0],
        phi_deg=[33.0, 38.0, 38.0], displacement_m=[0.1, np.nan, np.nan], pgv_m_s=0.6, pgd_m=0.1,
    )  # fmt: skip
    rows = {warning.code: [*warning.rows] for warning in diagnostics(shapes.warnings)}
    assert rows["unstable_at_rest"] == [2]
    assert rows["back_friction_neglected"] == [1]
    many = rbfrag.predict(np.full(40_000, 60.0), 0.1, pgv_m_s=0.6).warnings
    (outside,) = (w for w in diagnostics(many) if w.code == "extrapolation")
    assert np.array_equal(outside.rows, np.arange(40_000))


def rounded(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: round(value, 3))


BY_SHAPE = st.fixed_dictionaries(
    {"beta_deg": rounded(-10.0, 50.0), "phi_deg": rounded(10.0, 70.0)},
    optional={
        "phi_back_deg": rounded(5.0, 70.0), "displacement_m": rounded(0.01, 1.0),
        "back_fracture": st.booleans(), "cohesion_pa": st.sampled_from([0.0, 2000.0]),
        "water_m": rounded(0.0, 0.5), "phi_residual_deg": rounded(10.0, 50.0),
        "jrc": rounded(0.0, 12.0),
    },
)  # fmt: skip
SIDES = st.one_of(
    st.fixed_dictionaries({"height_m": rounded(0.05, 4.0), "width_m": rounded(0.02, 4.0)}),
    st.fixed_dictionaries(
        {"s1_m": rounded(0.2, 3.0), "s2_m": rounded(0.2, 3.0), "gamma_deg": rounded(20.0, 150.0)}
    ),
)
BY_NUMBERS = st.one_of(
    st.fixed_dictionaries(
        {"p2": rounded(0.05, 60.0), "kr": rounded(-0.1, 1.0)},
        optional={"kr_sigma": rounded(0.1, 0.5), "kind": st.just("rocking")},
    ),
    st.fixed_dictionaries({"ky": rounded(-0.1, 1.0), "displacement_m": rounded(0.01, 1.0)}),
    st.fixed_dictionaries({"ks": rounded(-0.1, 1.0), "ps2": rounded(0.1, 30.0)}),
    st.fixed_dictionaries({"kct": rounded(0.01, 1.0), "pct2": rounded(0.1, 30.0)}),
)
MEASURES = st.fixed_dictionaries(
    {"pgv_m_s": st.one_of(st.just(0.0), rounded(0.01, 3.0)), "pga_g": rounded(0.01, 3.0)},
    optional={
        "magnitude": rounded(5.0, 8.0), "pgv_sigma": rounded(0.1, 0.8), "tm_s": rounded(0.1, 2.0),
        "component": st.sampled_from(["single", "rotd50", "larger"]),
    },
)  # fmt: skip
BLOCKS = st.one_of(BY_NUMBERS, st.builds(lambda sides, planes: sides | planes, SIDES, BY_SHAPE))


@settings(max_examples=300, deadline=None)
@given(block=BLOCKS, shaking=MEASURES)
def test_codes_are_those_of_an_array(block: dict[str, Any], shaking: dict[str, Any]) -> None:
    question = block | shaking
    if "jrc" in question:
        question["jcs_mpa"] = 60.0
    try:
        expected = codes(rbfrag.predict(**question, db=REFERENCE).warnings)
    except InputError:
        return  # no array of one block has an answer either
    assert codes(rbfrag.predict(**arrays(question), db=REFERENCE).warnings) == expected
    several = {n: v if n in OF_WHOLE else np.repeat(v, 2) for n, v in arrays(question).items()}
    assert codes(rbfrag.predict(**several, db=REFERENCE).warnings) == expected
    kind = question.get("kind")
    row = {n: v for n, v in arrays(question).items() if n not in ("kind", "component")}
    result = with_drained_bound(
        lambda rows: ask(
            rows, kind=None if kind is None else [kind], rows=True, db=REFERENCE,
            component=question.get("component"),
        ),
        row,
    )  # fmt: skip
    assert codes(result.warnings) == expected
