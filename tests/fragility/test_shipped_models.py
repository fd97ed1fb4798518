"""The shipped models: smooth and monotone, with their intervals."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.fragility.completion import MOMENTS
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.method import arrays
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray

FloatArray = NDArray[np.float64]


@cache
def shipped() -> dict[str, FragilityModel]:
    return {row.name: FragilityModel.from_row(row) for row in read_models(REFERENCE)}


INPUTS = ("p2", "kr", "pgv_m_s", "pga_g", "sa(1)")
"""What completes the spectral velocities."""

# Dense grids: k_r, PGV (X(p)) and p² in steps of 1 %, from where the fit has its first block
STEP = 1.01


def grid_of(model: FragilityModel, name: str, n: int = 700) -> dict[str, FloatArray | float]:
    """A line of questions along one value, in steps of 1 %, for each of several blocks."""
    random = np.random.default_rng(3)
    several = 40
    pgv = np.exp(random.uniform(np.log(0.03), np.log(1.5), several))
    pga = pgv / 9.80665 / np.exp(random.normal(np.log(0.1), 0.3, several))
    p2 = np.exp(random.uniform(np.log(0.1), np.log(30.0), several))
    every = {
        "p2": p2,
        "kr": pgv * np.sqrt(p2) / 9.80665 * random.uniform(0.3, 1.0, several),
        "pgv_m_s": pgv,
        "pga_g": pga,
        "tm_s": 2 * np.pi * pgv / (pga * 9.80665) * np.exp(random.normal(0.0, 0.2, several)),
        "xp_m_s": pgv * random.uniform(0.4, 0.9, several),
        "pgd_m": 0.1 * pgv,
    }
    every["sa(1)"] = pga * np.exp(random.normal(-0.3, 0.3, several))
    arguments = {key: every[key][:, None] for key in ("p2", "kr", *model.term.inputs)}
    along = np.geomspace(1.0, STEP ** (n - 1), n)
    if name == "p2":
        arguments["p2"] = 0.1 * along[along <= 300.0][None, :]
    else:
        arguments[name] = arguments[name] * along / np.sqrt(along[-1])
    return arguments


OF_OUTCOMES = [
    row.name for row in read_models(REFERENCE)
    if row.kind == "toppling" and method_named(row.method).reads == "outcomes"
]  # fmt: skip


@pytest.mark.parametrize("name", OF_OUTCOMES)
def test_p_falls_with_strength_and_rises_with_the_measure_that_is_known_alone(name: str) -> None:
    model = shipped()[name].for_inputs(INPUTS)
    ways = [("kr", -1.0)]
    first = model.term.inputs[0]
    if len(model.term.inputs) == 1 or first == "xp_m_s":
        ways.append((first, 1.0))
    for along, sign in ways:
        answer = answer_given(model, grid_of(model, along), 0.95)
        assert isinstance(answer, PredictionArray)
        change = sign * np.diff(answer.probability, axis=1)
        assert change.min() >= -1e-14
        assert np.all(answer.ci_low <= answer.probability)
        assert np.all(answer.probability <= answer.ci_high)


@pytest.mark.parametrize(
    ("name", "along"),
    [
        (name, along)
        for name in OF_OUTCOMES
        for along in ("kr", "pgv_m_s", "xp_m_s", "p2")
        if along in ("kr", "p2", *shipped()[name].for_inputs(INPUTS).term.inputs)
    ],
)
def test_the_half_width_of_eta_has_no_steps(name: str, along: str) -> None:
    model = shipped()[name].for_inputs(INPUTS)
    grid = grid_of(model, along)
    shape = np.broadcast_shapes(*(np.shape(value) for value in grid.values()))
    flat = {key: np.broadcast_to(value, shape).ravel() for key, value in grid.items()}
    with np.errstate(all="ignore"):
        values = model.completed(flat, arrays())
        result, h = model.linear_predictor(values, arrays())
        half = model.errors.half_width(result, quantiles_of(0.95), arrays())
        reach = (h * half).reshape(shape)
        result = result._replace(eta=(result.eta * h).reshape(shape))
        h = 1.0
        values = {
            n: np.reshape(v, shape)
            for n, v in values.items()
            if n != MOMENTS and np.shape(v) == half.shape
        }
        p = model.method.link.probability(result.eta * h, arrays())
    # where the outcome is open, which is the domain of the statement; near the bounds of mechanics
    # ln(1 - v) goes to infinity within a step
    open_ = np.isfinite(reach) & (p > 0.001) & (p < 0.999)
    for bound in model.form.bounds:
        open_ &= ~bound.holds(values)
    pairs = open_[:, 1:] & open_[:, :-1]
    assert pairs.sum() > 1000
    change = np.abs(np.diff(reach, axis=1))
    assert change[pairs].max() <= 0.022
    # se of V alone changes by up to 5.7 % of itself where it is least, so that no bound of 2 %
    # of itself can hold
    assert (change / reach[:, :-1])[pairs].max() <= 0.06
