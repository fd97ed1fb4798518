import math
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import Prediction
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.question.question import predict
from rbfrag.results.numbers import interval

G = 9.80665


def independent(row, p2, kr, x, level=0.95):
    """P and its interval with scipy and matrices."""
    c = np.array(list(row.coefficients.values()))
    v = sum(b * x**k for k, b in enumerate(c[2:]))
    y = kr * G / math.sqrt(p2)
    z = (c[0] + c[1] * x - y) / math.sqrt(v)
    slopes = np.array([1.0, x, *(-z * x**k / (2 * math.sqrt(v)) for k in range(len(c) - 2))])
    slopes /= math.sqrt(v)
    error = math.sqrt(slopes @ np.array(row.covariance) @ slopes)
    q = norm.ppf(0.5 + level / 2)
    return norm.cdf([z, z - q * error, z + q * error])


@pytest.mark.parametrize("term", ["pgv", "pga_tm", "pgd_tm"])
@pytest.mark.parametrize("level", [0.5, 0.95, 0.999])
def test_probability_and_interval_against_scipy(row, term, level):
    random = np.random.default_rng(5)
    for _ in range(50):
        p2, kr = np.exp(random.uniform(-2, 3)), random.uniform(0.01, 0.5)
        tm, x = random.uniform(0.2, 1.2), random.uniform(0.02, 1.5)
        measures = {
            "pgv": {"pgv_m_s": x},
            "pga_tm": {"pga_g": x * 2 * math.pi / tm / G, "tm_s": tm},
            "pgd_tm": {"pgd_m": x * tm / 2 / math.pi, "tm_s": tm},
        }[term]
        # beyond PGA mechanics answers, not the model
        kr = min(kr, 0.99 * measures.get("pga_g", 1.0))
        answer = predict(p2, kr, model=row(term), level=level, **measures)
        expected = independent(row(term), p2, kr, x, level)
        assert [answer.probability, answer.ci_low, answer.ci_high] == pytest.approx(
            expected, rel=1e-9, abs=1e-300
        )
        assert answer.intensity_m_s == pytest.approx(x, rel=1e-14)
        assert answer.y_m_s == pytest.approx(kr * G / math.sqrt(p2), rel=1e-14)


def test_keys_of_the_json_contract(row):
    answer = predict(3.0, 0.1, pgv_m_s=0.6, model=row(), component="single")
    assert list(answer.as_dict()) == [
        "kind", "mode", "probability", "ci_low", "ci_high", "event_low", "event_high", "level",
        "model", "term", "method", "failure", "y_m_s", "intensity_m_s", "in_domain", "warnings",
        "pgv_over_pga_s", "median_displacement_m", "block_sd", "data", "shaking", "how",
        "drained", "uncertainty", "as_stated", "sensitivity", "solution",
    ]  # fmt: skip
    assert (answer.kind, answer.failure, answer.median_displacement_m) == (
        "toppling", "toppling", None,
    )  # fmt: skip
    assert (answer.level, answer.model, answer.term, answer.method) == (
        0.95, "wls-pgv", "pgv", "wls",
    )  # fmt: skip
    assert answer.in_domain is True
    assert answer.as_dict()["warnings"] == []


def test_limits(row):
    assert predict(3.0, 1e-9, pgv_m_s=1.5, model=row()).probability == 1.0
    strong = predict(3.0, 1e3, pgv_m_s=0.1, model=row())
    assert strong.probability == 0.0
    nothing = predict(3.0, 1e-9, pgv_m_s=0.0, model=row())
    assert (nothing.probability, nothing.ci_low, nothing.ci_high) == (0.0, 0.0, 0.0)
    assert "no shaking" in nothing.warnings[0]


@given(st.floats(0.1, 30.0), st.floats(1e-6, 2.0), st.floats(0.0, 3.0), st.floats(0.01, 0.9999))
def test_interval_lies_in_unit_interval_and_holds_the_probability(model, p2, kr, pgv, level):
    answer = predict(p2, kr, pgv_m_s=pgv, model=model, level=level)
    assert 0.0 <= answer.ci_low <= answer.probability <= answer.ci_high <= 1.0


@given(st.floats(0.1, 30.0), st.floats(1e-3, 2.0), st.floats(0.0, 3.0), st.floats(1.0, 3.0))
def test_stronger_shaking_and_weaker_blocks_topple_no_less(model, p2, kr, pgv, factor):
    base = predict(p2, kr, pgv_m_s=pgv, model=model).probability
    assert predict(p2, kr * factor, pgv_m_s=pgv, model=model).probability <= base
    if kr * G / math.sqrt(p2) >= model.parameters[0]:
        assert predict(p2, kr, pgv_m_s=pgv * factor, model=model).probability >= base - 1e-15


def test_where_the_line_is_not_monotone_it_says_so(row):
    model = row(coefficients={"c0": 0.02, "c1": 0.5, "v0": 1e-3, "v1": 0.0, "v2": 0.04},
                covariance=((1e-8,) * 5,) * 5, term="pgd_tm")  # fmt: skip
    # With y -> 0 the score (0.02 + 0.5 x)/sqrt(0.001 + 0.04 x²) falls beyond x = 0.625 m/s.
    for x, falls in ((0.5, False), (1.0, True)):
        low, high = (
            predict(3.0, 1e-6, pgd_m=v / (2 * math.pi), tm_s=1.0, model=model)
            for v in (x, 1.001 * x)
        )
        assert (high.probability < low.probability) is falls
        assert any("falls with growing intensity" in w for w in low.warnings) is falls


def test_negative_mass_near_zero_is_said(row):
    weak = predict(3.0, 0.01, pgv_m_s=0.021, model=row())
    assert any("negative critical velocities" in w for w in weak.warnings)
    common = predict(3.0, 0.1, pgv_m_s=0.6, model=row(), component="single")
    assert common.warnings == ()


def draws(n, seed=2):
    random = np.random.default_rng(seed)
    return {
        "p2": np.exp(random.uniform(-6, 6, n)),
        "kr": np.exp(random.uniform(-9, 2, n)),
        "pgv_m_s": np.exp(random.uniform(-9, 2, n)),
        "pga_g": np.exp(random.uniform(-9, 2, n)),
        "tm_s": np.exp(random.uniform(-5, 3, n)),
        "pgd_m": np.exp(random.uniform(-9, 2, n)),
    }


@pytest.mark.parametrize("term", ["pgv", "pga_tm", "pgd_tm"])
def test_arrays_agree_with_scalars(row, term):
    columns = draws(2000)
    many = predict(**columns, model=row(term))
    assert isinstance(many, PredictionArray)
    tails = many.probability[(many.probability > 0) & (many.probability < 1e-30)]
    assert tails.size > 5
    for i in range(2000):
        numbers = {k: float(c[i]) for k, c in columns.items()}
        single = predict(**numbers, model=row(term), component="single")
        assert isinstance(single, Prediction)
        assert [many.probability[i], many.ci_low[i], many.ci_high[i]] == pytest.approx(
            [single.probability, single.ci_low, single.ci_high], rel=1e-12, abs=1e-250
        )
        assert single.in_domain == many.in_domain[i]
        of_all = ("was not used", "Check the unit")
        expected = [text for text in single.warnings if not any(words in text for words in of_all)]
        assert len(expected) == len([r for r in many.reason[i].split("; ") if r])


def test_measures_that_the_model_does_not_read_are_named(row):
    single = predict(3.0, 0.1, pgv_m_s=0.6, tm_s=0.5, model=row())
    message = f"tm_s was not used: model {single.model} uses pgv_m_s"
    assert message in single.warnings
    assert message in predict([3.0, 4.0], 0.1, pgv_m_s=0.6, tm_s=0.5, model=row()).warnings
    assert (
        message in predict(height_m=2.0, width_m=0.4, pgv_m_s=0.6, tm_s=0.5, model=row()).warnings
    )
    assert not any("not used" in warning for warning in predict(3.0, 0.1, pgv_m_s=0.6).warnings)


@pytest.mark.parametrize("kr", [0.0, -0.1])
def test_what_falls_without_shaking_has_p_1_alone_and_in_arrays(row, kr):
    single = predict(3.0, kr, pgv_m_s=0.6, model=row())
    assert (single.probability, single.ci_low, single.ci_high) == (1.0, 1.0, 1.0)
    assert any("unstable without shaking" in text for text in single.warnings)
    many = predict(3.0, np.array([kr, 0.1]), pgv_m_s=0.6, model=row())
    assert many.probability[0] == 1.0
    assert many.probability[1] < 1.0


def test_an_interval_may_be_left_out(row):
    kr = np.array([0.1, 0.2, np.nan, -1.0])
    complete = predict(3.0, kr, pgv_m_s=0.6, model=row())
    alone = predict(3.0, kr, pgv_m_s=0.6, model=row(), interval=False)
    assert np.array_equal(alone.probability, complete.probability, equal_nan=True)
    assert np.array_equal(alone.reason, complete.reason)
    assert np.isnan(alone.ci_low).all()
    assert np.isnan(alone.ci_high).all()


def test_broadcast_shapes(row):
    answer = predict(np.ones((3, 1, 1)), np.full((4, 1), 0.1), pgv_m_s=[0.1, 0.2], model=row())
    for name in ("probability", "ci_low", "ci_high", "in_domain", "reason", "y_m_s"):
        assert getattr(answer, name).shape == (3, 4, 2)
    single = predict(1, 0.1, pgv_m_s=0.2, model=row()).probability
    assert answer.probability[0, 0, 1] == pytest.approx(single, rel=1e-12)
    assert predict([], 0.1, pgv_m_s=0.2, model=row()).probability.shape == (0,)
    with pytest.raises(InputError, match=r"p2 \(3,\).*kr \(2,\)"):
        predict(np.ones(3), np.ones(2), pgv_m_s=0.1, model=row())


@pytest.mark.parametrize("first", [np.float32(3), np.int64(3), np.array(3.0), 3])
def test_single_numbers_of_any_kind_answer_a_prediction(row, first):
    assert predict(first, 0.1, pgv_m_s=0.6, model=row()) == predict(
        3.0, 0.1, pgv_m_s=0.6, model=row()
    )


def test_series_and_lists(row):
    expected = predict(np.array([3.0, 1.0]), 0.1, pgv_m_s=0.6, model=row()).probability
    for p2 in ([3, 1], (3.0, 1.0), pd.Series([3.0, 1.0], index=[7, 9])):
        answer = predict(p2, 0.1, pgv_m_s=0.6, model=row())
        assert answer.probability.tolist() == expected.tolist()


def test_arrays_give_a_reason_for_every_special_element(row):
    kr = np.array([0.1, np.nan, 0.0, -0.2, 0.1, 0.1, 0.1, 0.1, 0.1, np.inf])
    p2 = np.array([3.0, 3.0, 3.0, 3.0, -3.0, np.nan, 3.0, 3.0, 100.0, 3.0])
    pgv = np.array([0.6, 0.6, 0.6, 0.0, 0.6, 0.6, -0.6, 0.0, 0.6, 0.6])
    answer = predict(p2, kr, pgv_m_s=pgv, model=row())
    assert np.isnan(answer.probability).tolist() == [
        False, True, False, False, True, True, True, False, False, True,
    ]  # fmt: skip
    for values in (answer.ci_low, answer.ci_high, answer.y_m_s, answer.intensity_m_s):
        assert np.array_equal(np.isnan(values), np.isnan(answer.probability))
    assert answer.probability[[2, 3, 7]].tolist() == [1.0, 1.0, 0.0]
    beginnings = [
        "", "kr is not a number", "unstable", "unstable", "p2 is not above zero",
        "p2 is not a number", "pgv_m_s is negative", "no shaking", "p2 is outside the fitted",
        "kr is beyond",
    ]  # fmt: skip
    for reason, beginning in zip(answer.reason, beginnings, strict=True):
        assert reason.startswith(beginning)
        assert bool(reason) == bool(beginning)
    assert answer.in_domain.tolist() == [
        True, False, True, True, False, False, False, True, False, False,
    ]  # fmt: skip
    model, mechanics = f"model {answer.model}", "by mechanics"
    assert answer.how.tolist() == [
        model, "", mechanics, mechanics, "", "", "", mechanics, model, "",
    ]  # fmt: skip


def test_what_the_model_does_not_need_may_be_missing_in_tables(row):
    answer = predict([3.0, 3.0], 0.1, pgv_m_s=0.6, pga_g=[0.5, np.nan], tm_s=np.nan, model=row())
    expected = predict(3.0, 0.1, pgv_m_s=0.6, model=row()).probability
    assert answer.probability.tolist() == pytest.approx([expected, expected], rel=1e-12)


def test_masked_elements_are_missing(row):
    p2 = np.ma.array([3.0, 3.0], mask=[False, True])
    answer = predict(p2, 0.1, pgv_m_s=0.6, model=row())
    assert np.isnan(answer.probability).tolist() == [False, True]


def test_the_callers_arrays_stay_as_they_are(row):
    pgv = np.array([0.6, np.nan, -1.0])
    answer = predict(3.0, 0.1, pgv_m_s=pgv, model=row())
    assert not np.shares_memory(answer.intensity_m_s, pgv)
    assert np.array_equal(pgv, [0.6, np.nan, -1.0], equal_nan=True)


def test_nan_can_be_rejected_in_arrays(row):
    with pytest.raises(InputError, match=r"element \(1, 0\): kr = nan"):
        predict(3.0, [[0.1], [np.nan]], pgv_m_s=0.6, model=row(), nan="raise")
    with pytest.raises(InputError, match="'ignore'"):
        predict(3.0, [0.1], pgv_m_s=0.6, model=row(), nan="ignore")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"p2": 0.0}, "p2 = 0 1/s² is not above zero"),
        ({"p2": -3.0}, "p2 = -3"),
        ({"p2": math.nan}, "p2 = nan"),
        ({"p2": math.inf}, "p2 = inf"),
        ({"p2": 1e-320}, "p2 = .* too small"),
        ({"p2": "3"}, "p2 = '3' is not a number"),
        ({"p2": True}, "p2 = True is not a number"),
        ({"p2": 1 + 2j}, "p2 = .*is not a number"),
        ({"p2": None}, "p2 is missing"),
        ({"kr": math.nan}, "kr = nan"),
        ({"kr": -math.inf}, "kr = -inf"),
        ({"kr": None}, "kr is missing"),
        ({"pgv_m_s": -0.1}, "pgv_m_s = -0.1 m/s is negative"),
        ({"pgv_m_s": math.nan}, "pgv_m_s = nan"),
        ({"pgv_m_s": math.inf}, "pgv_m_s = inf"),
        ({"pgv_m_s": None}, "requires pgv_m_s .*no intensity measure"),
        ({"pgv_m_s": None, "pga_g": 0.3, "tm_s": 0.4}, "requires pgv_m_s .*given: pga_g and tm_s"),
        ({"tm_s": 0.0}, "tm_s = 0 s is not above zero"),
        ({"pga_g": -1.0}, "pga_g = -1 g is negative"),
        ({"level": 95}, "level = 95"),
        ({"level": np.array([0.9, 0.95])}, "level = .*lies between 0 and 1"),
        ({"level": "0.9"}, "level = '0.9'"),
        ({"ky": 0.1}, "ky cannot be combined with kind toppling"),
        ({"rotation_deg": 2.0}, "rotation_deg is not a failure criterion of kind toppling"),
        ({"kind": "sliding"}, "of kind toppling, not sliding"),
        ({"p2": ["a", "b"]}, "p2 is not an array of numbers"),
        ({"p2": [[1.0], [1.0, 2.0]]}, "p2 is not an array of numbers"),
    ],
)  # fmt: skip
def test_bad_input_is_rejected_in_words(row, changes, words):
    arguments = {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.6, "model": row(), **changes}
    with pytest.raises(InputError, match=words):
        predict(**arguments)


@given(
    st.floats(1e-9, 1e9),
    st.floats(min_value=0, max_value=1e9, exclude_min=True),
    st.floats(0.0, 1e9),
)
def test_whatever_is_accepted_gives_finite_numbers(model, p2, kr, pgv):
    answer = predict(p2, kr, pgv_m_s=pgv, model=model)
    assert 0.0 <= answer.ci_low <= answer.probability <= answer.ci_high <= 1.0


def test_outside_the_domain_names_variable_range_and_edge(row):
    answer = predict(100.0, 0.1, pgv_m_s=0.6, model=row())
    assert not answer.in_domain
    assert "p2 = 100 1/s² is outside the fitted range 0.1 to 30" in answer.warnings[0]
    assert "nearest edge 30" in answer.warnings[0]
    assert not predict(3.0, 0.1, pgv_m_s=1.6, model=row()).in_domain
    assert not predict(3.0, 1.0, pgv_m_s=0.6, model=row()).in_domain
    assert not predict(3.0, 0.1, pgv_m_s=0.6, tm_s=3.0, model=row()).in_domain
    edge = predict(30.000000000000004, 0.1, pgv_m_s=1.5, model=row())
    assert edge.in_domain


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pgv_m_s": 60.0}, "did you mean cm/s"),
        ({"pga_g": 300.0}, "did you mean cm/s²"),
        ({"pgd_m": 25.0}, "did you mean cm"),
        ({"tm_s": 12.0}, "frequency"),
        ({"kr": 15.0}, "degrees"),
        ({"pga_g": 0.1}, "not below PGA"),
    ],
)
def test_suspicious_values_are_mentioned(row, changes, words):
    arguments = {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.6, **changes}
    answer = predict(**arguments, model=row())
    assert any(words in warning for warning in answer.warnings)
    many = predict(**{**arguments, "p2": [3.0]}, model=row())
    assert words in many.reason[0]
    assert many.probability[0] == pytest.approx(answer.probability, rel=1e-12)


def test_arrays_have_a_headline(row):
    many = predict(3.0, [0.1, 0.05, -0.1, np.nan], pgv_m_s=0.6, model=row())
    low, high = np.nanmin(many.probability), np.nanmax(many.probability)
    assert many.headline() == (f"P(toppling) = {interval(low, high)} of 3 blocks; 1 without answer")
    document = many.document(text=True)
    assert document["text"]["sentences"] == [many.headline()]
    assert "element 3" in many.warnings[-1]
    assert document["warnings"] == [*many.warnings]
    alone = predict(3.0, [np.nan], pgv_m_s=0.6, model=row())
    assert alone.headline() == "No probability of 1 block"


def test_a_model_of_an_unknown_method_or_a_torn_row_is_rejected(row):
    with pytest.raises(ModelError, match=r"'oracle'.*update rbfrag"):
        predict(3.0, 0.1, pgv_m_s=0.6, model=row(method="oracle"))
    with pytest.raises(ModelError, match="covariance of another size"):
        FragilityModel.from_row(row(covariance=((1.0,),)))


def test_single_numbers_load_no_heavy_library():
    program = """
import sys
from rbfrag.db.model_file import ModelRow
from rbfrag.question.question import predict
row = ModelRow("m", "pgv", "wls", {"c0": 0.0, "c1": 0.7, "v0": 1e-4, "v1": 2e-3},
               ((1e-6, 0, 0, 0), (0, 1e-4, 0, 0), (0, 0, 1e-10, 0), (0, 0, 0, 1e-8)),
               {"p2": (0.1, 30.0)}, "")
assert 0 < predict(3, 0.1, pgv_m_s=0.6, model=row).probability < 1
heavy = {"numpy", "scipy", "pandas", "statsmodels", "numba", "matplotlib", "sqlalchemy"}
print(sorted(heavy & set(sys.modules)))
"""
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert process.stdout.strip() == "[]"
