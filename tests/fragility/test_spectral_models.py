"""Models with a spectral predictor: coefficients and probabilities of an independent study of the
same motions, which model answers, and the interval against refits without each earthquake."""

from __future__ import annotations

import json
import math
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow, read_models
from rbfrag.fragility.completion import Regression, encode_regressions, key_of
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.fit.completions import MotionTable, regress
from rbfrag.fragility.fit.data import FitSource, fit_data, motions_of, read_source
from rbfrag.fragility.fit.likelihood import maximise, most_likely
from rbfrag.fragility.fit.maximum_likelihood import outcome_rows, parameter_names
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE, arrays
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.spectral_velocity import ln_rocking_velocity, ln_toppling_velocity

STUDY: dict[str, Any] = json.loads(
    Path(__file__).with_name("spectrum_coefficients.json").read_text(encoding="utf-8")
)
"""Coefficients, their CR3 errors and regressions by another code."""

OF_STUDY = {
    "toppling-pgv_pga": ("toppling", "pgv_pga"), "toppling-pga": ("toppling", "pga"),
    "toppling-sa": ("toppling", "sa"), "toppling-pgv": ("toppling", "pgv"),
    "record-xp": ("toppling", "xp"), "rocking-pga": ("rocking", "pga"),
    "rocking-sa": ("rocking", "sa"), "rocking-pgv": ("rocking", "pgv"),
}  # fmt: skip

ZETA = ("1", "zr", "zr2")
TABLES = {
    "toppling-pgv_pga": {
        "pgv_m_s pga_g": ("pgv_pga: 1, zr, zr2", (0, 1, 2)),
        "pgv_m_s pga_g tm_s": ("pgv_pga+tm: 1, zr, ln Tm, zr2", (0, 1, 3, 2)),
        "pgv_m_s pga_g sa(1)": ("pgv_pga + SA(1): 1, zr, xh, zr2", (0, 1, 3, 2)),
        "pgv_m_s pga_g sa(0.3) sa(1) sa(3)": (
            "pgv_pga + SA(.3,1,3): 1, zr, xh, zr2",
            (0, 1, 3, 2),
        ),
    },
    "toppling-pga": {
        "pga_g": ("pga: 1", (0,)),
        "pga_g tm_s": ("pga+tm: 1, ln Tm", (0, 1)),
        "pga_g sa(1)": ("pga + SA(1): 1, xh", (0, 1)),
        "pga_g sa(0.3) sa(1) sa(3)": ("pga + SA(.3,1,3): 1, xh", (0, 1)),
    },
    "toppling-sa": {"sa(1)": ("SA(1): 1, xh", (0, 1))},
    "rocking-pga": {
        "pga_g": ("none: 1", (0,)),
        "pga_g pgv_m_s": ("pgv: 1, zr, zr2", (0, 1, 2)),
        "pga_g tm_s": ("tm: 1, ln Tm", (0, 1)),
        "pga_g magnitude": ("magnitude: 1, min(M,6.5)-6.5", (0, 1)),
        "pga_g pgv_m_s tm_s": ("pgv, tm: 1, zr, zr2, ln Tm", (0, 1, 2, 3)),
        "pga_g sa(1)": ("SA(1): 1, xh", (0, 1)),
        "pga_g sa(0.3) sa(1) sa(3)": ("SA(.3,1,3): 1, xh", (0, 1)),
    },
}
"""Regressions of the study by the measures they read: their names there, the order of columns."""


@cache
def shipped() -> dict[str, ModelRow]:
    return {row.name: row for row in read_models(REFERENCE)}


def of_study(kind: str) -> Any:
    """Return the regressions of the study."""
    (name,) = (name for name in STUDY[kind] if name.startswith("completion"))
    return STUDY[kind][name]


def studied(name: str) -> FragilityModel:
    """Return a model with the coefficients and regressions of the study."""
    kind, term = OF_STUDY[name]
    regressions = {
        inputs: Regression(
            [[line[i] for i in order] for line in of_study(kind)[table]],
            [line[len(order)] for line in of_study(kind)[table]],
            [[0.2, 0.5]] * 6,
        )
        for inputs, (table, order) in TABLES.get(name, {}).items()
    }
    row = shipped()[name]
    coefficients = dict(zip(row.coefficients, STUDY[kind][term]["b"], strict=True))
    changed = {"coefficients": coefficients, "completions": encode_regressions(regressions)}
    return FragilityModel.from_row(ModelRow(**{**vars(row), **changed}))


@pytest.mark.parametrize("name", OF_STUDY)
def test_coefficients_are_those_of_the_study(name: str) -> None:
    kind, term = OF_STUDY[name]
    row, expected = shipped()[name], STUDY[kind][term]
    error = np.array(expected["cr3"])
    assert (np.abs(np.array([*row.coefficients.values()]) - expected["b"]) < 0.2 * error).all()
    assert np.sqrt(np.diag(row.covariance)) == pytest.approx(error, rel=0.1)


@pytest.mark.parametrize(
    ("name", "inputs"), [(name, inputs) for name, of in TABLES.items() for inputs in of]
)
def test_regressions_are_those_of_the_study(name: str, inputs: str) -> None:
    table, order = TABLES[name][inputs]
    lines = of_study(OF_STUDY[name][0])[table]
    completion = FragilityModel.from_row(shipped()[name]).for_inputs(inputs.split()).completion
    assert completion is not None
    assert completion.regression is not None
    result = np.column_stack([completion.regression.coefficients, completion.regression.sigma])
    # magnitudes of some earthquakes differ between the two collections of metadata
    within = 0.05 if "magnitude" in inputs else 0.005
    expected = [[line[i] for i in (*order, len(order))] for line in lines]
    assert result == pytest.approx(np.array(expected), abs=within)


SA = {"sa(0.3)": 0.9, "sa(1)": 0.5, "sa(3)": 0.15}
PGV, PGA, TM = {"pgv_m_s": 0.5}, {"pga_g": 0.4}, {"tm_s": 0.6}
TOPPLING, ROCKING = {"p2": 18.0, "kr": 0.1}, {"p2": 18.0, "kr": 0.22}


@pytest.mark.parametrize(
    ("name", "inputs", "expected"),
    [
        ("toppling-pgv", PGV, 0.7930),
        ("toppling-pgv_pga", PGV | PGA, 0.8883),
        ("toppling-pgv_pga", PGV | PGA | TM, 0.8823),
        ("toppling-pgv_pga", PGV | PGA | SA, 0.8798),
        ("toppling-pga", PGA | TM, 0.7507),
        ("toppling-pga", PGA, 0.4737),
        ("toppling-pga", PGA | SA, 0.7869),
        ("toppling-sa", {"sa(1)": 0.5}, 0.5603),
        ("rocking-pga", PGV | PGA, 0.7990),
        ("rocking-pga", PGA | SA, 0.8532),
    ],
)
def test_reference_probabilities(name: str, inputs: dict[str, float], expected: float) -> None:
    block = ROCKING if name.startswith("rocking") else TOPPLING
    # of PGV alone nothing is said of a spectrum; the others in the order of any question
    answer = answer_given(studied(name), {**block, **inputs}, 0.95)
    assert isinstance(answer, Prediction)
    assert answer.probability == pytest.approx(expected, abs=1e-4)
    fitted = answer_given(FragilityModel.from_row(shipped()[name]), {**block, **inputs}, 0.95)
    assert isinstance(fitted, Prediction)
    assert fitted.probability == pytest.approx(expected, abs=2e-3)


def test_spectral_velocities_of_the_check() -> None:
    ordinates = {0.03: 0.4, 0.3: 0.9, 1.0: 0.5, 3.0: 0.15}
    p = math.sqrt(18.0)
    assert ln_toppling_velocity(ordinates, p, SINGLE) == pytest.approx(-0.7627, abs=1e-4)
    assert ln_rocking_velocity(ordinates, p, SINGLE) == pytest.approx(-0.4032, abs=1e-4)


def test_velocities_are_those_of_the_definition_for_numbers_and_arrays() -> None:
    random = np.random.default_rng(0)
    choice = [0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 1.3, 2.0, 3.0, 5.0, 7.5, 10.0]
    for _ in range(60):
        periods = sorted(random.choice(choice, random.integers(1, 8), replace=False).tolist())
        sa = np.exp(random.normal(-1.0, 1.0, len(periods)))
        p = float(np.exp(random.uniform(-1.5, 2.0)))
        ln_v = np.log(sa * 9.80665 * np.array(periods) / (2.0 * math.pi))

        def interpolated(t: Any, periods: Any = periods, ln_v: Any = ln_v) -> Any:
            return np.interp(np.log(t), np.log(periods), ln_v)

        t = 0.1 * 100.0 ** (np.arange(60) / 59.0)
        x = 1.4 * 2.0 * math.pi / (p * t)
        cube = (np.exp(interpolated(t)) * x / np.sqrt(1.0 + x * x)) ** 3
        toppling = math.log(cube.mean()) / 3.0
        t = np.clip(0.25 * 8.0 ** (np.arange(24) / 23.0) * 2.0 * math.pi / p, 0.1, 10.0)
        rocking = interpolated(t).mean()
        ordinates = dict(zip(periods, sa.tolist(), strict=True))
        many = {period: np.array([value, 2.0 * value]) for period, value in ordinates.items()}
        for velocity, expected in (
            (ln_toppling_velocity, toppling),
            (ln_rocking_velocity, rocking),
        ):
            assert velocity(ordinates, p, SINGLE) == pytest.approx(expected, abs=1e-12)
            both = velocity(many, np.array([p, p]), arrays())
            assert both == pytest.approx([expected, expected + math.log(2.0)], abs=1e-12)


def test_a_long_mean_period_makes_the_same_pga_more_dangerous() -> None:
    expected = {0.3: 0.0010, 0.5: 0.0597, 0.7: 0.289, 0.8: 0.437, 1.0: 0.693}
    for tm_s, probability in expected.items():
        inputs = {"p2": 3.0, "kr": 0.1, "pga_g": 0.5, "tm_s": tm_s}
        model = find_model(None, tuple(inputs), REFERENCE)
        answer = answer_given(model, inputs, 0.95)
        assert isinstance(answer, Prediction)
        assert answer.probability == pytest.approx(probability, abs=0.002)


def test_p_is_continuous_across_the_sizes_of_the_regressions() -> None:
    model = FragilityModel.from_row(shipped()["toppling-pga"])
    for p2 in (30.0, 10.0, 3.0, 1.0, 0.3, 0.1):
        around = p2 * np.array([1.0 - 1e-9, 1.0, 1.0 + 1e-9])
        answer = answer_given(model, {"p2": around, "kr": 0.1, "pga_g": 0.4, "tm_s": 0.6}, 0.95)
        assert isinstance(answer, PredictionArray)
        for values in (answer.probability, answer.ci_low, answer.ci_high):
            assert np.ptp(values) < 1e-7


def test_ordinates_in_any_order_and_beyond_the_spectrum() -> None:
    model = FragilityModel.from_row(shipped()["toppling-pgv_pga"])
    inputs = {"p2": 3.0, "kr": 0.1, **PGV, **PGA, **SA}
    answer = answer_given(model, inputs, 0.95)
    turned = answer_given(model, dict(reversed(inputs.items())), 0.95)
    assert isinstance(answer, Prediction)
    assert isinstance(turned, Prediction)
    assert (turned.probability, turned.ci_low) == (answer.probability, answer.ci_low)


@pytest.fixture(scope="module")
def source() -> FitSource:
    with opened_database(REFERENCE, read_only=True) as engine, engine.connect() as connection:
        return read_source(connection, method_named("toppling").block, suite="reference")


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("toppling-pgv_pga", (*PGV, *PGA)),
        ("toppling-pga", (*PGA, *TM)),
        ("toppling-pga", (*PGA, *SA)),
        ("toppling-sa", ("sa(1)",)),
    ],
)
def test_intervals_are_those_of_refits_without_each_earthquake(
    source: FitSource, name: str, names: tuple[str, ...]
) -> None:
    kind, term = OF_STUDY[name]
    method, of_term = method_named("toppling"), TERMS[term]
    velocity = method.forms[term].velocity
    assert velocity is not None
    model = FragilityModel.from_row(shipped()[name]).for_inputs(names)
    data = fit_data(source, method, of_term, kind=kind)
    rows = outcome_rows(data, method, of_term, parameter_names(method, of_term))
    fitted = rows.data.only(rows.data.weights > 0.0)
    best = most_likely(fitted)
    events: Any = model.row.diagnostics["fitted_events"]
    motions = motions_of(source.only(data.combination), method.block, events)
    random = np.random.default_rng(1)
    n = 12
    factor = np.exp(random.uniform(-0.7, 0.5, n))
    inputs = {"p2": np.exp(random.uniform(-1.0, 3.0, n))}
    inputs["kr"] = random.uniform(0.2, 0.6, n) * np.minimum(0.2, 0.05 * np.sqrt(inputs["p2"]))
    inputs |= {key: value * (factor if key != "tm_s" else np.ones(n))
               for key, value in (PGV | PGA | TM | SA).items() if key in names}  # fmt: skip

    def probit(b: Any, regression: Regression) -> Any:
        changed = encode_regressions({key_of(model.term.inputs): regression})
        coefficients = dict(zip(model.row.coefficients, b.tolist(), strict=True))
        row = ModelRow(**{**vars(model.row), "coefficients": coefficients, "completions": changed})
        without = FragilityModel.from_row(row).for_inputs(names)
        values = without.completed(inputs, arrays())
        predictor, scale = without.linear_predictor(values, arrays())
        return predictor.eta * scale

    complete = probit(best, regress(velocity, model.term.inputs, motions))
    steps = []
    for number, event in enumerate(events):
        remaining = fitted.event != data.event_names.index(event)
        b = maximise(fitted.only(remaining), best)[0]
        rest = motions.event != number
        part = MotionTable(
            {key: column[rest] for key, column in motions.measures.items()},
            motions.event[rest], motions.recording[rest], motions.events,
        )  # fmt: skip
        steps.append(probit(b, regress(velocity, model.term.inputs, part)) - complete)
    g = len(events)
    error = np.sqrt((g - 1.0) / g * np.square(steps).sum(axis=0))
    values = model.completed(inputs, arrays())
    predictor, scale = model.linear_predictor(values, arrays())
    total, _ = model.errors.sums_of_arrays(predictor)
    ratio = scale * np.sqrt((g - 1.0) / g * total) / error
    assert ratio.min() > 0.95
    assert ratio.max() < 1.05
    # numbers and arrays have the same interval
    for i in range(n):
        single = {key: float(value[i]) for key, value in inputs.items()}
        alone = answer_given(model, single, 0.95)
        many = answer_given(model, inputs, 0.95)
        assert isinstance(alone, Prediction)
        assert isinstance(many, PredictionArray)
        for key in ("probability", "ci_low", "ci_high"):
            assert getattr(alone, key) == pytest.approx(getattr(many, key)[i], rel=1e-11)
    assert quantiles_of(0.95).normal > 1.0


def test_the_scatter_of_a_regression_falls_with_what_is_given() -> None:
    model = FragilityModel.from_row(shipped()["toppling-pga"])
    sets = [("pga_g",), ("pga_g", "sa(1)"), ("pga_g", *SA)]
    for less, more in pairwise(sets):
        parts = [model.for_inputs(names).completion for names in (less, more)]
        sigmas = [part.regression.sigma for part in parts if part and part.regression]
        assert all(b < a for a, b in zip(*sigmas, strict=True))
