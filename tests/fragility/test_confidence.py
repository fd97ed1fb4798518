"""The interval comes from V and the steps alone: computed again here by other means."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm, t

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow, read_models
from rbfrag.errors import InputError
from rbfrag.fragility.completion import (
    Regression,
    encode_regressions,
    key_of,
    used_inputs,
)
from rbfrag.fragility.confidence import ParameterErrors, packed, quantiles_of
from rbfrag.fragility.joint import share_range
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE, LinearPredictor, arrays
from rbfrag.fragility.methods import methods
from rbfrag.fragility.model import NO_EVENT_RANGE, FragilityModel
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from tests.fragility.portfolio_draws import SHARED

FloatArray = NDArray[np.float64]
FORMS = [(method, term) for method in methods() for term in method.forms]

SINGLE_TERM = LinearPredictor(None, (1.0,))


def drawn_model(number: int, seed: int, shared: dict[str, float] | None) -> FragilityModel:
    """A model of some form with parameters and steps at random."""
    method, term = FORMS[number % len(FORMS)]
    form = method.forms[term]
    random = np.random.default_rng(seed)
    b = np.array(form.start or random.uniform(0.5, 3.0, len(form.parameters)))
    if form.parameters[0] == "c0":  # a straight line with its variance
        b = np.array([0.002, 0.72, 4e-5, 3e-3, 5e-3])[: b.size]
    g = int(random.integers(3, 60))
    # a few earthquakes tell more than the others
    weight = np.exp(random.normal(0.0, 1.0, (g, 1)))
    steps = 0.02 * weight * random.normal(size=(g, b.size)) * np.abs(b)
    covariance = (g - 1) / g * steps.T @ steps
    criterion = {} if method.block.criterion is None else {method.block.criterion: None}
    completions = None
    if form.velocity is not None:
        used = used_inputs(TERMS[term], form.velocity, MEASURED)
        lines, sigma = random.normal(0.0, 0.3, (6, 6)), random.uniform(0.1, 0.5, 6)
        size = 1 + 2 * ("pgv_m_s" in used and bool(form.velocity.over)) + ("sa(1)" in used)
        node_steps = 0.01 * random.normal(size=(6, g, size + 1))
        regression = Regression(
            lines[:, :size].tolist(), sigma.tolist(), [[0.2, 0.5]] * 6, node_steps.tolist()
        )
        completions = encode_regressions({key_of(used): regression})
    return FragilityModel.from_row(
        ModelRow(
            name="drawn",
            kind=method.block.kind,
            term=term,
            method=method.name,
            coefficients=dict(zip(form.parameters, b.tolist(), strict=True)),
            covariance=tuple(map(tuple, covariance.tolist())),
            leave_out_steps=tuple(map(tuple, steps.tolist())),
            dependence=shared,
            domain={},
            data_fingerprint="",
            diagnostics=criterion,
            completions=completions,
        )
    ).for_inputs(MEASURED)


MEASURED = ("pga_g", "pgv_m_s", "sa(1)")
"""What completes a spectral velocity."""


def drawn_questions(model: FragilityModel, random: np.random.Generator, n: int) -> dict[str, Any]:
    """Blocks and motions within what mechanics leaves to the model, or nearly."""
    pgv = np.exp(random.uniform(-3.0, 0.5, n))
    every = {
        "pgv_m_s": pgv,
        "pga_g": pgv * np.exp(random.normal(0.2, 0.4, n)),
        "tm_s": np.exp(random.normal(-0.7, 0.4, n)),
        "pgd_m": 0.1 * pgv * np.exp(random.normal(0.0, 0.4, n)),
        "xp_m_s": pgv * random.uniform(0.3, 1.0, n),
        "arias_m_s": pgv * pgv * random.uniform(2.0, 60.0, n),
        "magnitude": random.uniform(5.0, 8.0, n),
        "p2": np.exp(random.uniform(np.log(0.1), np.log(30.0), n)),
        "ps2": np.exp(random.uniform(-1.0, 3.0, n)),
        "displacement_m": np.exp(random.uniform(-6.0, 0.0, n)),
    }
    every["pct2"] = every["ps2"]
    for period in ("0.3", "1", "2", "3"):
        every[f"sa({period})"] = every["pga_g"] * np.exp(random.normal(0.0, 0.5, n))
    every["ky"] = every["ks"] = every["kct"] = every["pga_g"] * random.uniform(0.05, 0.95, n)
    y = pgv * np.exp(random.uniform(-2.0, 0.6, n))
    every["kr"] = y * np.sqrt(every["p2"]) / 9.80665
    names = (*model.method.block.names, *model.term.inputs)
    return {name: every[name] for name in dict.fromkeys(names)}


def expected_ends(
    model: FragilityModel, inputs: dict[str, FloatArray], level: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """P and the interval by numpy and scipy from the stored row, slopes by central differences."""
    ns = arrays()

    def eta_of(model: FragilityModel) -> FloatArray:
        predictor, factor = model.linear_predictor(model.completed(inputs, ns), ns)
        return np.asarray(predictor.eta * factor)

    with np.errstate(all="ignore"):
        eta = eta_of(model)
        steps = np.array(model.errors.all_steps)
        scale = 1e-5 * (np.abs(steps).max(axis=0) + 1e-3)
        x = np.column_stack([
            (eta_of(model.moved(h)) - eta_of(model.moved(-h))) / (2.0 * h.sum())
            for h in np.diag(scale)
        ])  # fmt: skip
        g = len(steps)
        se = np.sqrt((g - 1.0) / g * ((x @ steps.T) ** 2).sum(axis=1))
        c = (x @ steps.T) ** 2
        nu = 2 * c.sum(1) ** 2 / ((c**2).sum(1) - c.sum(1) ** 2 / g)
        reach = t.ppf(0.5 + 0.5 * level, np.clip(nu, 2, g - 1)) * se
        link = model.method.link.probability
        p, low, high = (np.asarray(link(at, ns)) for at in (eta, eta - reach, eta + reach))
    return p, low, high


COLUMNS = ("probability", "ci_low", "ci_high")


@settings(max_examples=150)
@given(
    number=st.integers(0, 10_000),
    seed=st.integers(0, 10_000),
    level=st.sampled_from([0.5, 0.9, 0.95, 0.99]),
)
def test_nothing_but_v_widens_an_interval(number: int, seed: int, level: float) -> None:
    model = drawn_model(number, seed, SHARED)
    check_intervals(model, np.random.default_rng(seed), level)


def check_intervals(model: FragilityModel, random: np.random.Generator, level: float) -> None:
    inputs = drawn_questions(model, random, 40)
    many = answer_given(model, inputs, level)
    assert isinstance(many, PredictionArray)
    expected = expected_ends(model, inputs, level)
    ruled = np.zeros(40, dtype=bool)
    values = model.completed(inputs, arrays())
    for bound in (*model.form.bounds, model.method.block.at_rest):
        if bound.about in values and ("pga_g" in values or bound in model.form.bounds):
            ruled |= bound.holds(values)
    for name, column in zip(COLUMNS, expected, strict=True):
        result = getattr(many, name)
        np.testing.assert_allclose(
            result, np.where(ruled, 0.0, column), rtol=1e-5, atol=1e-8, err_msg=name
        )
    for i in range(40):
        single = answer_given(model, {name: float(v[i]) for name, v in inputs.items()}, level)
        result = [getattr(single, name) for name in COLUMNS]
        # P is held to 1e-12 elsewhere; the last bit of eta weighs more at the far ends of the wide
        # intervals that models drawn at random have
        assert result == pytest.approx(
            [getattr(many, name)[i] for name in COLUMNS], rel=1e-11, abs=1e-18
        )


def test_the_shipped_models_have_the_interval_of_v() -> None:
    rows = read_models(REFERENCE)
    assert len(rows) >= 20
    for row in rows:
        steps = np.array(row.leave_out_steps)
        g = len(steps)
        np.testing.assert_allclose(row.covariance, (g - 1) / g * steps.T @ steps, rtol=1e-9)
        model = FragilityModel.from_row(row).for_inputs(MEASURED)
        random = np.random.default_rng(1)
        inputs = drawn_questions(model, random, 60)
        many = answer_given(model, inputs, 0.95)
        _, low, high, *_ = expected_ends(model, inputs, 0.95)
        open_ = (many.probability > 0.0) & (many.probability < 1.0)
        assert open_.sum() > 10
        np.testing.assert_allclose(many.ci_low[open_], low[open_], rtol=1e-5, atol=1e-8)
        np.testing.assert_allclose(many.ci_high[open_], high[open_], rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("sites", [None, 3])
def test_ranges_of_one_earthquake_are_of_sites(sites: int | None) -> None:
    model = drawn_model(0, 1, SHARED)
    inputs = drawn_questions(model, np.random.default_rng(1), 5)
    many = answer_given(model, inputs, 0.9, sites=sites)
    single = answer_given(
        model, {name: float(v[0]) for name, v in inputs.items()}, 0.9, sites=sites
    )
    if sites is None:
        assert np.isnan([many.event_low, many.event_high]).all()
        assert single.event_low is single.event_high is single.as_dict()["event_low"] is None
        return
    assert model.dependence is not None
    law = model.dependence.shares(model.loadings(inputs, arrays()))
    ends = share_range(many.probability, law, sites, 0.9)
    np.testing.assert_array_equal([many.event_low, many.event_high], ends)
    assert (single.event_low, single.event_high) == (ends[0][0], ends[1][0])
    for wrong in (0, 1.5, -2, 10**6, True, math.nan, "3"):
        with pytest.raises(InputError, match="whole number from 1 to 10,000"):
            answer_given(model, inputs, 0.9, sites=wrong)


def test_a_model_that_does_not_know_what_blocks_share_says_so() -> None:
    model = drawn_model(0, 1, None)
    inputs = drawn_questions(model, np.random.default_rng(1), 5)
    assert answer_given(model, inputs, 0.95).warnings == ()
    many = answer_given(model, inputs, 0.95, sites=3)
    assert np.isnan([many.event_low, many.event_high]).all()
    assert many.warnings == (NO_EVENT_RANGE,)
    single = answer_given(model, {name: float(v[0]) for name, v in inputs.items()}, 0.95, sites=3)
    assert single.event_low is single.event_high is None
    assert NO_EVENT_RANGE in single.warnings


@pytest.mark.parametrize("level", [0.5, 0.9, 0.95, 0.99, 0.999, 0.9999])
def test_student_quantiles_are_those_of_scipy(level: float) -> None:
    nu = np.linspace(2.0, 60.0, 2000)
    expected = t.ppf(0.5 + 0.5 * level, nu)
    quantiles = quantiles_of(level)
    many = quantiles.student_at(1.0 / nu)
    assert np.abs(many - expected).max() < 1e-6
    single = [quantiles.student_at(1.0 / item) for item in nu.tolist()]
    np.testing.assert_allclose(many, single, rtol=1e-12)
    assert quantiles.normal == pytest.approx(norm.ppf(0.5 + 0.5 * level), rel=1e-13)


@pytest.mark.parametrize("level", [0.9, 0.95, 0.99])
def test_the_table_of_usual_levels_is_what_other_levels_compute(level: float) -> None:
    nearby = quantiles_of(level * (1.0 + 1e-15))
    assert nearby.level != level
    w = np.linspace(-1.0, 1.0, 101)
    for quantiles in (quantiles_of(level), nearby):
        assert len(quantiles.student) == 13
    np.testing.assert_allclose(
        np.polyval(quantiles_of(level).student, w), np.polyval(nearby.student, w), rtol=1e-12
    )


@pytest.mark.parametrize("level", [0.0, 1.0, -0.1, 95, True, float("nan"), "0.95"])
def test_levels_that_are_none(level: Any) -> None:
    with pytest.raises(InputError, match="between 0 and 1"):
        quantiles_of(level)


def extreme_slopes(steps: FloatArray, random: np.random.Generator) -> FloatArray:
    """Slopes of very different size, some of which nearly cancel in all steps, a column each."""
    k = steps.shape[1]
    spread = random.normal(size=(k, 500)) * np.exp(random.normal(0.0, 8.0, (k, 500)))
    directions = np.linalg.svd(steps, full_matrices=False)[2].T
    return np.hstack([spread, directions, np.eye(k), 1e50 * np.eye(k), 1e-50 * spread])


@pytest.mark.parametrize("name", ["slopes of questions", "extreme slopes"])
def test_sums_over_arrays_are_those_over_the_steps(name: str) -> None:
    random = np.random.default_rng(5)
    models = [FragilityModel.from_row(row).for_inputs(MEASURED) for row in read_models(REFERENCE)]
    assert {model.errors.size for model in models} >= {2, 3, 4, 5, 6}
    for model in models:
        steps = np.array(model.errors.all_steps)
        if name == "slopes of questions":
            inputs = drawn_questions(model, random, 2000)
            with np.errstate(all="ignore"):
                x, _ = model.linear_predictor(model.completed(inputs, arrays()), arrays())
            slopes = np.array(np.broadcast_arrays(*x.all_slopes))
        elif model.errors.size > 6:
            continue  # nearly equal steps of neighbouring nodes cancel in any sum of doubles
        else:
            slopes = extreme_slopes(steps, random)
            x = LinearPredictor(None, tuple(slopes))
        finite = np.isfinite(slopes).all(axis=0)
        squares = (steps.astype(np.longdouble) @ slopes[:, finite]) ** 2
        total, fourths = (sums[finite] for sums in model.errors.sums_of_arrays(x))
        np.testing.assert_allclose(total, squares.sum(axis=0), rtol=6e-13)
        np.testing.assert_allclose(fourths, (squares**2).sum(axis=0), rtol=6e-13)


def test_single_sums_are_the_same_with_and_without_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    (row,) = (row for row in read_models(REFERENCE) if row.name == "toppling-pgv_pga")
    model = FragilityModel.from_row(row).for_inputs(MEASURED)
    inputs = drawn_questions(model, np.random.default_rng(2), 50)
    predictors = [
        model.linear_predictor(
            model.completed({name: float(v[i]) for name, v in inputs.items()}, SINGLE), SINGLE
        )[0]
        for i in range(50)
        if inputs["kr"][i] < min(1.0, 2.0 * inputs["pgv_m_s"][i]) * inputs["pga_g"][i]
        if inputs["kr"][i] * 9.80665 < 2.0 * inputs["pgv_m_s"][i] * np.sqrt(inputs["p2"][i])
    ]
    assert len(predictors) > 20
    predictors += [LinearPredictor(None, x.all_slopes) for x in predictors]
    with_numpy = [model.errors.sums_of_number(x) for x in predictors]
    monkeypatch.delitem(sys.modules, "numpy")
    assert [model.errors.sums_of_number(x) for x in predictors] == with_numpy


def reach_over_error(steps: FloatArray, x: FloatArray) -> float:
    g = len(steps)
    covariance = (g - 1) / g * steps.T @ steps
    errors = ParameterErrors(packed(covariance.tolist()), tuple(map(tuple, steps.tolist())))
    quantiles = quantiles_of(0.95)
    return float(
        errors.half_width(LinearPredictor(None, tuple(x.tolist())), quantiles, SINGLE)
        / np.sqrt(x @ covariance @ x)
    )


def test_normal_steps_have_nearly_as_many_freedoms_as_earthquakes() -> None:
    steps = np.random.default_rng(1).normal(size=(4000, 3))
    assert reach_over_error(steps, np.ones(3)) == pytest.approx(t.ppf(0.975, 4000), rel=1e-3)


def test_few_earthquakes_that_decide_leave_few_freedoms() -> None:
    random = np.random.default_rng(2)
    steps = random.normal(size=(50, 2))
    steps[:4, 1] *= 20.0
    first, second = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    assert reach_over_error(steps, first) < t.ppf(0.975, 30)
    # of this block, not of the model
    assert reach_over_error(steps, second) > t.ppf(0.975, 12)
    # equal steps do not scatter, and there are never more freedoms than earthquakes less one
    assert reach_over_error(np.ones((9, 1)), np.ones(1)) == pytest.approx(t.ppf(0.975, 8))
    single = np.zeros((40, 1))
    single[0] = 1.0
    assert reach_over_error(single, np.ones(1)) == pytest.approx(t.ppf(0.975, 80 / 39), rel=1e-7)


def test_what_is_known_without_error_has_no_width() -> None:
    errors = ParameterErrors((0.0,), ((0.0,), (0.0,), (0.0,)))
    assert errors.half_width(SINGLE_TERM, quantiles_of(0.95), SINGLE) == 0.0
    expected = ParameterErrors((4.0,), ())
    assert expected.half_width(SINGLE_TERM, quantiles_of(0.95), SINGLE) == pytest.approx(
        2 * norm.ppf(0.975)
    )
